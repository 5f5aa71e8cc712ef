//! Which inputs of two results differ, parameter by parameter.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;
use tipwatch_language::{message, say, word};

use super::side::Side;
use crate::base::number::readable;
use crate::report::uncertainty_in_words;

/// An input that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputDifference {
    /// Its key: of the machine file, or of the options.
    pub key: String,
    /// Its value on side A; null if it is not stated there.
    pub a: Option<String>,
    /// Its value on side B.
    pub b: Option<String>,
    /// Whether it is a number wherever it is stated.
    #[serde(skip)]
    pub(crate) is_number: bool,
}

/// Key of the machine file's hash: an output folder holds no machine file, so that not all of its keys can be compared.
const MACHINE_FILE: &str = "machine_file.sha256";
/// Key of the hash of the URDF, which an output folder does not hold either.
const URDF: &str = "urdf.sha256";
/// What the keys of a URDF begin with whose text is known, and that of its hash.
const OF_URDF: &str = "URDF ";
const URDF_TEXT: &str = "URDF SHA-256";
/// Keys of the machine's mass, and of the largest one, which is the same unless payloads change it.
const MASS: &str = "machine.mass_kg";
const LARGEST_MASS: &str = "machine.largest_mass_kg";
/// Digits of a number that is told: these, and more only where the difference is in them.
const FEWEST_DIGITS: usize = 4;
const MOST_DIGITS: usize = 17;
/// Key of the rule by which the load is split, a sentence.
const SPLIT_RULE: &str = "split_rule";

impl InputDifference {
    /// Whether it is that of machine files whose keys are not all known here.
    pub(super) fn is_of_machine_files(&self) -> bool {
        [MACHINE_FILE, URDF].contains(&self.key.as_str())
    }

    /// Its key and its values as a reader reads them: numbers with four digits, or as many as show the difference, and hashes with
    /// eight, unless that hides it.
    pub(super) fn cells(&self) -> [String; 3] {
        let is_hash = self.key.ends_with("sha256") || self.key == URDF_TEXT;
        let digits = self.digits();
        let shown = |text: &str| match digits {
            Some(digits) => with_digits(text, digits),
            None if is_hash => hash_digits(text),
            None => text.into(),
        };
        let value = |value: &Option<String>, shown: &dyn Fn(&str) -> String| match value {
            Some(value) => shown(value),
            None => word!("not stated").into(),
        };
        let [a, b] = [&self.a, &self.b].map(|of| value(of, &shown));
        match a == b {
            true => [
                self.words(),
                value(&self.a, &str::to_owned),
                value(&self.b, &str::to_owned),
            ],
            false => [self.words(), a, b],
        }
    }

    /// How many digits of its numbers a reader needs; `None` for what is no number, and where no digit differs.
    fn digits(&self) -> Option<usize> {
        let numbers = [&self.a, &self.b].map(|of| of.as_ref()?.parse::<f64>().ok());
        let rounded = |value: f64, digits: usize| format!("{value:.*e}", digits - 1);
        let differ = |&digits: &usize| match numbers {
            [Some(a), Some(b)] => rounded(a, digits) != rounded(b, digits),
            _ => true,
        };
        let mut digits = (FEWEST_DIGITS..=MOST_DIGITS).filter(|_| self.is_number);
        digits.find(differ)
    }

    /// What it is. A key of the machine file is told as it stands there.
    fn words(&self) -> String {
        match self.key.as_str() {
            "supposed" => word!("supposed").into(),
            URDF | URDF_TEXT => word!("SHA-256 of the URDF").into(),
            MACHINE_FILE => word!("SHA-256 of the machine file").into(),
            "commissioning_file.sha256" => word!("SHA-256 of the commissioning").into(),
            MASS => format!("{} [kg]", word!("mass of the machine")),
            LARGEST_MASS => format!("{} [kg]", word!("largest mass of the machine")),
            "machine.gravity_m_s2" => format!("{} [m/s²]", word!("local gravity")),
            "machine.name" => word!("name of the machine").into(),
            SPLIT_RULE => word!("rule of the load split").into(),
            key => match key.split_once('.') {
                Some(("uncertainty", of)) => match uncertainty_in_words(of) {
                    // an unknown key
                    (_, "") => key.into(),
                    (words, unit) => say!("uncertainty of {words} [{unit}]"),
                },
                Some(("options", of)) => say!("option {}", readable(&of.replace('.', " "))),
                Some(("dbc_files", of)) => {
                    let place = of
                        .split('.')
                        .next()
                        .and_then(|place| place.parse::<usize>().ok());
                    say!("SHA-256 of DBC file {}", place.map_or(1, |place| place + 1))
                }
                _ => key.into(),
            },
        }
    }
}

fn hash_digits(sha256: &str) -> String {
    sha256.get(..8).unwrap_or(sha256).into()
}

/// So many digits of a number, or all where that is shorter, and of a whole one.
fn with_digits(text: &str, digits: usize) -> String {
    let Some(number) = text.parse::<f64>().ok().filter(|number| number.is_finite()) else {
        return text.into();
    };
    let digits = match number.abs() {
        size if size.fract() == 0.0 && size < 1e15 => format!("{number:.0}"),
        size if (1e-3..1e9).contains(&size) => {
            let after_point = digits as i32 - 1 - size.log10().floor() as i32;
            format!("{number:.*}", usize::try_from(after_point).unwrap_or(0))
        }
        _ => format!("{number:.*e}", digits - 1),
    };
    match digits.len() < text.len() {
        true => digits,
        false => text.into(),
    }
}

/// What must be known about machine files that differ and are not held.
pub(super) const NOT_HELD: &str = message!(
    "The machine files or their URDFs differ, and the output folders do not hold all of their parameters: others may differ, too. \
     Compare the logs under both machine files to see all of them."
);

/// The inputs that differ, by key.
pub(super) fn inputs(a: &Side, b: &Side) -> Vec<InputDifference> {
    let has_files = a.sources.is_some() && b.sources.is_some();
    let [on_a, on_b] = [a, b].map(|side| stated(side, has_files));
    let keys: std::collections::BTreeSet<_> = on_a.keys().chain(on_b.keys()).collect();
    let differences = keys.into_iter().map(|key| {
        let values = [&on_a, &on_b].map(|side| side.get(key));
        let [a, b] = values.map(|value| value.map(text_of));
        let is_number = values.into_iter().flatten().all(Value::is_number);
        InputDifference {
            key: key.clone(),
            a,
            b,
            is_number,
        }
    });
    // one machine file has one rule, which two results may tell in two languages
    let is_one_file = on_a.get(MACHINE_FILE) == on_b.get(MACHINE_FILE);
    let is_input = |of: &InputDifference| !(is_one_file && of.key == SPLIT_RULE);
    let mut found: Vec<InputDifference> = differences
        .filter(|of| of.a != of.b && is_input(of))
        .collect();
    let mass = found.iter().find(|of| of.key == MASS);
    let mass = mass.map(|of| [of.a.clone(), of.b.clone()]);
    let is_mass = |of: &InputDifference| mass.as_ref() == Some(&[of.a.clone(), of.b.clone()]);
    found.retain(|of| of.key != LARGEST_MASS || !is_mass(of));
    // what differs in no attribute differs by its text: spaces, comments, or what is no XML
    if found
        .iter()
        .filter(|of| of.key.starts_with(OF_URDF))
        .count()
        > 1
    {
        found.retain(|of| of.key != URDF_TEXT);
    }
    found
}

/// What a side was computed from. Without the machine files, what the summary has of them.
fn stated(side: &Side, has_files: bool) -> BTreeMap<String, Value> {
    let summary = &side.summary;
    let mut found = BTreeMap::new();
    flatten("options", &summary["options"], &mut found);
    let provenance = &summary["provenance"];
    let commissioning = &provenance["commissioning_file"]["sha256"];
    flatten("commissioning_file.sha256", commissioning, &mut found);
    for (place, file) in provenance["dbc_files"]
        .as_array()
        .into_iter()
        .flatten()
        .enumerate()
    {
        flatten(
            &format!("dbc_files.{place}.sha256"),
            &file["sha256"],
            &mut found,
        );
    }
    match side.sources.as_ref().filter(|_| has_files) {
        Some(sources) => {
            let file = toml::from_str::<toml::Table>(&sources.machine_file).ok();
            let file = file.and_then(|table| serde_json::to_value(table).ok());
            flatten("", &file.unwrap_or_default(), &mut found);
            flatten_urdf(&sources.urdf, &mut found);
            flatten(URDF_TEXT, &provenance["urdf"]["sha256"], &mut found);
        }
        None => {
            flatten(URDF, &provenance["urdf"]["sha256"], &mut found);
            flatten(
                MACHINE_FILE,
                &provenance["machine_file"]["sha256"],
                &mut found,
            );
            flatten("machine", &summary["machine"], &mut found);
            flatten(SPLIT_RULE, &summary["model"]["split_rule"], &mut found);
            flatten("uncertainty", &summary["uncertainty"], &mut found);
        }
    }
    found
}

/// Adds the values of a document under their paths; an absent one is not added.
fn flatten(path: &str, value: &Value, found: &mut BTreeMap<String, Value>) {
    let below = |key: &str| match path {
        "" => key.to_string(),
        _ => format!("{path}.{key}"),
    };
    match value {
        Value::Null => {}
        Value::Object(object) => {
            for (key, value) in object {
                flatten(&below(key), value, found);
            }
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            for (place, value) in list.iter().enumerate() {
                flatten(&below(&place.to_string()), value, found);
            }
        }
        other => {
            found.insert(path.into(), other.clone());
        }
    }
}

/// A value as it is stated.
fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Adds the attributes of a URDF under the elements that they are in: "URDF link boom inertial mass value". Elements without a name
/// are numbered where there are several alike: "URDF link boom collision 2 origin xyz".
fn flatten_urdf(text: &str, found: &mut BTreeMap<String, Value>) {
    let Ok(document) = roxmltree::Document::parse(text) else {
        return;
    };
    for element in document.descendants().filter(roxmltree::Node::is_element) {
        let mut path: Vec<String> = Vec::new();
        for within in element
            .ancestors()
            .filter(|node| node.is_element() && *node != document.root_element())
        {
            let tag = within.tag_name();
            let before = within.prev_siblings().skip(1);
            let alike = before.filter(|other| other.tag_name() == tag).count();
            match within.attribute("name") {
                Some(name) => path.push(name.into()),
                None if alike > 0 => path.push((alike + 1).to_string()),
                None => {}
            }
            path.push(tag.name().into());
        }
        path.reverse();
        for attribute in element.attributes().filter(|of| of.name() != "name") {
            let key = format!("{OF_URDF}{} {}", path.join(" "), attribute.name());
            found.insert(key, attribute.value().into());
        }
    }
}

/// A difference in words.
#[must_use]
pub(super) fn in_words(of: &InputDifference) -> String {
    let [key, a, b] = of.cells();
    say!("{key}: {a} in A, {b} in B")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_told_in_words_with_the_digits_that_differ() {
        let told = |key: &str, a: &str, b: &str| {
            let of = InputDifference {
                key: key.into(),
                a: Some(a.into()),
                b: Some(b.into()),
                is_number: true,
            };
            of.cells()
        };
        let [key, a, b] = told(
            "machine.mass_kg",
            "3502.9368944500015",
            "3602.9368944500015",
        );
        assert!(!key.contains('_'), "{key}");
        assert_eq!([a, b], ["3503", "3603"]);
        let [key, ..] = told("uncertainty.tyre_stiffness_share", "0.2", "0.3");
        assert!(!key.contains('_') && !key.contains('.'), "{key}");
        let [_, a, b] = told("contact.tyre_stiffness", "800000.0", "800000.25");
        assert_eq!([a, b], ["800000", "800000.2"]);
        let [_, a, b] = told("x", "0.5", "0.50001");
        assert_eq!([a, b], ["0.5", "0.50001"]);
        let [_, a, b] = told("x", "3", "3.0001234");
        assert_eq!([a, b], ["3", "3.0001"]);
        let [_, a, b] = told("x", "1.5", "1.50");
        assert_eq!([a, b], ["1.5", "1.50"]);
        let [_, a, b] = told("x", "1.00001", "1.00002");
        assert_eq!([a, b], ["1.00001", "1.00002"]);
    }

    /// A name of digits keeps them all.
    #[test]
    fn what_is_no_number_is_told_as_it_is_stated() {
        let told = |key: &str, a: &str, b: &str| {
            let of = InputDifference {
                key: key.into(),
                a: Some(a.into()),
                b: Some(b.into()),
                is_number: false,
            };
            of.cells()
        };
        let [_, a, b] = told("machine.name", "007", "123456.75");
        assert_eq!([a, b], ["007", "123456.75"]);
        let [_, a, b] = told(URDF_TEXT, "0123456789abcdef", "fedcba9876543210");
        assert_eq!([a, b], ["01234567", "fedcba98"]);
        let [key, ..] = told("dbc_files.0.sha256", "0123456789abcdef", "fedcba9876543210");
        assert!(!key.contains('_') && key.contains('1'), "{key}");
    }

    #[test]
    fn values_have_the_path_to_them_and_absent_ones_have_none() {
        let document = serde_json::json!({
            "contact": { "front_share": 0.5, "free_joints": ["a", "b"], "ground": null },
            "payload": [{ "link": "tool", "mass": 300.0 }],
        });
        let mut found = BTreeMap::new();
        flatten("", &document, &mut found);
        let found: Vec<(&str, String)> = found
            .iter()
            .map(|(k, v)| (k.as_str(), text_of(v)))
            .collect();
        assert_eq!(
            found,
            [
                ("contact.free_joints", "[\"a\",\"b\"]"),
                ("contact.front_share", "0.5"),
                ("payload.0.link", "tool"),
                ("payload.0.mass", "300.0"),
            ]
            .map(|(key, text)| (key, text.to_owned()))
        );
    }
}
