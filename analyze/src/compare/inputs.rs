//! Which inputs of two results differ, parameter by parameter.

use std::collections::{BTreeMap, BTreeSet};

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
    /// Kind of the input.
    #[serde(skip)]
    kind: InputKind,
    /// Whether the value is a number wherever it is stated.
    #[serde(skip)]
    is_number: bool,
}

/// Kind of an input, which determines its wording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum InputKind {
    /// A supposition.
    Supposed,
    /// An option of the analysis.
    Option,
    /// SHA-256 of a file.
    Hash(HashedFile),
    /// An attribute of a URDF whose text is known.
    UrdfAttribute,
    /// A key of the machine file, or what the summary has of one.
    Parameter,
}

/// A file that an input is the hash of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HashedFile {
    /// A machine file whose keys are not all known: an output folder holds none.
    Machine,
    /// A URDF whose text is not known: an output folder holds none.
    Urdf,
    /// A URDF whose attributes are known, too.
    UrdfText,
    Commissioning,
    /// A DBC file, by its place among them.
    Dbc(usize),
}

/// Inputs by their keys.
type Stated = BTreeMap<String, (InputKind, Value)>;

/// Key of the machine file's hash.
const MACHINE_FILE: &str = "machine_file.sha256";
/// Keys of the machine's mass, and of the largest one, which is the same unless payloads change it.
const MASS: &str = "machine.mass_kg";
const LARGEST_MASS: &str = "machine.largest_mass_kg";
/// Digits of a number that is told: these, and more only where the difference is in them.
const FEWEST_DIGITS: usize = 4;
const MOST_DIGITS: usize = 17;
/// Key of the rule by which the load is split, a sentence.
const SPLIT_RULE: &str = "split_rule";
/// Keys of the hash of a URDF whose text is known, and of its place.
const URDF_TEXT: &str = "URDF SHA-256";
const URDF_PLACE: &str = "urdf";

impl InputDifference {
    /// Returns the suppositions, which only B has.
    pub(crate) fn supposed(what: String) -> Self {
        Self {
            key: "supposed".into(),
            a: None,
            b: Some(what),
            kind: InputKind::Supposed,
            is_number: false,
        }
    }

    /// Whether the difference is that of machine files whose keys are not all known here.
    pub(super) fn is_of_machine_files(&self) -> bool {
        let files = [HashedFile::Machine, HashedFile::Urdf].map(InputKind::Hash);
        files.contains(&self.kind)
    }

    /// Its key and its values as a reader reads them: numbers with four digits, or as many as show the difference, and hashes with
    /// eight, unless that hides it.
    pub(super) fn cells(&self) -> [String; 3] {
        let digits = self.digits();
        let shown = |text: &str| match (digits, self.kind) {
            (Some(digits), _) => with_digits(text, digits),
            (None, InputKind::Hash(_)) => hash_digits(text),
            (None, InputKind::Option) => readable(text),
            (None, _) => text.into(),
        };
        let value = |value: &Option<String>, shown: &dyn Fn(&str) -> String| match value {
            Some(value) => shown(value),
            None if self.kind == InputKind::Supposed => word!("as recorded").into(),
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

    /// Returns the number of digits with which readers see the difference; `None` for a value that is no number, and where no
    /// digit differs.
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

    /// Names the input. A key of the machine file is named as it stands there.
    fn words(&self) -> String {
        match self.kind {
            InputKind::Supposed => word!("supposed").into(),
            InputKind::Option => option_in_words(&self.key),
            InputKind::Hash(HashedFile::Machine) => word!("SHA-256 of the machine file").into(),
            InputKind::Hash(HashedFile::Urdf | HashedFile::UrdfText) => {
                word!("SHA-256 of the URDF").into()
            }
            InputKind::Hash(HashedFile::Commissioning) => {
                word!("SHA-256 of the commissioning").into()
            }
            InputKind::Hash(HashedFile::Dbc(place)) => say!("SHA-256 of DBC file {}", place + 1),
            InputKind::UrdfAttribute => self.key.clone(),
            InputKind::Parameter => parameter_in_words(&self.key),
        }
    }
}

/// An option by its key.
fn option_in_words(key: &str) -> String {
    let of = key.strip_prefix("options.").unwrap_or(key);
    let of = match of {
        "from_s" => word!("start time [s]").into(),
        "to_s" => word!("end time [s]").into(),
        "rate_hz" => word!("row rate [Hz]").into(),
        of => readable(&of.replace('.', " ")),
    };
    say!("option {}", of)
}

/// A parameter of the machine by its key: in words where the summary has it, else the key.
fn parameter_in_words(key: &str) -> String {
    match key {
        MASS => format!("{} [kg]", word!("mass of the machine")),
        LARGEST_MASS => format!("{} [kg]", word!("largest mass of the machine")),
        "machine.gravity_m_s2" => format!("{} [m/s²]", word!("local gravity")),
        "machine.name" => word!("name of the machine").into(),
        SPLIT_RULE => word!("rule of the load split").into(),
        key => match key.strip_prefix("uncertainty.").map(uncertainty_in_words) {
            // an empty unit: an unknown key
            Some((words, unit)) if !unit.is_empty() => {
                say!("uncertainty of {words} [{unit}]")
            }
            _ => key.into(),
        },
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

/// Note on machine files that differ and are not held in the output folders.
pub(super) const NOT_HELD: &str = message!(
    "The machine files or their URDFs differ, and the output folders do not hold all of their parameters: others may differ, too. \
     Compare the logs under both machine files to see all of them."
);

/// The inputs that differ, by key.
pub(super) fn inputs(a: &Side, b: &Side) -> Vec<InputDifference> {
    let has_files = a.sources.is_some() && b.sources.is_some();
    let [on_a, on_b] = [a, b].map(|side| stated(side, has_files));
    // one machine file has one rule, which two results may tell in two languages
    let is_one_file = on_a.get(MACHINE_FILE) == on_b.get(MACHINE_FILE);
    // nor does one URDF become another in another place
    let [urdf_a, urdf_b] = [&on_a, &on_b].map(|side| side.get(URDF_TEXT));
    let is_one_urdf = urdf_a.is_some() && urdf_a == urdf_b;
    let keys: BTreeSet<_> = on_a.keys().chain(on_b.keys()).collect();
    let differences = keys.into_iter().filter_map(|key| {
        let sides = [&on_a, &on_b].map(|side| side.get(key));
        let (kind, _) = sides.into_iter().flatten().next()?;
        let values = sides.map(|side| side.map(|(_, value)| value));
        let [a, b] = values.map(|value| value.map(text_of));
        let is_same = is_one_file && key == SPLIT_RULE || is_one_urdf && key == URDF_PLACE;
        let is_input = a != b && !is_same;
        is_input.then(|| InputDifference {
            key: key.clone(),
            a,
            b,
            kind: *kind,
            is_number: values.into_iter().flatten().all(Value::is_number),
        })
    });
    let mut found: Vec<InputDifference> = differences.collect();
    let mass = found.iter().find(|of| of.key == MASS);
    let mass = mass.map(|of| [of.a.clone(), of.b.clone()]);
    let is_mass = |of: &InputDifference| mass.as_ref() == Some(&[of.a.clone(), of.b.clone()]);
    found.retain(|of| of.key != LARGEST_MASS || !is_mass(of));
    // what differs in no attribute differs by its text: spaces, comments, or what is no XML
    if found.iter().any(|of| of.kind == InputKind::UrdfAttribute) {
        found.retain(|of| of.kind != InputKind::Hash(HashedFile::UrdfText));
    }
    found
}

/// Returns the inputs from which a side was computed; without the machine files, as far as the summary has them.
fn stated(side: &Side, has_files: bool) -> Stated {
    let summary = &side.summary;
    let provenance = &summary["provenance"];
    let mut found = Stated::new();
    let mut add =
        |kind: InputKind, path: &str, value: &Value| flatten(kind, path, value, &mut found);
    let hash = InputKind::Hash;
    add(InputKind::Option, "options", &summary["options"]);
    let commissioning = &provenance["commissioning_file"]["sha256"];
    add(
        hash(HashedFile::Commissioning),
        "commissioning_file.sha256",
        commissioning,
    );
    let dbc_files = provenance["dbc_files"].as_array().into_iter().flatten();
    for (place, file) in dbc_files.enumerate() {
        let path = format!("dbc_files.{place}.sha256");
        add(hash(HashedFile::Dbc(place)), &path, &file["sha256"]);
    }
    let urdf = &provenance["urdf"]["sha256"];
    match side.sources.as_ref().filter(|_| has_files) {
        Some(sources) => {
            let file = toml::from_str::<toml::Table>(&sources.machine_file).ok();
            let file = file.and_then(|table| serde_json::to_value(table).ok());
            add(InputKind::Parameter, "", &file.unwrap_or_default());
            add(hash(HashedFile::UrdfText), URDF_TEXT, urdf);
            flatten_urdf(&sources.urdf, &mut found);
        }
        None => {
            add(hash(HashedFile::Urdf), "urdf.sha256", urdf);
            let file = &provenance["machine_file"]["sha256"];
            add(hash(HashedFile::Machine), MACHINE_FILE, file);
            let parameter = InputKind::Parameter;
            add(parameter, "machine", &summary["machine"]);
            add(parameter, SPLIT_RULE, &summary["model"]["split_rule"]);
            add(parameter, "uncertainty", &summary["uncertainty"]);
        }
    }
    found
}

/// Adds the values of a document under their paths; an absent one is not added.
fn flatten(kind: InputKind, path: &str, value: &Value, found: &mut Stated) {
    let below = |key: &str| match path {
        "" => key.to_string(),
        _ => format!("{path}.{key}"),
    };
    match value {
        Value::Null => {}
        Value::Object(object) => {
            for (key, value) in object {
                flatten(kind, &below(key), value, found);
            }
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            for (place, value) in list.iter().enumerate() {
                flatten(kind, &below(&place.to_string()), value, found);
            }
        }
        other => {
            found.insert(path.into(), (kind, other.clone()));
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
fn flatten_urdf(text: &str, found: &mut Stated) {
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
            let key = format!("URDF {} {}", path.join(" "), attribute.name());
            found.insert(key, (InputKind::UrdfAttribute, attribute.value().into()));
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
    use crate::analysis::Sources;

    #[test]
    fn inputs_are_told_in_words_with_the_digits_that_differ() {
        let told = |key: &str, a: &str, b: &str| {
            let of = InputDifference {
                key: key.into(),
                a: Some(a.into()),
                b: Some(b.into()),
                kind: InputKind::Parameter,
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
        let told = |kind: InputKind, key: &str, a: &str, b: &str| {
            let of = InputDifference {
                key: key.into(),
                a: Some(a.into()),
                b: Some(b.into()),
                kind,
                is_number: false,
            };
            of.cells()
        };
        let [_, a, b] = told(InputKind::Parameter, "machine.name", "007", "123456.75");
        assert_eq!([a, b], ["007", "123456.75"]);
        let hashes = ["0123456789abcdef", "fedcba9876543210"];
        let told_hash = |file: HashedFile| told(InputKind::Hash(file), "", hashes[0], hashes[1]);
        let [_, a, b] = told_hash(HashedFile::UrdfText);
        assert_eq!([a, b], ["01234567", "fedcba98"]);
        let [key, ..] = told_hash(HashedFile::Dbc(0));
        assert!(key.contains('1'), "{key}");
    }

    /// "supposed: not stated in A" stood there.
    #[test]
    fn what_is_supposed_is_told_beside_what_was_recorded() {
        let [_, a, b] = InputDifference::supposed("level ground".into()).cells();
        assert_eq!([a, b], ["as recorded", "level ground"]);
    }

    /// "option from s: not stated in A" stood there.
    #[test]
    fn options_are_told_in_words() {
        for key in ["from_s", "to_s", "rate_hz"] {
            let words = option_in_words(&format!("options.{key}"));
            assert!(!words.contains(&readable(key)), "{words}");
        }
    }

    #[test]
    fn a_urdf_that_differs_in_an_attribute_is_not_told_by_its_hash() {
        let side = |mass: &str, comment: &str| {
            let urdf = format!(
                "<robot><link name='a'><inertial><mass value='{mass}'/></inertial></link>{comment}</robot>"
            );
            let sha256 = format!("{mass}{comment}");
            Side {
                name: String::new(),
                summary: serde_json::json!({ "provenance": { "urdf": { "sha256": sha256 } } }),
                sources: Some(Sources {
                    machine_file: String::new(),
                    urdf,
                }),
                times_ns: Vec::new(),
                valid: Vec::new(),
                columns: Vec::new(),
                events: Vec::new(),
            }
        };
        let keys = |a: &Side, b: &Side| -> Vec<String> {
            inputs(a, b).into_iter().map(|of| of.key).collect()
        };
        let a = side("1.0", "");
        assert_eq!(
            keys(&a, &side("2.0", "")),
            ["URDF link a inertial mass value"]
        );
        assert_eq!(keys(&a, &side("1.0", "<!-- b -->")), ["URDF SHA-256"]);
        assert!(keys(&a, &a).is_empty());
        // the same one in another place is the same input
        let at = |place: &str, mass: &str| {
            let mut side = side(mass, "");
            let machine_file = format!("urdf = \"{place}\"");
            side.sources.as_mut().unwrap().machine_file = machine_file;
            side
        };
        assert!(keys(&at("a.urdf", "1.0"), &at("b/a.urdf", "1.0")).is_empty());
        assert_eq!(keys(&at("a.urdf", "1.0"), &at("b/a.urdf", "2.0")).len(), 2);
    }

    #[test]
    fn values_have_the_path_to_them_and_absent_ones_have_none() {
        let document = serde_json::json!({
            "contact": { "front_share": 0.5, "free_joints": ["a", "b"], "ground": null },
            "payload": [{ "link": "tool", "mass": 300.0 }],
        });
        let mut found = BTreeMap::new();
        flatten(InputKind::Parameter, "", &document, &mut found);
        let found: Vec<(&str, String)> = found
            .iter()
            .map(|(k, (_, v))| (k.as_str(), text_of(v)))
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
