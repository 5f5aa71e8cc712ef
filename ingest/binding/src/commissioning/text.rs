//! The result of a commissioning for people.

use std::fmt::Write;

use tipwatch_calibration::commissioning::{Assessment, Item, Status, Step};
use tipwatch_mechanics::machine::{Commissioned, Machine};

/// The order in which items are listed.
const ORDER: [Status; 4] = [
    Status::Contradicted,
    Status::NotShown,
    Status::Confirmed,
    Status::Proven,
];

/// Limits of the check: faults that no comparison of signals shows, stated with every result.
const BEYOND: &str = "Not part of the check: zeros of the encoders, masses and the positions of sensors and wheels (compare weighed loads and \
     measured postures), and faults that only arise later (the running checks look for them).";

/// Least part of a joint's positions that is told as unproven (rad or m).
const TOLD: f64 = 5e-3;

/// Returns the result as text: motions recognised, items, where joints are proven, and their meaning. `proven`: what the result proves.
#[must_use]
pub fn commissioning_text(
    assessment: &Assessment,
    machine: &Machine,
    proven: &Commissioned,
) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_all(&mut text, assessment, machine, proven);
    text
}

fn write_all(
    out: &mut String,
    assessment: &Assessment,
    machine: &Machine,
    proven: &Commissioned,
) -> std::fmt::Result {
    let count = |status| assessment.count(status);
    writeln!(
        out,
        "commissioning: {} items: {} proven, {} confirmed by a person, {} contradicted, {} not shown",
        assessment.items.len(),
        count(Status::Proven),
        count(Status::Confirmed),
        count(Status::Contradicted),
        count(Status::NotShown)
    )?;
    if !assessment.steps.is_empty() {
        let steps: Vec<String> = assessment.steps.iter().map(step).collect();
        writeln!(
            out,
            "motions recognised in {:.0} s: {}",
            assessment.duration_s,
            steps.join(", ")
        )?;
    }
    if !assessment.explanations.is_empty() {
        writeln!(
            out,
            "the contradictions are explained if {}",
            assessment.explanations.join(", or if ")
        )?;
    }
    writeln!(out)?;
    for status in ORDER {
        for item in assessment.items.iter().filter(|item| item.status == status) {
            write_item(out, item)?;
        }
    }
    write_where(out, assessment, machine, proven)?;
    writeln!(out, "\n{BEYOND}")?;
    let open = count(Status::NotShown);
    match (count(Status::Contradicted), assessment.is_complete()) {
        (0, true) => writeln!(out, "commissioned"),
        (0, false) => writeln!(out, "NOT commissioned: {open} items are not shown"),
        (wrong, _) => writeln!(
            out,
            "NOT commissioned: {wrong} items are contradicted, {open} are not shown"
        ),
    }
}

/// Where each joint is proven, and what that leaves open of this recording and of the joint's limits.
fn write_where(
    out: &mut String,
    assessment: &Assessment,
    machine: &Machine,
    proven: &Commissioned,
) -> std::fmt::Result {
    let mut is_first = true;
    for (joint, it) in machine.joints().iter().enumerate() {
        let Some(range) = proven.range(joint) else {
            continue;
        };
        if std::mem::take(&mut is_first) {
            writeln!(
                out,
                "\nwhere joints are proven; a verdict is assumed, and never safe, while one is elsewhere:"
            )?;
        }
        let unit = match machine.joint_slides(joint) {
            true => "m",
            false => "rad",
        };
        let items = assessment.items.iter();
        let mut items = items.filter(|item| is_of_joint(&item.key, &it.name));
        let recorded = items.find_map(|item| item.recorded);
        let open = |within: Option<[f64; 2]>| {
            let mut parts =
                within.map_or(Vec::new(), |within| proven.unproven_within(joint, within));
            parts.retain(|[from, to]| to - from > TOLD);
            let parts: Vec<String> = parts.into_iter().map(positions).collect();
            parts.join(" and ")
        };
        write!(out, "  {}: {} {unit}", it.name, positions(range))?;
        for (what, open) in [
            ("this recording", open(recorded)),
            ("its limits", open(it.limits)),
        ] {
            if !open.is_empty() {
                write!(out, "; of {what}, {open} {unit} are unproven")?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Whether an item with this key is one of a joint. Names may contain dots, what is shown of a joint does not.
fn is_of_joint(key: &str, name: &str) -> bool {
    let part = key.strip_prefix("joint.");
    let part = part.and_then(|key| key.strip_prefix(name)?.strip_prefix('.'));
    part.is_some_and(|part| !part.contains('.'))
}

fn positions([from, to]: [f64; 2]) -> String {
    format!("{from:.3} to {to:.3}")
}

fn step(step: &Step) -> String {
    format!(
        "{} {:.1}-{:.1} s",
        step.what, step.span_s[0], step.span_s[1]
    )
}

fn write_item(out: &mut String, item: &Item) -> std::fmt::Result {
    let name = format!("{}: {}", item.signal, item.property);
    write!(out, "{:<22}{name}", item.status.words())?;
    match item.sigmas {
        Some(sigmas) => writeln!(out, " (nearest alternative excluded by {sigmas:.0} sigma)")?,
        None => writeln!(out)?,
    }
    writeln!(out, "{:22}  {}", "", item.text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_has_no_items_of_one_whose_name_begins_with_its_own() {
        assert!(is_of_joint("joint.lift.sign", "lift"));
        assert!(is_of_joint("joint.lift.2.sign", "lift.2"));
        assert!(!is_of_joint("joint.lift.2.sign", "lift"));
        assert!(!is_of_joint("joint.lift_2.sign", "lift"));
        assert!(!is_of_joint("imu.sign", "lift"));
    }
}
