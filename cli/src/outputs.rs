//! Outputs: refused if they exist, written under a temporary name, renamed when complete.

use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use serde_json::Value;
use stereology::grid::{Format, write_atomically};

use crate::failure::{Explain, Failure};

/// Refuses an output file that exists (unless `force`), is a folder, or whose folder is missing.
///
/// Call it before the computation, so that a long run does not end in a refusal.
pub fn check_file(path: &Path, force: bool) -> Result<(), Failure> {
    let place = path.display();
    if path.is_dir() {
        return Err(Failure::run(format!(
            "{place} is a folder; -o needs the name of a file"
        )));
    }
    if path.exists() && !force {
        return Err(Failure::run(format!(
            "{place} exists; give another name, or --force to replace it"
        )));
    }
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() && !parent.is_dir() => Err(Failure::run(format!(
            "{place}: the folder {} does not exist; make it first",
            parent.display()
        ))),
        _ => Ok(()),
    }
}

/// As [`check_file`], for a volume, which can be a folder that `force` replaces.
pub fn check_volume(path: &Path, format: Format, force: bool) -> Result<(), Failure> {
    if format == Format::Zarr && force && path.join("zarr.json").is_file() {
        return Ok(());
    }
    if format == Format::Zarr && path.exists() {
        let place = path.display();
        return Err(Failure::run(format!(
            "{place} exists; give another name, or --force to replace it if it is a Zarr folder"
        )));
    }
    check_file(path, force)
}

/// Writes a text file completely or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    write_atomically(path, |out| out.write_all(text.as_bytes())).at(path)
}

/// Writes a PNG completely or not at all.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<(), Failure> {
    write_atomically(path, |out| {
        PngEncoder::new(out)
            .write_image(
                picture.as_raw(),
                picture.width(),
                picture.height(),
                ExtendedColorType::Rgb8,
            )
            .map_err(std::io::Error::other)
    })
    .at(path)
}

/// Writes indented JSON completely or not at all.
pub fn write_json(path: &Path, value: &Value) -> Result<(), Failure> {
    write_text(path, &format!("{value:#}\n"))
}

/// A folder of outputs that gets its name only when complete.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    partial: PathBuf,
    published: bool,
}

impl OutputFolder {
    /// Begins to write `target`, as `target.partial` beside it.
    ///
    /// A folder that contains anything is refused. With `force`, [`publish`](Self::publish) replaces it, but only if it
    /// is an output of this program (it has a `summary.json` of ours), so that no other folder is replaced by mistake.
    pub fn begin(target: &Path, force: bool) -> Result<Self, Failure> {
        let target = named(target)?;
        let place = target.display();
        if target.exists() && !target.is_dir() {
            return Err(Failure::run(format!(
                "{place} is a file; -o needs the name of a folder"
            )));
        }
        if is_filled(&target).at(&target)? {
            if !force {
                return Err(Failure::run(format!(
                    "{place} already contains files; give another folder, or --force to replace it"
                )));
            }
            if !is_ours(&target) {
                return Err(Failure::run(format!(
                    "{place} contains files but no summary.json of this program, so --force does not replace it; give another folder"
                )));
            }
        }
        let partial = with_suffix(&target, ".partial");
        if partial.is_dir() {
            // Left by an interrupted run.
            fs::remove_dir_all(&partial).at(&partial)?;
        }
        fs::create_dir_all(&partial)
            .map_err(|error| format!("{place}: its folder cannot be written ({error}); give another place"))
            .or_fail()?;
        Ok(Self {
            target,
            partial,
            published: false,
        })
    }

    /// Path at which to write the file `name` of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.partial.join(name)
    }

    /// Gives the complete folder its name.
    pub fn publish(mut self) -> Result<PathBuf, Failure> {
        let old = with_suffix(&self.target, ".partial-old");
        let replacing = self.target.exists();
        if replacing {
            if old.is_dir() {
                fs::remove_dir_all(&old).at(&old)?;
            }
            fs::rename(&self.target, &old).at(&self.target)?;
        }
        if let Err(error) = fs::rename(&self.partial, &self.target) {
            if replacing {
                let _ = fs::rename(&old, &self.target);
            }
            return Err(error).at(&self.target);
        }
        self.published = true;
        if replacing {
            fs::remove_dir_all(&old).at(&old)?;
        }
        Ok(self.target.clone())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.published {
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

/// The path with a last component, so that something can be written beside it (`.` has none).
fn named(path: &Path) -> Result<PathBuf, Failure> {
    if path.file_name().is_some() {
        // Without a slash at its end.
        Ok(path.components().collect())
    } else {
        fs::canonicalize(path).at(path)
    }
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
    name.push(suffix);
    path.with_file_name(name)
}

fn is_filled(folder: &Path) -> std::io::Result<bool> {
    Ok(folder.exists() && fs::read_dir(folder)?.next().is_some())
}

fn is_ours(folder: &Path) -> bool {
    fs::read_to_string(folder.join("summary.json"))
        .ok()
        .and_then(|text| serde_json::from_str::<Value>(&text).ok())
        .and_then(|summary| {
            summary["schema"]
                .as_str()
                .map(|schema| schema.starts_with("stereology."))
        })
        .unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::{OutputFolder, check_file, write_text};
    use std::fs;

    #[test]
    fn a_folder_appears_only_when_complete() {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        let folder = OutputFolder::begin(&out, false).unwrap();
        write_text(&folder.file("a.txt"), "a").unwrap();
        assert!(!out.exists());
        drop(folder);
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);

        let folder = OutputFolder::begin(&out, false).unwrap();
        write_text(&folder.file("summary.json"), r#"{"schema": "stereology.segment/1"}"#).unwrap();
        folder.publish().unwrap();
        assert!(out.join("summary.json").exists());
    }

    #[test]
    fn force_replaces_results_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out/");
        fs::create_dir(&out).unwrap();
        drop(OutputFolder::begin(&out, false).unwrap()); // empty: free to use
        fs::write(out.join("thesis.tex"), "years of work").unwrap();
        assert!(
            OutputFolder::begin(&out, true)
                .unwrap_err()
                .to_string()
                .contains("summary.json")
        );
        fs::write(out.join("summary.json"), r#"{"schema": "stereology.segment/1"}"#).unwrap();
        assert!(
            OutputFolder::begin(&out, false)
                .unwrap_err()
                .to_string()
                .contains("--force")
        );
        let folder = OutputFolder::begin(&out, true).unwrap();
        write_text(&folder.file("new"), "b").unwrap();
        folder.publish().unwrap();
        assert!(out.join("new").exists() && !out.join("thesis.tex").exists());
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_is_checked_before_the_work() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("a.csv");
        assert!(check_file(&file, false).is_ok());
        fs::write(&file, "x").unwrap();
        assert!(check_file(&file, false).is_err() && check_file(&file, true).is_ok());
        assert!(check_file(place.path(), true).is_err());
        assert!(check_file(&place.path().join("none/a.csv"), false).is_err());
    }
}
