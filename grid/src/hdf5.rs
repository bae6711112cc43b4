//! HDF5 files of groups, attributes and contiguous arrays, one of which may follow after everything else.
//!
//! This is all that a volume needs, in the second version of the format. It is written here because a volume larger
//! than memory must be written slab by slab, which the pure-Rust libraries do not offer, and because it takes 200 lines
//! only. Source: HDF5 File Format Specification, version 3.0, sections II.A (superblock 2), IV.A.1.b (object header 2)
//! and IV.A.2 (messages).

/// Type of the values of an array or attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// Unsigned integers of this many bytes.
    Unsigned(u8),
    /// Signed integers of this many bytes.
    Signed(u8),
    /// IEEE floating-point numbers of 32 bits.
    Float32,
    /// Text of this many bytes, the final zero included.
    Text(u32),
}

/// A named value attached to an object.
#[derive(Debug)]
pub(crate) struct Attribute {
    name: &'static str,
    of: Type,
    sizes: Vec<u64>,
    bytes: Vec<u8>,
}

impl Attribute {
    pub(crate) fn text(name: &'static str, text: &str) -> Self {
        let bytes = [text.as_bytes(), &[0]].concat();
        Self {
            name,
            of: Type::Text(u32::try_from(bytes.len()).unwrap_or(u32::MAX)),
            sizes: Vec::new(),
            bytes,
        }
    }

    pub(crate) fn array(name: &'static str, of: Type, bytes: Vec<u8>) -> Self {
        Self {
            name,
            of,
            sizes: vec![bytes.len() as u64 / u64::from(of.size())],
            bytes,
        }
    }
}

/// A group of the file, or an array in it.
#[derive(Debug)]
pub(crate) enum Object {
    Group {
        attributes: Vec<Attribute>,
        members: Vec<(&'static str, Object)>,
    },
    Array {
        attributes: Vec<Attribute>,
        of: Type,
        sizes: Vec<u64>,
        data: Data,
    },
}

/// Where the samples of an array are.
#[derive(Debug)]
pub(crate) enum Data {
    /// In the head.
    Here(Vec<u8>),
    /// This many bytes after the head.
    Behind(u64),
}

/// Everything before the samples that are [`Data::Behind`]; its length is a multiple of 8 bytes.
pub(crate) fn head(root: &Object, behind: u64) -> Vec<u8> {
    // Addresses have a fixed size, so the length does not depend on their values.
    let length = file(root, 0, behind).len() as u64;
    file(root, length, behind)
}

const SUPERBLOCK: usize = 48;
const UNDEFINED: u64 = u64::MAX;

fn file(root: &Object, data: u64, behind: u64) -> Vec<u8> {
    let mut out = vec![0; SUPERBLOCK];
    let root = write(root, data, &mut out);
    let mut superblock = b"\x89HDF\r\n\x1a\n\x02\x08\x08\x00".to_vec();
    for address in [0, UNDEFINED, out.len() as u64 + behind, root] {
        superblock.extend(address.to_le_bytes());
    }
    superblock.extend(lookup3(&superblock).to_le_bytes());
    out[..SUPERBLOCK].copy_from_slice(&superblock);
    out
}

/// Appends an object with all its members, and returns the address of its header.
fn write(object: &Object, data: u64, out: &mut Vec<u8>) -> u64 {
    let mut messages = Vec::new();
    let attributes = match object {
        Object::Group { attributes, members } => {
            let links: Vec<(&str, u64)> = members.iter().map(|(name, of)| (*name, write(of, data, out))).collect();
            messages.push((LINK_INFO, [&[0, 0][..], &[0xff; 16]].concat()));
            messages.push((GROUP_INFO, vec![0, 0]));
            messages.extend(links.iter().map(|&(name, address)| (LINK, link(name, address))));
            attributes
        }
        Object::Array {
            attributes,
            of,
            sizes,
            data: samples,
        } => {
            let (address, length) = match samples {
                Data::Here(bytes) => {
                    let address = out.len() as u64;
                    out.extend(bytes);
                    align(out);
                    (address, bytes.len() as u64)
                }
                Data::Behind(length) => (data, *length),
            };
            messages.push((DATASPACE, dataspace(sizes)));
            messages.push((DATATYPE, of.encoded()));
            messages.push((FILL_VALUE, vec![3, 0x0a])); // undefined: readers use zero
            messages.push((
                LAYOUT,
                [&[3, 1][..], &address.to_le_bytes(), &length.to_le_bytes()].concat(),
            ));
            attributes
        }
    };
    messages.extend(attributes.iter().map(|attribute| (ATTRIBUTE, attribute.encoded())));
    let address = out.len() as u64;
    out.extend(header(&messages));
    align(out);
    address
}

fn align(out: &mut Vec<u8>) {
    out.resize(out.len().next_multiple_of(8), 0);
}

const DATASPACE: u8 = 0x01;
const LINK_INFO: u8 = 0x02;
const DATATYPE: u8 = 0x03;
const FILL_VALUE: u8 = 0x05;
const LINK: u8 = 0x06;
const LAYOUT: u8 = 0x08;
const GROUP_INFO: u8 = 0x0a;
const ATTRIBUTE: u8 = 0x0c;

/// An object header of version 2 that stores the length of its messages in four bytes.
fn header(messages: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, message) in messages {
        body.push(*kind);
        body.extend(short(message.len()));
        body.push(0);
        body.extend(message);
    }
    let length = u32::try_from(body.len()).unwrap_or(u32::MAX);
    let mut header = [b"OHDR\x02\x02", &length.to_le_bytes()[..], &body].concat();
    header.extend(lookup3(&header).to_le_bytes());
    header
}

/// A length as two bytes. All names and messages are written by this crate and far below 64 KiB.
fn short(length: usize) -> [u8; 2] {
    u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes()
}

fn link(name: &str, address: u64) -> Vec<u8> {
    let length = u8::try_from(name.len()).unwrap_or(u8::MAX);
    [&[1, 0, length][..], name.as_bytes(), &address.to_le_bytes()].concat()
}

/// A dataspace message. No sizes mean a single value.
fn dataspace(sizes: &[u64]) -> Vec<u8> {
    let rank = u8::try_from(sizes.len()).unwrap_or(u8::MAX);
    let mut message = vec![2, rank, 0, u8::from(rank > 0)];
    message.extend(sizes.iter().flat_map(|size| size.to_le_bytes()));
    message
}

impl Type {
    fn size(self) -> u32 {
        match self {
            Self::Unsigned(bytes) | Self::Signed(bytes) => u32::from(bytes),
            Self::Float32 => 4,
            Self::Text(length) => length,
        }
    }

    fn encoded(self) -> Vec<u8> {
        let whole = |signed: u8, bytes: u8| {
            [
                &[0x10, signed, 0, 0, bytes, 0, 0, 0, 0, 0][..],
                &short(8 * usize::from(bytes)),
            ]
            .concat()
        };
        match self {
            Self::Unsigned(bytes) => whole(0, bytes),
            Self::Signed(bytes) => whole(8, bytes),
            // Implied leading bit, sign at bit 31; exponent of 8 bits at bit 23, fraction of 23 bits at bit 0, bias
            // 127.
            Self::Float32 => vec![0x11, 0x20, 31, 0, 4, 0, 0, 0, 0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0],
            Self::Text(length) => [&[0x13, 0, 0, 0][..], &length.to_le_bytes()].concat(),
        }
    }
}

impl Attribute {
    fn encoded(&self) -> Vec<u8> {
        let (of, space) = (self.of.encoded(), dataspace(&self.sizes));
        let mut message = vec![3, 0];
        for length in [self.name.len() + 1, of.len(), space.len()] {
            message.extend(short(length));
        }
        message.push(0);
        [&message, self.name.as_bytes(), &[0], &of, &space, &self.bytes].concat()
    }
}

/// Bob Jenkins' lookup3 hash (2006) with initial value 0, the checksum of the format.
fn lookup3(bytes: &[u8]) -> u32 {
    let word = |part: &[u8]| part.iter().rev().fold(0_u32, |word, &byte| word << 8 | u32::from(byte));
    let start = 0xdead_beef_u32.wrapping_add(u32::try_from(bytes.len()).unwrap_or(u32::MAX));
    let [mut a, mut b, mut c] = [start; 3];
    let mut rest = bytes;
    let add = |a: &mut u32, b: &mut u32, c: &mut u32, part: &[u8]| {
        let at = |k: usize| word(&part[(4 * k).min(part.len())..(4 * k + 4).min(part.len())]);
        *a = a.wrapping_add(at(0));
        *b = b.wrapping_add(at(1));
        *c = c.wrapping_add(at(2));
    };
    while rest.len() > 12 {
        add(&mut a, &mut b, &mut c, &rest[..12]);
        for [turn_a, turn_b, turn_c] in [[4, 6, 8], [16, 19, 4]] {
            a = a.wrapping_sub(c) ^ c.rotate_left(turn_a);
            c = c.wrapping_add(b);
            b = b.wrapping_sub(a) ^ a.rotate_left(turn_b);
            a = a.wrapping_add(c);
            c = c.wrapping_sub(b) ^ b.rotate_left(turn_c);
            b = b.wrapping_add(a);
        }
        rest = &rest[12..];
    }
    if rest.is_empty() {
        return c;
    }
    add(&mut a, &mut b, &mut c, rest);
    c = (c ^ b).wrapping_sub(b.rotate_left(14));
    a = (a ^ c).wrapping_sub(c.rotate_left(11));
    b = (b ^ a).wrapping_sub(a.rotate_left(25));
    c = (c ^ b).wrapping_sub(b.rotate_left(16));
    a = (a ^ c).wrapping_sub(c.rotate_left(4));
    b = (b ^ a).wrapping_sub(a.rotate_left(14));
    (c ^ b).wrapping_sub(b.rotate_left(24))
}

#[cfg(test)]
mod tests {
    use super::lookup3;

    /// Values that the author of the hash published with it.
    #[test]
    fn the_checksum_is_jenkins() {
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }
}
