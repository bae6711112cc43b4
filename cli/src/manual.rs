//! `docs/cli.md`, made from the same words as `--help`, so that the two cannot differ.

use std::fmt::Write;

use clap::{Arg, Command, CommandFactory};

use crate::arguments::Program;
use crate::commands;
use crate::warnings::CODES;

/// The whole page in Markdown.
pub fn page() -> String {
    let mut program = Program::command();
    program.build();
    let mut page = String::new();
    let everywhere: Vec<&Arg> = program.get_arguments().filter(|arg| arg.is_global_set()).collect();

    let _ = writeln!(page, "# The program `stereology`\n");
    let _ = writeln!(
        page,
        "<!-- Made by `stereology manual > docs/cli.md` from the program's own help. Change the help, not this page. -->\n"
    );
    let _ = writeln!(page, "{}\n", block(&program));
    let _ = writeln!(page, "{}\n", commands::CONVENTIONS);
    if let Some(after) = program.get_after_long_help() {
        let _ = writeln!(page, "{after}\n");
    }
    let _ = writeln!(page, "## For every command\n");
    options(&mut page, &everywhere);
    for command in program.get_subcommands().filter(|command| !command.is_hide_set()) {
        section(&mut page, command);
    }
    let _ = writeln!(page, "## Warnings\n");
    let _ = writeln!(page, "| code | what it means | what to do |\n|---|---|---|");
    for (code, meaning, advice) in CODES {
        let _ = writeln!(page, "| `{code}` | {meaning} | {advice} |");
    }
    page
}

fn section(page: &mut String, command: &Command) {
    let _ = writeln!(page, "## stereology {}\n", command.get_name());
    let usage = command.clone().render_usage().to_string();
    let _ = writeln!(page, "```text\n{}\n```\n", usage.trim_start_matches("Usage: "));
    let _ = writeln!(page, "{}\n", block(command));
    let own: Vec<&Arg> = command
        .get_arguments()
        .filter(|arg| {
            !arg.is_global_set() && !arg.is_hide_set() && !["help", "version"].contains(&arg.get_id().as_str())
        })
        .collect();
    options(page, &own);
    if let Some(after) = command.get_after_long_help() {
        let _ = writeln!(page, "```text\n{after}\n```\n");
    }
}

fn block(command: &Command) -> String {
    let text = command.get_long_about().or_else(|| command.get_about());
    let text = text.map(ToString::to_string).unwrap_or_default();
    let shown_as_written = command.get_name() == "stereology";
    if shown_as_written {
        format!("```text\n{text}\n```")
    } else {
        text
    }
}

fn options(page: &mut String, options: &[&Arg]) {
    if options.is_empty() {
        return;
    }
    let _ = writeln!(page, "| option | |\n|---|---|");
    for arg in options {
        let help = arg
            .get_long_help()
            .or_else(|| arg.get_help())
            .map(ToString::to_string)
            .unwrap_or_default();
        let mut help = help
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
            .replace('|', "\\|");
        let choices: Vec<String> = if arg.get_action().takes_values() {
            arg.get_possible_values()
        } else {
            Vec::new()
        }
        .iter()
        .filter(|value| !value.is_hide_set())
        .map(|value| format!("`{}`", value.get_name()))
        .collect();
        if !choices.is_empty() {
            let _ = write!(help, " ({})", choices.join(", "));
        }
        let default: Vec<_> = arg
            .get_default_values()
            .iter()
            .map(|value| value.to_string_lossy())
            .collect();
        if !default.is_empty() && arg.get_action().takes_values() {
            let _ = write!(help, " [default: {}]", default.join(","));
        }
        let short = arg.get_short().map(|short| format!("-{short}, ")).unwrap_or_default();
        let _ = writeln!(page, "| `{short}{arg}` | {help} |");
    }
    page.push('\n');
}
