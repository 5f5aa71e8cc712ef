//! Steps of an accelerometer: the specific force changes from one sample to the next, and stays where no body of the machine went.
//!
//! What is left of the specific force without gravity, by attitude and gyro, changes the velocity v of the place at which it is measured
//! (base axes). The odometry or the wheels, and the gyro, show that velocity. With the bias b of the accelerometer:
//! ```text
//!     r = f - g up - w x v = dv/dt + b,         v = v_base + w x p
//!     r = dv/dt + b + d                         since a step d
//! ```
//! A kerb, a stop, brakes that bite and a wheel that falls back change the specific force from one sample to the next, too. But what
//! they do shows in the velocity, or is over soon. So a step is weighed after a time: the mean of `r - dv/dt - b` since then is
//! about zero if a body moved, and d if the accelerometer stepped. Whichever is nearer holds; b is known from the time before. A
//! velocity that is filtered lags, which leaves a share of the step unexplained: that time is T and the longest gap of samples, of
//! which such a lag is less than half.
//!
//! Odometry is measured less often than forces, or falls silent: the means reach from one stamp of the velocity to another one, and
//! begin anew where another source shows it.
//!
//! Where r steps and the specific force itself does not, an attitude or a velocity has jumped: that is none of the accelerometer.
//!
//! Without odometry and wheels nobody knows the velocity forward. What is left is asked across it, and of a platform that does not turn.
//! By wheels that are steered and do not show the velocity across, it is asked along and upward. A step that vibration hides is left to
//! the relation of the specific force.

use nalgebra::Vector3;

use super::super::explanation::Explanation;
use super::super::fault::Component;
use super::super::notice::{Limits, Notice};
use super::super::outliers::Outliers;
use super::super::signal_doubt::SignalDoubt;
use super::super::signals::HARMLESS_FORCE;
use super::motion::VELOCITY_NOISE;
use super::window::{RESTS_TURNING, ShownBy, ShownVelocity, TURNED_OVER, WINDOW_S};
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
    /// The last velocity of the base.
    pub(super) velocity: ShownVelocity,
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
    force: Vector3<f64>,
    /// Mean of the acceleration, which fades with T.
    mean_acceleration: Vector3<f64>,
    shown: Shown,
    /// Mean of `r - dv/dt`, which fades with T: the bias of the accelerometer.
    bias: Vector3<f64>,
}

/// The last velocity of the place at which the specific force is measured.
#[derive(Debug, Clone, Copy)]
struct Shown {
    by: ShownBy,
    stamp_ns: i64,
    velocity: Vector3<f64>,
    /// Integral of the acceleration since then (m/s).
    gained: Vector3<f64>,
}

/// A step that is not weighed yet.
#[derive(Debug, Clone, Copy)]
struct Step {
    since_ns: i64,
    stamp_ns: i64,
    by: Vector3<f64>,
    /// Bias and velocity before it; the integral goes on.
    bias: Vector3<f64>,
    shown: Shown,
    /// Turn since then (rad).
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

impl Shown {
    /// Returns the integral of `r - dv/dt` from this velocity to the next one (m/s).
    fn beyond(&self, next: &Self) -> Vector3<f64> {
        self.gained - next.gained - (next.velocity - self.velocity)
    }
}

impl Before {
    /// Returns the means that begin with a sample.
    fn at(measured: &Measured, acceleration: Vector3<f64>, shown: Shown) -> Self {
        Self {
            since_ns: measured.stamp_ns,
            stamp_ns: measured.stamp_ns,
            force: measured.force,
            mean_acceleration: acceleration,
            shown,
            bias: acceleration,
        }
    }

    /// Takes a sample, whose last velocity is `now`.
    fn take(
        &mut self,
        measured: &Measured,
        acceleration: Vector3<f64>,
        now: &Shown,
        limits: &Limits,
    ) {
        let step_s = limits.elapsed_s(self.stamp_ns, measured.stamp_ns);
        let share = step_s / (WINDOW_S + step_s);
        self.mean_acceleration += (acceleration - self.mean_acceleration) * share;
        self.shown.gained += acceleration * step_s;
        (self.stamp_ns, self.force) = (measured.stamp_ns, measured.force);
        if now.stamp_ns > self.shown.stamp_ns {
            let span_s = limits.elapsed_s(self.shown.stamp_ns, now.stamp_ns);
            let known_s = limits.elapsed_s(self.since_ns, now.stamp_ns);
            let share = span_s / known_s.min(WINDOW_S).max(span_s);
            self.bias += (self.shown.beyond(now) / span_s - self.bias) * share;
            self.shown = *now;
        }
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
        let (stamp_ns, of_base) = (measured.stamp_ns, &measured.velocity);
        let velocity = of_base.velocity + measured.turning.cross(&self.position);
        let gravity = measured.up * self.gravity;
        let acceleration = measured.force - gravity - measured.turning.cross(&velocity);
        let now = Shown {
            by: of_base.by,
            stamp_ns: of_base.stamp_ns,
            velocity,
            gained: acceleration * limits.elapsed_s(of_base.stamp_ns, stamp_ns),
        };
        let goes_on = self.before.is_some_and(|before| {
            before.shown.by == now.by
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
        let before = (self.before).get_or_insert(Before::at(measured, acceleration, now));
        let axes = now.by.axes();
        let known_s = limits.elapsed_s(before.since_ns, stamp_ns);
        if has_changed && self.step.is_none() && known_s >= KNOWN_WINDOWS * WINDOW_S {
            let by = (acceleration - before.mean_acceleration).component_mul(&axes);
            if by.norm() > self.outliers.limit() {
                if (measured.force - before.force).dot(&by) < 0.5 * by.norm_squared() {
                    // an attitude or a velocity has jumped
                    self.restart();
                    return;
                }
                let mut shown = before.shown;
                let unknown_s = limits.elapsed_s(before.stamp_ns, self.suspect_ns);
                shown.gained += before.mean_acceleration * unknown_s;
                self.step = Some(Step {
                    since_ns: self.suspect_ns,
                    stamp_ns: self.suspect_ns,
                    by,
                    bias: before.bias,
                    shown,
                    turned: 0.0,
                });
            }
        }
        let is_new = now.stamp_ns > before.shown.stamp_ns;
        before.take(measured, acceleration, &now, limits);
        let Some(step) = &mut self.step else { return };
        let step_s = limits.elapsed_s(step.stamp_ns, stamp_ns);
        step.stamp_ns = stamp_ns;
        step.shown.gained += acceleration * step_s;
        let weighed_s = WINDOW_S + limits.max_gap_s;
        let (turning, most) = match now.by {
            ShownBy::Nothing => (measured.turning.norm(), RESTS_TURNING * weighed_s),
            _ => (measured.turning.xy().norm(), TURNED_OVER),
        };
        step.turned += turning * step_s;
        if step.turned > most {
            self.step = None;
            return;
        }
        let since_s = limits.elapsed_s(step.since_ns, now.stamp_ns);
        if !is_new || since_s < weighed_s {
            return;
        }
        // the bias acts from the velocity before the step on, the step from its own stamp on
        let span_s = limits.elapsed_s(step.shown.stamp_ns, now.stamp_ns);
        let excess = (step.shown.beyond(&now) - step.bias * span_s) / since_s;
        let (excess, half) = (excess.component_mul(&axes), 0.5 * step.by.norm());
        let noise = std::f64::consts::SQRT_2 * of_base.sigma.max(VELOCITY_NOISE) / since_s;
        let stays = half > STANDS_OUT * noise && (excess - step.by).norm() < half;
        let Step { since_ns, bias, .. } = *step;
        self.step = None;
        match stays {
            true => {
                self.add(since_ns, excess);
                // what was before is no bias of what follows
                self.restart();
            }
            // a body moved: what of that a velocity showed late is no bias
            false => before.bias = bias,
        }
    }

    /// Forgets the samples so far: after a hole, where another source shows the velocity, or in a motion that it does not show. What has
    /// stepped stays so.
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
        steps_by(ShownBy::Odometry, [1, 0], shown, steps)
    }

    /// The same of a velocity that this source shows in one of `every` samples.
    fn steps_by(
        by: ShownBy,
        [every, first]: [i64; 2],
        shown: impl Fn(f64) -> (Vector3<f64>, Option<Vector3<f64>>),
        steps: &mut ForceSteps,
    ) -> Option<f64> {
        for sample in 0..2000_i64 {
            let t = sample as f64 * 0.01;
            let (acceleration, _) = shown(t);
            let last = sample - (sample - first).rem_euclid(every);
            let (_, velocity) = shown(last as f64 * 0.01);
            let noise = Vector3::new((171.0 * t).sin(), (193.0 * t).sin(), (207.0 * t).sin());
            let measured = Measured {
                stamp_ns: sample * 10_000_000,
                force: Vector3::z() * GRAVITY + acceleration + noise * 0.05,
                turning: noise * 0.005,
                up: Vector3::z(),
                velocity: ShownVelocity {
                    stamp_ns: velocity.map_or(sample, |_| last) * 10_000_000,
                    velocity: velocity.unwrap_or_default(),
                    sigma: 0.01,
                    by: velocity.map_or(ShownBy::Nothing, |_| by),
                },
            };
            steps.take(&measured, &Limits::OF_TESTS);
        }
        steps.doubt().map(|doubt| doubt.by)
    }

    fn stands(shown: impl Fn(f64) -> (Vector3<f64>, Option<Vector3<f64>>)) -> Option<f64> {
        stands_by(ShownBy::Odometry, [1, 0], shown)
    }

    fn stands_by(
        by: ShownBy,
        every: [i64; 2],
        shown: impl Fn(f64) -> (Vector3<f64>, Option<Vector3<f64>>),
    ) -> Option<f64> {
        let mut steps = ForceSteps::at(Vector3::new(0.1, 0.0, 0.05), GRAVITY);
        steps_by(by, every, shown, &mut steps)
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

    /// Brakes bite and let go by a filtered odometry that is behind, and is measured seldom; or its messages are lost just then.
    #[test]
    fn an_odometry_that_is_late_and_measured_seldom_shows_what_a_body_does() {
        for every in [1, 10, 25] {
            for (first, lag_s) in [(0, 0.24), (7, 0.1), (13, 0.24), (21, 0.2)] {
                for brakes_s in [0.3, 0.6, 1.0, 1.5, 99.0] {
                    let found = stands_by(ShownBy::Odometry, [every, first], |t| {
                        let braking = within(t, [9.995, 9.995 + brakes_s], Vector3::x() * -5.0);
                        let slower = 5.0 * (t - 9.995 - lag_s).clamp(0.0, brakes_s);
                        (braking, Some(Vector3::x() * (5.0 - slower)))
                    });
                    assert_eq!(found, None, "{every} {first} {lag_s} {brakes_s}");
                }
            }
        }
        let steps = |t: f64| {
            (
                within(t, [9.995, 99.0], Vector3::y() * 3.0),
                Some(Vector3::zeros()),
            )
        };
        for every in [10, 25] {
            for first in (0..every).step_by(3) {
                let found = stands_by(ShownBy::Odometry, [every, first], steps);
                let found = found.expect("it stands");
                assert!((found - 3.0).abs() < 0.2, "{every} {first}: {found}");
            }
        }
    }

    /// Crab steering: what brakes it goes to the side, too.
    #[test]
    fn wheels_that_do_not_show_the_velocity_across_are_asked_along_alone() {
        let way = Vector3::new(0.28, 0.96, 0.0);
        let slows = |t: f64| way * (5.0 - 4.0 * (t - 10.0).max(0.0));
        let brakes = |t: f64| within(t, [9.995, 99.0], way * -4.0);
        let stands = |by, shown: &dyn Fn(f64) -> Vector3<f64>| {
            stands_by(by, [1, 0], |t| (brakes(t), Some(shown(t))))
        };
        let along = |t: f64| Vector3::x() * slows(t).x;
        assert_eq!(stands(ShownBy::Wheels, &slows), None);
        assert_eq!(stands(ShownBy::WheelsAlong, &along), None);
        // as if it did not go to the side
        assert!(stands(ShownBy::Wheels, &along).is_some());
        let step = |by: Vector3<f64>| {
            let shown = move |t: f64| (within(t, [9.995, 99.0], by), Some(Vector3::zeros()));
            stands_by(ShownBy::WheelsAlong, [1, 0], shown)
        };
        assert!(step(Vector3::x() * -3.0).is_some());
        assert_eq!(step(Vector3::y() * 3.0), None);
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
