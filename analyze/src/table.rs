//! The list of columns of `samples.parquet` and `events.parquet`: names, units, values.

use polars::prelude::{Column, DataFrame, IntoColumn, ListStringChunkedBuilder, NamedFrom, Series};
use polars::prelude::{ListBuilderTrait, PlSmallStr, PolarsResult};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Machine;

use crate::analysis::{Analysis, Rows};
use crate::events::Event;

/// A table with the unit of every column; no unit: a time, a truth value or a text.
#[derive(Debug, Clone)]
pub struct Table {
    /// The columns.
    pub frame: DataFrame,
    /// Column name to unit, in the order of the columns.
    pub units: Vec<(String, &'static str)>,
}

/// Name and unit of the column of a quantity; `None` where it is no column.
#[must_use]
pub fn name_and_unit(machine: &Machine, quantity: Quantity) -> Option<(String, &'static str)> {
    let wheel = |w: usize| machine.wheels()[w].name.to_lowercase();
    let edge = |e: usize| machine.polygon().edges()[e].name.clone();
    Some(match quantity {
        Quantity::Load(w) => (format!("load_{}", wheel(w)), "N"),
        Quantity::Otf(w) => (format!("otf_{}", wheel(w)), "N"),
        Quantity::LoadLeast(w) => (format!("load_{}_min", wheel(w)), "N"),
        Quantity::LoadLargest(w) => (format!("load_{}_max", wheel(w)), "N"),
        Quantity::ItomFull(e) => (format!("itom_full_{}", edge(e)), "N m"),
        Quantity::NormalForce => ("normal_force".into(), "N"),
        Quantity::ZmpX => ("zmp_x".into(), "m"),
        Quantity::ZmpY => ("zmp_y".into(), "m"),
        Quantity::ZmpMargin => ("zmp_margin".into(), "m"),
        Quantity::LinkageClosure => return None,
    })
}

/// One row for each sample.
///
/// # Errors
/// The columns do not fit together.
pub fn samples(analysis: &Analysis) -> PolarsResult<Table> {
    let rows = &analysis.rows;
    let mut columns = vec![
        Series::new("time_ns".into(), rows.times_ns.as_slice()).into_column(),
        Series::new(
            "valid".into(),
            rows.reasons
                .iter()
                .map(|r| r.is_empty())
                .collect::<Vec<_>>(),
        )
        .into_column(),
        reasons(rows),
    ];
    let mut units = vec![("time_ns".to_string(), "ns")];
    for (&quantity, values) in rows.outcomes.quantities.iter().zip(&rows.outcomes.columns) {
        if let Some((name, unit)) = name_and_unit(&analysis.machine, quantity) {
            columns.push(known(&name, values));
            units.push((name, unit));
        }
    }
    Ok(Table {
        frame: DataFrame::new(rows.len(), columns)?,
        units,
    })
}

/// A column in which what is not finite is null.
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
    let mut builder = ListStringChunkedBuilder::new("reasons".into(), rows.len(), 0);
    for reasons in &rows.reasons {
        builder.append_values_iter(reasons.iter().map(tipwatch_mechanics::signal::Reason::name));
    }
    builder.finish().into_column()
}

fn column<T>(name: &str, values: impl Iterator<Item = T>) -> Column
where
    Series: NamedFrom<Vec<T>, [T]>,
{
    Series::new(name.into(), values.collect::<Vec<T>>()).into_column()
}

/// One row for each event.
///
/// # Errors
/// The columns do not fit together.
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
        ],
    )?;
    let units = [
        ("start_ns", "ns"),
        ("end_ns", "ns"),
        ("worst", "column unit"),
        ("worst_ns", "ns"),
        ("lead_s", "s"),
        ("certainty", "-"),
    ];
    Ok(Table {
        frame,
        units: units.map(|(name, unit)| (name.to_string(), unit)).to_vec(),
    })
}
