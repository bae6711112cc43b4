//! The directories of a TIFF: for each page, its fields by tag.
//!
//! The crate `tiff` reads a directory only together with an image that it can decode, so the fields of palettes, of
//! pages in other compressions and of pages behind them would be out of reach.

use std::collections::BTreeMap;

/// Most pages looked at; a directory may point back to an earlier one.
const MOST_PAGES: usize = 10_000;

/// The fields of a page: what is stored, by tag.
pub(super) struct Directory<'a> {
    fields: BTreeMap<u16, Field<'a>>,
    big_endian: bool,
}

/// A field: the code of its type, and its bytes.
struct Field<'a> {
    kind: u16,
    bytes: &'a [u8],
}

/// Numbers in the byte order and with the sizes of a file.
struct Reader<'a> {
    bytes: &'a [u8],
    big_endian: bool,
    /// BigTIFF: offsets and counts have eight bytes.
    big: bool,
}

/// The directories of all pages, in order.
pub(super) fn directories(bytes: &[u8]) -> Result<Vec<Directory<'_>>, String> {
    let big_endian = bytes.starts_with(b"MM");
    let start = |at| number(bytes.get(at..at + 2)?, big_endian);
    let big = start(2) == Some(43);
    let reader = Reader { bytes, big_endian, big };
    let mut next = reader.offset(if big { 8 } else { 4 });
    let mut found = Vec::new();
    let mut seen = Vec::new();
    while let Some(at) = next.filter(|at| *at != 0) {
        if seen.contains(&at) || found.len() == MOST_PAGES {
            break;
        }
        seen.push(at);
        match reader.directory(at) {
            Some((directory, after)) => {
                found.push(directory);
                next = after;
            }
            None if found.is_empty() => return Err("the TIFF's directory is damaged or truncated".into()),
            None => break,
        }
    }
    if found.is_empty() {
        return Err("the TIFF has no page".into());
    }
    Ok(found)
}

impl<'a> Reader<'a> {
    fn short(&self, at: usize) -> Option<u64> {
        number(self.bytes.get(at..at.checked_add(2)?)?, self.big_endian)
    }

    /// A count or an offset.
    fn offset(&self, at: usize) -> Option<usize> {
        let size = if self.big { 8 } else { 4 };
        let value = number(self.bytes.get(at..at.checked_add(size)?)?, self.big_endian)?;
        usize::try_from(value).ok()
    }

    /// A directory, and the place of the next one.
    fn directory(&self, at: usize) -> Option<(Directory<'a>, Option<usize>)> {
        let (count, start, each, inline) = if self.big {
            (self.offset(at)?, at.checked_add(8)?, 20, 8)
        } else {
            (usize::try_from(self.short(at)?).ok()?, at.checked_add(2)?, 12, 4)
        };
        let end = count.checked_mul(each)?.checked_add(start)?;
        self.bytes.get(start..end)?;
        let mut fields = BTreeMap::new();
        for entry in (start..end).step_by(each) {
            let (Some(tag), Some(kind)) = (self.short(entry), self.short(entry + 2)) else {
                continue;
            };
            let length = self
                .offset(entry + 4)
                .and_then(|n| n.checked_mul(size_of_kind(u16::try_from(kind).ok()?)?));
            let Some(length) = length else { continue };
            let value = entry + each - inline;
            let place = if length <= inline {
                Some(value)
            } else {
                self.offset(value)
            };
            let bytes = place.and_then(|p| self.bytes.get(p..p.checked_add(length)?));
            if let (Some(bytes), Ok(tag), Ok(kind)) = (bytes, u16::try_from(tag), u16::try_from(kind)) {
                fields.insert(tag, Field { kind, bytes });
            }
        }
        let directory = Directory {
            fields,
            big_endian: self.big_endian,
        };
        Some((directory, self.offset(end)))
    }
}

impl<'a> Directory<'a> {
    /// Whether numbers of several bytes are stored with the largest first.
    pub(super) fn big_endian(&self) -> bool {
        self.big_endian
    }

    /// Bytes of a field.
    pub(super) fn bytes(&self, tag: u16) -> Option<&'a [u8]> {
        self.fields.get(&tag).map(|f| f.bytes)
    }

    /// Whole numbers of a field, empty without one.
    pub(super) fn numbers(&self, tag: u16) -> Vec<u64> {
        let Some(field) = self.fields.get(&tag) else {
            return Vec::new();
        };
        let size = match field.kind {
            1 | 2 | 6 | 7 => 1,
            3 | 8 => 2,
            4 | 9 | 13 => 4,
            16..=18 => 8,
            _ => return Vec::new(),
        };
        let values = field.bytes.chunks_exact(size);
        values.filter_map(|bytes| number(bytes, self.big_endian)).collect()
    }

    /// The first number of a field.
    pub(super) fn number(&self, tag: u16) -> Option<u64> {
        self.numbers(tag).first().copied()
    }
}

/// Bytes of a value of a type.
fn size_of_kind(kind: u16) -> Option<usize> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16..=18 => Some(8),
        _ => None,
    }
}

/// A whole number of one to eight bytes.
pub(super) fn number(bytes: &[u8], big_endian: bool) -> Option<u64> {
    let add = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    let within = !bytes.is_empty() && bytes.len() <= 8;
    within.then(|| {
        if big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        }
    })
}
