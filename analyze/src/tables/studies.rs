//! Columns of the tables that not every analysis has: sensitivities and the Monte Carlo study.

use tipwatch_mechanics::ColumnNames;

use super::samples::add_times;
use super::table::Table;
use crate::analysis::Analysis;
use crate::analysis::sensitivity::SensitivityRow;
use crate::base::options::Precision;

/// The table of sensitivities, one line per wheel and parameter; `None` if the model has no derivatives.
#[must_use]
pub fn sensitivity(analysis: &Analysis) -> Option<Table> {
    let found = analysis.sensitivity.as_ref()?;
    let machine = &analysis.machine;
    let finite = |value: f64| Some(value).filter(|v| v.is_finite());
    let wheel = |w: usize| machine.wheels()[w].name.to_lowercase();
    let kind = |row: &SensitivityRow| match row.parameter.is_signal() {
        true => "signal",
        false => "parameter",
    };
    let all = || found.rows.iter();
    let mut table = Table::default();
    table.add("parameter", None, all().map(|r| r.parameter.name(machine)));
    table.add("kind", None, all().map(kind));
    table.add("unit", None, all().map(|r| r.parameter.unit(machine)));
    table.add("nominal", Some("column unit"), all().map(|r| r.nominal));
    table.add("sigma", Some("column unit"), all().map(|r| r.sigma));
    table.add("wheel", None, all().map(|r| wheel(r.wheel)));
    let is_worst = all().map(|r| r.wheel == found.worst_wheel);
    table.add("is_worst_wheel", None, is_worst);
    table.add("worst_ns", Some("ns"), all().map(|r| r.worst_ns));
    table.add("worst_otf", Some("N"), all().map(|r| r.worst_otf_n));
    let per_unit = Some("N / column unit");
    table.add("derivative", per_unit, all().map(|r| finite(r.derivative)));
    table.add("derivative_rms", per_unit, all().map(|r| finite(r.rms)));
    let to_zero = all().map(|r| r.change_to_zero);
    table.add("change_to_zero", Some("column unit"), to_zero);
    let share = all().map(|r| finite(r.variance_share));
    table.add("variance_share", Some("-"), share);
    Some(table)
}

/// The bands of the Monte Carlo study, one line per row: 2.5 % of the draws are below `_low` and above
/// `_high`; `None` without a study.
#[must_use]
pub fn monte_carlo(analysis: &Analysis, precision: Precision) -> Option<Table> {
    let study = analysis.monte_carlo.as_ref()?;
    let mut table = Table::default();
    add_times(&mut table, &analysis.rows.times_ns);
    let names = ColumnNames::of(&analysis.machine);
    for band in &study.bands {
        let (name, unit) = (band.quantity.column(&names), band.quantity.kind().unit);
        for (part, values) in [
            ("low", &band.low),
            ("high", &band.high),
            ("sigma", &band.sigma),
        ] {
            table.add_known(format!("{name}_{part}"), unit, precision, values);
        }
        let left_out = band.left_out.iter().copied();
        table.add(format!("{name}_left_out"), Some("draws"), left_out);
    }
    Some(table)
}
