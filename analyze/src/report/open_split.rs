//! The wheels that another split of the load could have unloaded.

use crate::analysis::Analysis;

/// A wheel that stayed above its limit under the stated split, but not under every split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OpenWheel {
    /// Its index.
    pub(super) wheel: usize,
    /// Time at which the wheel carried least under the stated split while another split could have unloaded it (ns).
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
    let wheels = analysis.digest.wheels.iter().enumerate();
    let open = wheels.filter_map(|(wheel, found)| Some((wheel, found.open?)));
    open.map(|(wheel, open)| OpenWheel {
        wheel,
        time_ns: analysis.rows.times_ns[open.row],
        load_n: open.load_n,
        least_n: open.least_n,
        largest_n: open.largest_n,
    })
    .collect()
}

/// Whether the range of every wheel's load is known in every valid row.
pub(super) fn is_known(analysis: &Analysis) -> bool {
    let mut wheels = analysis.digest.wheels.iter();
    wheels.all(|wheel| wheel.is_range_known)
}
