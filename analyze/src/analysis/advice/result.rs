//! The advice on a log: the changes that hold in the simulation, and what they were judged by.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::change::Change;

/// What would have prevented the worst event, by simulation of each single change over the whole event.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Advice {
    /// The wheel that came closest to lifting, in lower case.
    pub wheel: String,
    /// Load that it should keep (N).
    pub limit_n: f64,
    /// Its smallest OTF in a valid row of the event (N).
    pub worst_otf_n: f64,
    /// Time of that OTF (ns).
    pub worst_ns: i64,
    /// Start of the event (ns); events that overlap are one.
    pub event_start_ns: i64,
    /// End of the event (ns).
    pub event_end_ns: i64,
    /// Start of the simulated window (ns): the event and the manoeuvre around it.
    pub from_ns: i64,
    /// End of the simulated window (ns).
    pub to_ns: i64,
    /// Number of rows that were simulated.
    pub rows: usize,
    /// Rows of the window that were left out because their state is unknown.
    pub rows_left_out: usize,
    /// Rows in which the machine was tipping: the base keeps its motion from before.
    pub rows_held: usize,
    /// The changes that hold under the stated load split, the smallest effort first.
    pub changes: Vec<SimulatedChange>,
    /// The changes that were tried and do not hold.
    pub rejected: Vec<RejectedChange>,
    /// What the simulation assumes.
    pub assumptions: Vec<String>,
    /// Why nothing was simulated; null if the changes were tried.
    pub not_simulated: Option<String>,
}

/// A change that holds over the whole window.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SimulatedChange {
    /// The change.
    #[serde(skip)]
    #[schemars(skip)]
    pub of: Change,
    /// Stable name of what changes, for example `slew.position`.
    pub name: String,
    /// The change in words.
    pub statement: String,
    /// The change, in `unit`: an offset, or a relative change of a velocity, an acceleration or a force.
    pub change: f64,
    /// Unit of `change`: "rad", "m", "kg" or "-".
    pub unit: &'static str,
    /// The change as a share of `effort_of`.
    pub effort: f64,
    /// What the change is compared with.
    pub effort_of: &'static str,
    /// The change by the first derivative at the worst row, in `unit`: where the search began; null where no
    /// derivative applies.
    pub first_order: Option<f64>,
    /// Smallest OTF of the wheel in the simulation (N).
    pub least_otf_n: f64,
    /// Time of that OTF (ns).
    pub least_otf_ns: i64,
    /// Its standard deviation (N); null if unknown.
    pub otf_sigma_n: Option<f64>,
    /// Residual of the solution: smallest OTF minus limit (N).
    pub residual_n: f64,
    /// Probability that every wheel that was below its limit reaches it, under the stated split; null without
    /// uncertainties.
    pub chance: Option<f64>,
    /// Every wheel, by name in lower case.
    pub wheels: BTreeMap<String, WheelMargins>,
    /// Smallest distance of the centre of pressure (ZMP) from the nearest edge (m).
    pub zmp_margin_m: BeforeAfter,
    /// Largest overturning moment (ITOM with wheels) about any edge (N m); negative while stable.
    pub overturning_moment_nm: BeforeAfter,
    /// Whether the change holds under any load split that equilibrium allows: wheels that were below their limit reach it
    /// under each, the others come no lower than as logged.
    pub holds_under_any_split: bool,
}

/// Margins of one wheel over the window.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct WheelMargins {
    /// OTF that the wheel must keep over the whole window (N): its load limit.
    pub limit_n: f64,
    /// Smallest OTF under the stated load split (N).
    pub otf_n: BeforeAfter,
    /// Smallest load under any split that equilibrium allows (N).
    pub any_split_n: BeforeAfter,
}

/// A number as logged and with the change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct BeforeAfter {
    /// As logged.
    pub before: f64,
    /// With the change.
    pub after: f64,
}

/// A change that was tried and does not hold.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RejectedChange {
    /// Stable name of what would change.
    pub name: String,
    /// Why it is not advised.
    pub reason: String,
}
