//! Columns of `samples.parquet`: one line per row of the log.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::prediction::{
    Law, PREDICTED_AGE, PREDICTED_CAUSE, PREDICTED_GAP, PREDICTED_OTF, PREDICTED_WHEEL,
    PredictedNumber, PredictionGap, predicted_column,
};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{InputFault, Level, Verdict};
use tipwatch_mechanics::{
    ColumnNames, Contribution, OutcomeColumns, Quantity, RowColumn, StateColumns,
};

use super::table::Table;
use crate::analysis::evaluation::scope;
use crate::base::options::{Options, Precision};
use crate::base::predicted::Predictions;
use crate::base::rows::{Rows, Verdicts};
use crate::load::MeasuredLoads;

/// Returns the table of a block of rows. Its columns depend on the machine and on the request alone, not on the
/// values: all blocks of a log have the same.
#[must_use]
pub fn samples(
    machine: &Machine,
    rows: &Rows,
    precision: Precision,
    measured: &MeasuredLoads,
) -> Table {
    let mut table = Table::default();
    let names = ColumnNames::of(machine);
    add_times(&mut table, &rows.times_ns);
    let valid = rows.reasons.iter().map(|reasons| reasons.leave_valid());
    table.add(RowColumn::VALID.name, None, valid);
    let reasons = rows.reasons.iter();
    let reasons = reasons.map(|reasons| Some(reasons.iter().map(Reason::name)));
    table.add_lists(RowColumn::REASONS.name, reasons);
    for (&quantity, values) in rows.outcomes.quantities.iter().zip(&rows.outcomes.columns) {
        let unit = quantity.kind().unit;
        table.add_known(quantity.column(&names), unit, precision, values);
    }
    add_measured(&mut table, machine, rows, precision, measured);
    if let Some(verdicts) = &rows.verdicts {
        add_verdicts(&mut table, machine, verdicts, &names, precision);
    }
    table
}

/// The columns of any log of this machine, before one is read: those that only some logs have, as of measured loads, are not
/// among them, and those of the predictions are, which not every estimator has.
#[must_use]
pub fn columns(machine: &Machine, options: &Options) -> Vec<String> {
    let rows = Rows {
        first: 0,
        start_ns: 0,
        times_ns: Vec::new(),
        reasons: Vec::new(),
        states: StateColumns::unknown(machine, 0),
        outcomes: OutcomeColumns::empty(machine, scope(options)),
        verdicts: Some(Verdicts {
            verdicts: Vec::new(),
            time_to_lift_off_s: Vec::new(),
            predictions: Some(Predictions::none(machine.wheels().len())),
            recorded: Vec::new(),
        }),
    };
    let table = samples(machine, &rows, Precision::Double, &MeasuredLoads::default());
    let mut names: Vec<String> = table
        .columns()
        .iter()
        .map(|column| column.name().to_owned())
        .collect();
    names.push(RowColumn::INPUT_FAULTS.name.to_owned());
    names
}

pub(super) fn add_times(table: &mut Table, times_ns: &[i64]) {
    let RowColumn { name, unit, .. } = RowColumn::TIME;
    table.add(name, Some(unit), times_ns.iter().copied());
}

/// Adds the measured loads, and their residuals: measured minus computed load.
fn add_measured(
    table: &mut Table,
    machine: &Machine,
    rows: &Rows,
    precision: Precision,
    measured: &MeasuredLoads,
) {
    let weight = rows.outcomes.column(Quantity::NormalForce);
    let vary = machine.supports().vary();
    for (index, load) in measured.sensors.iter().enumerate() {
        let times = rows.times_ns.iter();
        let values: Vec<f64> = times.map(|&time| measured.at(index, time)).collect();
        let mut residual = values.clone();
        let mut carries = vec![false; values.len()];
        for place in load.sensor.places(machine) {
            let computed = rows.outcomes.column(Quantity::Load(place));
            for (row, computed) in computed.iter().enumerate() {
                // a support that is off the ground has no load in a row that is known
                if !vary || !computed.is_nan() || weight[row].is_nan() {
                    residual[row] -= computed;
                    carries[row] = true;
                }
            }
        }
        let residual_of_none = residual.iter_mut().zip(carries);
        for (residual, _) in residual_of_none.filter(|(_, carries)| !carries) {
            *residual = f64::NAN;
        }
        let name = &load.sensor.name;
        table.add_known(format!("load_measured_{name}"), "N", precision, &values);
        table.add_known(format!("load_residual_{name}"), "N", precision, &residual);
    }
}

/// Adds the predictions of each row, by the assumed motions.
fn add_predictions(
    table: &mut Table,
    predictions: &Predictions,
    names: &ColumnNames,
    precision: Precision,
) {
    for law in Law::ALL {
        let columns = predictions.of(law);
        for number in PredictedNumber::ALL {
            let column = number.column();
            let name = predicted_column(column, law);
            table.add_known(name, column.unit, precision, columns.number(number));
        }
        for (wheel, values) in names.wheels.iter().zip(&columns.otf_least) {
            let name = predicted_column(PREDICTED_OTF, law).replace("{wheel}", wheel);
            table.add_known(name, PREDICTED_OTF.unit, precision, values);
        }
        let wheels = columns.wheels.iter();
        let wheels = wheels.map(|wheel| wheel.map(|wheel| names.wheels[wheel].as_str()));
        table.add(predicted_column(PREDICTED_WHEEL, law), None, wheels);
        let causes = columns
            .causes
            .iter()
            .map(|cause| cause.map(Contribution::name));
        table.add(predicted_column(PREDICTED_CAUSE, law), None, causes);
        let gaps = columns.gaps.iter().map(|gap| gap.map(PredictionGap::name));
        table.add(predicted_column(PREDICTED_GAP, law), None, gaps);
    }
    let RowColumn { name, unit, .. } = PREDICTED_AGE;
    table.add_known(*name, unit, precision, &predictions.age_s);
}

fn add_verdicts(
    table: &mut Table,
    machine: &Machine,
    verdicts: &Verdicts,
    names_of: &ColumnNames,
    precision: Precision,
) {
    let names = |of: fn(&Verdict) -> Level| verdicts.verdicts.iter().map(move |v| of(v).name());
    table.add(RowColumn::VERDICT.name, None, names(|v| v.level));
    table.add(
        RowColumn::VERDICT_LATCHED.name,
        None,
        names(|v| v.latched_level),
    );
    let basis = verdicts.verdicts.iter().map(|v| v.basis.name());
    table.add(RowColumn::VERDICT_BASIS.name, None, basis);
    // the same over long stretches
    let stretches = verdicts.verdicts.chunk_by(|a, b| a.unproven == b.unproven);
    let stretches: Vec<(usize, Vec<String>)> = stretches
        .map(|rows| (rows.len(), rows[0].unproven.names(machine)))
        .collect();
    let unproven: Vec<&Vec<String>> = stretches
        .iter()
        .flat_map(|(rows, names)| std::iter::repeat_n(names, *rows))
        .collect();
    let unproven = unproven.into_iter();
    let unproven = unproven.map(|names| Some(names.iter().map(String::as_str)));
    table.add_lists(RowColumn::UNPROVEN.name, unproven);
    let RowColumn { name, unit, .. } = RowColumn::TIME_TO_LIFT_OFF;
    table.add_known(name, unit, precision, &verdicts.time_to_lift_off_s);
    if let Some(predictions) = &verdicts.predictions {
        add_predictions(table, predictions, names_of, precision);
    }
    // those that a monitor recorded in the log, for every row or for none
    if !verdicts.recorded.is_empty() {
        let faults = verdicts.recorded.iter().map(|conditions| {
            let mut found = conditions.faults;
            found.add_all(conditions.cautions);
            Some(found.iter().map(InputFault::name).collect::<Vec<_>>())
        });
        table.add_lists(RowColumn::INPUT_FAULTS.name, faults);
    }
}
