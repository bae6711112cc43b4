//! JSON Schemas: the published files are those of the program, and answers follow them.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{answer, path, stereology};

fn published() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema");
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            (
                path.file_stem().unwrap().to_string_lossy().into_owned(),
                fs::read_to_string(&path).unwrap(),
            )
        })
        .collect();
    files.sort();
    files
}

#[test]
fn published_schemas_are_those_of_the_program() {
    let place = tempfile::tempdir().unwrap();
    let (code, _, error) = stereology(&["schema", "-o", place.path().to_str().unwrap()]);
    assert_eq!(code, 0, "{error}");
    let published = published();
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), published.len());
    for (command, text) in published {
        let made = fs::read_to_string(place.path().join(format!("{command}.json"))).unwrap();
        assert!(
            made == text,
            "docs/schema/{command}.json is out of date; run `stereology schema -o docs/schema --force`"
        );
    }
}

/// Checks the parts of JSON Schema that our schemas use; a key that the schema does not name is an error too.
fn check(schema: &Value, root: &Value, value: &Value, place: &str) -> Result<(), String> {
    if let Some(reference) = schema["$ref"].as_str() {
        let of = root
            .pointer(&reference[1..])
            .ok_or(format!("{place}: no {reference}"))?;
        return check(of, root, value, place);
    }
    if let Some(choices) = schema["anyOf"].as_array() {
        let errors: Vec<_> = choices.iter().map(|of| check(of, root, value, place)).collect();
        return if errors.iter().any(Result::is_ok) {
            Ok(())
        } else {
            Err(format!("{errors:?}"))
        };
    }
    if let Some(constant) = schema.get("const")
        && constant != value
    {
        return Err(format!("{place}: {value} instead of {constant}"));
    }
    let kind = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    let allows = |of: &Value| of == kind || (kind == "integer" && of == "number");
    match &schema["type"] {
        Value::Array(kinds) if !kinds.iter().any(allows) => return Err(format!("{place}: {kind}, not {kinds:?}")),
        one @ Value::String(_) if !allows(one) => return Err(format!("{place}: {kind}, not {one}")),
        _ => {}
    }
    if let (Some(items), Some(values)) = (schema.get("items"), value.as_array()) {
        for (k, value) in values.iter().enumerate() {
            check(items, root, value, &format!("{place}[{k}]"))?;
        }
    }
    if let (Some(properties), Some(object)) = (schema["properties"].as_object(), value.as_object()) {
        for (key, value) in object {
            let of = properties
                .get(key)
                .ok_or(format!("{place}.{key} is not in the schema"))?;
            check(of, root, value, &format!("{place}.{key}"))?;
        }
        for key in schema["required"].as_array().into_iter().flatten() {
            if !object.contains_key(key.as_str().unwrap()) {
                return Err(format!("{place} has no {key}"));
            }
        }
    }
    Ok(())
}

#[test]
fn answers_follow_their_schemas() {
    let place = tempfile::tempdir().unwrap();
    let file = |name: &str| path(&place, name);
    let mut table = String::from("size,type,category\n");
    for k in 0..60 {
        table.push_str(&format!("{},{},{}\n", k % 9 + 2, k % 2, k % 3));
    }
    fs::write(file("profiles.csv"), table).unwrap();
    let profiles = file("profiles.csv");
    let sizes: String = (0..60).map(|k| format!("{},{}\n", k % 9 + 2, k % 3)).collect();
    fs::write(file("one-type.csv"), format!("size,category\n{sizes}")).unwrap();
    let one_type = file("one-type.csv");
    let calls: [&[&str]; 5] = [
        &["kmatrix", "box:1,1,2", "--bins", "4", "--directions", "50", "--paper"],
        &["shape", "rock:1", "-o", &file("rock.obj")],
        &["unfold", &one_type, "--area", "1e5", "--bins", "4", "--bootstrap", "5"],
        &[
            "unfold",
            &profiles,
            "--area",
            "1e5",
            "--bins",
            "3",
            "--shape",
            "sphere",
            "--shape",
            "box:1,1,2",
        ],
        &[
            "pack",
            "--constant",
            "--count",
            "40",
            "--fraction",
            "0.2",
            "--quality",
            "-o",
            &file("packing.json"),
        ],
    ];
    let schemas = published();
    for call in calls {
        let answer = answer(call);
        let (_, schema) = schemas.iter().find(|(command, _)| command == call[0]).unwrap();
        let schema: Value = serde_json::from_str(schema).unwrap();
        check(&schema, &schema, &answer, call[0]).unwrap();
        // A missing or unknown key must be found.
        let mut wrong = answer.clone();
        wrong.as_object_mut().unwrap().remove("warnings");
        assert!(check(&schema, &schema, &wrong, call[0]).is_err());
        wrong = answer.clone();
        wrong["unheard-of"] = Value::Null;
        assert!(check(&schema, &schema, &wrong, call[0]).is_err());
    }
}
