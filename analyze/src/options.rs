//! What is asked of an analysis.

use serde::Serialize;

/// Options of the analysis of a log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Options {
    /// The estimator.
    pub estimator: Estimator,
    /// The model of the ground wrench.
    pub model: Model,
    /// Rate of the rows (Hz); at the stamps of the fastest joint stream where `None`.
    pub rate_hz: Option<f64>,
    /// From when on rows are kept (s from the first sample).
    pub from_s: Option<f64>,
    /// Until when (s from the first sample).
    pub to_s: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            estimator: Estimator::Smoother,
            model: Model::WholeBody,
            rate_hz: None,
            from_s: None,
            to_s: None,
        }
    }
}

/// How signals become states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Looks both ways: the most accurate.
    Smoother,
    /// Looks back only: what live use computes, to the bit.
    Causal,
}

/// How the ground wrench is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Newton-Euler over every body.
    WholeBody,
}
