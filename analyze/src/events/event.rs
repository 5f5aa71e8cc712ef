//! Events: kind, time, severity, evidence.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::machine::Policy;

/// A finding with a duration.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Its kind.
    pub kind: EventKind,
    /// First row (ns).
    pub start_ns: i64,
    /// Last row (ns); `None` if the event is still active when the log ends.
    pub end_ns: Option<i64>,
    /// The wheel, edge or signal, in lower case.
    pub subject: String,
    /// The worst value; [`EventKind`] defines the quantity.
    pub worst: f64,
    /// Time of the worst value (ns).
    pub worst_ns: i64,
    /// Unit of `worst`.
    pub unit: &'static str,
    /// Time (s) from the onset of the `wheel_light` that preceded this event; `None` without one.
    pub lead_s: Option<f64>,
    /// Confidence, 0 to 1: probability that the finding is true, from the standard deviation of the OTF
    /// (overturning force) under the stated split rule; `None` without uncertainties.
    pub certainty: Option<f64>,
    /// Whether the finding would disappear under another statically admissible load split.
    pub split_dependent: Option<bool>,
    /// Causes of the load loss; `None` for events without a load and models without causes.
    pub causes: Option<EventCauses>,
    /// The input fault; `None` for other kinds of events.
    pub fault: Option<InputFault>,
}

/// An input fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputFault {
    /// Kind of fault.
    pub kind: FaultKind,
    /// What happens to rows that depend on it.
    pub policy: Policy,
    /// The limit that the worst value exceeded, in its unit; `None` for faults without a limit.
    pub limit: Option<f64>,
    /// Number of samples.
    pub samples: u64,
}

/// Causes of the load loss (OTF) of an event's wheels since the machine was last steady.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EventCauses {
    /// Start of the comparison (ns).
    pub since_ns: i64,
    /// Whether the machine was steady then; otherwise the start is the first valid row.
    pub since_is_steady: bool,
    /// End of the comparison: the row with the smallest load (ns).
    pub at_ns: i64,
    /// OTF of the wheels at the start (N).
    pub otf_before_n: f64,
    /// OTF of the wheels at the end (N).
    pub otf_n: f64,
    /// Shares of the causes, the largest first.
    pub shares: Vec<CauseShare>,
}

/// Share of one cause.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CauseShare {
    /// Name of the cause, as in the column names.
    pub cause: &'static str,
    /// OTF that it removed (N); negative if it added load.
    pub taken_n: f64,
    /// The same as a percentage of the total loss.
    pub percent: f64,
}

/// Kinds of events.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    clap::ValueEnum,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[value(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum EventKind {
    /// A wheel's load is below the limit; `worst` is the lowest load (N).
    WheelLight,
    /// A wheel carries no load; `worst` is the lowest OTF (N).
    WheelLift,
    /// All wheels off an edge carry no load; `worst` is the largest overturning moment (N m).
    EdgeTipping,
    /// Edge tipping during which the tilt grows by more than 10 degrees, or which lasts until the log
    /// ends; `worst` is the growth of the tilt (rad).
    TipOver,
    /// A signal is missing for longer than the estimator bridges; `worst` is the duration (s).
    InputGap,
    /// A signal is implausible; the kind of fault defines `worst`. Unlike the others it is listed
    /// however short it is.
    InputFault,
}

impl EventKind {
    /// All kinds.
    #[must_use]
    pub fn all() -> &'static [Self] {
        <Self as strum::VariantArray>::VARIANTS
    }

    /// Whether it concerns the machine's stability, not the log.
    #[must_use]
    pub fn is_stability(self) -> bool {
        match self {
            Self::WheelLight | Self::WheelLift | Self::EdgeTipping | Self::TipOver => true,
            Self::InputGap | Self::InputFault => false,
        }
    }

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}
