//! Outputs that collide with inputs, or with each other.

use std::fs;
use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use stereology::grid::destination;

use crate::failure::Failure;
use crate::outputs::output::Output;
use crate::outputs::{list, special};

/// The inputs of a run.
#[derive(Debug, Default)]
pub struct Inputs(Vec<Input>);

#[derive(Debug)]
struct Input {
    given: String,
    place: Place,
}

/// Where a path leads.
#[derive(Debug, PartialEq, Eq)]
struct Place {
    path: PathBuf,
    /// Device and number of the file, equal for hard links.
    identity: Option<(u64, u64)>,
    is_folder: bool,
}

/// Checks the outputs on the command line, and returns the inputs.
pub fn check(command: &Command, given: &ArgMatches) -> Result<Inputs, Failure> {
    let mut inputs = Inputs::default();
    let mut outputs: Vec<(String, &Path)> = Vec::new();
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        if !argument.get_action().takes_values() || given.try_contains_id(id).is_err() {
            continue;
        }
        if let Ok(names) = given.try_get_many::<Output>(id) {
            let option = argument.get_long().map_or_else(
                || {
                    argument
                        .get_short()
                        .map_or_else(|| id.to_owned(), |short| format!("-{short}"))
                },
                |long| format!("--{long}"),
            );
            outputs.extend(
                names
                    .into_iter()
                    .flatten()
                    .map(|output| (option.clone(), output.name())),
            );
        } else if given.value_source(id) == Some(ValueSource::CommandLine) {
            let is_path = matches!(given.try_get_many::<PathBuf>(id), Ok(Some(_)));
            for value in given.get_raw(id).into_iter().flatten() {
                let text = value.to_string_lossy();
                // SHAPE=FRACTION
                let before = text.rsplit_once('=').map(|(file, _)| Path::new(file));
                for path in [Some(Path::new(value)), before].into_iter().flatten() {
                    // A number or a word is an input only if it is the name of a file.
                    if path.is_file() || (is_path && path.is_dir()) {
                        inputs.add(path, &path.display().to_string());
                    }
                }
            }
        }
    }
    for (k, (option, output)) in outputs.iter().enumerate() {
        let name = format!("{option} {}", output.display());
        inputs.refuse(output, &name)?;
        for (other_option, other) in &outputs[..k] {
            refuse_same((&name, output), (&format!("{other_option} {}", other.display()), other))?;
        }
    }
    Ok(inputs)
}

impl Inputs {
    /// Adds an input, if it exists.
    pub fn add(&mut self, path: &Path, given: &str) {
        if let Some(place) = Place::of(path) {
            self.0.push(Input {
                given: given.to_owned(),
                place,
            });
        }
    }

    /// Refuses an output, called `name`, that is an input, contains one, or is a part of one.
    pub fn refuse(&self, output: &Path, name: &str) -> Result<(), Failure> {
        let Some(place) = Place::of(output) else {
            return Ok(());
        };
        for Input { given, place: input } in &self.0 {
            let same = place.path == input.path || (place.identity.is_some() && place.identity == input.identity);
            let relation = if same {
                "is an input of this command"
            } else if input.path.starts_with(&place.path) {
                "contains an input of this command"
            } else if input.has_part(&place.path) {
                "is a part of an input of this command"
            } else {
                continue;
            };
            return Err(Failure::usage(format!(
                "{name} {relation}, {given}, which would be lost; give another name"
            )));
        }
        Ok(())
    }
}

impl Place {
    /// `None` if links lead in a circle.
    fn of(path: &Path) -> Option<Self> {
        let whole = without_links(&destination(path).ok()?);
        let found = fs::metadata(&whole).ok();
        Some(Self {
            identity: found.as_ref().filter(|of| of.is_file()).and_then(identity),
            is_folder: found.is_some_and(|of| of.is_dir()),
            path: whole,
        })
    }

    /// Whether an existing file or folder at `path` is one of the results in this folder. What users have put into it
    /// is theirs to replace.
    fn has_part(&self, path: &Path) -> bool {
        let Ok(inside) = path.strip_prefix(&self.path) else {
            return false;
        };
        self.is_folder && path.exists() && list::read(&self.path).is_none_or(|ours| list::holds(&ours, inside))
    }
}

/// The absolute path without links and `..`, as far as it exists.
fn without_links(path: &Path) -> PathBuf {
    match (fs::canonicalize(path), path.parent(), path.file_name()) {
        (Ok(whole), ..) => whole,
        (Err(_), Some(folder), Some(name)) if folder.as_os_str().is_empty() => without_links(Path::new(".")).join(name),
        (Err(_), Some(folder), Some(name)) => without_links(folder).join(name),
        _ => path.to_owned(),
    }
}

#[cfg(unix)]
fn identity(of: &fs::Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((of.dev(), of.ino()))
}

#[cfg(not(unix))]
fn identity(_: &fs::Metadata) -> Option<(u64, u64)> {
    None
}

/// Refuses two outputs of one name, and one inside the other. Devices and pipes can take several.
fn refuse_same((name, output): (&str, &Path), (other_name, other): (&str, &Path)) -> Result<(), Failure> {
    let (Some(place), Some(there)) = (Place::of(output), Place::of(other)) else {
        return Ok(());
    };
    if special::is_special(output) {
        return Ok(());
    }
    if place.path == there.path {
        return Err(Failure::usage(format!(
            "{other_name} and {name} name one output; give two names"
        )));
    }
    if place.path.starts_with(&there.path) || there.path.starts_with(&place.path) {
        return Err(Failure::usage(format!(
            "of {other_name} and {name}, one is inside the other; give names beside each other"
        )));
    }
    Ok(())
}
