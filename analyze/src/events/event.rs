//! Events: what was found, when, how bad.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::machine::Policy;
use tipwatch_mechanics::plausibility::FaultKind;

/// A finding that lasted a while.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// What kind.
    pub kind: EventKind,
    /// First row of it (ns).
    pub start_ns: i64,
    /// Last row of it (ns); `None` while the log ends in it.
    pub end_ns: Option<i64>,
    /// The wheel, edge or signal, in lower case.
    pub subject: String,
    /// The worst value; what of is told by the kind.
    pub worst: f64,
    /// When it was worst (ns).
    pub worst_ns: i64,
    /// Unit of `worst`.
    pub unit: &'static str,
    /// Time from the first `wheel_light` of the same course of events to this (s); `None` without one.
    pub lead_s: Option<f64>,
    /// Probability that the finding is true, 0 to 1, from the standard deviation of the OTF under the
    /// stated split; `None` where the uncertainty is not computed.
    pub certainty: Option<f64>,
    /// Whether another split of the loads, within equilibrium, would undo the finding.
    pub split_dependent: Option<bool>,
    /// What took the load away; `None` of events without a load, and of a model without causes.
    pub causes: Option<EventCauses>,
    /// What is wrong with the input; `None` of events of other kinds.
    pub fault: Option<InputFault>,
}

/// What is wrong with an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputFault {
    /// What is wrong.
    pub kind: FaultKind,
    /// What becomes of the rows that rest on it.
    pub policy: Policy,
    /// What the worst value was held against, in its unit; `None` where nothing was.
    pub limit: Option<f64>,
    /// How many samples.
    pub samples: u64,
}

/// What took the load (OTF) of the wheels that an event is about away since the machine was steady.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EventCauses {
    /// From when on (ns).
    pub since_ns: i64,
    /// Whether the machine was steady then; else it is the first valid row.
    pub since_is_steady: bool,
    /// Until when: the row in which the wheels carry least (ns).
    pub at_ns: i64,
    /// OTF of the wheels before (N).
    pub otf_before_n: f64,
    /// OTF of the wheels at that row (N).
    pub otf_n: f64,
    /// What each cause took, the largest first.
    pub shares: Vec<CauseShare>,
}

/// What a cause took.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CauseShare {
    /// Name of the cause, as in the columns.
    pub cause: &'static str,
    /// OTF that it took away (N); negative where it gave.
    pub taken_n: f64,
    /// The same in per cent of what was lost in all.
    pub percent: f64,
}

/// Kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum EventKind {
    /// A wheel's load is below the limit; `worst` is the lowest load (N).
    WheelLight,
    /// A wheel carries nothing; `worst` is the lowest OTF (N).
    WheelLift,
    /// Every wheel off an edge carries nothing; `worst` is the largest overturning moment (N m).
    EdgeTipping,
    /// An edge tipping that ends with the tilt grown by more than 10 degrees, or with the log; `worst` is
    /// the growth of the tilt (rad).
    TipOver,
    /// A signal is missing for longer than the estimator bridges; `worst` is how long (s).
    InputGap,
    /// What a signal says cannot be true; `worst` is told by the kind of the fault. Unlike the others
    /// it is listed however short it is.
    InputFault,
}

impl EventKind {
    /// All kinds.
    #[must_use]
    pub fn all() -> &'static [Self] {
        <Self as clap::ValueEnum>::value_variants()
    }

    /// Whether it tells of the machine's stability rather than of the log.
    #[must_use]
    pub fn is_stability(self) -> bool {
        match self {
            Self::WheelLight | Self::WheelLift | Self::EdgeTipping | Self::TipOver => true,
            Self::InputGap | Self::InputFault => false,
        }
    }

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::WheelLight => "wheel_light",
            Self::WheelLift => "wheel_lift",
            Self::EdgeTipping => "edge_tipping",
            Self::TipOver => "tip_over",
            Self::InputGap => "input_gap",
            Self::InputFault => "input_fault",
        }
    }
}
