//! "All sensors are sound" and the alternatives, for vectors that two sensors measure.

use nalgebra::{SVector, Vector3};

use super::super::explanation::Explanation;
use super::likelihood::{Evidence, Mixture, Standing, log_density_of_other};
use super::unknowns::Unknowns;

/// Measurement of a window that a relation compares with its prediction.
pub(super) struct Compared {
    /// Start of the window (ns).
    pub(super) start_ns: i64,
    pub(super) measured: Vector3<f64>,
    /// Scale of each component; infinite where it is not asked for.
    pub(super) sigma: Vector3<f64>,
    /// Standard deviation of the change of the learned offset since the window before, and the change of the difference per
    /// offset.
    pub(super) drift: f64,
    pub(super) per_offset: f64,
}

/// The hypotheses of a relation between vectors.
#[derive(Debug, Clone)]
pub(super) struct Hypotheses {
    mixture: Mixture,
    sound: [Unknowns<1>; 3],
    alternatives: Vec<Alternative>,
    threshold: f64,
}

#[derive(Debug, Clone)]
struct Alternative {
    explanation: Explanation,
    /// The component that `Other` is about. Components that agree would outweigh the one that does not.
    other: Option<usize>,
    offsets: [Unknowns<1>; 3],
    evidence: Evidence,
}

/// Log odds, beforehand, of a turned housing against a part of it that alone is turned: an attitude is computed from the
/// accelerometer and the gyro beside it, and is wrong with them. On level ground nothing else tells the two apart.
const HOUSING: f64 = 3.0;

impl Alternative {
    /// Returns the score by which alternatives that stand are compared: log likelihood ratio plus log prior odds.
    fn lead(&self) -> f64 {
        let beforehand = match self.explanation {
            Explanation::HousingHalfTurn(_) | Explanation::HousingQuarterTurn(..) => HOUSING,
            _ => 0.0,
        };
        self.evidence.sum + beforehand
    }
}

impl Hypotheses {
    /// Creates the hypotheses with these alternatives and `Other` of each component; `offset` is the standard deviation of the
    /// offset that is learned.
    pub(super) fn new(
        mixture: Mixture,
        offset: f64,
        alternatives: Vec<Explanation>,
        threshold: f64,
    ) -> Self {
        let offset = Unknowns::new(SVector::from([0.0]), SVector::from([offset]));
        let stated = alternatives.into_iter().map(|it| (it, None));
        let others = (0..3).map(|axis| (Explanation::Other, Some(axis)));
        Self {
            mixture,
            sound: [offset; 3],
            alternatives: (others.chain(stated))
                .map(|(explanation, other)| Alternative {
                    explanation,
                    other,
                    offsets: [offset; 3],
                    evidence: Evidence::default(),
                })
                .collect(),
            threshold,
        }
    }

    /// Weighs a window. `predicted` gives the vector that should have been measured if the sensors are sound (`None`), or
    /// under an alternative.
    pub(super) fn weigh(
        &mut self,
        compared: &Compared,
        predicted: impl Fn(Option<Explanation>) -> Vector3<f64>,
    ) {
        let (mixture, threshold) = (self.mixture, self.threshold);
        let before = self.sound;
        let residual = compared.measured - predicted(None);
        let densities = take(&mut self.sound, compared, &residual, mixture);
        let sound = densities.sum();
        for it in &mut self.alternatives {
            let ratio = match it.other {
                Some(axis) if compared.sigma[axis].is_finite() => {
                    let offset = before[axis].mean[0] * compared.per_offset;
                    let other = log_density_of_other(residual[axis] - offset, compared.sigma[axis]);
                    other - densities[axis]
                }
                Some(_) => continue,
                None => {
                    let residual = compared.measured - predicted(Some(it.explanation));
                    take(&mut it.offsets, compared, &residual, mixture).sum() - sound
                }
            };
            it.evidence.add(compared.start_ns, ratio, threshold);
            if it.evidence.value == 0.0 {
                it.offsets = self.sound;
            }
        }
    }

    /// Forgets the evidence of alternatives that do not stand.
    pub(super) fn forget(&mut self) {
        let alternatives = self.alternatives.iter_mut();
        alternatives.for_each(|it| it.evidence.forget());
    }

    /// Whether any alternative, with this prior probability, is now more likely than sound sensors.
    pub(super) fn is_disputed(&self, beforehand: f64) -> bool {
        let mut alternatives = self.alternatives.iter();
        alternatives.any(|it| it.evidence.disputes(beforehand))
    }

    /// Returns the evidence of sound sensors against an alternative, as a log likelihood ratio; zero for an unknown alternative.
    pub(super) fn against(&self, explanation: Explanation) -> f64 {
        let mut alternatives = self.alternatives.iter();
        let found = alternatives.find(|it| it.explanation == explanation);
        found.map_or(0.0, |it| it.evidence.against())
    }

    /// The best of the alternatives that stand, with the threshold.
    pub(super) fn standing(&self) -> Standing {
        let standing = self.alternatives.iter().filter(|it| it.evidence.stands());
        let best = standing.max_by(|a, b| a.lead().total_cmp(&b.lead()))?;
        Some((best.explanation, best.evidence, self.threshold))
    }
}

/// Returns the log density of each component of a residual, 0 where it is not asked for, and updates the offsets by the residual.
fn take(
    offsets: &mut [Unknowns<1>; 3],
    compared: &Compared,
    residual: &Vector3<f64>,
    mixture: Mixture,
) -> Vector3<f64> {
    let mut densities = Vector3::zeros();
    for (axis, offset) in offsets.iter_mut().enumerate() {
        let sigma = compared.sigma[axis];
        if sigma.is_finite() {
            offset.drift(SVector::from([compared.drift]));
            let row = SVector::from([compared.per_offset]);
            densities[axis] = offset.take(&row, residual[axis], sigma, mixture);
        }
    }
    densities
}
