//! What is asked of an analysis.

use schemars::JsonSchema;
use serde::Serialize;

/// Options of the analysis of a log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
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
    /// Where the closed form takes the platform's acceleration from; what the log has where `None`.
    pub closed_form_input: Option<ClosedFormInput>,
    /// Columns beyond the usual ones.
    pub columns: MoreColumns,
    /// Which offsets between the topics' clocks are taken out.
    pub apply_clock_offsets: ApplyClockOffsets,
    /// How many machines the study of parametric uncertainty draws; none where `None`.
    pub monte_carlo: Option<usize>,
}

/// Columns that are written on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct MoreColumns {
    /// `part_<link>_<wheel>`: what each link contributes to each wheel's OTF.
    pub parts: bool,
    /// `term_<1 to 11>_<wheel>` of the closed form, and speed, direction and sideslip angle of wheels and
    /// axles.
    pub terms: bool,
}

/// Where the closed form takes the platform's acceleration from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ClosedFormInput {
    /// From the odometry's velocities and their derivatives, as the paper does.
    Velocity,
    /// From the accelerometer.
    Accelerometer,
}

/// A group of columns that is written on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ColumnGroup {
    /// What each link contributes to each wheel's load.
    Parts,
    /// Terms of the closed form, and how wheels and axles travel; with `--model closed-form` or
    /// `variable-inertia`.
    Terms,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            estimator: Estimator::Smoother,
            model: Model::WholeBody,
            rate_hz: None,
            from_s: None,
            to_s: None,
            closed_form_input: None,
            columns: MoreColumns::default(),
            apply_clock_offsets: ApplyClockOffsets::Stated,
            monte_carlo: None,
        }
    }
}

/// Which offsets between the topics' clocks are taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ApplyClockOffsets {
    /// Those that the machine file states, no others.
    Stated,
    /// Beside them those found from the physics that are real (three standard deviations, 5 ms) and well
    /// known (standard deviation 15 ms or less).
    Estimated,
}

/// How signals become states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Looks both ways: the most accurate.
    Smoother,
    /// Looks back only: what live use computes, to the bit.
    Causal,
}

/// How the ground wrench is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Newton-Euler over every body.
    WholeBody,
    /// The second paper's analytic model: the platform's inertia follows its actuators.
    VariableInertia,
    /// The first paper's analytic model: a rigid platform, its suspension at mid stroke.
    ClosedForm,
}

impl Model {
    /// All models.
    pub const ALL: [Self; 3] = [Self::WholeBody, Self::VariableInertia, Self::ClosedForm];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::WholeBody => "whole-body",
            Self::VariableInertia => "variable-inertia",
            Self::ClosedForm => "closed-form",
        }
    }
}
