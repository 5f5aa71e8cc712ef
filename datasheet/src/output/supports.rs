//! Supports other than wheels in the machine file: outriggers and tracks.

use std::fmt::Write;

use super::text::{comment, float, quoted};
use crate::body::{Machine, Outrigger, PadSet};

/// Writes what the machine file says about outriggers and tracks.
pub(super) fn write(out: &mut String, machine: &Machine) {
    if machine.has_tracks {
        comment(
            out,
            "The supports above are the ends of the tracks. Between them the ground may bear anywhere; the polygon of support \
             is the same.",
        );
    }
    if machine.outriggers.is_empty() {
        return;
    }
    out.push('\n');
    comment(
        out,
        "Outriggers. The URDF has a frame at the sole of each pad, set on the ground and fully extended. Stiffness (N/m): \
         assumed, of a jack on firm ground.",
    );
    let (told, open): (Vec<&Outrigger>, Vec<&Outrigger>) =
        machine.outriggers.iter().partition(|pad| pad.set.is_some());
    for pad in told {
        out.push_str(&support(machine, pad));
    }
    if open.is_empty() {
        return;
    }
    comment(
        out,
        "This file describes the machine without the pads below, because the sheet does not say when they stand on the ground. \
         Needed, for a log with them set: `set` as a constant or a signal, and that the wheels are then off the ground:",
    );
    for pad in &open {
        for line in support(machine, pad).lines() {
            let _ = writeln!(out, "# {line}");
        }
    }
    comment(
        out,
        &format!("and in each [wheels.NAME]: {}", raised_by(&open)),
    );
}

/// What holds a wheel off the ground: the pads that may be set, while all of them are. `None` if there are none.
pub(super) fn wheel_raised_by(machine: &Machine) -> Option<String> {
    let pads: Vec<&Outrigger> = (machine.outriggers.iter())
        .filter(|pad| pad.may_be_set())
        .collect();
    (!pads.is_empty()).then(|| raised_by(&pads))
}

fn raised_by(pads: &[&Outrigger]) -> String {
    let pads: Vec<String> = pads.iter().map(|pad| quoted(&pad.support())).collect();
    format!("raised_by = [{}]", pads.join(", "))
}

/// The section of a pad.
fn support(machine: &Machine, pad: &Outrigger) -> String {
    // ten times as stiff as the tyres of its share of the machine
    let tyres: f64 = machine.wheels.iter().map(|wheel| wheel.stiffness).sum();
    let stiffness = 10.0 * tyres / machine.outriggers.len() as f64;
    let set = match &pad.set {
        None => "true".to_owned(),
        Some(PadSet::Always(on)) => on.to_string(),
        Some(PadSet::While(switch)) => {
            let above = switch
                .above
                .map_or(String::new(), |above| format!(", above = {}", float(above)));
            format!(
                "{{ topic = {}, field = {}{above} }}",
                quoted(&switch.topic),
                quoted(&switch.field)
            )
        }
    };
    format!(
        "[supports.{}]\nlink = {}\nstiffness = {}\nset = {set}\n",
        pad.support(),
        quoted(&pad.link),
        float(stiffness.round())
    )
}
