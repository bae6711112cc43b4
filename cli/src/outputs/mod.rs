//! Outputs: what a command writes gets its names all at once, when everything is complete.
//!
//! Options that name outputs have the type [`Output`]. [`Outputs`] finds them all on the command line, so that no
//! command can forget a check: two options may not name one output, and an output may not be an input or contain one. A
//! command asks [`Outputs`] for paths to write to; these are temporary and beside the final names. `main` publishes all
//! of them when the command is done, or none.

mod collisions;
mod list;
mod output;
mod special;

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use serde_json::Value;
use stereology::grid::{Format, Staging, destination, foreign_file_in_zarr, write_atomically};

use crate::failure::{Explain, Failure};
use collisions::Inputs;
pub use output::Output;

/// All outputs of a run.
#[derive(Clone, Debug, Default)]
pub struct Outputs(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    /// Whether existing outputs are replaced.
    force: bool,
    inputs: Inputs,
    staged: Vec<Staged>,
    finished: bool,
}

/// An output under a temporary name.
#[derive(Debug)]
struct Staged {
    given: PathBuf,
    staging: Staging,
    kind: Kind,
}

#[derive(Debug, PartialEq, Eq)]
enum Kind {
    File,
    /// A folder of results, with a list of its files.
    Folder,
    /// A volume that is a folder.
    Zarr,
    /// A device or a pipe, which gets the content and is not replaced.
    Special,
}

impl Outputs {
    /// The outputs of a command. Refuses, before any work, two options that name one output, and outputs that are
    /// inputs or contain one, even with `force`.
    pub fn of(command: &clap::Command, given: &clap::ArgMatches, force: bool) -> Result<Self, Failure> {
        let inputs = collisions::check(command, given)?;
        Ok(Self(Arc::new(Mutex::new(State {
            force,
            inputs,
            ..State::default()
        }))))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Path at which to write a file.
    ///
    /// Call it before the computation: an output that exists (unless `--force`), is a folder, or whose folder is
    /// missing is refused.
    pub fn file(&self, output: &Output) -> Result<PathBuf, Failure> {
        self.file_called(output.name())
    }

    /// As [`file`](Self::file), for a name that the command has made of the one given.
    pub fn file_called(&self, path: &Path) -> Result<PathBuf, Failure> {
        let mut state = self.state();
        state.inputs.refuse(path, &path.display().to_string())?;
        if special::is_special(path) {
            return state.stage_in(
                path,
                &std::env::temp_dir().join(path.file_name().unwrap_or_default()),
                Kind::Special,
            );
        }
        check_file(path, state.force)?;
        state.stage(path, Kind::File)
    }

    /// Path at which to write a volume, which can be a folder.
    pub fn volume(&self, output: &Output, format: Format) -> Result<PathBuf, Failure> {
        if format != Format::Zarr {
            return self.file(output);
        }
        let mut state = self.state();
        check_zarr(output.name(), state.force)?;
        state.stage(output.name(), Kind::Zarr)
    }

    /// Path at which to resume a volume. The library gives it its name, as `FILE.partial` is to stay if it cannot.
    pub fn resumed_volume(&self, output: &Output, format: Format) -> Result<PathBuf, Failure> {
        let force = self.state().force;
        match format {
            Format::Zarr => check_zarr(output.name(), force)?,
            _ if special::is_special(output.name()) => {
                return Err(Failure::usage(format!(
                    "{}: --resume needs a regular file, as it goes on from its beginning",
                    output.display()
                )));
            }
            _ => check_file(output.name(), force)?,
        }
        Ok(output.name().to_owned())
    }

    /// Folder in which to write files.
    ///
    /// A folder that contains anything is refused. With `--force` it is replaced, but only if every file in it was
    /// written by this program, so that nothing else is lost.
    pub fn folder(&self, output: &Output) -> Result<OutputFolder, Failure> {
        let target = named(output.name())?;
        let mut state = self.state();
        check_folder(&target, state.force)?;
        let folder = state.stage(&target, Kind::Folder)?;
        fs::create_dir(&folder).at(&target)?;
        Ok(OutputFolder(folder))
    }

    /// Adds an input that is not on the command line, such as a mesh that another file names.
    pub fn refuse_input(&self, path: &Path) -> Result<(), Failure> {
        let mut state = self.state();
        state.inputs.add(path, &path.display().to_string());
        let State { inputs, staged, .. } = &*state;
        staged
            .iter()
            .try_for_each(|output| inputs.refuse(&output.given, &output.given.display().to_string()))
    }

    /// Gives all outputs their names. If one of them cannot be had, none is.
    pub fn publish(&self) -> Result<(), Failure> {
        let mut state = self.state();
        let force = state.force;
        for output in &mut state.staged {
            output.complete(force)?;
        }
        for k in 0..state.staged.len() {
            if let Err(failure) = state.staged[k].publish(force) {
                for output in state.staged[..k].iter_mut().rev() {
                    let _ = output.staging.take_back(); // the first failure is the one to tell
                }
                return Err(failure);
            }
        }
        state.finished = true;
        state.staged.clear(); // removes temporary folders, and what was replaced
        Ok(())
    }

    /// What ends the program without outputs, unless they have their names already. It does not keep the outputs, whose
    /// temporary files are removed when the command is done with them.
    pub fn abandoning(&self) -> impl FnOnce() + Send + 'static {
        let outputs = Arc::downgrade(&self.0);
        move || {
            if let Some(state) = outputs.upgrade() {
                Self(state).abandon();
            }
        }
    }

    fn abandon(&self) {
        let state = self.state();
        if state.finished {
            return;
        }
        let stopped = Failure::stopped();
        let _ = writeln!(io::stderr(), "error: {stopped}");
        for output in &state.staged {
            let folder = output.staging.folder();
            // Under another name, threads that still write find no place, so that it becomes empty and stays so.
            let aside = folder.with_extension("stopped");
            let there = if fs::rename(folder, &aside).is_ok() {
                &*aside
            } else {
                folder
            };
            let _ = fs::remove_dir_all(there);
        }
        std::process::exit(i32::from(stopped.code()));
    }

    /// A message with the final names of outputs instead of the temporary ones.
    pub fn with_final_names(&self, message: &str) -> String {
        self.state().staged.iter().fold(message.to_owned(), |message, output| {
            message.replace(
                &*output.staging.path().to_string_lossy(),
                &output.given.to_string_lossy(),
            )
        })
    }
}

impl State {
    fn stage(&mut self, path: &Path, kind: Kind) -> Result<PathBuf, Failure> {
        self.stage_in(path, path, kind)
    }

    fn stage_in(&mut self, given: &Path, beside: &Path, kind: Kind) -> Result<PathBuf, Failure> {
        let staging = Staging::beside(beside)
            .map_err(|error| format!("{}: cannot be written ({error}); give another place", given.display()))
            .or_fail()?;
        let path = staging.path().to_owned();
        self.staged.push(Staged {
            given: given.to_owned(),
            staging,
            kind,
        });
        Ok(path)
    }
}

impl Staged {
    /// Does all that can fail before the names are given.
    fn complete(&mut self, force: bool) -> Result<(), Failure> {
        let target = self.staging.target();
        match self.kind {
            Kind::File => Ok(()),
            Kind::Special => special::copy(self.staging.path(), &self.given),
            // Looked at once more: files may have come in the meantime.
            Kind::Zarr => check_zarr(target, force).map_err(|_| self.taken()),
            Kind::Folder => {
                check_folder(target, force)?;
                list::write(self.staging.path()).at(&self.given)
            }
        }
    }

    fn publish(&mut self, force: bool) -> Result<(), Failure> {
        if self.kind == Kind::Special {
            return Ok(());
        }
        if self.kind == Kind::Folder {
            // An empty folder may be used; this removes no other.
            let _ = fs::remove_dir(self.staging.target());
        }
        self.staging.publish(force).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists | io::ErrorKind::DirectoryNotEmpty => self.taken(),
            _ => Failure::run(format!("{}: {error}", self.given.display())),
        })
    }

    fn taken(&self) -> Failure {
        Failure::run(format!(
            "{} exists: another process wrote it while this one was running, and this one has written nothing; give another name, or --force to replace it",
            self.given.display()
        ))
    }
}

/// A folder of outputs that gets its name only when complete.
#[derive(Debug)]
pub struct OutputFolder(PathBuf);

impl OutputFolder {
    /// Path at which to write the file `name` of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

/// Refuses an output file that exists (unless `force`), is a folder, or whose folder is missing.
fn check_file(path: &Path, force: bool) -> Result<(), Failure> {
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
    let target = destination(path).at(path)?;
    match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() && !parent.is_dir() => Err(Failure::run(format!(
            "{place}: the folder {} does not exist; make it first",
            parent.display()
        ))),
        _ => Ok(()),
    }
}

/// As [`check_file`], for a volume that is a folder, which `force` replaces if all of its files are of a volume.
fn check_zarr(path: &Path, force: bool) -> Result<(), Failure> {
    let place = path.display();
    if !path.is_dir() {
        return match path.exists() {
            true => Err(Failure::run(format!(
                "{place} is a file, and a .zarr is a folder; give another name"
            ))),
            false => check_file(path, force),
        };
    }
    if !force {
        return Err(Failure::run(format!(
            "{place} exists; give another name, or --force to replace it if it is a Zarr folder"
        )));
    }
    match foreign_file_in_zarr(path).at(path)? {
        None => Ok(()),
        Some(file) => Err(Failure::run(format!(
            "{place} contains {}, which is not of a volume of this program, so --force does not replace the folder; move that file away, or give another name",
            file.display()
        ))),
    }
}

fn check_folder(target: &Path, force: bool) -> Result<(), Failure> {
    let place = target.display();
    if target.exists() && !target.is_dir() {
        return Err(Failure::run(format!(
            "{place} is a file; -o needs the name of a folder"
        )));
    }
    if !is_filled(target).at(target)? {
        let parent = destination(target).at(target)?;
        let Some(parent) = parent.parent().filter(|parent| !parent.as_os_str().is_empty()) else {
            return Ok(());
        };
        return fs::create_dir_all(parent)
            .map_err(|error| format!("{place}: its folder cannot be written ({error}); give another place"))
            .or_fail();
    }
    if !force {
        return Err(Failure::run(format!(
            "{place} already contains files; give another folder, or --force to replace it"
        )));
    }
    match list::foreign_file(target).at(target)? {
        None => Ok(()),
        Some(file) => Err(Failure::run(format!(
            "{place} contains {}, which this program did not write there, so --force does not replace the folder; move that file away, or give another folder",
            file.display()
        ))),
    }
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

/// The path with a last component, so that something can be written beside it (`.` has none).
fn named(path: &Path) -> Result<PathBuf, Failure> {
    if path.file_name().is_some() {
        // Without a slash at its end.
        Ok(path.components().collect())
    } else {
        fs::canonicalize(path).at(path)
    }
}

fn is_filled(folder: &Path) -> io::Result<bool> {
    Ok(folder.exists() && fs::read_dir(folder)?.next().is_some())
}
