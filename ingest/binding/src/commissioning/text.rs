//! The result of a commissioning for people.

use std::fmt::Write;

use tipwatch_calibration::commissioning::{Assessment, Item, Status, Step};

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

/// Returns the result as text: motions recognised, items, and their meaning.
#[must_use]
pub fn commissioning_text(assessment: &Assessment) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_all(&mut text, assessment);
    text
}

fn write_all(out: &mut String, assessment: &Assessment) -> std::fmt::Result {
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
