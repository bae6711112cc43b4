//! What is checked before and around the decoders of other crates.

use std::thread::Builder;

/// Name of the threads in which decoders run: a program may keep their panics from its users, as they are reported as
/// errors.
pub const DECODER_THREAD: &str = "decoder of pictures";

/// Runs a decoder so that a panic of it is an error.
pub(crate) fn guarded<T: Send>(decode: impl FnOnce() -> Result<T, String> + Send) -> Result<T, String> {
    std::thread::scope(|scope| {
        let thread = Builder::new().name(DECODER_THREAD.into()).spawn_scoped(scope, decode);
        let thread = thread.map_err(|e| format!("no thread to decode it in ({e})"))?;
        thread.join().unwrap_or_else(|_| {
            Err("the decoder failed on it: the file is damaged in an unusual way; open it in another program and save it again".into())
        })
    })
}

/// Refuses a PNG whose palette is no list of colours, which not every decoder checks.
pub(crate) fn check_png(bytes: &[u8]) -> Result<(), String> {
    let long = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let Some(depth) = bytes.get(24) else {
        return Err("the PNG is truncated: its header is missing".into());
    };
    let mut at = 8;
    while let (Some(length), Some(kind)) = (long(at), bytes.get(at + 4..at + 8)) {
        match kind {
            b"IDAT" => break,
            b"PLTE" => {
                let most = 3 << (*depth).min(8);
                if length == 0 || length % 3 != 0 || length > most.max(3 * 256) {
                    return Err(format!(
                        "the PNG's palette (chunk PLTE) has {length} bytes; it must have three per colour, of at most 256"
                    ));
                }
            }
            _ => {}
        }
        at = match at.checked_add(12).and_then(|n| n.checked_add(length)) {
            Some(next) => next,
            None => break,
        };
    }
    Ok(())
}

/// The bytes of a JPEG up to its end marker, without what cameras append (films, depth maps); `None` if the end is
/// missing: decoders fill missing pixels with grey.
pub(crate) fn whole_jpeg(bytes: &[u8]) -> Option<&[u8]> {
    let mut at = 2;
    let mut scanned = false;
    loop {
        // Entropy-coded data has no markers but restarts; an escaped byte is followed by 0.
        let gap = bytes
            .get(at..)?
            .windows(2)
            .position(|w| w[0] == 0xff && !matches!(w[1], 0 | 0xff));
        at += gap?;
        let marker = bytes[at + 1];
        at += 2;
        match marker {
            0xd9 if scanned => return bytes.get(..at),
            0xd9 => return None,
            0x01 | 0xd0..=0xd8 => {}
            _ => {
                scanned |= marker == 0xda;
                let length = bytes.get(at..at + 2)?;
                at += usize::from(u16::from_be_bytes([length[0], length[1]])).max(2);
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, reason = "small sizes and levels")]
mod tests {
    use super::*;

    /// A panic of a decoder becomes an error.
    #[test]
    fn panics_are_errors() {
        let empty: &[i32] = &[];
        let refused = guarded(|| Ok(empty[7]));
        assert!(refused.unwrap_err().contains("damaged"));
        assert_eq!(guarded(|| Ok(3)), Ok(3));
    }

    /// What follows the end of a JPEG does not count, whatever markers it seems to have; a missing end is noticed.
    #[test]
    fn jpegs_end_at_their_marker() {
        let mut bytes = Vec::new();
        let photo = image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([(x * 6) as u8, (y * 8) as u8, (x * y) as u8]));
        image::codecs::jpeg::JpegEncoder::new(&mut bytes)
            .encode_image(&photo)
            .unwrap();
        let tail = [&bytes[..], b"\0\0\x01mdat\xff\xda\0\x02\xff\xd9junk\xff\xda"].concat();
        assert_eq!(whole_jpeg(&tail), Some(&bytes[..]));
        assert_eq!(whole_jpeg(&bytes), Some(&bytes[..]));
        assert_eq!(whole_jpeg(&bytes[..bytes.len() - 2]), None);
        assert_eq!(whole_jpeg(&bytes[..bytes.len() / 2]), None);
    }
}
