//! Outputs that are devices or pipes: they get the content and are not replaced.

use std::fs;
use std::path::Path;

use crate::failure::{Explain, Failure};
use crate::progress;

/// Whether something with this name exists that is neither a file nor a folder.
pub fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// Copies a complete file into a device or pipe.
pub fn copy(content: &Path, special: &Path) -> Result<(), Failure> {
    let bytes = fs::File::open(content).at(special)?;
    copy_all(bytes, special)
}

/// Without blocking, so that a pipe that nobody reads can be left.
#[cfg(unix)]
fn copy_all(mut from: fs::File, special: &Path) -> Result<(), Failure> {
    use std::io::{ErrorKind, Read, Write};
    use std::os::unix::fs::OpenOptionsExt;
    use std::time::Duration;

    use rustix::fs::OFlags;
    use rustix::io::Errno;

    let wait = || {
        std::thread::sleep(Duration::from_millis(5));
        progress::go_on()
    };
    let mut options = fs::OpenOptions::new();
    options.write(true).custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    let mut to = loop {
        match options.open(special) {
            // A pipe without a reader.
            Err(error) if error.raw_os_error() == Some(Errno::NXIO.raw_os_error()) => wait()?,
            opened => break opened.at(special)?,
        }
    };
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = from.read(&mut buffer).at(special)?;
        let mut rest = &buffer[..count];
        while !rest.is_empty() {
            match to.write(rest) {
                Ok(written) => rest = &rest[written..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => wait()?,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error).at(special),
            }
        }
        if count == 0 {
            return Ok(());
        }
    }
}

#[cfg(not(unix))]
fn copy_all(mut from: fs::File, special: &Path) -> Result<(), Failure> {
    let mut to = fs::OpenOptions::new().write(true).open(special).at(special)?;
    progress::go_on()?;
    std::io::copy(&mut from, &mut to).map(drop).at(special)
}
