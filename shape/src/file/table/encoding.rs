//! The encoding of a text file: by its byte order mark, its zero bytes, or because it is valid UTF-8.

use std::fmt;

/// How the characters of a text file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextEncoding {
    /// UTF-8, with or without a byte order mark.
    Utf8,
    /// UTF-16 of either byte order, with or without a byte order mark ("Unicode text" of Excel).
    Utf16,
    /// One byte per character: Latin-1, with the Windows characters 0x80 to 0x9F. Files that are not valid UTF-8.
    Latin1,
}

impl fmt::Display for TextEncoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Utf8 => "UTF-8",
            Self::Utf16 => "UTF-16",
            Self::Latin1 => "Latin-1",
        })
    }
}

/// Beginnings of files that spreadsheets are stored in, and archives.
const NOT_TEXT: [(&[u8], &str); 3] = [
    (b"PK\x03\x04", "a workbook (.xlsx, .ods) or another ZIP archive"),
    (b"\xd0\xcf\x11\xe0", "a workbook (.xls)"),
    (b"\x1f\x8b", "compressed (gzip)"),
];

/// The text of a file, with every line end as `\n`; what is wrong, if it is not text.
pub(super) fn decode(bytes: &[u8]) -> Result<(String, TextEncoding), String> {
    if let Some((_, what)) = NOT_TEXT.iter().find(|(signature, _)| bytes.starts_with(signature)) {
        return Err(format!("the file is {what}, not text; save the table as CSV"));
    }
    let (text, encoding) = match bytes {
        [0xFF, 0xFE, rest @ ..] => (utf16(rest, u16::from_le_bytes)?, TextEncoding::Utf16),
        [0xFE, 0xFF, rest @ ..] => (utf16(rest, u16::from_be_bytes)?, TextEncoding::Utf16),
        _ => match zeros(bytes) {
            [false, true] => (utf16(bytes, u16::from_le_bytes)?, TextEncoding::Utf16),
            [true, false] => (utf16(bytes, u16::from_be_bytes)?, TextEncoding::Utf16),
            _ => one_byte_units(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)),
        },
    };
    let text = if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n")
    } else {
        text
    };
    // Ctrl-Z ends the text files of DOS.
    let whole = text.trim_end_matches('\u{1a}').len();
    match text[..whole].char_indices().find(|(_, c)| is_control(*c)) {
        None if whole == text.len() => Ok((text, encoding)),
        None => Ok((text[..whole].to_owned(), encoding)),
        Some((at, control)) => Err(format!(
            "line {} contains the control character U+{:04X} (read as {encoding}): the file is not text",
            1 + text[..at].matches('\n').count(),
            u32::from(control)
        )),
    }
}

fn is_control(c: char) -> bool {
    c < ' ' && !matches!(c, '\t' | '\n' | '\u{c}')
}

/// Whether most of the bytes at even, and at odd, places of the beginning are zero: in UTF-16, Latin letters have them
/// at one kind of place.
fn zeros(bytes: &[u8]) -> [bool; 2] {
    let (pairs, _) = bytes[..bytes.len().min(4096)].as_chunks::<2>();
    [0, 1].map(|at| 2 * pairs.iter().filter(|pair| pair[at] == 0).count() > pairs.len())
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String, String> {
    let (units, rest) = bytes.as_chunks::<2>();
    let text: Result<String, _> = char::decode_utf16(units.iter().map(|pair| unit(*pair))).collect();
    match text {
        Ok(text) if rest.is_empty() => Ok(text.trim_start_matches('\u{feff}').to_owned()),
        _ => Err("the file begins as text in UTF-16, but is not: it is damaged or truncated".to_owned()),
    }
}

fn one_byte_units(bytes: &[u8]) -> (String, TextEncoding) {
    match str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), TextEncoding::Utf8),
        Err(_) => (bytes.iter().map(|&byte| windows(byte)).collect(), TextEncoding::Latin1),
    }
}

/// A character of Windows-1252, which is Latin-1 but for 0x80 to 0x9F.
fn windows(byte: u8) -> char {
    const HIGH: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9F => HIGH[usize::from(byte - 0x80)],
        byte => char::from(byte),
    }
}

#[cfg(test)]
mod tests {
    use super::{TextEncoding, decode};

    #[test]
    fn every_encoding_gives_the_same_text() {
        let text = "area (µm²)\n1,5\n";
        let le = || text.encode_utf16().flat_map(u16::to_le_bytes);
        let be = || text.encode_utf16().flat_map(u16::to_be_bytes);
        let cases: [(Vec<u8>, TextEncoding); 7] = [
            (text.into(), TextEncoding::Utf8),
            ([b"\xEF\xBB\xBF", text.as_bytes()].concat(), TextEncoding::Utf8),
            ([0xFF, 0xFE].into_iter().chain(le()).collect(), TextEncoding::Utf16),
            ([0xFE, 0xFF].into_iter().chain(be()).collect(), TextEncoding::Utf16),
            (le().collect(), TextEncoding::Utf16),
            (be().collect(), TextEncoding::Utf16),
            (b"area (\xb5m\xb2)\r1,5\r\n\x1a".to_vec(), TextEncoding::Latin1),
        ];
        for (bytes, encoding) in cases {
            assert_eq!(decode(&bytes).unwrap(), (text.to_owned(), encoding));
        }
    }

    #[test]
    fn other_files_are_refused_with_their_kind() {
        for (bytes, what) in [
            (&b"PK\x03\x04rest"[..], "workbook"),
            (b"\xd0\xcf\x11\xe0\xa1", "workbook (.xls)"),
            (
                b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
                "line 2 contains the control character U+001A",
            ),
            (b"area\n1\x002", "line 2 contains the control character U+0000"),
            (b"\xFF\xFEa\0b", "truncated"),
            (b"\xFF\xFE\x00\xd8a\0", "damaged"),
        ] {
            let error = decode(bytes).unwrap_err();
            assert!(error.contains(what), "{error}");
        }
    }
}
