//! The verdict as `diagnostic_msgs/DiagnosticArray`.

use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::verdict::{InputFault, Level};

use super::view::View;
use crate::record::Cdr;

/// The message, with the time of this computer (ns) as its stamp. Without a current verdict it is stale: never OK.
#[must_use]
pub fn diagnostics(view: &View<'_>, unix_now_ns: i64) -> Vec<u8> {
    let level = view.level();
    let known = view.verdict.map_or(Level::Unknown, |_| level);
    let status = known.diagnostic();
    let worst = view.worst_wheel();
    let wheel = worst.map_or("unknown", |(wheel, _)| view.wheel_name(wheel));
    let message = match view.verdict {
        None => "no current verdict: treat as a fault".to_owned(),
        Some(_) if worst.is_some() => format!("{}, worst wheel {wheel}", level.name()),
        Some(_) => level.name().to_owned(),
    };
    let number = |number: f64| match number.is_finite() {
        true => format!("{number:.3}"),
        false => "unknown".to_owned(),
    };
    let mut values = vec![
        ("level", view.momentary().name().to_owned()),
        ("latched_level", level.name().to_owned()),
        ("utilisation", number(view.number(Quantity::Utilisation))),
        ("worst_wheel", wheel.to_owned()),
        (
            "overturning_force_n",
            number(worst.map_or(f64::NAN, |(_, force)| force)),
        ),
        ("time_to_lift_off_s", number(view.time_to_lift_off_s())),
    ];
    if let Some(verdict) = view.verdict {
        let held = verdict.verdict().held;
        let faults: Vec<&str> = held.faults.iter().map(InputFault::name).collect();
        let cautions: Vec<&str> = held.cautions.iter().map(InputFault::name).collect();
        values.push(("basis", verdict.verdict().basis.name().to_owned()));
        values.push(("unproven", view.names.unproven(verdict).join(" ")));
        values.push(("missing_proofs", view.names.missing_proofs_text(verdict)));
        values.push(("doubted", view.names.doubted(verdict).join(" ")));
        values.push(("doubted_loads", view.names.doubted_loads(verdict).join(" ")));
        values.push((
            "load_explanations",
            view.names.load_explanations(verdict).join(" "),
        ));
        let forces = view.names.doubted_forces(verdict);
        values.push(("doubted_forces", forces.join(" ")));
        let forces = view.names.frozen_forces(verdict);
        values.push(("frozen_forces", forces.join(" ")));
        let standing = view.names.standing(verdict).unwrap_or_default();
        values.push(("standing", standing.join(" ")));
        let gap = view.names.ground_gap_text(verdict);
        values.push(("ground_gap", gap.unwrap_or_default()));
        values.push(("faults", faults.join(" ")));
        values.push(("cautions", cautions.join(" ")));
        values.push(("samples_lost", verdict.lost.to_string()));
        values.push(("samples_refused", verdict.refused.to_string()));
    }
    let mut cdr = Cdr::with_capacity(512);
    cdr.header(unix_now_ns, "");
    cdr.u32(1);
    cdr.u8(status);
    cdr.text("tipwatch: tip-over");
    cdr.text(&message);
    cdr.text(&view.names.machine);
    cdr.u32(values.len() as u32);
    for (key, value) in values {
        cdr.text(key);
        cdr.text(&value);
    }
    cdr.finish()
}
