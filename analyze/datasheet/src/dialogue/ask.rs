//! Asks, and turns the answers into a sheet.

use std::io::{BufRead, Result, Write};

use super::parts::fixed_answers;
use super::prompt::{parts, prompt, refusal};
use super::question::{Kind, Question};
use super::questions::questions;
use crate::prior::Template;
use crate::quantity::{Angle, Length, Mass};

/// Asks the questions of a kind of machine and returns the text of a sheet. A number may have a unit.
///
/// # Errors
/// The terminal cannot be read or written, or the answers end early.
pub fn ask(template: Template, input: &mut dyn BufRead, output: &mut dyn Write) -> Result<String> {
    writeln!(
        output,
        "{}: {}.\nNumbers are in kg, m and degrees, or have a unit: 18.6 t, 3300 mm. An empty answer leaves a value open.",
        template,
        template.title()
    )?;
    let axles = match template.prior().has_tracks {
        true => 0,
        false => axle_count(input, output)?,
    };
    let mut root = toml::Table::new();
    for (key, value) in fixed_answers(template) {
        set(&mut root, &key, toml::Value::String(value));
    }
    let mut answered: Vec<String> = Vec::new();
    for question in questions(template, axles) {
        let after = question.after.as_ref();
        if after.is_some_and(|key| !answered.contains(key)) {
            continue;
        }
        if let Some(answer) = answer(&question, input, output)? {
            set(&mut root, &question.key, answer);
            answered.push(question.key);
        }
    }
    toml::to_string(&root).map_err(std::io::Error::other)
}

fn axle_count(input: &mut dyn BufRead, output: &mut dyn Write) -> Result<usize> {
    let read = |text: &str| match (text, text.parse::<usize>()) {
        ("", _) => Ok(2),
        (_, Ok(count)) if (2..=6).contains(&count) => Ok(count),
        _ => Err(refusal("a number from 2 to 6", text)),
    };
    let text = "Number of axles, a pair of bogies as one [2]";
    prompt(text, read, input, output)
}

/// A number as it is, or with its unit.
fn number(text: &str) -> Option<toml::Value> {
    if let Some(plain) = text.parse::<f64>().ok().filter(|number| number.is_finite()) {
        return Some(toml::Value::Float(plain));
    }
    let is_number = Mass::parse(text).is_some()
        || Length::parse(text).is_some()
        || Angle::parse(text).is_some();
    is_number.then(|| toml::Value::String(text.into()))
}

fn range(text: &str) -> Option<toml::Value> {
    let both: Option<Vec<toml::Value>> = parts(text).map(number).collect();
    both.filter(|both| both.len() == 2).map(toml::Value::Array)
}

impl Kind {
    fn expected(self) -> &'static str {
        match self {
            Self::Number => "a number, perhaps with its unit",
            Self::Range => "two numbers with a comma between them",
            Self::Text => "text",
        }
    }
}

fn answer(
    question: &Question,
    input: &mut dyn BufRead,
    output: &mut dyn Write,
) -> Result<Option<toml::Value>> {
    let read = |text: &str| {
        if text.is_empty() {
            return match question.is_required {
                true => Err("This value is needed.".into()),
                false => Ok(None),
            };
        }
        let value = match question.kind {
            Kind::Text => Some(toml::Value::String(text.into())),
            Kind::Number => number(text),
            Kind::Range => range(text),
        };
        value
            .map(Some)
            .ok_or_else(|| refusal(question.kind.expected(), text))
    };
    prompt(&question.text, read, input, output)
}

/// Sets a key such as `axles.0.load`; numbers are places in lists.
fn set(table: &mut toml::Table, key: &str, value: toml::Value) {
    let (first, rest) = match key.split_once('.') {
        None => {
            table.insert(key.into(), value);
            return;
        }
        Some(parts) => parts,
    };
    let next = rest.split('.').next().unwrap_or_default();
    let Ok(index) = next.parse::<usize>() else {
        let inner = table
            .entry(first)
            .or_insert_with(|| toml::Value::Table(toml::Table::new()));
        if let Some(inner) = inner.as_table_mut() {
            set(inner, rest, value);
        }
        return;
    };
    let list = table
        .entry(first)
        .or_insert_with(|| toml::Value::Array(Vec::new()));
    let Some(list) = list.as_array_mut() else {
        return;
    };
    match rest.split_once('.') {
        None => list.push(value),
        Some((_, rest)) => {
            while list.len() <= index {
                list.push(toml::Value::Table(toml::Table::new()));
            }
            if let Some(inner) = list[index].as_table_mut() {
                set(inner, rest, value);
            }
        }
    }
}
