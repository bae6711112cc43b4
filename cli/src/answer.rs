//! What a command answers: one JSON object for programs, or a few lines for people.

use std::io::{self, Write};
use std::process::ExitCode;

use serde_json::{Map, Value, json};

use crate::arguments::Everywhere;
use crate::warnings::{self, Warning};

/// The answer of one command.
#[derive(Debug)]
pub struct Answer {
    command: &'static str,
    fields: Map<String, Value>,
    text: Vec<String>,
    warnings: Vec<Warning>,
    seconds: Option<Value>,
}

impl Answer {
    /// An empty answer of `command`.
    pub fn new(command: &'static str) -> Self {
        Self {
            command,
            fields: Map::new(),
            text: Vec::new(),
            warnings: Vec::new(),
            seconds: None,
        }
    }

    /// Adds a field of the JSON object; numbers that are not finite become `null`.
    pub fn field(&mut self, name: &str, value: impl Into<Value>) -> &mut Self {
        self.fields.insert(name.to_owned(), value.into());
        self
    }

    /// Adds a line of the summary for people.
    pub fn line(&mut self, line: impl Into<String>) -> &mut Self {
        self.text.push(line.into());
        self
    }

    /// Adds a warning; the same one is told once.
    pub fn warn(&mut self, warning: Warning) -> &mut Self {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
        self
    }

    /// Elapsed time, of the whole or by step: shown on stdout, never written into a file.
    pub fn seconds(&mut self, seconds: impl Into<Value>) -> &mut Self {
        self.seconds = Some(seconds.into());
        self
    }

    /// The object that goes into a `summary.json`: the same bytes whenever and wherever it is made, so without `seconds`.
    pub fn summary(&self) -> Value {
        let mut object = Map::new();
        object.insert("schema".to_owned(), json!(format!("stereology.{}/1", self.command)));
        object.insert(
            "warnings".to_owned(),
            self.warnings.iter().map(warnings::to_json).collect(),
        );
        object.extend(self.fields.clone());
        Value::Object(object)
    }

    /// Prints the answer; exit code 0, or 3 with warnings under `--strict`.
    pub fn print(&self, everywhere: &Everywhere) -> ExitCode {
        let mut out = String::new();
        if everywhere.json {
            let mut object = self.summary();
            if let (Some(seconds), Value::Object(fields)) = (&self.seconds, &mut object) {
                fields.insert("seconds".to_owned(), seconds.clone());
            }
            out.push_str(&object.to_string());
            out.push('\n');
        } else {
            for line in &self.text {
                out.push_str(line);
                out.push('\n');
            }
            for warning in &self.warnings {
                out.push_str(&format!("warning [{}]: {}\n", warning.code, warning.message));
                if let Some(advice) = warnings::advice(warning) {
                    out.push_str(&format!("  {advice}\n"));
                }
            }
        }
        let mut stdout = io::stdout().lock();
        // A reader that went away (`| head`) is no failure of ours.
        let _ = stdout.write_all(out.as_bytes()).and_then(|()| stdout.flush());
        ExitCode::from(if everywhere.strict && !self.warnings.is_empty() {
            3
        } else {
            0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Answer;
    use crate::warnings::Warning;

    #[test]
    fn the_schema_comes_first_and_time_is_left_out_of_files() {
        let mut answer = Answer::new("pack");
        answer.field("particles", 3).field("nonsense", f64::NAN).seconds(1.5);
        answer
            .warn(Warning::new("few-profiles", "3 profiles"))
            .warn(Warning::new("few-profiles", "3 profiles"));
        assert_eq!(
            answer.summary().to_string(),
            r#"{"schema":"stereology.pack/1","warnings":[{"code":"few-profiles","message":"3 profiles"}],"particles":3,"nonsense":null}"#
        );
    }
}
