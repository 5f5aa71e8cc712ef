//! Counterfactuals: whether the wheels of an event would have lifted under other conditions.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::say;
use tipwatch_mechanics::number::BEYOND_SURE;

use crate::base::number::{probability, readable, with_sure_band};

tipwatch_mechanics::named! {
    /// What is supposed instead of what was recorded.
    #[derive(PartialOrd, Ord, JsonSchema)]
    #[schemars(rename_all = "snake_case")]
    pub enum Supposition {
        /// The ground has no slope; all motion relative to the ground is as recorded, the rocking of the platform included.
        /// On ground that cannot be told from level ground (two standard deviations) this is what was recorded, with the error
        /// of the slope.
        LevelGround,
        /// Machine and arm travel the same path at half the speed.
        HalfSpeed,
        /// The arm carries no payload, and nothing pushes on the tool.
        WithoutLoad,
        /// The arm rests in the steadiest posture that the machine had around the event, or in the stated reference posture if
        /// that is steadier.
        ArmIn,
    }
}

tipwatch_mechanics::named! {
    /// Whether the event would have happened.
    #[derive(Default, JsonSchema)]
    #[schemars(rename_all = "snake_case")]
    pub enum Answer {
        /// Yes, by two standard deviations.
        Yes,
        /// No, by two standard deviations.
        No,
        /// The probability is between, or cannot be computed.
        #[default]
        Open,
    }
}

/// How near what an event is about, a wheel or the wheels off an edge, comes to lifting in the rows around it, and whether it
/// would have.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Reply {
    /// Whether the wheels would have lifted.
    pub answer: Answer,
    /// Probability that they would have, under the stated split rule; null where it cannot be computed.
    pub probability: Option<f64>,
    /// Smallest OTF of the event's wheels as recorded, weighted by their distance for an edge (N).
    pub recorded_otf_n: Option<f64>,
    /// Its standard deviation (N); null where it cannot be computed.
    pub recorded_sigma_n: Option<f64>,
    /// Probability of the event as recorded by the same evaluation: what differs from it is the effect of the supposition.
    pub recorded_probability: Option<f64>,
    /// The smallest OTF under the supposition (N); null where it cannot be computed.
    pub otf_n: Option<f64>,
    /// Its standard deviation (N).
    pub sigma_n: Option<f64>,
    /// Start of the rows that were evaluated (ns).
    pub from_ns: i64,
    /// Their end (ns). From where the platform tips on it keeps its motion from before, and the joints move as recorded.
    pub to_ns: i64,
    /// Why it cannot be computed.
    pub why_not: Option<&'static str>,
}

/// The answer to one supposition, by evaluating the rows of the event again.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Counterfactual {
    /// What is supposed.
    pub supposed: Supposition,
    /// When the machine had the posture that is supposed (ns); null for the reference posture and other suppositions.
    pub posture_ns: Option<i64>,
    /// Whether the base rests in the event: what changes its speed is then the arm alone.
    #[serde(skip)]
    #[schemars(skip)]
    pub base_rests: bool,
    /// The answer.
    #[serde(flatten)]
    pub reply: Reply,
}

impl Reply {
    /// Describes the answer with its probability and the margin it rests on; `None` if it is open for want of a probability.
    pub(crate) fn in_words(&self) -> Option<String> {
        let chance = probability(self.probability?);
        let otf = otf_in_words(self.otf_n, self.sigma_n)?;
        Some(format!(
            "{}, {chance} ({otf})",
            readable(self.answer.name())
        ))
    }

    /// Describes the probability as recorded, by the same evaluation, and the margin it rests on.
    pub(crate) fn recorded_in_words(&self) -> Option<String> {
        let chance = probability(self.recorded_probability?);
        let otf = otf_in_words(self.recorded_otf_n, self.recorded_sigma_n)?;
        Some(format!("{chance} ({otf})"))
    }
}

fn otf_in_words(otf_n: Option<f64>, sigma_n: Option<f64>) -> Option<String> {
    let otf = with_sure_band(otf_n?, sigma_n?);
    Some(say!("minimum OTF {otf} N"))
}

impl Answer {
    /// Returns the answer by the probability that the event would have happened.
    #[must_use]
    pub fn of(probability: Option<f64>) -> Self {
        match probability {
            Some(p) if p >= 1.0 - BEYOND_SURE => Self::Yes,
            Some(p) if p <= BEYOND_SURE => Self::No,
            _ => Self::Open,
        }
    }
}
