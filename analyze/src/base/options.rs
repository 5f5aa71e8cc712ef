//! Options of an analysis.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::{Language, Speaking, speak};

/// Most machines that are drawn for a Monte Carlo study.
pub const MOST_DRAWS: u32 = 10_000;

/// Highest row rate (Hz): no sensor of a machine is faster.
pub const HIGHEST_RATE_HZ: f64 = 10_000.0;

/// Longest control period (s).
pub const LONGEST_STEP_S: f64 = 10.0;

/// How a log is analysed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Options {
    /// The estimator.
    pub estimator: Estimator,
    /// The model of the ground wrench.
    pub model: ModelKind,
    /// Row rate (Hz); if `None`, rows follow the stamps of the fastest joint stream.
    pub rate_hz: Option<f64>,
    /// Start time (seconds after the first sample).
    pub from_s: Option<f64>,
    /// End time (seconds after the first sample).
    pub to_s: Option<f64>,
    /// Source of the platform's acceleration in the closed form; if `None`, whatever the log has.
    pub closed_form_input: Option<ClosedFormInput>,
    /// Optional columns.
    pub columns: MoreColumns,
    /// Which offsets between the clocks of topics to correct.
    pub apply_clock_offsets: ApplyClockOffsets,
    /// Number of machines drawn for the Monte Carlo study of the parameters; `None` for no study.
    pub monte_carlo: Option<usize>,
    /// Whether rows of a sparse log are static; if absent, as the machine file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quasi_static: Option<QuasiStaticOption>,
}

/// Optional columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct MoreColumns {
    /// `part_<link>_<wheel>`: contribution of each link to the OTF (overturning force) of each wheel.
    pub parts: bool,
    /// `term_<1 to 11>_<wheel>` of the closed form, and speed, direction and sideslip angle of wheels and
    /// axles.
    pub terms: bool,
}

/// Source of the platform's acceleration in the closed form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ClosedFormInput {
    /// Odometry velocities and their derivatives, as in the paper.
    Velocity,
    /// The accelerometer.
    Accelerometer,
}

/// Width of the computed numbers in a table. Times are always exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Precision {
    /// 32 bits: seven digits.
    #[default]
    #[value(name = "32")]
    Single,
    /// 64 bits: every bit of the computation.
    #[value(name = "64")]
    Double,
}

/// Language of reports and findings by its tag (ISO 639).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum ReportLanguage {
    /// English.
    #[default]
    En,
    /// German.
    De,
}

impl From<ReportLanguage> for Language {
    fn from(language: ReportLanguage) -> Self {
        match language {
            ReportLanguage::En => Self::English,
            ReportLanguage::De => Self::German,
        }
    }
}

impl ReportLanguage {
    /// Chooses the language in a process with several callers, until what is returned is dropped.
    pub fn speak(self) -> Speaking {
        speak(self.into())
    }
}

/// Which rows `derived.mcap` has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum DerivedRows {
    /// All rows within 0.5 s of an event. Elsewhere, of every two seconds the rows with the smallest and the largest OTF
    /// (overturning force) of each wheel and the last row, and the rows at which the verdict or the reasons change.
    #[default]
    Events,
    /// All rows.
    Full,
}

/// A group of optional columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ColumnGroup {
    /// Contribution of each link to each wheel load.
    Parts,
    /// Terms of the closed form, and speed and direction of wheels and axles; needs `--model
    /// closed-form` or `variable-inertia`.
    Terms,
}

/// Which offsets between the clocks of topics to correct.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ApplyClockOffsets {
    /// Only those stated in the machine file.
    #[default]
    Stated,
    /// Also estimated ones that are significant (three standard deviations and 5 ms) and precise
    /// (standard deviation at most 15 ms).
    Estimated,
}

/// Whether rows without neighbours are static.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum QuasiStaticOption {
    /// In a log whose samples are too far apart for most of its time.
    Auto,
    /// In every log.
    Always,
    /// In no log: rows in gaps are invalid.
    Never,
}

/// Estimator of the states.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Default,
    Serialize,
    JsonSchema,
    clap::ValueEnum,
    strum::IntoStaticStr,
)]
#[strum(serialize_all = "kebab-case")]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Uses past and future samples; the most accurate.
    #[default]
    Smoother,
    /// Uses past samples only; bit-identical to live operation.
    Causal,
}

impl Estimator {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Model of the ground wrench.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Default,
    Serialize,
    JsonSchema,
    clap::ValueEnum,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[strum(serialize_all = "kebab-case")]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// Recursive Newton-Euler over all bodies.
    #[default]
    WholeBody,
    /// Analytic model of the second paper: platform inertia depends on the actuators.
    VariableInertia,
    /// Analytic model of the first paper: rigid platform, suspension at mid stroke.
    ClosedForm,
}

impl ModelKind {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A time.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_string())?;
    match value.is_finite() {
        true => Ok(value),
        false => Err("expected a finite number".into()),
    }
}

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_string())?;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err("expected a positive number".into())
    }
}

pub(crate) fn share(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_string())?;
    match (0.0..=1.0).contains(&value) {
        true => Ok(value),
        false => Err("expected a share, 0 to 1".into()),
    }
}
