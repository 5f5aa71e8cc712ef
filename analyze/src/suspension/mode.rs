//! Suspension motion of a replay.

use serde::Serialize;

/// Suspension motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SuspensionMode {
    /// Rods locked in the first valid row.
    Locked,
    /// As recorded.
    Recorded,
    /// The optimisation problem of the second paper, one step ahead.
    Literal,
    /// Optimisation over a planned motion.
    LookAhead,
}

/// Options of a replay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WhatIfOptions {
    /// Suspension motion.
    pub suspension: SuspensionMode,
    /// Control period (s); if `None`, that of the machine file.
    pub step_s: Option<f64>,
}
