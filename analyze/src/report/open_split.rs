//! The wheels that another split of the load could have unloaded.

use tipwatch_mechanics::Quantity;

use crate::analysis::Analysis;
use crate::events::split_rule::is_open;

/// A wheel that stayed above its limit under the stated split, but not under every split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OpenWheel {
    /// Its index.
    pub(super) wheel: usize,
    /// When it carried least under the stated split while another split could have unloaded it (ns).
    pub(super) time_ns: i64,
    /// Its load under the stated split (N).
    pub(super) load_n: f64,
    /// The smallest load that equilibrium allows (N).
    pub(super) least_n: f64,
    /// The largest load that equilibrium allows (N).
    pub(super) largest_n: f64,
}

/// The wheels whose smallest load in equilibrium is below the limit, or zero without one, in a valid row.
pub(super) fn wheels(analysis: &Analysis) -> Vec<OpenWheel> {
    let (rows, limits) = (&analysis.rows, analysis.min_loads_n.as_deref());
    let of_wheel = |wheel: usize| {
        let at = |quantity, row: usize| rows.outcomes.column(quantity)[row];
        let limit_n = limits.map_or(0.0, |limits| limits[wheel]);
        let unloaded = |row: usize| {
            let least_n = at(Quantity::LoadLeast(wheel), row);
            least_n < limit_n || least_n <= 0.0
        };
        let open = (0..rows.len())
            .filter(|&row| rows.is_valid(row) && is_open(rows, wheel, row) && unloaded(row));
        let load_n = |row: usize| at(Quantity::Load(wheel), row);
        let row = open.min_by(|&a, &b| load_n(a).total_cmp(&load_n(b)))?;
        Some(OpenWheel {
            wheel,
            time_ns: rows.times_ns[row],
            load_n: load_n(row),
            least_n: at(Quantity::LoadLeast(wheel), row),
            largest_n: at(Quantity::LoadLargest(wheel), row),
        })
    };
    (0..analysis.machine.wheels().len())
        .filter_map(of_wheel)
        .collect()
}

/// Whether the range of every wheel's load is known in every valid row.
pub(super) fn is_known(analysis: &Analysis) -> bool {
    let rows = &analysis.rows;
    (0..analysis.machine.wheels().len()).all(|wheel| {
        let least = rows.outcomes.column(Quantity::LoadLeast(wheel));
        (0..rows.len()).all(|row| !rows.is_valid(row) || least[row].is_finite())
    })
}
