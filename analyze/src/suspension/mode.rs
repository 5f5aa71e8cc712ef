//! How the suspension of a replay moves.

use serde::Serialize;

/// How the suspension moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SuspensionMode {
    /// The rods stay where they are in the first valid row.
    Locked,
    /// As the log has it.
    Recorded,
    /// The second paper's problem, one step ahead.
    Literal,
    /// Where a planned move leads.
    LookAhead,
}

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WhatIfOptions {
    /// How the suspension moves.
    pub suspension: SuspensionMode,
    /// Length of a step of the control (s); by the machine file where `None`.
    pub step_s: Option<f64>,
}
