//! The result of a prediction.

use super::gap::PredictionGap;
use super::law::Law;
use crate::explain::attribution::Contribution;

/// Prediction by one assumed motion, up to the horizon.
#[derive(Debug, Clone, PartialEq)]
pub struct Ahead {
    /// Reason for which nothing is predicted; the numbers are NaN then, and there is no wheel and no cause. `None` for a
    /// prediction.
    pub gap: Option<PredictionGap>,
    /// The wheel that lifts first; if none does, the one that comes closest to lifting.
    pub wheel: Option<usize>,
    /// Time until that wheel lifts (s), by the computed OTF; zero if it has lifted; NaN if none lifts.
    pub lift_off_s: f64,
    /// The earliest time at which a wheel may lift (s): where its OTF less two standard deviations is zero; NaN beyond the
    /// horizon. It can be known where `lift_off_s` is not: then lift-off is possible within the uncertainty.
    pub earliest_s: f64,
    /// The time by which the wheel has lifted (s): where its OTF plus two standard deviations is zero; NaN beyond the
    /// horizon.
    pub latest_s: f64,
    /// Greatest utilisation at the first instant with a lifted wheel; if there is none, at that with the smallest OTF as a
    /// fraction of the static load.
    pub utilisation: f64,
    /// Contribution that takes most load off the wheel until that instant; `None` if none does.
    pub cause: Option<Contribution>,
    /// Smallest OTF within the horizon, by wheel (N).
    pub otf_least: Vec<f64>,
}

impl Ahead {
    pub(super) fn unknown(wheels: usize) -> Self {
        Self {
            gap: Some(PredictionGap::RowInvalid),
            wheel: None,
            lift_off_s: f64::NAN,
            earliest_s: f64::NAN,
            latest_s: f64::NAN,
            utilisation: f64::NAN,
            cause: None,
            otf_least: vec![f64::NAN; wheels],
        }
    }

    /// Forgets everything but the reason.
    pub(super) fn set_gap(&mut self, gap: PredictionGap) {
        self.gap = Some(gap);
        self.wheel = None;
        self.cause = None;
        for number in [
            &mut self.lift_off_s,
            &mut self.earliest_s,
            &mut self.latest_s,
            &mut self.utilisation,
        ] {
            *number = f64::NAN;
        }
        self.otf_least.fill(f64::NAN);
    }

    /// Whether a wheel lifts within the horizon.
    #[must_use]
    pub fn lifts(&self) -> bool {
        self.lift_off_s.is_finite()
    }
}

/// Predictions by every assumed motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Prediction by each [`Law`], in their order.
    pub ahead: [Ahead; Law::ALL.len()],
    /// Age of the prediction (s): time from the row for which it was made to the row that it is given for; zero in the former.
    /// Its times count from the former row. NaN if nothing is known.
    pub age_s: f64,
}

impl Prediction {
    /// Nothing is predicted: the row is not valid.
    #[must_use]
    pub fn unknown(wheels: usize) -> Self {
        Self {
            ahead: std::array::from_fn(|_| Ahead::unknown(wheels)),
            age_s: f64::NAN,
        }
    }

    /// Returns the prediction by this motion.
    #[must_use]
    pub fn of(&self, law: Law) -> &Ahead {
        &self.ahead[law as usize]
    }

    /// Forgets everything but the reason. Does not allocate.
    pub fn set_gap(&mut self, gap: PredictionGap) {
        for ahead in &mut self.ahead {
            ahead.set_gap(gap);
        }
        self.age_s = f64::NAN;
    }
}
