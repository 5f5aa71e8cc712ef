//! Kalman filter of a velocity v and of the constant difference s between two measured accelerations.
//!
//! ```text
//!     dv/dt = a - s - w x v + noise,    ds/dt = noise
//!     z = v + noise
//! ```
//! with the measured acceleration a and angular velocity w. The model is linear in v and s.

use nalgebra::{Cholesky, Matrix3, Matrix3x6, Matrix6, Matrix6x3, Vector3, Vector6};

/// Standard deviation of an unknown velocity (m/s).
const VELOCITY_SPREAD: f64 = 10.0;
/// Standard deviation of the difference before any measurement (m/s^2): much larger than any bias.
const DIFFERENCE_SPREAD: f64 = 3.0;
/// Drift of the difference: standard deviation of its change in one second (m/s^2).
const DRIFT: f64 = 2e-4;
/// A velocity further from the predicted one than this many standard deviations counts less.
const OUTLIER_SIGMAS: f64 = 4.0;

/// Number of measured velocities between two states that a smoother keeps: a state needs ten times the memory of a measurement,
/// and the smoother repeats the filter's steps from there.
const KEPT_EVERY: usize = 256;

/// The filter, with its inputs where a smoother needs them.
#[derive(Debug, Clone)]
pub(super) struct DifferenceFilter {
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
    ahead: Prediction,
    history: Option<History>,
}

/// The measured velocities that were used, in batches that can be repeated one by one.
#[derive(Debug, Clone, Default)]
struct History {
    batches: Vec<Batch>,
    /// Whether the last velocity was refused.
    is_cut: bool,
}

/// Consecutive measured velocities, and the filter before the first.
#[derive(Debug, Clone)]
struct Batch {
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
    measured: Vec<Measured>,
}

/// A measured velocity, its variance on each axis, and the motion since the last one.
#[derive(Debug, Clone)]
struct Measured {
    velocity: Vector3<f64>,
    variance: f64,
    motion: Prediction,
}

/// The motion since the last measured velocity.
#[derive(Debug, Clone)]
struct Prediction {
    /// Transition of the velocity; the difference stays.
    transition: Matrix3x6<f64>,
    velocity: Vector3<f64>,
    velocity_variance: f64,
    difference_variance: f64,
}

/// The filter at a measured velocity.
#[derive(Debug, Clone)]
struct Stage {
    transition: Matrix6<f64>,
    predicted: Vector6<f64>,
    predicted_covariance: Matrix6<f64>,
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
}

/// Estimate of the difference (m/s^2) and its covariance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Difference {
    pub(super) value: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
}

impl Prediction {
    fn none() -> Self {
        Self {
            transition: Matrix3x6::identity(),
            velocity: Vector3::zeros(),
            velocity_variance: 0.0,
            difference_variance: 0.0,
        }
    }
}

impl DifferenceFilter {
    pub(super) fn new(keeps_history: bool) -> Self {
        let variances = [VELOCITY_SPREAD, DIFFERENCE_SPREAD].map(|spread| spread * spread);
        Self {
            state: Vector6::zeros(),
            covariance: Matrix6::from_diagonal(&Vector6::from_fn(|i, _| variances[i / 3])),
            ahead: Prediction::none(),
            history: keeps_history.then(History::default),
        }
    }

    /// Forgets the velocity, which is unknown after a gap; the difference stays.
    pub(super) fn forget_velocity(&mut self) {
        self.ahead.transition.fill(0.0);
        self.ahead.velocity = Vector3::zeros();
        self.ahead.velocity_variance = VELOCITY_SPREAD * VELOCITY_SPREAD;
    }

    /// Carries the state over `dt` seconds: `acceleration` a (m/s^2) with white noise of density `density`
    /// (m^2/s^3), `turning` w (rad/s).
    pub(super) fn advance(
        &mut self,
        dt: f64,
        acceleration: &Vector3<f64>,
        turning: &Vector3<f64>,
        density: f64,
    ) {
        // exp(-[w] dt) to second order
        let turned = -turning.cross_matrix() * dt;
        let turn = Matrix3::identity() + turned + turned * turned * 0.5;
        let ahead = &mut self.ahead;
        for column in [0, 3] {
            let block = turn * ahead.transition.fixed_view::<3, 3>(0, column);
            ahead
                .transition
                .fixed_view_mut::<3, 3>(0, column)
                .copy_from(&block);
        }
        for axis in 0..3 {
            ahead.transition[(axis, axis + 3)] -= dt;
        }
        ahead.velocity = turn * ahead.velocity + acceleration * dt;
        ahead.velocity_variance += density * dt;
        ahead.difference_variance += DRIFT * DRIFT * dt;
    }

    /// The velocity predicted so far.
    #[cfg(test)]
    pub(super) fn velocity(&self) -> Vector3<f64> {
        self.ahead.transition * self.state + self.ahead.velocity
    }

    /// The difference as estimated so far.
    pub(super) fn difference(&self) -> Difference {
        difference(&self.state, &self.covariance)
    }

    /// Updates the state with a measured velocity (m/s) of this variance on each axis; returns whether it was used.
    pub(super) fn correct(&mut self, measured: &Vector3<f64>, variance: f64) -> bool {
        let motion = std::mem::replace(&mut self.ahead, Prediction::none());
        let before = self
            .history
            .is_some()
            .then_some((self.state, self.covariance));
        let stage = self.follow(&motion, measured, variance);
        if let (Some(history), Some(before)) = (&mut self.history, before) {
            let measured = Measured {
                velocity: *measured,
                variance,
                motion,
            };
            history.push(stage.is_some().then_some(measured), before);
        }
        stage.is_some()
    }

    /// Updates the state with a measured velocity after a given motion since the last one; `None` where the velocity was not
    /// used.
    fn follow(
        &mut self,
        motion: &Prediction,
        measured: &Vector3<f64>,
        variance: f64,
    ) -> Option<Stage> {
        let mut transition = Matrix6::identity();
        transition
            .fixed_view_mut::<3, 6>(0, 0)
            .copy_from(&motion.transition);
        let mut predicted = transition * self.state;
        let mut predicted_covariance = transition * self.covariance * transition.transpose();
        for axis in 0..3 {
            predicted[axis] += motion.velocity[axis];
            predicted_covariance[(axis, axis)] += motion.velocity_variance;
            predicted_covariance[(axis + 3, axis + 3)] += motion.difference_variance;
        }
        let innovation = measured - predicted.fixed_rows::<3>(0);
        let velocity_covariance: Matrix3<f64> =
            predicted_covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let innovation_inverse = |variance: f64| {
            let covariance = velocity_covariance + Matrix3::identity() * variance;
            Cholesky::new(covariance).map(|factor| factor.inverse())
        };
        (self.state, self.covariance) = (predicted, predicted_covariance);
        // Fails only where a number is not finite.
        let mut inverse = innovation_inverse(variance)?;
        let surprise = innovation.dot(&(inverse * innovation)) / OUTLIER_SIGMAS.powi(2);
        if surprise > 1.0
            && let Some(wider) = innovation_inverse(variance * surprise)
        {
            inverse = wider;
        }
        let by_velocity: Matrix6x3<f64> =
            predicted_covariance.fixed_view::<6, 3>(0, 0).into_owned();
        let gain = by_velocity * inverse;
        self.state += gain * innovation;
        self.covariance -= gain * by_velocity.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        Some(Stage {
            transition,
            predicted,
            predicted_covariance,
            state: self.state,
            covariance: self.covariance,
        })
    }

    /// Visits the difference at every measured velocity, the last one first, from all of them (Rauch-Tung-Striebel):
    /// `x_k += C (x_(k+1) - x_(k+1|k))`, `P_k += C (P_(k+1) - P_(k+1|k)) C'`, `C = P_k F' inv(P_(k+1|k))`.
    pub(super) fn for_each_smoothed_backwards(mut self, mut visit: impl FnMut(Difference)) {
        let mut later: Option<Stage> = None;
        let mut stages = Vec::new();
        let mut batches = self.history.take().unwrap_or_default().batches;
        while let Some(batch) = batches.pop() {
            (self.state, self.covariance) = (batch.state, batch.covariance);
            stages.clear();
            stages.extend(batch.measured.iter().filter_map(|measured| {
                self.follow(&measured.motion, &measured.velocity, measured.variance)
            }));
            while let Some(mut stage) = stages.pop() {
                if let Some(next) = &later {
                    stage.smooth(next);
                }
                visit(difference(&stage.state, &stage.covariance));
                later = Some(stage);
            }
        }
    }
}

impl History {
    /// Takes a measured velocity, `None` for one that the filter refused, and the filter before it.
    fn push(&mut self, measured: Option<Measured>, before: (Vector6<f64>, Matrix6<f64>)) {
        let Some(measured) = measured else {
            // What a refused velocity leaves is not repeated: the next one starts a batch.
            self.is_cut = true;
            return;
        };
        let is_cut = std::mem::take(&mut self.is_cut);
        match self.batches.last_mut() {
            Some(batch) if !is_cut && batch.measured.len() < KEPT_EVERY => {
                batch.measured.push(measured);
            }
            _ => self.batches.push(Batch {
                state: before.0,
                covariance: before.1,
                measured: vec![measured],
            }),
        }
    }
}

impl Stage {
    fn smooth(&mut self, next: &Self) {
        let Some(factor) = Cholesky::new(next.predicted_covariance) else {
            return;
        };
        let gain = self.covariance * next.transition.transpose() * factor.inverse();
        self.state += gain * (next.state - next.predicted);
        self.covariance += gain * (next.covariance - next.predicted_covariance) * gain.transpose();
    }
}

fn difference(state: &Vector6<f64>, covariance: &Matrix6<f64>) -> Difference {
    Difference {
        value: state.fixed_rows::<3>(3).into_owned(),
        covariance: covariance.fixed_view::<3, 3>(3, 3).into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 0.01;

    /// A velocity that turns and changes, with a constant difference in the measured acceleration.
    fn driven(keeps_history: bool, seconds: f64, difference: Vector3<f64>) -> DifferenceFilter {
        let mut filter = DifferenceFilter::new(keeps_history);
        let turning = Vector3::new(0.05, -0.02, 0.4);
        let mut velocity = Vector3::new(1.0, 0.0, 0.0);
        let steps = (seconds / STEP_S) as usize;
        for k in 0..steps {
            let rate = Vector3::new((k as f64 * 0.003).cos(), 0.0, 0.0);
            let acceleration = rate + turning.cross(&velocity);
            // dv/dt = a - w x v, in the steps of the filter
            let turned = -turning.cross_matrix() * STEP_S;
            velocity = (Matrix3::identity() + turned + turned * turned * 0.5) * velocity
                + acceleration * STEP_S;
            filter.advance(STEP_S, &(acceleration + difference), &turning, 1e-4);
            if k % 20 == 19 {
                filter.correct(&velocity, 1e-4);
            }
        }
        filter
    }

    #[test]
    fn difference_is_found_while_driving_a_curve() {
        let truth = Vector3::new(0.03, -0.02, 0.05);
        let found = driven(false, 20.0, truth).difference();
        assert!((found.value - truth).norm() < 1e-3, "{found:?}");
        assert!(found.covariance.trace().sqrt() < 0.01);
    }

    #[test]
    fn last_smoothed_difference_is_the_filtered_one_and_the_first_is_no_worse() {
        let truth = Vector3::new(0.03, -0.02, 0.05);
        let filter = driven(true, 10.0, truth);
        let last = filter.difference();
        let mut smoothed = Vec::new();
        filter.for_each_smoothed_backwards(|difference| smoothed.insert(0, difference));
        assert_eq!(smoothed.len(), 50);
        assert_eq!(smoothed[49].value, last.value);
        assert!((smoothed[0].value - truth).norm() < 1e-3);
        assert!(smoothed[0].covariance.trace() < 1.1 * last.covariance.trace());
    }

    #[test]
    fn gap_forgets_the_velocity_but_not_the_difference() {
        let truth = Vector3::new(0.03, -0.02, 0.05);
        let mut filter = driven(false, 20.0, truth);
        filter.forget_velocity();
        filter.correct(&Vector3::new(-5.0, 2.0, 0.0), 1e-4);
        assert!((filter.velocity() - Vector3::new(-5.0, 2.0, 0.0)).norm() < 1e-3);
        assert!((filter.difference().value - truth).norm() < 1e-3);
    }

    #[test]
    fn one_wild_velocity_does_not_move_the_difference() {
        let truth = Vector3::new(0.03, -0.02, 0.05);
        let mut filter = driven(false, 20.0, truth);
        filter.advance(STEP_S, &Vector3::zeros(), &Vector3::zeros(), 1e-4);
        let velocity = filter.velocity();
        filter.correct(&(velocity + Vector3::new(30.0, 0.0, 0.0)), 1e-4);
        assert!((filter.difference().value - truth).norm() < 2e-3);
    }
}
