//! The command line: what every command understands. The options of a command stand in its module.

use std::path::Path;

use clap::builder::styling::{AnsiColor, Styles};
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, CommandFactory, Parser};

use crate::commands::Command;
use crate::values::positive;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold());

/// From a photograph of a cut through a material to the solid it came from.
///
/// Terrazzo, concrete, asphalt, conglomerate: particles in a binder. A cut shows profiles of the particles; stereology tells from their number and sizes
/// how many particles of which size the solid holds. This program does that, packs such particles without overlap into a box that repeats, and gives
/// them the photograph's colours and texture: a solid that can be cut anywhere.
///
/// Everything at once:   stereology synthesize photo.jpg -o out
/// Step by step:         segment -> unfold (kmatrix) -> pack -> texture
/// On a finished solid:  slice, render, export
///
/// Method: Jagnow, Dorsey & Rushmeier, Stereological Techniques for Solid Textures, SIGGRAPH 2004.
#[derive(Debug, Parser)]
#[command(
    name = "stereology",
    version,
    styles = STYLES,
    verbatim_doc_comment,
    disable_help_subcommand = true,
    after_long_help = "Exit codes: 0 done; 1 the data or the run failed; 2 wrong usage; 3 done, but with warnings, under --strict; 130 stopped by Ctrl-C.\n\
                       Outputs are written beside and renamed when complete; existing ones are refused without --force.\n\
                       docs/cli.md holds this help in one page, and every warning's meaning."
)]
pub struct Program {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// What every command understands.
    #[command(flatten)]
    pub everywhere: Everywhere,
}

/// Options of every command.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "For every command")]
pub struct Everywhere {
    /// Print one JSON object, and nothing else, on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Seed of everything random: same seed and inputs, same bytes in every output file
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub seed: u64,
    /// Threads to use [default: all cores]; changes the time a run takes, never its result
    #[arg(long, global = true, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// No progress bars
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Exit with code 3 if there are warnings
    #[arg(long, global = true)]
    pub strict: bool,
    /// Replace existing outputs
    #[arg(long, global = true)]
    pub force: bool,
    /// Units of length per pixel; without it lengths are pixels
    #[arg(long, global = true, value_name = "UNITS_PER_PIXEL", default_value_t = 1.0, value_parser = positive)]
    pub scale: f64,
    /// How the program was called.
    #[arg(skip)]
    pub invocation: Invocation,
}

/// How a command was called, for people who want to repeat it: the same wherever and with however many threads it ran.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Invocation {
    /// The command with all options that were given; files by their names.
    pub command: String,
    /// Every option that can change the result, and its value.
    pub parameters: Vec<(String, String)>,
}

/// What changes no output, so that it is not repeated.
const WITHOUT_EFFECT: [&str; 7] = ["json", "threads", "quiet", "strict", "force", "output", "help"];

impl Invocation {
    /// How `matches`, of the whole program, was called.
    pub fn of(matches: &ArgMatches) -> Self {
        let mut invocation = Self::default();
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
                told_default(arg).unwrap_or_else(|| "not given".to_owned())
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
}

/// What the help of an argument tells of its default.
fn told_default(arg: &clap::Arg) -> Option<String> {
    let help = arg.get_help()?.to_string();
    let (_, told) = help.split_once("[default: ")?;
    Some(format!("not given: {}", told.strip_suffix(']')?))
}

/// A word as a shell reads it back.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "._-+=:,/".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n @ 1..=1024) => Ok(n),
        _ => Err("a number of threads from 1 to 1024 is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::{Invocation, Program};
    use clap::CommandFactory;

    #[test]
    fn an_invocation_can_be_repeated_anywhere() {
        let of = |words: &[&str]| Invocation::of(&Program::command().try_get_matches_from(words).unwrap());
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
                Some("not given: the photograph's area fraction"),
                None
            )
        );
        assert_eq!(
            of(&["stereology", "synthesize", "-o", "x"]).command,
            "stereology synthesize -o out"
        );
    }
}
