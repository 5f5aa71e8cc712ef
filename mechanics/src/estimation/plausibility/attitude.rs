//! Plausibility checks of an orientation.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::fault::Component;
use super::freeze::Freeze;
use super::notice::{Found, Limits, Notice};
use super::outliers::Outliers;
use crate::estimation::turns::shorter_way;
use crate::machine::FaultKind;

/// State of the checks of one orientation.
#[derive(Debug, Clone)]
pub(super) struct AttitudeWatch {
    was_given: bool,
    freeze: Freeze,
    /// Outliers of the up direction.
    outliers: Outliers<3>,
    last_ns: Option<i64>,
    /// The last credible attitude.
    good: Option<Good>,
    /// Angle by which the gyro has inclined the attitude in about the last [`INCLINED_S`] (rad).
    inclined: f64,
    jumped: Option<Jumped>,
    /// Angle by which the gyro has turned the heading in about the last [`INCLINED_S`] (rad).
    headed: f64,
    /// Sum of the jumps of the heading (rad), and whether it stays so far off.
    heading_off: f64,
    has_turned: bool,
    /// By how much it was off in an earlier session (rad). What jumps back in this one may be a heading that finds north.
    was_off: Option<f64>,
}

/// A credible attitude, its up direction, and the angular velocity beside it (rad/s, NaN: not known).
#[derive(Debug, Clone, Copy)]
struct Good {
    stamp_ns: i64,
    attitude: UnitQuaternion<f64>,
    up: Vector3<f64>,
    turning: Vector3<f64>,
}

/// An inclination that jumped without the gyro: one side of the jump is wrong, until it jumps back.
#[derive(Debug, Clone, Copy)]
struct Jumped {
    since_ns: i64,
    /// Sum of the jumps of the up direction, and the part of it that may be noise and motion (rad).
    by: Vector3<f64>,
    moved: f64,
}

/// Time for which an attitude may hold its value, and then show the turn of all of it in one sample (s).
const INCLINED_S: f64 = 0.5;

/// Jump of the heading from which the axes of a housing that turned are nearer to other ones: an eighth of a turn (rad). A compass that is
/// corrected, or that finds north, turns no axes, but nothing tells the two apart.
pub(super) const OTHER_AXES: f64 = std::f64::consts::FRAC_PI_4;

/// Change of the inclination between two samples that does no harm (rad).
const HARMLESS_TILT: f64 = 0.05;

impl AttitudeWatch {
    pub(super) fn new() -> Self {
        Self {
            was_given: false,
            freeze: Freeze::new(),
            outliers: Outliers::new(HARMLESS_TILT),
            last_ns: None,
            good: None,
            inclined: 0.0,
            jumped: None,
            headed: 0.0,
            heading_off: 0.0,
            has_turned: false,
            was_off: None,
        }
    }

    /// Returns by how much the heading jumped without the gyro, and stayed (rad), where that is so far that the housing may show other
    /// axes.
    pub(super) fn turned(&self) -> Option<f64> {
        let is_off = self.has_turned.then_some(self.heading_off);
        self.was_off.or(is_off)
    }

    /// Remembers by how much the heading was off in an earlier session (rad).
    pub(super) fn remember_turned(&mut self, by: f64) {
        self.was_off = Some(by);
    }

    /// Trusts the axes of the housing as they are now.
    pub(super) fn trust(&mut self) {
        (self.heading_off, self.has_turned, self.was_off) = (0.0, false, None);
    }

    /// Reports faults of a quaternion to `found` and returns whether it is present and credible. If it is NaN or
    /// zero from the start, the sensor has no orientation. `turning` is the angular velocity in its axes (rad/s), NaN where none is
    /// known.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        xyzw: &[f64],
        turning: Vector3<f64>,
        turns: bool,
        limits: &Limits,
        found: &mut Found<'_>,
    ) -> bool {
        if !xyzw.iter().all(|v| v.is_finite()) {
            let is_absent = !self.was_given && xyzw.iter().all(|v| v.is_nan());
            if !is_absent {
                found(Notice::not_finite(stamp_ns, Component::Value));
            }
            return false;
        }
        let length = xyzw.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length == 0.0 && !self.was_given {
            return false;
        }
        self.was_given = true;
        let excess = (length - 1.0).abs();
        if excess > limits.quaternion_tolerance {
            found(
                Notice::of(FaultKind::NotUnit, stamp_ns)
                    .measured(length, 1.0)
                    .amount(excess, 0.0),
            );
            return false;
        }
        let last_ns = self.last_ns.replace(stamp_ns);
        if last_ns.is_some_and(|last_ns| limits.elapsed_s(last_ns, stamp_ns) > limits.max_gap_s) {
            self.outliers.restart();
            self.good = None;
        }
        if let Some((attitude, up)) = attitude_of(xyzw).zip(up_direction(xyzw)) {
            let was_suspect = self.outliers.is_suspect();
            if let Some(notice) = (self.outliers).notice(stamp_ns, up.into(), Component::Value) {
                found(notice);
                return false;
            }
            let now = Good {
                stamp_ns,
                attitude,
                up,
                turning,
            };
            self.follow(now, was_suspect, limits);
        }
        if let Some(jumped) = &self.jumped {
            found(Notice::offset(
                jumped.since_ns,
                jumped.by.norm(),
                jumped.moved,
            ));
        }
        if let Some(notice) = self.freeze.notice(stamp_ns, xyzw, turns, limits) {
            // where it froze is no inclination from which it jumps
            self.good = None;
            found(notice);
        }
        true
    }
}

impl AttitudeWatch {
    /// Takes a credible attitude. An up direction that has changed within a sample has turned as the gyro says, or jumped:
    /// ```text
    ///     u1 = exp(-w dt) u0 + jump,      |jump| > limit of outliers + integral of |w x u| dt over the last half second
    /// ```
    /// Only where the gyro is known on both sides. Headings are no jumps: a compass corrects them.
    fn follow(&mut self, now: Good, has_changed: bool, limits: &Limits) {
        let Some(last) = self.good.replace(now) else {
            (self.inclined, self.headed) = (0.0, 0.0);
            return;
        };
        let (up, good, stamp_ns) = (now.up, last.up, now.stamp_ns);
        let step_s = limits.elapsed_s(last.stamp_ns, stamp_ns);
        let by_gyro = 0.5 * (last.turning + now.turning) * step_s;
        if !by_gyro.iter().all(|angle| angle.is_finite()) {
            (self.inclined, self.headed) = (0.0, 0.0);
            return;
        }
        let heads = |it: &Good| it.turning.dot(&it.up).abs();
        self.headed = faded(self.headed, heads(&last).max(heads(&now)), step_s);
        self.follow_heading(&last, &now, by_gyro);
        // a turn about the vertical does not incline
        let [before, turning] = [last.turning.cross(&good), now.turning.cross(&up)];
        let fastest = before.norm().max(turning.norm());
        self.inclined = faded(self.inclined, fastest, step_s);
        if !has_changed {
            return;
        }
        let by = up - UnitQuaternion::from_scaled_axis(-by_gyro) * good;
        let moved = self.outliers.limit() + self.inclined;
        if by.norm() <= moved {
            return;
        }
        let jumped = self.jumped.get_or_insert(Jumped {
            since_ns: stamp_ns,
            by: Vector3::zeros(),
            moved: 0.0,
        });
        jumped.by += by;
        jumped.moved += moved;
        if jumped.by.norm() <= jumped.moved {
            self.jumped = None;
        }
    }
}

impl AttitudeWatch {
    /// Takes by how much the heading turned beyond what the gyro says from one sample to the next. One sample tells nothing.
    fn follow_heading(&mut self, last: &Good, now: &Good, by_gyro: Vector3<f64>) {
        let by_attitude = last.attitude.inverse() * now.attitude;
        let beyond = UnitQuaternion::from_scaled_axis(-by_gyro) * by_attitude;
        let jump = beyond.scaled_axis().dot(&now.up);
        // as for the inclination, the turn that it may show late is none
        if jump.abs() > OTHER_AXES + self.headed {
            self.heading_off = shorter_way(self.heading_off + jump);
        } else {
            self.has_turned = self.heading_off.abs() > OTHER_AXES;
        }
    }
}

/// Returns the angle of about the last [`INCLINED_S`] after a step at this rate (rad).
fn faded(angle: f64, rate: f64, step_s: f64) -> f64 {
    (angle + rate * step_s) * INCLINED_S / (INCLINED_S + step_s)
}

fn attitude_of(xyzw: &[f64]) -> Option<UnitQuaternion<f64>> {
    let &[x, y, z, w] = xyzw else { return None };
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)
}

/// Up direction in the axes of a body with this orientation; `None` where that is not finite.
pub(super) fn up_direction(xyzw: &[f64]) -> Option<Vector3<f64>> {
    let up = attitude_of(xyzw)?.inverse_transform_vector(&Vector3::z());
    up.iter().all(|v| v.is_finite()).then_some(up)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times (s) of the first and of the last sample that contradicts itself; samples every ten milliseconds. `shown` gives roll by
    /// attitude (rad) and rate by gyro (rad/s).
    fn jumped(shown: impl Fn(f64) -> [f64; 2]) -> Option<[f64; 2]> {
        let mut watch = AttitudeWatch::new();
        let mut first_and_last: Option<[f64; 2]> = None;
        for step in 0..2000_i64 {
            let time_s = step as f64 * 0.01;
            let [roll, rate] = shown(time_s);
            let noise = 5e-4 * (step as f64 * 12.9898).sin();
            let attitude = UnitQuaternion::from_euler_angles(roll + noise, 0.0, 0.3 * time_s);
            let turning =
                attitude.inverse_transform_vector(&(Vector3::z() * 0.3)) + Vector3::x() * rate;
            let xyzw: [f64; 4] = attitude.coords.into();
            let mut take = |notice: Notice| {
                if notice.kind == FaultKind::Contradiction {
                    let first = first_and_last.map_or(time_s, |[first, _]| first);
                    first_and_last = Some([first, time_s]);
                }
            };
            let stamp_ns = step * 10_000_000;
            watch.check(stamp_ns, &xyzw, turning, true, &Limits::OF_TESTS, &mut take);
        }
        first_and_last
    }

    #[test]
    fn an_inclination_that_jumps_and_stays_contradicts_a_silent_gyro_until_it_is_back() {
        let jump = |t: f64| if t > 5.0 { 0.12 } else { 0.0 };
        let [first, last] = jumped(|t| [jump(t), 0.0]).unwrap();
        assert!(
            (5.0..5.05).contains(&first) && last > 19.9,
            "{first} {last}"
        );
        let passes = |t: f64| if t > 12.0 { 0.0 } else { jump(t) };
        let [_, last] = jumped(|t| [passes(t), 0.0]).unwrap();
        assert!((11.9..12.1).contains(&last), "{last}");
    }

    /// Whether the axes may be others after 20 s of a machine that turns by 0.3 rad/s; `off` gives by how much the heading is off (rad).
    fn has_turned(off: impl Fn(f64) -> f64) -> bool {
        turned(&mut AttitudeWatch::new(), 0.3, off).is_some()
    }

    /// The same of a machine that turns by this rate (rad/s): by how much the heading stays off.
    fn turned(watch: &mut AttitudeWatch, rate: f64, off: impl Fn(f64) -> f64) -> Option<f64> {
        for step in 0..2000_i64 {
            let time_s = step as f64 * 0.01;
            let heading = rate * time_s + off(time_s);
            let attitude = UnitQuaternion::from_euler_angles(0.05, 0.0, heading);
            let turning = attitude.inverse_transform_vector(&(Vector3::z() * rate));
            let xyzw: [f64; 4] = attitude.coords.into();
            let stamp_ns = step * 10_000_000;
            watch.check(
                stamp_ns,
                &xyzw,
                turning,
                true,
                &Limits::OF_TESTS,
                &mut |_| (),
            );
        }
        watch.turned()
    }

    #[test]
    fn a_heading_that_jumps_as_a_housing_turns_leaves_its_axes_open_until_it_is_back() {
        let jump = |by: f64, to_s: f64| {
            let off = move |t: f64| if (9.995..to_s).contains(&t) { by } else { 0.0 };
            has_turned(off)
        };
        let half = std::f64::consts::PI;
        for by in [half, -half, 0.5 * half, -0.5 * half, 1.0] {
            assert!(jump(by, 99.0), "{by}");
            assert!(!jump(by, 14.995), "{by}");
            // one sample
            assert!(!jump(by, 10.005), "{by}");
        }
        // a compass that is corrected, at once or slowly
        assert!(!jump(0.5, 99.0));
        assert!(!has_turned(|t| 3.0 * (-t).exp()));
        // an attitude that holds its value, and shows the turn late
        let rate = 2.5;
        let held = |t: f64| rate * ((2.0 * t).floor() / 2.0 - t);
        assert_eq!(turned(&mut AttitudeWatch::new(), rate, held), None);
    }

    #[test]
    fn a_housing_that_turned_in_an_earlier_session_is_trusted_by_a_person_alone() {
        let mut watch = AttitudeWatch::new();
        let jumps = |t: f64| if t > 9.995 { 1.5 } else { 0.0 };
        let by = turned(&mut watch, 0.3, jumps).unwrap();
        assert!((by - 1.5).abs() < 1e-6, "{by}");
        let mut next = AttitudeWatch::new();
        next.remember_turned(by);
        assert_eq!(turned(&mut next, 0.3, |t| -jumps(t)), Some(by));
        for mut watch in [watch, next] {
            watch.trust();
            assert_eq!(watch.turned(), None);
        }
    }

    #[test]
    fn an_inclination_that_moves_contradicts_nothing() {
        // as the gyro says, however fast; also where it shows that late, or every 0.2 s
        let roll = |t: f64| 0.4 * (6.0 * t).sin();
        let rate = |t: f64| 2.4 * (6.0 * t).cos();
        assert_eq!(jumped(|t| [roll(t), rate(t)]), None);
        assert_eq!(jumped(|t| [roll(t - 0.05), rate(t)]), None);
        assert_eq!(jumped(|t| [roll((5.0 * t).floor() / 5.0), rate(t)]), None);
        // a filter that converges, or is corrected slowly
        assert_eq!(jumped(|t| [0.3 * (-t).exp(), 0.0]), None);
        assert_eq!(jumped(|t| [0.3 * ((t - 9.0) * 2.0).tanh(), 0.0]), None);
        // one sample, and a gyro that is not known
        let flips = |t: f64| if (5.0..5.005).contains(&t) { 0.4 } else { 0.0 };
        assert_eq!(jumped(|t| [flips(t), 0.0]), None);
        assert_eq!(
            jumped(|t| [if t > 5.0 { 0.3 } else { 0.0 }, f64::NAN]),
            None
        );
    }
}
