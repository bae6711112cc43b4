//! Files of other programs, made byte by byte.

/// A TIFF of one or more pages, in either byte order, small or big.
#[derive(Clone, Copy)]
pub(crate) struct TiffMaker {
    pub(crate) big_endian: bool,
    pub(crate) big: bool,
}

pub(crate) const PLAIN: TiffMaker = TiffMaker {
    big_endian: false,
    big: false,
};

/// A page: fields of whole numbers (tag, values) as 32 bits, those of bytes, and strips or tiles.
#[derive(Clone, Default)]
pub(crate) struct MadePage {
    pub(crate) fields: Vec<(u16, Vec<u32>)>,
    pub(crate) bytes: Vec<(u16, Vec<u8>)>,
    pub(crate) chunks: Vec<Vec<u8>>,
    pub(crate) tiled: bool,
}

impl MadePage {
    pub(crate) fn new(width: u32, height: u32, fields: &[(u16, &[u32])], chunks: Vec<Vec<u8>>) -> Self {
        let mut all: Vec<(u16, Vec<u32>)> = vec![(256, vec![width]), (257, vec![height])];
        all.extend(fields.iter().map(|(tag, values)| (*tag, values.to_vec())));
        let tiled = fields.iter().any(|(tag, _)| *tag == 322);
        Self {
            fields: all,
            chunks,
            tiled,
            ..Self::default()
        }
    }
}

impl TiffMaker {
    fn number(self, value: u64, size: usize) -> Vec<u8> {
        let bytes = value.to_le_bytes()[..size].to_vec();
        if self.big_endian {
            bytes.into_iter().rev().collect()
        } else {
            bytes
        }
    }

    fn offset(self, value: usize) -> Vec<u8> {
        self.number(value as u64, if self.big { 8 } else { 4 })
    }

    /// The bytes of a file.
    pub(crate) fn file(self, pages: &[MadePage]) -> Vec<u8> {
        let mut out = if self.big_endian {
            b"MM".to_vec()
        } else {
            b"II".to_vec()
        };
        if self.big {
            out.extend(self.number(43, 2));
            out.extend(self.number(8, 2));
            out.extend(self.number(0, 2));
        } else {
            out.extend(self.number(42, 2));
        }
        let mut link = out.len();
        out.extend(self.offset(0));
        for page in pages {
            let place = |bytes: &[u8], out: &mut Vec<u8>| {
                let at = out.len();
                out.extend(bytes);
                at
            };
            let offsets: Vec<u32> = page.chunks.iter().map(|c| place(c, &mut out) as u32).collect();
            let counts: Vec<u32> = page.chunks.iter().map(|c| c.len() as u32).collect();
            let [at, length] = if page.tiled { [324, 325] } else { [273, 279] };
            // Tag, type, count, bytes.
            let mut entries: Vec<(u16, u64, usize, Vec<u8>)> = Vec::new();
            for (tag, values) in page.fields.iter().cloned().chain([(at, offsets), (length, counts)]) {
                let bytes = values.iter().flat_map(|v| self.number(u64::from(*v), 4)).collect();
                entries.push((tag, 4, values.len(), bytes));
            }
            entries.extend(page.bytes.iter().map(|(tag, b)| (*tag, 7, b.len(), b.clone())));
            entries.sort_by_key(|e| e.0);
            let inline = if self.big { 8 } else { 4 };
            let values: Vec<Vec<u8>> = entries
                .iter()
                .map(|(.., bytes)| {
                    if bytes.len() > inline {
                        self.offset(place(bytes, &mut out))
                    } else {
                        let mut short = bytes.clone();
                        short.resize(inline, 0);
                        short
                    }
                })
                .collect();
            let start = out.len();
            let pointer = self.offset(start);
            out[link..link + pointer.len()].copy_from_slice(&pointer);
            out.extend(self.number(entries.len() as u64, if self.big { 8 } else { 2 }));
            for ((tag, kind, count, _), value) in entries.iter().zip(values) {
                out.extend(self.number(u64::from(*tag), 2));
                out.extend(self.number(*kind, 2));
                out.extend(self.offset(*count));
                out.extend(value);
            }
            link = out.len();
            out.extend(self.offset(0));
        }
        out
    }
}

/// A chunk of a PNG.
pub(crate) fn png_chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut crc = flate2::Crc::new();
    crc.update(kind);
    crc.update(data);
    [
        &(data.len() as u32).to_be_bytes()[..],
        kind,
        data,
        &crc.sum().to_be_bytes(),
    ]
    .concat()
}

/// A PNG of one row of one pixel with a palette of these bytes.
pub(crate) fn png_with_palette(palette: &[u8]) -> Vec<u8> {
    let header = [&1_u32.to_be_bytes()[..], &1_u32.to_be_bytes(), &[8, 3, 0, 0, 0]].concat();
    let row = compressed(&[0, 0]);
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        png_chunk(b"IHDR", &header),
        png_chunk(b"PLTE", palette),
        png_chunk(b"IDAT", &row),
        png_chunk(b"IEND", &[]),
    ]
    .concat()
}

/// Deflate with a header of zlib.
pub(crate) fn compressed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// A region of ImageJ: its kind, bounds (top, left, bottom, right), numbers in the header, and what follows.
pub(crate) fn roi(kind: u8, bounds: [i16; 4], shorts: &[(usize, u16)], longs: &[(usize, u32)], tail: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0_u8; 64];
    bytes[..4].copy_from_slice(b"Iout");
    bytes[4..6].copy_from_slice(&227_u16.to_be_bytes());
    bytes[6] = kind;
    for (i, v) in bounds.into_iter().enumerate() {
        bytes[8 + 2 * i..10 + 2 * i].copy_from_slice(&v.to_be_bytes());
    }
    for (at, v) in shorts {
        bytes[*at..at + 2].copy_from_slice(&v.to_be_bytes());
    }
    for (at, v) in longs {
        bytes[*at..at + 4].copy_from_slice(&v.to_be_bytes());
    }
    bytes.extend(tail);
    bytes
}

/// An archive of named entries.
pub(crate) fn archive(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    use std::io::Write;
    let mut out = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    for (name, bytes) in entries {
        out.start_file(*name, options).unwrap();
        out.write_all(bytes).unwrap();
    }
    out.finish().unwrap().into_inner()
}

/// A .npy of two axes.
pub(crate) fn npy(kind: &str, shape: [usize; 2], data: &[u8]) -> Vec<u8> {
    let [height, width] = shape;
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({height}, {width}), }}\n");
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}
