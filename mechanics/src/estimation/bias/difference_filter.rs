//! Kalman filter of a velocity v and of the constant difference s between two measured accelerations.
//!
//! ```text
//!     dv/dt = a - s - w x v + noise,    ds/dt = noise
//!     z = v + noise
//! ```
//! with the measured acceleration a and angular velocity w. The model is linear in v and s.

use nalgebra::{Cholesky, Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

/// Standard deviation of an unknown velocity (m/s).
const VELOCITY_SPREAD: f64 = 10.0;
/// Standard deviation of the difference before any measurement (m/s^2): much larger than any bias.
const DIFFERENCE_SPREAD: f64 = 3.0;
/// Drift of the difference: standard deviation of its change in one second (m/s^2).
const DRIFT: f64 = 2e-4;
/// A velocity further from the predicted one than this many standard deviations counts less.
const OUTLIER_SIGMAS: f64 = 4.0;

/// The filter, and the earlier steps where a smoother needs them.
#[derive(Debug, Clone)]
pub(super) struct DifferenceFilter {
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
    ahead: Prediction,
    history: Option<Vec<Stage>>,
}

/// The motion since the last measured velocity.
#[derive(Debug, Clone)]
struct Prediction {
    transition: Matrix6<f64>,
    velocity: Vector3<f64>,
    velocity_variance: f64,
    difference_variance: f64,
}

/// A measured velocity in the history.
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
            transition: Matrix6::identity(),
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
            history: keeps_history.then(Vec::new),
        }
    }

    /// After a gap the velocity is unknown; the difference stays.
    pub(super) fn forget_velocity(&mut self) {
        self.ahead.transition.fixed_view_mut::<3, 6>(0, 0).fill(0.0);
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
        self.ahead.transition.fixed_view::<3, 6>(0, 0) * self.state + self.ahead.velocity
    }

    /// The difference as estimated so far.
    pub(super) fn difference(&self) -> Difference {
        difference(&self.state, &self.covariance)
    }

    /// Updates the state with a measured velocity (m/s) of this variance on each axis; returns whether it was used.
    pub(super) fn correct(&mut self, measured: &Vector3<f64>, variance: f64) -> bool {
        let ahead = std::mem::replace(&mut self.ahead, Prediction::none());
        let mut predicted = ahead.transition * self.state;
        let mut predicted_covariance =
            ahead.transition * self.covariance * ahead.transition.transpose();
        for axis in 0..3 {
            predicted[axis] += ahead.velocity[axis];
            predicted_covariance[(axis, axis)] += ahead.velocity_variance;
            predicted_covariance[(axis + 3, axis + 3)] += ahead.difference_variance;
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
        let Some(mut inverse) = innovation_inverse(variance) else {
            return false;
        };
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
        if let Some(history) = &mut self.history {
            history.push(Stage {
                transition: ahead.transition,
                predicted,
                predicted_covariance,
                state: self.state,
                covariance: self.covariance,
            });
        }
        true
    }

    /// The difference at every measured velocity, from all of them (Rauch-Tung-Striebel):
    /// `x_k += C (x_(k+1) - x_(k+1|k))`, `P_k += C (P_(k+1) - P_(k+1|k)) C'`, `C = P_k F' inv(P_(k+1|k))`.
    pub(super) fn smoothed(self) -> Vec<Difference> {
        let mut stages = self.history.unwrap_or_default();
        for k in (0..stages.len().saturating_sub(1)).rev() {
            let (before, after) = stages.split_at_mut(k + 1);
            let (own, next) = (&mut before[k], &after[0]);
            let Some(factor) = Cholesky::new(next.predicted_covariance) else {
                continue;
            };
            let gain = own.covariance * next.transition.transpose() * factor.inverse();
            own.state += gain * (next.state - next.predicted);
            own.covariance +=
                gain * (next.covariance - next.predicted_covariance) * gain.transpose();
        }
        stages
            .iter()
            .map(|stage| difference(&stage.state, &stage.covariance))
            .collect()
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
        let smoothed = filter.smoothed();
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
