//! Options of every command, and how the program was invoked.

use clap::Args;

use crate::values::positive;

/// Options of every command.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Options of every command")]
pub struct Everywhere {
    /// Print the result as one JSON object on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Random seed: equal seeds and inputs give identical output files
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub seed: u64,
    /// Number of threads [default: all cores]; affects the time, not the result
    #[arg(long, global = true, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Show no progress bars
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Exit with code 3 if there are warnings
    #[arg(long, global = true)]
    pub strict: bool,
    /// Replace existing outputs
    #[arg(long, global = true)]
    pub force: bool,
    /// Units of length per pixel; without it lengths are in pixels
    #[arg(long, global = true, value_name = "UNITS_PER_PIXEL", default_value_t = 1.0, value_parser = positive)]
    pub scale: f64,
    /// How the program was invoked.
    #[arg(skip)]
    pub invocation: Invocation,
}

/// How a command was invoked, so that a reader of its output can repeat it. It does not depend on folders or the number
/// of threads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Invocation {
    /// The command with all options given; files without their folders.
    pub command: String,
    /// Every option that can change the result, with its value.
    pub parameters: Vec<(String, String)>,
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n @ 1..=1024) => Ok(n),
        _ => Err("a number of threads from 1 to 1024 is needed".to_owned()),
    }
}
