//! Which inputs of two results differ, parameter by parameter.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;
use tipwatch_language::{message, say, word};

use super::side::Side;

/// An input that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputDifference {
    /// Its key: of the machine file, or of the options.
    pub key: String,
    /// Its value on side A; null if it is not stated there.
    pub a: Option<String>,
    /// Its value on side B.
    pub b: Option<String>,
}

/// Key of the machine file's hash: an output folder holds no machine file, so that not all of its keys can be compared.
const MACHINE_FILE: &str = "machine_file.sha256";
/// Key of the hash of the URDF, which an output folder does not hold either.
const URDF: &str = "urdf.sha256";
/// What the keys of a URDF begin with whose text is known, and that of its hash.
const OF_URDF: &str = "URDF ";
const URDF_TEXT: &str = "URDF SHA-256";
/// Key of the rule by which the load is split, a sentence.
const SPLIT_RULE: &str = "split_rule";

impl InputDifference {
    /// Whether it is that of machine files whose keys are not all known here.
    pub(super) fn is_of_machine_files(&self) -> bool {
        [MACHINE_FILE, URDF].contains(&self.key.as_str())
    }

    /// Its key and its values as a reader reads them.
    pub(super) fn cells(&self) -> [String; 3] {
        let key = match self.key.as_str() {
            "supposed" => word!("supposed"),
            URDF => word!("SHA-256 of the URDF"),
            MACHINE_FILE => word!("SHA-256 of the machine file"),
            key => key,
        };
        let value = |value: &Option<String>| match value {
            Some(value) => value.clone(),
            None => word!("not stated").into(),
        };
        [key.into(), value(&self.a), value(&self.b)]
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
    let differences = keys.into_iter().map(|key| InputDifference {
        key: key.clone(),
        a: on_a.get(key).cloned(),
        b: on_b.get(key).cloned(),
    });
    // one machine file has one rule, which two results may tell in two languages
    let is_one_file = on_a.get(MACHINE_FILE) == on_b.get(MACHINE_FILE);
    let is_input = |of: &InputDifference| !(is_one_file && of.key == SPLIT_RULE);
    let mut found: Vec<InputDifference> = differences
        .filter(|of| of.a != of.b && is_input(of))
        .collect();
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
fn stated(side: &Side, has_files: bool) -> BTreeMap<String, String> {
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
fn flatten(path: &str, value: &Value, found: &mut BTreeMap<String, String>) {
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
        Value::String(text) => {
            found.insert(path.into(), text.clone());
        }
        other => {
            found.insert(path.into(), other.to_string());
        }
    }
}

/// Adds the attributes of a URDF under the elements that they are in: "URDF link boom inertial mass value". Elements without a name
/// are numbered where there are several alike: "URDF link boom collision 2 origin xyz".
fn flatten_urdf(text: &str, found: &mut BTreeMap<String, String>) {
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
    fn values_have_the_path_to_them_and_absent_ones_have_none() {
        let document = serde_json::json!({
            "contact": { "front_share": 0.5, "free_joints": ["a", "b"], "ground": null },
            "payload": [{ "link": "tool", "mass": 300.0 }],
        });
        let mut found = BTreeMap::new();
        flatten("", &document, &mut found);
        let found: Vec<(&str, &str)> = found
            .iter()
            .map(|(k, v)| (k.as_str(), v.as_str()))
            .collect();
        assert_eq!(
            found,
            [
                ("contact.free_joints", "[\"a\",\"b\"]"),
                ("contact.front_share", "0.5"),
                ("payload.0.link", "tool"),
                ("payload.0.mass", "300.0"),
            ]
        );
    }
}
