//! The command line: the program, its commands, and how it was invoked.

use std::path::Path;

use clap::builder::styling::{AnsiColor, Styles};
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, Parser, Subcommand};

use crate::answer::Answer;
use crate::commands::{
    assemble, carve, contact, displace, exemplar, explore, export, grow, kmatrix, measure, pack, pyramid, render,
    schema, segment, shape, slice, synthesize, texture, unfold,
};
use crate::everywhere::{Everywhere, Invocation};
use crate::failure::Failure;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold());

/// From a photograph of a cut through a material to the solid it came from.
///
/// Terrazzo, concrete, asphalt and conglomerate consist of particles in a binder. A plane section shows profiles of the
/// particles; stereology estimates from their number and sizes how many particles of each size the solid contains. This
/// program makes that estimate, packs such particles without overlap into a periodic box, and gives them the colours
/// and the texture of the photograph. The result is a solid that can be sectioned anywhere.
///
/// All steps at once:    stereology synthesize photo.jpg -o out
/// Step by step:         segment -> unfold (kmatrix) -> pack -> texture -> assemble
/// On a finished solid:  slice, render, export, carve
/// Without particles:    exemplar, grow, measure
/// Reliefs on meshes:    contact, displace, explore
///
/// Method: Jagnow, Dorsey & Rushmeier, Stereological Techniques for Solid Textures, SIGGRAPH 2004.
#[derive(Debug, Parser)]
#[command(
    name = "stereology",
    version,
    styles = STYLES,
    verbatim_doc_comment,
    disable_help_subcommand = true,
    after_long_help = "Exit codes: 0 success; 1 the data are unsuitable or the run failed; 2 wrong usage; 3 success with warnings, under --strict; 130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.\n\
                       Outputs are written under temporary names and renamed together when all are complete. Existing outputs are replaced only with --force, and a folder only if this program wrote all that is in it. An output is never an input, and links are followed.\n\
                       docs/cli.md contains the help of all commands and the meaning of every warning."
)]
pub struct Program {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
    /// Options of every command.
    #[command(flatten)]
    pub everywhere: Everywhere,
}

/// A command and its options.
#[derive(Debug, Subcommand)]
pub enum Command {
    Synthesize(synthesize::Synthesize),
    Segment(segment::Segment),
    Kmatrix(kmatrix::Kmatrix),
    Unfold(unfold::Unfold),
    Pack(pack::Pack),
    Texture(texture::Texture),
    Pyramid(pyramid::Pyramid),
    Shape(shape::Shape),
    Assemble(assemble::Assemble),
    Slice(slice::Slice),
    Render(render::Render),
    Export(export::Export),
    Carve(carve::Carve),
    Measure(measure::Measure),
    Exemplar(exemplar::Exemplar),
    Grow(grow::Grow),
    Contact(contact::Contact),
    Displace(displace::Displace),
    Explore(explore::Explore),
    Schema(schema::SchemaOf),
    /// Prints docs/cli.md
    #[command(hide = true)]
    Manual,
}

impl Command {
    /// Runs the command; `None` if it has printed its output itself.
    pub fn run(&self, everywhere: &Everywhere) -> Result<Option<Answer>, Failure> {
        match self {
            Self::Synthesize(options) => options.run(everywhere).map(Some),
            Self::Segment(options) => options.run(everywhere).map(Some),
            Self::Kmatrix(options) => options.run(everywhere).map(Some),
            Self::Unfold(options) => options.run(everywhere).map(Some),
            Self::Pack(options) => options.run(everywhere).map(Some),
            Self::Texture(options) => options.run(everywhere).map(Some),
            Self::Pyramid(options) => options.run(everywhere).map(Some),
            Self::Shape(options) => options.run(everywhere).map(Some),
            Self::Assemble(options) => options.run(everywhere).map(Some),
            Self::Slice(options) => options.run(everywhere).map(Some),
            Self::Render(options) => options.run(everywhere).map(Some),
            Self::Export(options) => options.run(everywhere).map(Some),
            Self::Carve(options) => options.run(everywhere).map(Some),
            Self::Measure(options) => options.run(everywhere).map(Some),
            Self::Exemplar(options) => options.run(everywhere).map(Some),
            Self::Grow(options) => options.run(everywhere).map(Some),
            Self::Contact(options) => options.run(everywhere).map(Some),
            Self::Displace(options) => options.run(everywhere).map(Some),
            Self::Explore(options) => options.run(everywhere).map(Some),
            Self::Schema(options) => options.run(everywhere).map(|()| None),
            // The page is generated from the definitions in this file, so `main` prints it.
            Self::Manual => Ok(None),
        }
    }
}

/// Options that do not affect output files.
const WITHOUT_EFFECT: [&str; 8] = ["json", "threads", "quiet", "strict", "force", "output", "from", "help"];

/// The invocation in the matches of the whole program.
pub fn invocation(matches: &ArgMatches) -> Invocation {
    let mut invocation = Invocation::default();
    let Some((name, given)) = matches.subcommand() else {
        return invocation;
    };
    let mut program = Program::command();
    program.build();
    let Some(command) = program.find_subcommand(name) else {
        return invocation;
    };
    let (mut files, mut options) = (String::new(), String::new());
    for arg in command.get_arguments() {
        let id = arg.get_id().as_str();
        if WITHOUT_EFFECT.contains(&id) || given.try_contains_id(id).is_err() {
            continue;
        }
        let values: Vec<String> = given
            .get_raw(id)
            .into_iter()
            .flatten()
            .map(|value| {
                Path::new(value)
                    .file_name()
                    .unwrap_or(value)
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        let shown = if values.is_empty() {
            documented_default(arg).unwrap_or_else(|| "not given".to_owned())
        } else {
            values.join("  ")
        };
        let by_hand = given.value_source(id) == Some(ValueSource::CommandLine);
        match arg.get_long() {
            Some(long) => {
                invocation.parameters.push((format!("--{long}"), shown));
                if by_hand {
                    values
                        .iter()
                        .for_each(|value| options.push_str(&format!(" --{long} {}", quoted(value))));
                }
            }
            None => {
                invocation.parameters.push((id.to_uppercase(), shown));
                values
                    .iter()
                    .for_each(|value| files.push_str(&format!(" {}", quoted(value))));
            }
        }
    }
    let output = if command.get_arguments().any(|arg| arg.get_id() == "output") {
        " -o out"
    } else {
        ""
    };
    invocation.command = format!("stereology {name}{files}{output}{options}");
    invocation
}

/// The default that the help of an argument documents.
fn documented_default(arg: &clap::Arg) -> Option<String> {
    let help = arg.get_help()?.to_string();
    let (_, default) = help.split_once("[default: ")?;
    Some(format!("not given: {}", default.strip_suffix(']')?))
}

/// A word quoted for a shell.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "._-+=:,/".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::{Program, invocation};
    use clap::CommandFactory;

    #[test]
    fn an_invocation_can_be_repeated_anywhere() {
        let of = |words: &[&str]| invocation(&Program::command().try_get_matches_from(words).unwrap());
        let invocation = of(&[
            "stereology",
            "synthesize",
            "/home/me/my photo.jpg",
            "-o",
            "/tmp/x",
            "--shape",
            "rock:1=0.5",
            "--shape",
            "a.obj",
            "--threads",
            "2",
            "--seed",
            "3",
        ]);
        assert_eq!(
            invocation.command,
            "stereology synthesize 'my photo.jpg' -o out --shape rock:1=0.5 --shape a.obj --seed 3"
        );
        let value = |name: &str| {
            invocation
                .parameters
                .iter()
                .find(|(of, _)| of == name)
                .map(|(_, value)| value.as_str())
        };
        assert_eq!(
            (
                value("--seed"),
                value("--count"),
                value("--fraction"),
                value("--threads")
            ),
            (
                Some("3"),
                Some("not given"),
                Some("not given: the area fraction of the photograph"),
                None
            )
        );
        assert_eq!(
            of(&["stereology", "synthesize", "-o", "x"]).command,
            "stereology synthesize -o out"
        );
    }
}
