//! Steps of an accelerometer: the specific force changes from one sample to the next, and stays where no body of the machine went.
//!
//! What is left of the specific force without gravity, by attitude and gyro, changes the velocity v of the place at which it is measured
//! (base axes). The odometry or the wheels, and the gyro, show that velocity. With the bias b of the accelerometer:
//! ```text
//!     r = f - g up - w x v = dv/dt + b,         v = v_base + w x p
//!     r = dv/dt + b + d                         since a step d
//! ```
//! A kerb, a stop, brakes that bite and a wheel that falls back change the specific force from one sample to the next, too. But what
//! they do shows in the velocity, or is over soon. So a step is weighed after the time T: the mean of `r - dv/dt - b` since then is
//! about zero if a body moved, and d if the accelerometer stepped. Whichever is nearer holds; b is known from the time before.
//!
//! Without odometry and wheels nobody knows the velocity forward. What is left is asked across it, and of a platform that does not turn.
//! A step that vibration hides is left to the relation of the specific force.

use nalgebra::Vector3;

use super::super::explanation::Explanation;
use super::super::fault::Component;
use super::super::notice::{Limits, Notice};
use super::super::outliers::Outliers;
use super::super::signal_doubt::SignalDoubt;
use super::super::signals::HARMLESS_FORCE;
use super::motion::VELOCITY_NOISE;
use super::window::{RESTS_TURNING, TURNED_OVER, WINDOW_S};
use crate::machine::{Machine, Proof};

/// Times T that must have passed before a step, for the means of the time before it, which fade with T.
const KNOWN_WINDOWS: f64 = 2.0;
/// Standard deviations of a mean by the noise of the velocity from which half of a step stands out.
const STANDS_OUT: f64 = 5.0;

/// A sample of the IMU that is sound (base axes).
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    pub(super) stamp_ns: i64,
    pub(super) force: Vector3<f64>,
    pub(super) turning: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    /// Velocity of the base and the standard deviation of its components (m/s); `None` where nothing measures it.
    pub(super) velocity: Option<(Vector3<f64>, f64)>,
}

/// The steps of one accelerometer.
#[derive(Debug, Clone)]
pub(super) struct ForceSteps {
    gravity: f64,
    /// Position of the IMU (m, base axes).
    position: Vector3<f64>,
    outliers: Outliers<3>,
    /// Stamp of the sample that may have been the first after a step (ns).
    suspect_ns: i64,
    before: Option<Before>,
    step: Option<Step>,
    standing: Option<Stepped>,
}

/// The last samples.
#[derive(Debug, Clone, Copy)]
struct Before {
    since_ns: i64,
    stamp_ns: i64,
    is_velocity_known: bool,
    velocity: Vector3<f64>,
    /// Means that fade with T, of the acceleration and of the velocity.
    mean_acceleration: Vector3<f64>,
    mean_velocity: Vector3<f64>,
}

/// A step that is not weighed yet.
#[derive(Debug, Clone, Copy)]
struct Step {
    since_ns: i64,
    stamp_ns: i64,
    by: Vector3<f64>,
    /// Bias and velocity before it.
    bias: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Integral of the acceleration since then (m/s), and turn (rad).
    gained: Vector3<f64>,
    turned: f64,
}

/// An accelerometer that has stepped.
#[derive(Debug, Clone, Copy)]
struct Stepped {
    /// Stamp of the first step (ns); `None` if that was before the first sample.
    since_ns: Option<i64>,
    /// Sum of the steps (m/s^2). Of an earlier session only its length is known.
    by: Vector3<f64>,
    is_of_before: bool,
}

impl Before {
    /// Returns the means that begin with a sample.
    fn at(stamp_ns: i64, acceleration: Vector3<f64>, velocity: Vector3<f64>, known: bool) -> Self {
        Self {
            since_ns: stamp_ns,
            stamp_ns,
            is_velocity_known: known,
            velocity,
            mean_acceleration: acceleration,
            mean_velocity: velocity,
        }
    }

    /// Returns the bias of the accelerometer: the mean of the velocity changes by `(v - mean) / T`.
    fn bias(&self) -> Vector3<f64> {
        self.mean_acceleration - (self.velocity - self.mean_velocity) / WINDOW_S
    }
}

impl ForceSteps {
    pub(super) fn new(machine: &Machine) -> Self {
        let position = machine.imu().body_from_mount.translation.vector;
        Self::at(position, machine.gravity())
    }

    fn at(position: Vector3<f64>, gravity: f64) -> Self {
        Self {
            gravity,
            position,
            outliers: Outliers::new(HARMLESS_FORCE),
            suspect_ns: i64::MIN,
            before: None,
            step: None,
            standing: None,
        }
    }

    /// Takes a sample of the IMU.
    pub(super) fn take(&mut self, measured: &Measured, limits: &Limits) {
        let stamp_ns = measured.stamp_ns;
        let is_velocity_known = measured.velocity.is_some();
        let (of_base, sigma) = measured.velocity.unwrap_or((Vector3::zeros(), 0.0));
        let velocity = of_base + measured.turning.cross(&self.position);
        let gravity = measured.up * self.gravity;
        let acceleration = measured.force - gravity - measured.turning.cross(&velocity);
        let goes_on = self.before.is_some_and(|before| {
            before.is_velocity_known == is_velocity_known
                && limits.elapsed_s(before.stamp_ns, stamp_ns) <= limits.max_gap_s
        });
        if !goes_on {
            self.restart();
        }
        let has_changed = self.outliers.is_suspect();
        let notice = (self.outliers).notice(stamp_ns, acceleration.into(), Component::Value);
        if notice.is_some() {
            self.suspect_ns = stamp_ns;
            return;
        }
        let before = (self.before).get_or_insert(Before::at(
            stamp_ns,
            acceleration,
            velocity,
            is_velocity_known,
        ));
        // without odometry and wheels it may brake or speed up
        let shown = |vector: Vector3<f64>| match is_velocity_known {
            true => vector,
            false => Vector3::new(0.0, vector.y, vector.z),
        };
        let known_s = limits.elapsed_s(before.since_ns, stamp_ns);
        if has_changed && self.step.is_none() && known_s >= KNOWN_WINDOWS * WINDOW_S {
            let by = shown(acceleration - before.mean_acceleration);
            let step = Step {
                since_ns: self.suspect_ns,
                stamp_ns: self.suspect_ns,
                by,
                bias: before.bias(),
                velocity: before.velocity,
                gained: Vector3::zeros(),
                turned: 0.0,
            };
            self.step = Some(step).filter(|_| by.norm() > self.outliers.limit());
        }
        let share = limits.elapsed_s(before.stamp_ns, stamp_ns);
        let share = share / (WINDOW_S + share);
        before.mean_acceleration += (acceleration - before.mean_acceleration) * share;
        before.mean_velocity += (velocity - before.mean_velocity) * share;
        (before.stamp_ns, before.velocity) = (stamp_ns, velocity);
        let Some(step) = &mut self.step else { return };
        let step_s = limits.elapsed_s(step.stamp_ns, stamp_ns);
        step.stamp_ns = stamp_ns;
        step.gained += acceleration * step_s;
        let (turning, most) = match is_velocity_known {
            true => (measured.turning.xy().norm(), TURNED_OVER),
            false => (measured.turning.norm(), RESTS_TURNING * WINDOW_S),
        };
        step.turned += turning * step_s;
        let since_s = limits.elapsed_s(step.since_ns, stamp_ns);
        let rests = step.turned <= most;
        if rests && since_s < WINDOW_S {
            return;
        }
        let excess = (step.gained - (velocity - step.velocity)) / since_s - step.bias;
        let (excess, half) = (shown(excess), 0.5 * step.by.norm());
        let noise = std::f64::consts::SQRT_2 * sigma.max(VELOCITY_NOISE) / since_s;
        let stays = rests && half > STANDS_OUT * noise && (excess - step.by).norm() < half;
        let since_ns = step.since_ns;
        self.step = None;
        if stays {
            self.add(since_ns, excess);
            // what was before is no bias of what follows
            self.restart();
        }
    }

    /// Forgets the samples so far: after a hole, or in a motion that the velocity does not show. What has stepped stays so.
    pub(super) fn restart(&mut self) {
        self.outliers.restart();
        (self.before, self.step) = (None, None);
    }

    fn add(&mut self, since_ns: i64, by: Vector3<f64>) {
        let standing = self.standing.get_or_insert(Stepped {
            since_ns: Some(since_ns),
            by: Vector3::zeros(),
            is_of_before: false,
        });
        if standing.is_of_before {
            return;
        }
        standing.by += by;
        if standing.by.norm() <= HARMLESS_FORCE {
            self.standing = None;
        }
    }

    /// Returns the doubt about an accelerometer that has stepped.
    pub(super) fn doubt(&self) -> Option<SignalDoubt> {
        self.standing.map(|stepped| SignalDoubt {
            signal: Proof::SpecificForce,
            by: stepped.by.norm(),
            moved: HARMLESS_FORCE,
        })
    }

    /// Remembers the size (m/s^2) of a step in an earlier session.
    pub(super) fn remember(&mut self, by: f64) {
        self.standing = Some(Stepped {
            since_ns: None,
            by: Vector3::x() * by,
            is_of_before: true,
        });
    }

    /// Trusts the specific force as it is now.
    pub(super) fn trust(&mut self) {
        self.standing = None;
        self.restart();
    }

    /// Returns the notice that the accelerometer has stepped; if that was before the first sample, since that sample, at `stamp_ns`.
    pub(super) fn standing(&mut self, stamp_ns: i64) -> Option<Notice> {
        let stepped = self.standing.as_mut()?;
        let since_ns = *stepped.since_ns.get_or_insert(stamp_ns);
        let offset = Notice::offset(since_ns, stepped.by.norm(), HARMLESS_FORCE);
        Some(offset.explained(Explanation::AccelerometerOffset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRAVITY: f64 = 9.81;

    /// Returns the size of the steps that stand after 20 s of a platform that stands upright or drives, at 100 Hz. `shown` gives
    /// acceleration (m/s^2) and velocity (m/s) at a time (s), as the sensors show them.
    fn steps(
        shown: impl Fn(f64) -> (Vector3<f64>, Option<Vector3<f64>>),
        steps: &mut ForceSteps,
    ) -> Option<f64> {
        for sample in 0..2000_i64 {
            let t = sample as f64 * 0.01;
            let (acceleration, velocity) = shown(t);
            let noise = Vector3::new((171.0 * t).sin(), (193.0 * t).sin(), (207.0 * t).sin());
            let measured = Measured {
                stamp_ns: sample * 10_000_000,
                force: Vector3::z() * GRAVITY + acceleration + noise * 0.05,
                turning: noise * 0.005,
                up: Vector3::z(),
                velocity: velocity.map(|velocity| (velocity, 0.01)),
            };
            steps.take(&measured, &Limits::OF_TESTS);
        }
        steps.doubt().map(|doubt| doubt.by)
    }

    fn stands(shown: impl Fn(f64) -> (Vector3<f64>, Option<Vector3<f64>>)) -> Option<f64> {
        steps(
            shown,
            &mut ForceSteps::at(Vector3::new(0.1, 0.0, 0.05), GRAVITY),
        )
    }

    /// Value from one time to another, else zero.
    fn within(t: f64, [from, to]: [f64; 2], value: Vector3<f64>) -> Vector3<f64> {
        match (from..to).contains(&t) {
            true => value,
            false => Vector3::zeros(),
        }
    }

    #[test]
    fn a_step_that_stays_counts_until_it_is_back() {
        for by in [Vector3::x() * -3.0, Vector3::y() * 3.0, Vector3::z() * 2.5] {
            let until =
                |end_s: f64| stands(|t| (within(t, [9.995, end_s], by), Some(Vector3::zeros())));
            let found = until(f64::INFINITY).expect("it stands");
            assert!((found - by.norm()).abs() < 0.2, "{found}");
            assert_eq!(until(14.995), None);
        }
        // beside a bias, in a bend, and from a velocity that grows evenly
        let of_machine = Vector3::new(0.5, 1.2, 0.2);
        let grows = |t: f64| Some(Vector3::x() * (0.5 * t));
        let found = stands(|t| {
            let step = within(t, [9.995, 99.0], Vector3::y() * 3.0);
            (of_machine + step, grows(t))
        });
        assert!(found.is_some());
    }

    #[test]
    fn what_a_body_does_is_no_step() {
        // brakes that bite and let go, shown by an odometry that lags behind by a tenth of a second
        let braking = |t: f64| within(t, [9.995, 11.0], Vector3::x() * -5.0);
        let slows = |t: f64| Vector3::x() * (6.0 - 5.0 * (t - 10.0).clamp(0.0, 1.0));
        assert_eq!(stands(|t| (braking(t), Some(slows(t)))), None);
        assert_eq!(stands(|t| (braking(t), Some(slows(t - 0.1)))), None);
        // a knock against a kerb, a wheel that falls back and swings, a free fall of some centimetres
        let at_rest = Some(Vector3::zeros());
        let knock = Vector3::new(-8.0, 2.0, 6.0);
        assert_eq!(stands(|t| (within(t, [9.995, 10.1], knock), at_rest)), None);
        let swings = |t: f64| Vector3::z() * (6.0 * (20.0 * (t - 10.0)).cos());
        assert_eq!(
            stands(|t| (within(t, [9.995, 99.0], swings(t)), at_rest)),
            None
        );
        let falls = Vector3::z() * -GRAVITY;
        assert_eq!(
            stands(|t| (within(t, [9.995, 10.15], falls), at_rest)),
            None
        );
    }

    #[test]
    fn without_a_velocity_it_may_brake_and_does_not_slide() {
        let step = |by: Vector3<f64>| stands(move |t| (within(t, [9.995, 99.0], by), None));
        assert!(step(Vector3::y() * 3.0).is_some());
        assert_eq!(step(Vector3::x() * -3.0), None);
    }

    #[test]
    fn a_step_of_an_earlier_session_stands_until_somebody_trusts_it() {
        let mut found = ForceSteps::at(Vector3::zeros(), GRAVITY);
        found.remember(3.0);
        let back = |t: f64| {
            (
                within(t, [0.0, 9.995], Vector3::x() * 3.0),
                Some(Vector3::zeros()),
            )
        };
        assert_eq!(steps(back, &mut found), Some(3.0));
        assert!(found.standing(7).is_some());
        found.trust();
        assert_eq!(found.doubt(), None);
    }
}
