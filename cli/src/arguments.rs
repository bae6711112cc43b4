//! The command line: what every command understands. The options of a command stand in its module.

use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, Parser};

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
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n @ 1..=1024) => Ok(n),
        _ => Err("a number of threads from 1 to 1024 is needed".to_owned()),
    }
}
