//! "All sensors are sound" and the alternatives, for vectors that two sensors measure.

use nalgebra::{SVector, Vector3};

use super::super::explanation::Explanation;
use super::likelihood::{Evidence, Mixture, Standing, log_density_of_other};
use super::unknowns::Unknowns;

/// What a relation compares in a window.
pub(super) struct Compared {
    /// Start of the window (ns).
    pub(super) start_ns: i64,
    pub(super) measured: Vector3<f64>,
    /// Scale of each component; infinite where it is not asked for.
    pub(super) sigma: Vector3<f64>,
    /// How much the offset that is learned may have changed, and its effect on the difference.
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
    /// By what it leads before others, as a logarithm of likelihood.
    fn lead(&self) -> f64 {
        let beforehand = match self.explanation {
            Explanation::HousingHalfTurn(_) | Explanation::HousingQuarterTurn(..) => HOUSING,
            _ => 0.0,
        };
        self.evidence.sum + beforehand
    }
}

impl Hypotheses {
    /// Of these alternatives and `Other` of each component; `offset` is the standard deviation of the offset that is learned.
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

    /// What does not stand is forgotten.
    pub(super) fn forget(&mut self) {
        let alternatives = self.alternatives.iter_mut();
        alternatives.for_each(|it| it.evidence.forget());
    }

    /// The evidence of every alternative.
    pub(super) fn evidence(&self) -> impl Iterator<Item = (Explanation, f64)> {
        let alternatives = self.alternatives.iter();
        alternatives.map(|it| (it.explanation, it.evidence.value))
    }

    /// Whether an alternative of this probability beforehand is the more likely one by now.
    pub(super) fn is_disputed(&self, beforehand: f64) -> bool {
        let mut alternatives = self.alternatives.iter();
        alternatives.any(|it| it.evidence.disputes(beforehand))
    }

    /// What the windows say against an alternative.
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

/// Log density of each component of a residual, 0 where it is not asked for, and what it teaches of the offsets.
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
