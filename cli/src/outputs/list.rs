//! The list of files in a folder of results, by which the program knows its own.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Name of the list: one path a line, relative to the folder.
const LIST: &str = ".stereology-files";

/// Writes the list of all files in `folder`.
pub fn write(folder: &Path) -> io::Result<()> {
    let mut files = Vec::new();
    collect(folder, Path::new(""), &mut files)?;
    let names: Vec<String> = files.iter().map(|file| format!("{}\n", line(file))).collect();
    fs::write(folder.join(LIST), names.concat())
}

/// The files that this program wrote into `folder`; `None` if it is no folder of results.
pub fn read(folder: &Path) -> Option<BTreeSet<String>> {
    let text = fs::read_to_string(folder.join(LIST)).ok()?;
    Some(text.lines().map(str::to_owned).chain([LIST.to_owned()]).collect())
}

/// A file in `folder`, relative to it, that is not in its list.
pub fn foreign_file(folder: &Path) -> io::Result<Option<PathBuf>> {
    let ours = read(folder).unwrap_or_default();
    let mut files = Vec::new();
    collect(folder, Path::new(""), &mut files)?;
    Ok(files.into_iter().find(|file| !ours.contains(&line(file))))
}

/// Whether `inside`, a file or folder, is one that this program wrote into a folder with these files, or contains one.
pub fn holds(ours: &BTreeSet<String>, inside: &Path) -> bool {
    ours.iter().any(|file| Path::new(file).starts_with(inside))
}

fn line(file: &Path) -> String {
    let parts: Vec<_> = file.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

/// All files, links and empty folders below `folder`, in order.
fn collect(folder: &Path, below: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries = fs::read_dir(folder.join(below))?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    if entries.is_empty() && below != Path::new("") {
        files.push(below.to_owned());
    }
    for entry in entries {
        let inside = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            collect(folder, &inside, files)?;
        } else {
            files.push(inside);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{foreign_file, holds, read, write};
    use std::fs;
    use std::path::Path;

    #[test]
    fn only_listed_files_are_ours() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path();
        fs::create_dir(folder.join("designs")).unwrap();
        fs::write(folder.join("designs/1.json"), "").unwrap();
        fs::write(folder.join("summary.json"), "").unwrap();
        assert_eq!(foreign_file(folder).unwrap().unwrap(), Path::new("designs/1.json"));
        write(folder).unwrap();
        assert_eq!(foreign_file(folder).unwrap(), None);
        let ours = read(folder).unwrap();
        assert!(holds(&ours, Path::new("designs")) && holds(&ours, Path::new("designs/1.json")));
        assert!(!holds(&ours, Path::new("designs/2.json")));

        fs::write(folder.join("designs/2.json"), "").unwrap();
        assert_eq!(foreign_file(folder).unwrap().unwrap(), Path::new("designs/2.json"));
        fs::remove_file(folder.join("designs/2.json")).unwrap();
        fs::create_dir(folder.join("mine")).unwrap();
        assert_eq!(foreign_file(folder).unwrap().unwrap(), Path::new("mine"));
    }
}
