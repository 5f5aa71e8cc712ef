//! Columns of `events.parquet`: one line per event.

use tipwatch_mechanics::Contribution;

use super::table::Table;
use crate::events::{Event, Supposition};

/// The table of events.
#[must_use]
pub fn events(events: &[Event]) -> Table {
    let all = || events.iter();
    let mut table = Table::default();
    table.add("kind", None, all().map(|e| e.kind.name()));
    table.add("start_ns", Some("ns"), all().map(|e| e.start_ns));
    table.add("end_ns", Some("ns"), all().map(|e| e.end_ns));
    table.add("subject", None, all().map(|e| e.subject.as_str()));
    table.add("worst", Some("column unit"), all().map(|e| e.worst));
    table.add("worst_ns", Some("ns"), all().map(|e| e.worst_ns));
    table.add("unit", None, all().map(|e| e.unit));
    table.add("lead_s", Some("s"), all().map(|e| e.lead_s));
    table.add("certainty", Some("-"), all().map(|e| e.certainty));
    table.add("split_dependent", None, all().map(|e| e.split_dependent));
    let any_split = all().map(|e| e.certainty_any_split);
    table.add("certainty_any_split", Some("-"), any_split);
    table.add("start_sigma_s", Some("s"), all().map(|e| e.start_sigma_s));
    table.add("end_sigma_s", Some("s"), all().map(|e| e.end_sigma_s));
    let bound = all().map(|e| e.start_bound.name());
    table.add("start_bound", None, bound);
    table.add("end_bound", None, all().map(|e| e.end_bound.name()));
    let end = |of: usize| all().map(move |e| e.load_range_n.map(|n| n[of]));
    let flips_at = all().map(|e| e.split_flips_at);
    table.add("split_flips_at", Some("-"), flips_at);
    table.add("load_min", Some("N"), end(0));
    table.add("load_max", Some("N"), end(1));
    let measured = all().map(|e| e.measured_load_n);
    table.add("load_measured", Some("N"), measured);
    table.add("judged_ns", Some("ns"), all().map(|e| e.judged_ns));
    table.add("any_split_ns", Some("ns"), all().map(|e| e.any_split_ns));
    table.add("rotation", Some("rad"), all().map(|e| e.rotation_rad));
    add_rotation(&mut table, events);
    let fault = || all().map(|e| e.fault.as_ref());
    table.add("fault", None, fault().map(|f| Some(f?.kind.name())));
    table.add("policy", None, fault().map(|f| Some(f?.policy.name())));
    table.add("limit", Some("column unit"), fault().map(|f| f?.limit));
    table.add("samples", Some("-"), fault().map(|f| Some(f?.samples)));
    let explanation = fault().map(|f| f?.explanation.as_deref());
    table.add("explanation", None, explanation);
    let doubt = || all().map(|e| e.doubt.as_ref());
    let right = all().map(|e| match (&e.doubt, &e.fault) {
        (Some(doubt), _) => Some(doubt.loads_are_right),
        (None, fault) => fault.as_ref()?.loads_are_right,
    });
    table.add("loads_are_right", Some("-"), right);
    let doubted_by = doubt().map(|d| Some(d?.subjects.join("; ")));
    table.add("doubted_by", None, doubted_by);
    let untested = all().map(|e| {
        let joints = e.untested.iter().map(|sign| sign.joint.as_str());
        Some(joints.collect::<Vec<_>>().join("; ")).filter(|joints| !joints.is_empty())
    });
    table.add("untested_signs", None, untested);
    add_causes(&mut table, events);
    for supposed in Supposition::ALL {
        let probability = all().map(|event| {
            let mut answers = event.counterfactuals.iter();
            answers
                .find(|answer| answer.supposed == supposed)?
                .reply
                .probability
        });
        let name = format!("probability_{}", supposed.name());
        table.add(name, Some("-"), probability);
    }
    table
}

/// Adds the evidence for a tipping, and the measured rotation.
fn add_rotation(table: &mut Table, events: &[Event]) {
    let shown_by = events.iter().map(|e| Some(e.shown_by?.name()));
    table.add("shown_by", None, shown_by);
    let all = || events.iter().map(|event| event.measured_rotation.as_ref());
    table.add("rotation_by", None, all().map(|r| Some(r?.witness.name())));
    let other = events.iter().map(|event| event.other_edge());
    table.add("rotation_other_edge", None, other);
    let sigma = all().map(|r| Some(r?.sigma_rad));
    table.add("rotation_sigma", Some("rad"), sigma);
    table.add("onset_in_log", None, all().map(|r| Some(r?.onset_in_log)));
    let ten_degrees = all().map(|r| r?.ten_degrees_ns);
    table.add("ten_degrees_ns", Some("ns"), ten_degrees);
    table.add("no_return", Some("rad"), all().map(|r| r?.no_return_rad));
    let sigma = all().map(|r| r?.no_return_sigma_rad);
    table.add("no_return_sigma", Some("rad"), sigma);
    let load = all().map(|r| r?.no_return_load_kg);
    table.add("no_return_load", Some("kg"), load);
    table.add("no_return_ns", Some("ns"), all().map(|r| r?.no_return_ns));
    let sigma = all().map(|r| r?.no_return_time_sigma_s);
    table.add("no_return_time_sigma", Some("s"), sigma);
    table.add("at_rest_ns", Some("ns"), all().map(|r| r?.at_rest_ns));
    table.add("rested_ns", Some("ns"), all().map(|r| r?.rested_ns));
}

/// Adds the contributions that took the load, up to the onset; null for events without a load and models without causes.
fn add_causes(table: &mut Table, events: &[Event]) {
    let all = || events.iter().map(|event| event.causes.as_ref());
    table.add(
        "causes_since_ns",
        Some("ns"),
        all().map(|c| Some(c?.since_ns)),
    );
    let is_steady = all().map(|c| Some(c?.since_is_steady));
    table.add("causes_since_is_steady", None, is_steady);
    table.add("causes_at_ns", Some("ns"), all().map(|c| Some(c?.at_ns)));
    table.add(
        "otf_before",
        Some("N"),
        all().map(|c| Some(c?.otf_before_n)),
    );
    table.add("otf_at_onset", Some("N"), all().map(|c| Some(c?.otf_n)));
    for cause in Contribution::ALL {
        let taken = all().map(|causes| {
            let mut shares = causes?.shares.iter();
            let share = shares.find(|share| share.cause == cause.name());
            share.map(|share| share.taken_n)
        });
        table.add(format!("taken_by_{}", cause.name()), Some("N"), taken);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use schemars::schema_for;
    use serde_json::Value;

    use super::*;

    /// Columns that are called otherwise than the key without its unit, by the path of the key in `summary.json`.
    const CALLED_OTHERWISE: [(&str, &[&str]); 16] = [
        ("load_range_n", &["load_min", "load_max"]),
        ("measured_load_n", &["load_measured"]),
        ("untested", &["untested_signs"]),
        ("measured_rotation.shown_by", &["rotation_by"]),
        ("measured_rotation.other_edge", &["rotation_other_edge"]),
        ("measured_rotation.sigma_rad", &["rotation_sigma"]),
        (
            "measured_rotation.no_return_sigma_rad",
            &["no_return_sigma"],
        ),
        (
            "measured_rotation.no_return_time_sigma_s",
            &["no_return_time_sigma"],
        ),
        ("causes.since_ns", &["causes_since_ns"]),
        ("causes.since_is_steady", &["causes_since_is_steady"]),
        ("causes.at_ns", &["causes_at_ns"]),
        ("causes.otf_before_n", &["otf_before"]),
        ("causes.otf_n", &["otf_at_onset"]),
        ("fault.kind", &["fault"]),
        ("fault.loads_are_right", &["loads_are_right"]),
        ("doubt.subjects", &["doubted_by"]),
    ];

    /// The columns of a key whose list has one for each of its names.
    fn of_list(path: &str) -> Option<Vec<String>> {
        match path {
            "causes.shares" => {
                let all = Contribution::ALL.iter();
                Some(all.map(|of| format!("taken_by_{}", of.name())).collect())
            }
            "counterfactuals" => {
                let all = Supposition::ALL.iter();
                Some(all.map(|of| format!("probability_{}", of.name())).collect())
            }
            _ => None,
        }
    }

    /// The paths of the keys of an object, those of objects in it behind their own.
    fn keys(schema: &Value, of: &Value, path: &str, found: &mut BTreeSet<String>) {
        for (key, value) in of["properties"].as_object().expect("an object") {
            let path = match path {
                "" => key.clone(),
                path => format!("{path}.{key}"),
            };
            let or_null = value["anyOf"].as_array().into_iter().flatten();
            let mut named = or_null.chain([value]).filter_map(|of| of["$ref"].as_str());
            match named.next().and_then(|named| named.strip_prefix('#')) {
                Some(pointer) => {
                    let of = schema.pointer(pointer).expect("a definition");
                    keys(schema, of, &path, found);
                }
                None => {
                    found.insert(path);
                }
            }
        }
    }

    #[test]
    fn each_key_of_an_event_has_its_column() {
        let schema = schema_for!(Event).to_value();
        let mut found = BTreeSet::new();
        keys(&schema, &schema, "", &mut found);
        let table = events(&[]);
        for path in &found {
            let own = path.rsplit('.').next().unwrap_or(path);
            let bare = ["_n", "_rad", "_kg"].into_iter();
            let bare = bare.filter_map(|unit| own.strip_suffix(unit)).next();
            let own = [bare.unwrap_or(own)];
            let mut otherwise = CALLED_OTHERWISE.iter();
            let columns = otherwise.find(|(of, _)| of == path);
            let columns = columns.map_or(&own[..], |(_, columns)| columns);
            let columns = columns.iter().map(|column| (*column).to_owned());
            for column in of_list(path).unwrap_or_else(|| columns.collect()) {
                assert!(
                    table.column(&column).is_some(),
                    "{path} has no column {column}"
                );
            }
        }
        let lists = ["causes.shares", "counterfactuals"];
        for path in (CALLED_OTHERWISE.iter().map(|(path, _)| *path)).chain(lists) {
            assert!(found.contains(path), "no key {path}");
        }
    }
}
