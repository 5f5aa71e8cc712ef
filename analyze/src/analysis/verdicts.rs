//! Verdicts over all rows, from the same judge as live.

use std::collections::BTreeMap;

use anyhow::Result;
use tipwatch_binding::monitor_topic;
use tipwatch_ingest::Log;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::verdict::{
    Conditions, InputFaults, Judge, Latch, Level, LiftOffForecast, RowFacts,
};
use tipwatch_mechanics::{Quantity, Scope};

use crate::base::rows::{Rows, Verdicts};

/// Judges all rows.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn of(
    log: &Log,
    machine: &Machine,
    rows: &Rows,
    scope: Scope,
) -> Result<Option<Verdicts>> {
    if !scope.sensitivities {
        return Ok(None);
    }
    let recorded = recorded(log)?;
    let wheels = 0..machine.wheels().len();
    let otf_columns: Vec<&[f64]> = wheels
        .map(|wheel| rows.outcomes.column(Quantity::Otf(wheel)))
        .collect();
    let utilisation = rows.outcomes.column(Quantity::Utilisation);
    let mut judge = Judge::new(machine.limits());
    judge.resume(inherited_alarm(log)?);
    let mut forecast = LiftOffForecast::new(machine);
    let mut otf = vec![f64::NAN; otf_columns.len()];
    let mut all = Verdicts {
        verdicts: Vec::with_capacity(rows.len()),
        time_to_lift_off_s: Vec::with_capacity(rows.len()),
        recorded: Vec::new(),
    };
    for row in 0..rows.len() {
        let (time_ns, reasons) = (rows.times_ns[row], rows.reasons[row]);
        let (conditions, is_acknowledged) = recorded.get(&time_ns).copied().unwrap_or_default();
        for (otf, column) in otf.iter_mut().zip(&otf_columns) {
            *otf = column[row];
        }
        let verdict = judge.row(&RowFacts {
            time_ns,
            reasons,
            utilisation: utilisation[row],
            is_wheel_unloaded: otf.iter().any(|otf| *otf <= 0.0),
            conditions,
            is_acknowledged,
        });
        all.verdicts.push(verdict);
        let next = (reasons.leave_loads())
            .then(|| forecast.row(machine, time_ns, &otf))
            .flatten()
            .filter(|_| verdict.level.announces_lift_off());
        all.time_to_lift_off_s
            .push(next.map_or(f64::NAN, |next| next.in_s));
        if !recorded.is_empty() {
            all.recorded.push(conditions);
        }
    }
    Ok(Some(all))
}

type Recorded = BTreeMap<i64, (Conditions, bool)>;

/// Input faults that a monitor recorded in the log, by time of the row.
fn recorded(log: &Log) -> Result<Recorded> {
    let Some(columns) = monitor_topic::verdicts(log)? else {
        return Ok(Recorded::new());
    };
    let [event, faults, cautions, acknowledged] = &columns;
    let set = |number: f64| InputFaults::from_bits(number as u32);
    let rows = (0..event.values.len())
        .filter(|&at| event.values[at] == f64::from(monitor_topic::EVENT_ROW))
        .map(|at| {
            let conditions = Conditions {
                faults: set(faults.values[at]),
                cautions: set(cautions.values[at]),
            };
            (
                event.stamps_ns[at],
                (conditions, acknowledged.values[at] != 0.0),
            )
        });
    Ok(rows.collect())
}

/// The latched alarm with which the recorded session began. A monitor that was restarted meanwhile resumed its own alarm:
/// only the first verdict tells what was there before.
fn inherited_alarm(log: &Log) -> Result<Latch> {
    let Some([level, is_acknowledged]) = monitor_topic::inherited_alarms(log)? else {
        return Ok(Latch::default());
    };
    let level = level.values.first().filter(|level| **level != 0.0);
    Ok(Latch {
        level: level.map(|level| Level::from_number(*level as u32)),
        is_acknowledged: is_acknowledged.values.first().is_some_and(|n| *n != 0.0),
    })
}
