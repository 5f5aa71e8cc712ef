//! Supports other than wheels in the machine file: outriggers and tracks.

use std::fmt::Write;

use super::text::{comment, float};
use crate::body::Machine;

/// Writes what the machine file says about outriggers and tracks. When an outrigger stands on the ground only a log
/// tells, so they are left open.
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
        "Outriggers. The URDF has a frame at the sole of each pad, set on the ground and fully extended. This file describes \
         the machine on its wheels. Needed, for a log with the outriggers set: when each pad stands on the ground, as a \
         constant or a signal; and that the wheels are then off it. Stiffness (N/m): assumed, of a jack on firm ground.",
    );
    // ten times as stiff as the tyres of its share of the machine
    let mean = machine
        .wheels
        .iter()
        .map(|wheel| wheel.stiffness)
        .sum::<f64>()
        / machine.outriggers.len() as f64;
    for name in &machine.outriggers {
        let _ = writeln!(
            out,
            "# [supports.{}]\n# link = \"{name}\"\n# stiffness = {}\n# set = true",
            name.to_uppercase(),
            float((10.0 * mean).round())
        );
    }
    let pads: Vec<String> = machine
        .outriggers
        .iter()
        .map(|name| format!("\"{}\"", name.to_uppercase()))
        .collect();
    comment(
        out,
        &format!(
            "and in each [wheels.NAME]: raised_by = [{}]",
            pads.join(", ")
        ),
    );
}
