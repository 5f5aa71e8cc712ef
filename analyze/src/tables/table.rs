//! Columns of `samples.parquet`, `events.parquet` and the tables beside them: names, units, values.

use polars::prelude::{Column, DataFrame, IntoColumn, ListStringChunkedBuilder, NamedFrom, Series};
use polars::prelude::{ListBuilderTrait, PlSmallStr, PolarsResult};
use tipwatch_mechanics::verdict::{InputFault, Level, Verdict};
use tipwatch_mechanics::{ColumnNames, Contribution, Quantity, RowColumn};

use crate::analysis::Analysis;
use crate::analysis::sensitivity::SensitivityRow;
use crate::base::rows::Rows;
use crate::base::rows::Verdicts;
use crate::events::Event;

/// A table and the units of its columns; times, booleans and texts have none.
#[derive(Debug, Clone)]
pub struct Table {
    /// The columns.
    pub frame: DataFrame,
    /// Unit by column name, in column order.
    pub units: Vec<(String, &'static str)>,
}

/// Whether a column is written: without a single value, that of the specific force as a cause is omitted, which
/// is known only where slope and platform acceleration are not.
pub(crate) fn is_written(quantity: Quantity, values: &[f64]) -> bool {
    !matches!(
        quantity,
        Quantity::Contribution(Contribution::SpecificForce, _)
    ) || values.iter().any(|value| value.is_finite())
}

/// The table of samples, one line per row.
///
/// # Errors
/// The columns differ in length.
pub fn samples(analysis: &Analysis) -> PolarsResult<Table> {
    let rows = &analysis.rows;
    let mut columns = vec![
        times(rows),
        column(
            RowColumn::VALID.name,
            rows.reasons.iter().map(|r| r.is_empty()),
        ),
        reasons(rows),
    ];
    let mut units = vec![unit_of(RowColumn::TIME)];
    let names = ColumnNames::of(&analysis.machine);
    for (&quantity, values) in rows.outcomes.quantities.iter().zip(&rows.outcomes.columns) {
        if is_written(quantity, values) {
            let name = quantity.column(&names);
            columns.push(known(&name, values));
            units.push((name, quantity.kind().unit));
        }
    }
    if let Some(verdicts) = &rows.verdicts {
        let names = |of: fn(&Verdict) -> Level| verdicts.verdicts.iter().map(move |v| of(v).name());
        let lift_off = RowColumn::TIME_TO_LIFT_OFF;
        columns.push(column(RowColumn::VERDICT.name, names(|v| v.level)));
        columns.push(column(
            RowColumn::VERDICT_LATCHED.name,
            names(|v| v.latched_level),
        ));
        columns.push(known(lift_off.name, &verdicts.time_to_lift_off_s));
        units.push(unit_of(lift_off));
        if !verdicts.recorded.is_empty() {
            columns.push(input_faults(verdicts));
        }
    }
    Ok(Table {
        frame: DataFrame::new(rows.len(), columns)?,
        units,
    })
}

fn times(rows: &Rows) -> Column {
    Series::new(RowColumn::TIME.name.into(), rows.times_ns.as_slice()).into_column()
}

fn unit_of(column: RowColumn) -> (String, &'static str) {
    (column.name.to_string(), column.unit)
}

/// Input faults that the monitor recorded in the log.
fn input_faults(verdicts: &Verdicts) -> Column {
    let rows = verdicts.recorded.len();
    let mut builder = ListStringChunkedBuilder::new(RowColumn::INPUT_FAULTS.name.into(), rows, 0);
    for conditions in &verdicts.recorded {
        let mut found = conditions.faults;
        found.add_all(conditions.cautions);
        builder.append_values_iter(found.iter().map(InputFault::name));
    }
    builder.finish().into_column()
}

/// A column with null for values that are not finite.
fn known(name: &str, values: &[f64]) -> Column {
    let name = PlSmallStr::from_str(name);
    if values.iter().all(|value| value.is_finite()) {
        return Series::new(name, values).into_column();
    }
    let known: Vec<Option<f64>> = values
        .iter()
        .map(|&value| Some(value).filter(|v| v.is_finite()))
        .collect();
    Series::new(name, known).into_column()
}

fn reasons(rows: &Rows) -> Column {
    let mut builder = ListStringChunkedBuilder::new(RowColumn::REASONS.name.into(), rows.len(), 0);
    for reasons in &rows.reasons {
        builder.append_values_iter(reasons.iter().map(tipwatch_mechanics::state::Reason::name));
    }
    builder.finish().into_column()
}

pub(crate) fn column<T>(name: &str, values: impl Iterator<Item = T>) -> Column
where
    Series: NamedFrom<Vec<T>, [T]>,
{
    Series::new(name.into(), values.collect::<Vec<T>>()).into_column()
}

/// The table of events.
///
/// # Errors
/// The columns differ in length.
pub fn events(events: &[Event]) -> PolarsResult<Table> {
    let frame = DataFrame::new(
        events.len(),
        vec![
            column("kind", events.iter().map(|e| e.kind.name())),
            column("start_ns", events.iter().map(|e| e.start_ns)),
            column("end_ns", events.iter().map(|e| e.end_ns)),
            column("subject", events.iter().map(|e| e.subject.as_str())),
            column("worst", events.iter().map(|e| e.worst)),
            column("worst_ns", events.iter().map(|e| e.worst_ns)),
            column("unit", events.iter().map(|e| e.unit)),
            column("lead_s", events.iter().map(|e| e.lead_s)),
            column("certainty", events.iter().map(|e| e.certainty)),
            column("split_dependent", events.iter().map(|e| e.split_dependent)),
            column(
                "certainty_any_split",
                events.iter().map(|e| e.certainty_any_split),
            ),
            column("start_sigma_s", events.iter().map(|e| e.start_sigma_s)),
            column(
                "load_min",
                events.iter().map(|e| e.load_range_n.map(|n| n[0])),
            ),
            column(
                "load_max",
                events.iter().map(|e| e.load_range_n.map(|n| n[1])),
            ),
            column("judged_ns", events.iter().map(|e| e.judged_ns)),
            column("any_split_ns", events.iter().map(|e| e.any_split_ns)),
            column("rotation", events.iter().map(|e| e.rotation_rad)),
            column(
                "fault",
                events.iter().map(|e| e.fault.map(|f| f.kind.name())),
            ),
            column(
                "policy",
                events.iter().map(|e| e.fault.map(|f| f.policy.name())),
            ),
            column(
                "limit",
                events.iter().map(|e| e.fault.and_then(|f| f.limit)),
            ),
            column("samples", events.iter().map(|e| e.fault.map(|f| f.samples))),
        ],
    )?;
    let units = [
        ("start_ns", "ns"),
        ("end_ns", "ns"),
        ("worst", "column unit"),
        ("worst_ns", "ns"),
        ("lead_s", "s"),
        ("certainty", "-"),
        ("certainty_any_split", "-"),
        ("start_sigma_s", "s"),
        ("load_min", "N"),
        ("load_max", "N"),
        ("judged_ns", "ns"),
        ("any_split_ns", "ns"),
        ("rotation", "rad"),
        ("limit", "column unit"),
        ("samples", "-"),
    ];
    Ok(Table {
        frame,
        units: units.map(|(name, unit)| (name.to_string(), unit)).to_vec(),
    })
}

/// The table of sensitivities, one line per wheel and parameter; `None` if the model has no derivatives.
///
/// # Errors
/// The columns differ in length.
pub fn sensitivity(analysis: &Analysis) -> PolarsResult<Option<Table>> {
    let Some(table) = &analysis.sensitivity else {
        return Ok(None);
    };
    let (machine, rows) = (&analysis.machine, &table.rows);
    let finite = |value: f64| Some(value).filter(|v| v.is_finite());
    let wheel = |w: usize| machine.wheels()[w].name.to_lowercase();
    let unit = |row: &SensitivityRow| row.parameter.unit(machine);
    let kind = |row: &SensitivityRow| match row.parameter.is_signal() {
        true => "signal",
        false => "parameter",
    };
    let frame = DataFrame::new(
        rows.len(),
        vec![
            column("parameter", rows.iter().map(|r| r.parameter.name(machine))),
            column("kind", rows.iter().map(kind)),
            column("unit", rows.iter().map(unit)),
            column("nominal", rows.iter().map(|r| r.nominal)),
            column("sigma", rows.iter().map(|r| r.sigma)),
            column("wheel", rows.iter().map(|r| wheel(r.wheel))),
            column(
                "is_worst_wheel",
                rows.iter().map(|r| r.wheel == table.worst_wheel),
            ),
            column("worst_ns", rows.iter().map(|r| r.worst_ns)),
            column("worst_otf", rows.iter().map(|r| r.worst_otf_n)),
            column("derivative", rows.iter().map(|r| finite(r.derivative))),
            column("derivative_rms", rows.iter().map(|r| finite(r.rms))),
            column("change_to_zero", rows.iter().map(|r| r.change_to_zero)),
            column(
                "variance_share",
                rows.iter().map(|r| finite(r.variance_share)),
            ),
        ],
    )?;
    let units = [
        ("nominal", "column unit"),
        ("sigma", "column unit"),
        ("worst_ns", "ns"),
        ("worst_otf", "N"),
        ("derivative", "N / column unit"),
        ("derivative_rms", "N / column unit"),
        ("change_to_zero", "column unit"),
        ("variance_share", "-"),
    ];
    Ok(Some(Table {
        frame,
        units: units.map(|(name, unit)| (name.to_string(), unit)).to_vec(),
    }))
}

/// The bands of the Monte Carlo study, one line per row: 2.5 % of the draws are below `_low` and above
/// `_high`; `None` without a study.
///
/// # Errors
/// The columns differ in length.
pub fn monte_carlo(analysis: &Analysis) -> PolarsResult<Option<Table>> {
    let Some(study) = &analysis.monte_carlo else {
        return Ok(None);
    };
    let rows = &analysis.rows;
    let mut columns = vec![times(rows)];
    let mut units = vec![unit_of(RowColumn::TIME)];
    let names = ColumnNames::of(&analysis.machine);
    for band in &study.bands {
        let (name, unit) = (band.quantity.column(&names), band.quantity.kind().unit);
        for (part, values) in [
            ("low", &band.low),
            ("high", &band.high),
            ("sigma", &band.sigma),
        ] {
            let name = format!("{name}_{part}");
            columns.push(known(&name, values));
            units.push((name, unit));
        }
        let left_out = format!("{name}_left_out");
        columns.push(Series::new(left_out.as_str().into(), &band.left_out[..]).into_column());
        units.push((left_out, "draws"));
    }
    let frame = DataFrame::new(rows.len(), columns)?;
    Ok(Some(Table { frame, units }))
}
