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
mod pictures;
mod program;
mod progress;
mod signals;
mod values;
mod warnings;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{ArgMatches, CommandFactory, FromArgMatches};
use stereology::segment::DECODER_THREAD;

use crate::answer::print;
use crate::failure::Failure;
use crate::outputs::Outputs;
use crate::program::{Command, Program, invocation};

fn main() -> ExitCode {
    quiet_decoders();
    let matches = match Program::command().try_get_matches() {
        Ok(matches) => matches,
        Err(error) => return explained(&error),
    };
    let mut program = match Program::from_arg_matches(&matches) {
        Ok(program) => program,
        Err(error) => return explained(&error),
    };
    program.everywhere.invocation = invocation(&matches);
    let done = program
        .everywhere
        .settle()
        .and_then(|()| outputs_of(&matches, &program))
        .and_then(|outputs| {
            program.everywhere.outputs = outputs;
            run(&program)
        });
    match done {
        Ok(code) => code,
        Err(failure) => {
            let failure = if signals::stopped() {
                Failure::stopped()
            } else {
                failure
            };
            let failure = failure.reworded(|message| program.everywhere.outputs.with_final_names(message));
            let _ = writeln!(io::stderr(), "error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}

/// Help, the version, or wrong usage. Help that cannot be printed is a failure.
fn explained(error: &clap::Error) -> ExitCode {
    let code = error.exit_code();
    match error.print().and_then(|()| io::stdout().flush()) {
        Err(lost) if lost.kind() != io::ErrorKind::BrokenPipe => ExitCode::FAILURE,
        _ => ExitCode::from(u8::try_from(code).unwrap_or(1)),
    }
}

/// The outputs that the command line names.
fn outputs_of(matches: &ArgMatches, program: &Program) -> Result<Outputs, Failure> {
    let Some((name, given)) = matches.subcommand() else {
        return Ok(Outputs::default());
    };
    let mut all = Program::command();
    all.build();
    match all.find_subcommand(name) {
        Some(command) => Outputs::of(command, given, program.everywhere.force),
        None => Ok(Outputs::default()),
    }
}

/// Keeps panics of decoders of images from users: they are reported as errors.
fn quiet_decoders() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::thread::current().name() != Some(DECODER_THREAD) {
            usual(panic);
        }
    }));
}

fn run(program: &Program) -> Result<ExitCode, Failure> {
    let everywhere = &program.everywhere;
    signals::stop_on_signals(everywhere.outputs.abandoning());
    everywhere.start_threads()?;
    if matches!(program.command, Command::Manual) {
        print(&manual::page())?;
        return Ok(ExitCode::SUCCESS);
    }
    let answer = program.command.run(everywhere)?;
    progress::go_on()?;
    everywhere.outputs.publish()?;
    match answer {
        Some(answer) => answer.print(everywhere),
        None => Ok(ExitCode::SUCCESS),
    }
}
