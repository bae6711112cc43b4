//! The program `stereology`: from a photograph of a cut through a material to the solid it came from.
//!
//! Every command is a module of [`commands`]: its options with their help, and a thin `run` that calls the libraries
//! and fills an [`answer::Answer`].

mod answer;
mod commands;
mod everywhere;
mod failure;
mod manual;
mod outputs;
mod particle_files;
mod particle_surfaces;
mod program;
mod progress;
mod values;
mod warnings;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use crate::failure::Failure;
use crate::program::{Command, Program, invocation};

fn main() -> ExitCode {
    let matches = Program::command().get_matches();
    let program = Program::from_arg_matches(&matches).map(|mut program| {
        program.everywhere.invocation = invocation(&matches);
        program
    });
    let mut program = match program {
        Ok(program) => program,
        Err(error) => error.exit(),
    };
    match program.everywhere.settle().and_then(|()| run(&program)) {
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
    if matches!(program.command, Command::Manual) {
        print!("{}", manual::page());
        return Ok(ExitCode::SUCCESS);
    }
    match program.command.run(everywhere)? {
        Some(answer) => {
            progress::go_on()?;
            Ok(answer.print(everywhere))
        }
        None => Ok(ExitCode::SUCCESS),
    }
}
