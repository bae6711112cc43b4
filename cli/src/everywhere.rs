//! Options of every command, and how the program was invoked.

use clap::Args;
use stereology::grid::LengthUnit;

use crate::failure::Failure;
use crate::outputs::Outputs;
use crate::values::PixelLength;

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
    /// Length of a pixel, with its unit (nm, um, mm, cm, m or in), such as 0.05mm; without it lengths are in pixels
    #[arg(long = "scale", global = true, value_name = "LENGTH_PER_PIXEL", id = "scale")]
    pub scale_given: Option<PixelLength>,
    /// Unit of length, if --scale has none: nm, um, mm, cm, m or in
    #[arg(long = "unit", global = true, value_name = "UNIT", id = "unit")]
    pub unit_given: Option<LengthUnit>,
    /// Length of a pixel; 1 if lengths are in pixels.
    #[arg(skip = 1.0)]
    pub scale: f64,
    /// Unit of length, if it is known.
    #[arg(skip)]
    pub unit: Option<LengthUnit>,
    /// How the program was invoked.
    #[arg(skip)]
    pub invocation: Invocation,
    /// The outputs of the command.
    #[arg(skip)]
    pub outputs: Outputs,
}

impl Everywhere {
    /// Takes length of a pixel and unit from the options.
    pub fn settle(&mut self) -> Result<(), Failure> {
        let of_scale = self.scale_given.and_then(|scale| scale.unit);
        if let (Some(of_scale), Some(unit)) = (of_scale, self.unit_given)
            && of_scale != unit
        {
            return Err(Failure::usage(format!(
                "--scale is in {of_scale}, but --unit is {unit}; give one of them"
            )));
        }
        self.scale = self.scale_given.map_or(1.0, |scale| scale.length);
        self.unit = of_scale.or(self.unit_given);
        Ok(())
    }

    /// Refuses a unit for lengths in pixels.
    pub fn refuse_unit_of_pixels(&self) -> Result<(), Failure> {
        match (self.unit_given, self.scale_given) {
            (Some(unit), None) => Err(Failure::usage(format!(
                "--unit {unit} needs --scale, the length of a pixel in {unit}"
            ))),
            _ => Ok(()),
        }
    }
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

impl Everywhere {
    /// Starts the threads of the computation.
    pub fn start_threads(&self) -> Result<(), Failure> {
        let mut pool = rayon::ThreadPoolBuilder::new();
        if let Some(count) = self.threads {
            pool = pool.num_threads(count);
        } else if let Some(value) = std::env::var_os("RAYON_NUM_THREADS")
            && let Some(count) = value.to_str().and_then(|text| text.parse::<usize>().ok())
            && count > MOST_THREADS
        {
            return Err(Failure::usage(format!(
                "the environment variable RAYON_NUM_THREADS={count}: at most {MOST_THREADS} threads are possible"
            )));
        }
        pool.build_global()
            .map_err(|error| Failure::run(format!("the threads cannot be started ({error}); give fewer --threads")))
    }
}

/// Largest number of threads.
const MOST_THREADS: usize = 1024;

fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n @ 1..=MOST_THREADS) => Ok(n),
        _ => Err(format!("a number of threads from 1 to {MOST_THREADS} is needed")),
    }
}
