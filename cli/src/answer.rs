//! The answer of a command: one JSON object for programs, or a few lines for people.

use std::io::{self, Write};
use std::process::ExitCode;

use schemars::{JsonSchema, Schema, SchemaGenerator, generate::SchemaSettings};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::warnings::{self, Warning};

/// The fields that a command adds to its JSON object, in the order of the struct.
pub trait Fields: Serialize + JsonSchema {
    /// Name of the command.
    const COMMAND: &'static str;
}

/// What a command reports besides its fields.
#[derive(Debug, Default)]
pub struct Notes {
    text: Vec<String>,
    warnings: Vec<Warning>,
    seconds: Option<Value>,
    taken_up: Option<Vec<&'static str>>,
}

impl Notes {
    /// Adds a line of the summary for people.
    pub fn line(&mut self, line: impl Into<String>) -> &mut Self {
        self.text.push(line.into());
        self
    }

    /// Adds lines of the summary for people.
    pub fn lines(&mut self, lines: impl IntoIterator<Item = String>) -> &mut Self {
        self.text.extend(lines);
        self
    }

    /// Adds a warning, unless the same one is there already.
    pub fn warn(&mut self, warning: Warning) -> &mut Self {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
        self
    }

    /// Steps of an earlier run that were taken up: printed, but never written into a file.
    pub fn taken_up(&mut self, steps: Vec<&'static str>) -> &mut Self {
        let shown = if steps.is_empty() {
            "none".to_owned()
        } else {
            steps.join(", ")
        };
        self.text.push(format!("steps taken up: {shown}"));
        self.taken_up = Some(steps);
        self
    }

    /// Elapsed time in seconds, of the whole command or by step: printed, but never written into a file.
    pub fn seconds(&mut self, seconds: impl Into<Value>) -> &mut Self {
        self.seconds = Some(seconds.into());
        self
    }
}

/// The answer of one command.
#[derive(Debug)]
pub struct Answer {
    command: &'static str,
    fields: Map<String, Value>,
    /// Lines, warnings and times.
    pub notes: Notes,
}

impl Answer {
    /// The answer with these fields; numbers that are not finite become `null`.
    pub fn new<T: Fields>(fields: &T, notes: Notes) -> Result<Self, Failure> {
        match serde_json::to_value(fields).or_fail()? {
            Value::Object(fields) => Ok(Self {
                command: T::COMMAND,
                fields,
                notes,
            }),
            _ => Err(Failure::run(format!(
                "the answer of `{}` is not an object; please report this fault",
                T::COMMAND
            ))),
        }
    }

    /// The object for a `summary.json`. It has no `seconds`, so that equal inputs give equal bytes.
    pub fn summary(&self) -> Value {
        let mut object = Map::new();
        object.insert("schema".to_owned(), json!(schema_name(self.command)));
        object.insert(
            "warnings".to_owned(),
            json!(
                self.notes
                    .warnings
                    .iter()
                    .map(warnings::Record::from)
                    .collect::<Vec<_>>()
            ),
        );
        object.extend(self.fields.clone());
        Value::Object(object)
    }

    /// Prints the answer; the exit code is 0, or 3 if there are warnings and `--strict` is given.
    ///
    /// # Errors
    ///
    /// If standard output cannot be written.
    pub fn print(&self, everywhere: &Everywhere) -> Result<ExitCode, Failure> {
        let Notes {
            text,
            warnings,
            seconds,
            taken_up,
        } = &self.notes;
        let mut out = String::new();
        if everywhere.json {
            let mut object = self.summary();
            if let (Some(steps), Value::Object(fields)) = (taken_up, &mut object) {
                fields.insert("taken_up".to_owned(), json!(steps));
            }
            if let (Some(seconds), Value::Object(fields)) = (seconds, &mut object) {
                fields.insert("seconds".to_owned(), seconds.clone());
            }
            out.push_str(&object.to_string());
            out.push('\n');
        } else {
            for line in text {
                out.push_str(line);
                out.push('\n');
            }
            for warning in warnings {
                out.push_str(&format!("warning [{}]: {}\n", warning.code, warning.message));
                if let Some(advice) = warnings::advice(warning.code) {
                    out.push_str(&format!("  {advice}\n"));
                }
            }
        }
        print(&out)?;
        Ok(ExitCode::from(if everywhere.strict && !warnings.is_empty() {
            3
        } else {
            0
        }))
    }
}

/// Prints on standard output. A closed pipe (`| head`) is not an error of this program.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::run(format!(
            "standard output: the answer cannot be written ({error})"
        ))),
        _ => Ok(()),
    }
}

/// Value of the key `schema` in the answer of `command`.
fn schema_name(command: &str) -> String {
    format!("stereology.{command}/1")
}

/// JSON Schema of a command's answer: its fields, and those that every answer has.
pub fn schema_of<T: Fields>() -> Schema {
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut schema = generator.into_root_schema_for::<T>();
    let common = common_properties(T::COMMAND);
    let object = schema.ensure_object();
    let own = match object.shift_remove("properties") {
        Some(Value::Object(own)) => own,
        _ => Map::new(),
    };
    let required = match object.shift_remove("required") {
        Some(Value::Array(own)) => own,
        _ => Vec::new(),
    };
    let definitions = object.shift_remove("$defs");
    object.insert("title".to_owned(), json!(format!("stereology {}", T::COMMAND)));
    let required: Vec<Value> = ["schema", "warnings"]
        .into_iter()
        .map(Value::from)
        .chain(required)
        .collect();
    let (before, after) = common;
    let properties: Map<String, Value> = before.into_iter().chain(own).chain(after).collect();
    object.insert("properties".to_owned(), Value::Object(properties));
    object.insert("required".to_owned(), Value::Array(required));
    if let Some(definitions) = definitions {
        object.insert("$defs".to_owned(), definitions);
    }
    join_lines(schema.ensure_object());
    schema
}

/// Joins the lines of all descriptions, which doc comments break.
fn join_lines(fields: &mut Map<String, Value>) {
    for (key, value) in fields {
        match value {
            Value::String(text) if key == "description" => *text = text.replace('\n', " "),
            Value::Object(inner) => join_lines(inner),
            Value::Array(values) => values.iter_mut().filter_map(Value::as_object_mut).for_each(join_lines),
            _ => {}
        }
    }
}

/// Properties of every answer: those before a command's own fields, and those behind them.
fn common_properties(command: &str) -> (Map<String, Value>, Map<String, Value>) {
    let mut before = Map::new();
    before.insert(
        "schema".to_owned(),
        json!({ "description": "Name and version of this format.", "const": schema_name(command) }),
    );
    let mut generator =
        SchemaGenerator::from(SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true));
    before.insert(
        "warnings".to_owned(),
        json!({
            "description": "What deserves attention; docs/cli.md lists all codes.",
            "type": "array",
            "items": generator.subschema_for::<warnings::Record>(),
        }),
    );
    let mut after = Map::new();
    if command == "synthesize" {
        after.insert(
            "taken_up".to_owned(),
            json!({
                "description": "Steps of an earlier run that were taken up; with --from. Printed only, never written into a file.",
                "type": "array",
                "items": { "type": "string" },
            }),
        );
    }
    after.insert(
        "seconds".to_owned(),
        json!({
            "description": "Elapsed time in seconds, of the whole command or by step. Printed only, never written into a file.",
            "anyOf": [{ "type": "number" }, { "type": "object", "additionalProperties": { "type": "number" } }],
        }),
    );
    (before, after)
}

#[cfg(test)]
mod tests {
    use super::{Answer, Fields, Notes, schema_of};
    use crate::warnings::Warning;

    /// Test fields.
    #[derive(serde::Serialize, schemars::JsonSchema)]
    struct Packed {
        particles: usize,
        nonsense: f64,
    }

    impl Fields for Packed {
        const COMMAND: &'static str = "pack";
    }

    #[test]
    fn the_schema_comes_first_and_times_stay_out_of_files() {
        let mut notes = Notes::default();
        notes
            .seconds(1.5)
            .warn(Warning::new("few-profiles", "3 profiles"))
            .warn(Warning::new("few-profiles", "3 profiles"));
        let fields = Packed {
            particles: 3,
            nonsense: f64::NAN,
        };
        assert_eq!(
            Answer::new(&fields, notes).unwrap().summary().to_string(),
            r#"{"schema":"stereology.pack/1","warnings":[{"code":"few-profiles","message":"3 profiles"}],"particles":3,"nonsense":null}"#
        );
    }

    #[test]
    fn a_json_schema_describes_the_common_keys_too() {
        let schema = schema_of::<Packed>();
        let keys: Vec<&str> = schema.as_object().unwrap()["properties"]
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        assert_eq!(keys, ["schema", "warnings", "particles", "nonsense", "seconds"]);
    }
}
