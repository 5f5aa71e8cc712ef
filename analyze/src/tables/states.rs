//! The table of states: the signals of a log's sensors, on one clock.

use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::{Axis, Machine, Parameter};
use tipwatch_mechanics::state::Reason;

use super::table::Table;
use crate::base::estimated::EstimatedRows;
use crate::base::options::Precision;

/// Names and units of the base's attitude and velocity: up, velocity, and its rate, in base axes.
const BASE: [(&str, &str); 3] = [
    ("base.up", "-"),
    ("base.velocity", "m/s"),
    ("base.velocity_rate", "m/s^2"),
];

/// One row per time: the signals by name (`boom.position`, `imu.specific_force_x`), null where unknown, and why a row
/// is not valid as far as the signals show.
#[must_use]
pub fn states(machine: &Machine, rows: &EstimatedRows) -> Table {
    let signals = Parameter::all(machine).into_iter();
    let signals = signals.filter(|p| p.is_signal() && !matches!(p, Parameter::BaseMotion(_)));
    let signals: Vec<Parameter> = signals.collect();
    let mut columns = vec![Vec::with_capacity(rows.len()); signals.len() + 3 * BASE.len()];
    let mut state = State::zero(machine);
    for row in 0..rows.len() {
        rows.state(row, &mut state);
        let base = [
            &state.base.up,
            &state.base.velocity,
            &state.base.velocity_rate,
        ];
        let base = base.into_iter().flat_map(|vector| vector.iter().copied());
        let signals = signals.iter();
        let signals = signals.map(|&signal| state.value(signal).unwrap_or(f64::NAN));
        for (column, value) in columns.iter_mut().zip(signals.chain(base)) {
            column.push(value);
        }
    }
    let mut table = Table::default();
    table.add("time_ns", Some("ns"), rows.times_ns.iter().copied());
    let reasons = rows.reasons.iter();
    let reasons = reasons.map(|reasons| Some(reasons.iter().map(Reason::name)));
    table.add_lists("reasons", reasons);
    let signals = signals.iter();
    let named = signals.map(|signal| (signal.name(machine), signal.unit(machine)));
    let base = BASE
        .iter()
        .flat_map(|&(name, unit)| Axis::ALL.map(|axis| (format!("{name}_{}", axis.name()), unit)));
    for ((name, unit), values) in named.chain(base).zip(&columns) {
        table.add_known(name, unit, Precision::Double, values);
    }
    table
}
