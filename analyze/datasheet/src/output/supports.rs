//! Supports other than wheels in the machine file: outriggers and tracks.

use std::fmt::Write;

use super::text::{comment, float, quoted, triple};
use crate::body::{Machine, Outrigger, PadSet, Wheel};

/// Writes the tracks.
pub(super) fn write_tracks(out: &mut String, machine: &Machine) {
    out.push('\n');
    comment(
        out,
        "Tracks. Their points are supports that are springs alike. Between the points the ground may bear anywhere; the polygon \
         of support is the same.",
    );
    let raised_by = raised_by_pads(machine, None);
    // the name of a point is that of its track and its number, from rear to front
    let mut points: Vec<(&str, &Wheel)> = Vec::new();
    for point in &machine.wheels {
        let track = point.name.rsplit_once('_').map_or("", |(track, _)| track);
        points.push((track, point));
    }
    for track in points.chunk_by(|a, b| a.0 == b.0) {
        let ([(name, rear), ..], [.., (_, front)]) = (track, track) else {
            continue;
        };
        let _ = writeln!(
            out,
            "\n[tracks.{name}]\nlink = {}\nfrom = {}\nto = {}\npoints = {}",
            quoted(&machine.links[rear.link].name),
            triple(rear.place),
            triple(front.place),
            track.len()
        );
        if let Some(raised_by) = &raised_by {
            let _ = writeln!(out, "{raised_by}");
        }
    }
}

/// Writes the section on outriggers.
pub(super) fn write(out: &mut String, machine: &Machine) {
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
    let wheels = machine.wheels.iter();
    let raised = wheels.filter(|wheel| raises(machine, &open, Some(wheel)));
    let raised: Vec<String> = raised
        .map(|wheel| format!("[wheels.{}]", wheel.name))
        .collect();
    let which = match machine.has_tracks {
        true if raises(machine, &open, None) => "each [tracks.NAME]".to_owned(),
        true => return,
        false if raised.len() == machine.wheels.len() => "each [wheels.NAME]".to_owned(),
        false => raised.join(" and "),
    };
    comment(out, &format!("and in {which}: {}", raised_by(&open)));
}

/// Returns the key `raised_by` for a wheel, or else for the tracks, with the pads that may be set: while all of them are set,
/// they hold the wheel off the ground. `None` if no pads do.
pub(super) fn raised_by_pads(machine: &Machine, wheel: Option<&Wheel>) -> Option<String> {
    let pads: Vec<&Outrigger> = (machine.outriggers.iter())
        .filter(|pad| pad.may_be_set())
        .collect();
    raises(machine, &pads, wheel).then(|| raised_by(&pads))
}

/// Whether pads hold a wheel, or else the tracks, off the ground: those of two pairs hold the whole machine, those of one
/// pair only the axle next to them.
fn raises(machine: &Machine, pads: &[&Outrigger], wheel: Option<&Wheel>) -> bool {
    let [pad, ..] = pads else { return false };
    if pads.iter().any(|other| other.x != pad.x) {
        return true;
    }
    let away = |axle: usize| (machine.axles[axle].x - pad.x).abs();
    let nearest = (0..machine.axles.len()).min_by(|&a, &b| away(a).total_cmp(&away(b)));
    wheel.is_some_and(|wheel| nearest == Some(wheel.axle))
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
