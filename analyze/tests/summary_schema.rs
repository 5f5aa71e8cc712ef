//! The published schema of `summary.json` matches the program, and every summary satisfies it.

use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use super::support::{data, tipwatch};

#[test]
fn the_published_schema_matches_the_program() {
    let printed = String::from_utf8(tipwatch(&["schema"]).stdout).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("summary.schema.json");
    let published = std::fs::read_to_string(&path).unwrap();
    assert!(
        printed == published,
        "analyze/summary.schema.json is old: tipwatch schema > analyze/summary.schema.json"
    );
}

#[test]
fn every_summary_satisfies_the_schema() {
    let schema: Value = serde_json::from_slice(&tipwatch(&["schema"]).stdout).unwrap();
    let folder = TempDir::new().unwrap();
    let out = folder.path().to_str().unwrap();
    let cases = [
        ("tiny", &["--monte-carlo", "5"][..]),
        ("tiny_lift", &["--model", "closed-form"]),
        ("lift_payload", &["--estimator", "causal"]),
        ("forwarder6_bump", &["--rate", "20"]),
    ];
    for (name, more) in cases {
        let log = data(&format!("{name}.mcap"));
        let machine = data(&format!("{name}.toml"));
        let (log, machine) = (log.to_str().unwrap(), machine.to_str().unwrap());
        let mut args = vec!["analyze", log, "--machine", machine, "--out", out];
        args.extend(more);
        let output = tipwatch(&args);
        assert!(output.status.success(), "{output:?}");
        let summary = std::fs::read(folder.path().join("summary.json")).unwrap();
        let summary: Value = serde_json::from_slice(&summary).unwrap();
        let (mut mistakes, mut checked) = (Vec::new(), 0);
        check(
            &schema,
            &schema,
            &summary,
            name,
            &mut mistakes,
            &mut checked,
        );
        assert_eq!(mistakes, Vec::<String>::new());
        assert!(checked > 200, "{checked}");

        // and the check detects violations
        let mut wrong = summary.clone();
        wrong["rows"]["count"] = Value::from("many");
        wrong["surprise"] = Value::from(1);
        wrong.as_object_mut().unwrap().remove("wheels");
        check(&schema, &schema, &wrong, name, &mut mistakes, &mut checked);
        assert_eq!(mistakes.len(), 3, "{mistakes:?}");
    }
}

/// Lists the violations of `schema` by `value`, for the keywords that the program's schema uses. Keys that are
/// not in the schema are violations, too.
fn check(
    root: &Value,
    schema: &Value,
    value: &Value,
    at: &str,
    mistakes: &mut Vec<String>,
    checked: &mut usize,
) {
    *checked += 1;
    if let Some(pointer) = schema["$ref"].as_str() {
        let target = root.pointer(pointer.trim_start_matches('#')).unwrap();
        check(root, target, value, at, mistakes, checked);
    }
    let choices = schema["anyOf"].as_array().or(schema["oneOf"].as_array());
    if let Some(choices) = choices {
        let fits = |choice: &Value| {
            let mut inner = Vec::new();
            check(root, choice, value, at, &mut inner, &mut 0);
            inner.is_empty()
        };
        if !choices.iter().any(fits) {
            mistakes.push(format!("{at}: {value} is none of the choices"));
        }
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::String(one) => vec![one],
        Value::Array(several) => several.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    if !types.is_empty() && !types.iter().any(|name| is(value, name)) {
        mistakes.push(format!("{at}: {value} is not {types:?}"));
    }
    if let Some(names) = schema["enum"].as_array()
        && !names.contains(value)
    {
        mistakes.push(format!("{at}: {value} is not among {names:?}"));
    }
    if let Some(constant) = schema.get("const")
        && constant != value
    {
        mistakes.push(format!("{at}: {value} is not {constant}"));
    }
    if let (Some(items), Some(values)) = (schema.get("items"), value.as_array()) {
        for (i, value) in values.iter().enumerate() {
            check(root, items, value, &format!("{at}[{i}]"), mistakes, checked);
        }
    }
    let Some(object) = value.as_object() else {
        return;
    };
    for name in schema["required"].as_array().into_iter().flatten() {
        if !object.contains_key(name.as_str().unwrap()) {
            mistakes.push(format!("{at}: {name} is missing"));
        }
    }
    let (known, others) = (&schema["properties"], schema.get("additionalProperties"));
    for (name, value) in object {
        let at = format!("{at}.{name}");
        match known.get(name).or(others) {
            Some(schema) => check(root, schema, value, &at, mistakes, checked),
            None if known.is_object() => mistakes.push(format!("{at}: not in the schema")),
            None => {}
        }
    }
}

fn is(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("a schema of \"{other}\" is not supported by this check"),
    }
}
