//! The program `stereology`: a photograph of a cut through a material in, the solid it came from out.
//!
//! Every command is a module of [`commands`]: its arguments, its help and a thin `run` that calls the libraries and fills an [`answer::Answer`].

mod answer;
mod arguments;
mod commands;
mod failure;
mod manual;
mod numbers;
mod outputs;
mod particle_files;
mod particle_surfaces;
mod progress;
mod report;
mod values;
mod warnings;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use crate::arguments::{Invocation, Program};
use crate::failure::Failure;

fn main() -> ExitCode {
    let matches = Program::command().get_matches();
    let program = Program::from_arg_matches(&matches).map(|mut program| {
        program.everywhere.invocation = Invocation::of(&matches);
        program
    });
    let program = match program {
        Ok(program) => program,
        Err(error) => error.exit(),
    };
    match run(&program) {
        Ok(code) => code,
        Err(failure) => {
            let failure = if progress::stopped() {
                Failure::stopped()
            } else {
                failure
            };
            let _ = writeln!(io::stderr(), "error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}

fn run(program: &Program) -> Result<ExitCode, Failure> {
    let everywhere = &program.everywhere;
    progress::stop_on_ctrl_c();
    if let Some(threads) = everywhere.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|error| Failure::run(format!("--threads {threads}: the threads cannot be started ({error})")))?;
    }
    match commands::run(&program.command, everywhere)? {
        Some(answer) => {
            progress::go_on()?;
            Ok(answer.print(everywhere))
        }
        None => Ok(ExitCode::SUCCESS),
    }
}
