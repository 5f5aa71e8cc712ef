//! The explanations of a rotation about an edge, with their evidence.

use schemars::JsonSchema;
use serde::Serialize;

use crate::events::LEAST_OF_A_FACT;

/// An explanation that is less than so many times as probable as the machine as stated does not count against it: its evidence
/// is "not worth more than a bare mention" (Kass and Raftery 1995).
const BARELY_MORE: f64 = 3.0;

/// What explains a rotation about an edge.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ExplainedFall {
    /// The edge.
    pub edge: String,
    /// When the rotation about it began (ns).
    pub onset_ns: i64,
    /// The last row that was used (ns).
    pub until_ns: i64,
    /// Rotation about the edge at that row (rad).
    pub rotation_rad: f64,
    /// Rows of the onset and of the fall that were used.
    pub rows: usize,
    /// Rows before the lift, in which the platform leans on its tyres, that were used.
    pub lean_rows: usize,
    /// The explanations that were tried, the most probable first; the probabilities add up to 1.
    pub explanations: Vec<Explanation>,
    /// The unstated mass on the tool; null without an arm.
    pub load: Option<LoadEstimates>,
    /// Why nothing could be estimated; null if it was.
    pub not_estimated: Option<String>,
}

impl ExplainedFall {
    /// Whether the machine as stated explains the rotation, as far as anything does.
    #[must_use]
    pub fn is_as_stated(&self) -> bool {
        self.told().is_none_or(|told| told.kind == "stated_machine")
    }

    /// Whether a load or a force outwards on the tool explains the rotation, that the machine file does not state.
    pub(crate) fn has_unstated_load(&self) -> bool {
        let is_load = |told: &Explanation| matches!(told.kind, "load_on_tool" | "force_on_tool");
        let loaded = self.told().filter(|told| is_load(told));
        loaded.is_some_and(|told| told.amounts.first().is_some_and(|it| it.value > 0.0))
    }

    /// The machine as stated among the explanations.
    pub(crate) fn stated(&self) -> Option<&Explanation> {
        let mut all = self.explanations.iter();
        all.find(|it| it.kind == "stated_machine")
    }

    /// The explanation that the rotation is told with: the machine as stated, unless another one is a fact or clearly more
    /// probable.
    #[must_use]
    pub fn told(&self) -> Option<&Explanation> {
        let best = self.explanations.first()?;
        let stated = self.stated();
        let is_close = |stated: &&Explanation| {
            best.probability < LEAST_OF_A_FACT
                && best.probability < BARELY_MORE * stated.probability
        };
        Some(stated.filter(is_close).unwrap_or(best))
    }
}

/// An explanation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Explanation {
    /// Its kind: `stated_machine`, `load_on_tool`, `force_on_tool`, `centre_of_mass`, `mass`, `imu_rotation`,
    /// `encoder_offset`, `encoder_stopped`, `encoder_sign`, `imu_sign`, `wheel_radius` or `none_of_these`.
    pub kind: &'static str,
    /// The link, joint, wheel or axis; null where the kind says it.
    pub subject: Option<String>,
    /// Probability among the explanations that were tried, every kind equally probable beforehand.
    pub probability: f64,
    /// Natural logarithm of the marginal likelihood, relative to that of the stated machine.
    pub log_evidence: f64,
    /// What it takes, as fitted.
    pub amounts: Vec<EstimatedAmount>,
}

/// An estimated amount.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EstimatedAmount {
    /// What it is an amount of, for example `mass` or `x`.
    pub name: &'static str,
    /// The amount, in `unit`.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Unit: "kg", "N", "m" or "rad".
    pub unit: &'static str,
}

/// The mass on the tool beyond the stated one, estimated in three ways.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LoadEstimates {
    /// The link that carries it.
    pub link: String,
    /// From the lean of the platform on its tyres before the lift, against their stiffness; null where `no_lean` says why.
    pub by_lean: Option<MassEstimate>,
    /// From the moment about the edge at the onset, where it is zero.
    pub by_onset: Option<MassEstimate>,
    /// From the moment about the edge during the rotation; null where that was too short.
    pub by_fall: Option<MassEstimate>,
    /// From all of them; null if they contradict each other.
    pub combined: Option<MassEstimate>,
    /// Whether they agree; null for a single estimate.
    pub agreement: Option<Agreement>,
    /// Why the lean gives no estimate.
    pub no_lean: Option<String>,
}

/// An estimated mass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct MassEstimate {
    /// Mass beyond the stated one (kg); negative where there was less.
    pub mass_kg: f64,
    /// Standard deviation (kg).
    pub sigma_kg: f64,
}

impl MassEstimate {
    /// Two standard deviations below and above (kg).
    #[must_use]
    pub fn band_kg(&self) -> [f64; 2] {
        [-2.0, 2.0].map(|sigmas| self.mass_kg + sigmas * self.sigma_kg)
    }
}

/// Whether estimates agree, by their joint covariance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Agreement {
    /// Sum of squared deviations from their common value, by their covariance.
    pub chi_square: f64,
    /// Number of estimates less one.
    pub degrees: usize,
    /// Probability of a larger sum if all of them are right.
    pub probability: f64,
}

#[cfg(test)]
impl ExplainedFall {
    /// A fall whose explanations, each about the joint "tilt", have these probabilities.
    pub(crate) fn by(explanations: &[(&'static str, f64)]) -> Self {
        let explanation = |&(kind, probability): &(&'static str, f64)| Explanation {
            kind,
            subject: Some("tilt".into()),
            probability,
            log_evidence: 0.0,
            amounts: Vec::new(),
        };
        Self {
            edge: "left".into(),
            onset_ns: 0,
            until_ns: 0,
            rotation_rad: 0.0,
            rows: 0,
            lean_rows: 0,
            explanations: explanations.iter().map(explanation).collect(),
            load: None,
            not_estimated: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the kind of the explanation that is reported for a fall whose explanations have these probabilities.
    fn told(explanations: &[(&'static str, f64)]) -> Option<&'static str> {
        ExplainedFall::by(explanations).told().map(|it| it.kind)
    }

    #[test]
    fn explanations_as_probable_as_the_stated_machine_do_not_count_against_it() {
        let close = [("imu_rotation", 0.21), ("stated_machine", 0.17)];
        assert_eq!(told(&close), Some("stated_machine"));
        let clear = [("load_on_tool", 0.4), ("stated_machine", 0.1)];
        assert_eq!(told(&clear), Some("load_on_tool"));
        let fact = [("load_on_tool", 0.6), ("stated_machine", 0.4)];
        assert_eq!(told(&fact), Some("load_on_tool"));
        assert_eq!(told(&[]), None);
    }
}
