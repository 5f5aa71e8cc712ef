//! Rotations of the platform about an edge, by gyro and attitude alone, in retrospect: when they began, how far they went.

use std::collections::VecDeque;

use nalgebra::Vector3;
use tipwatch_mechanics::estimation::rotation::{
    PlatformRotation, RotationSpell, RotationWitness, ShownUp,
};
use tipwatch_mechanics::number::{BEYOND_SURE, SURE_SIGMAS};

use super::onset::{self, Curve, Onset};
use super::turning::Turning;
use crate::base::rows::last_until;

/// Time before the platform left its reference that the onset is searched in, and by which the search begins earlier while it finds
/// an onset within so many seconds of where it begins (ns, s). A machine that balances on an edge falls slowly at first, and the reference
/// of one whose wheels creep follows for long.
const BEFORE_NS: i64 = 2_500_000_000;
const AT_BEGINNING_S: f64 = 1.0;
/// Time before the last sample that is kept while the platform does not rotate (ns).
const KEPT_NS: i64 = 15_000_000_000;
/// Time after the certain rotation that is kept point by point (ns).
const AFTER_NS: i64 = 20_000_000_000;
/// Rotation up to which the onset is fitted (rad).
const FITTED_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;
/// An onset this close to the first sample is not in the log (s).
pub(super) const FIRST_S: f64 = 0.1;
/// A platform stood if it rotated by less than this for so long (rad, s).
const STOOD_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;
const STOOD_S: f64 = 0.4;
/// Probability that a platform that creeps, or rests between wheels and side, is held, and not on ground that gave way.
const HELD: f64 = 0.5;
/// Probability that a rotation about one of two edges is about this one.
const THIS_EDGE: f64 = 0.5;
/// Ground that gives way turns a machine by less (rad).
const GROUND_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Rotation at which a fall must have grown faster (rad), and the least ratio of its rate there to its mean rate until then.
const GROWN_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;
const GROWN: f64 = 1.5;
/// Gyro and attitude that turn together by so much in a log show a fall, wherever it began and however the IMU is mounted (rad).
pub(crate) const FALL_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// A rotation about an edge.
#[derive(Debug, Clone)]
pub(crate) struct FoundRotation {
    /// Name of the edge.
    pub(crate) edge: String,
    /// Name of the edge that the gyro shows, where the attitude shows `edge`.
    pub(crate) other_edge: Option<String>,
    /// Spell of rotation that the watch found.
    pub(crate) spell: RotationSpell,
    /// Start of the rotation (ns): the onset, or else the first sample that shows it.
    pub(crate) start_ns: i64,
    /// Standard deviation of the onset (s); `None` where the log does not contain it.
    pub(crate) start_sigma_s: Option<f64>,
    /// Time at which the platform was back (ns); `None` if the rotation stands at the end of the log.
    pub(crate) end_ns: Option<i64>,
    /// Whether the rotation does not grow faster and faster, as a fall does: see [`creeps`].
    pub(crate) creeps: bool,
    /// Rotation since the start (rad), outwards positive, by time (ns).
    pub(crate) angles: Vec<(i64, f64)>,
    /// Largest rotation about the edge that the tyres allow (rad).
    pub(crate) on_tyres_rad: f64,
}

impl FoundRotation {
    /// The largest rotation since the start (rad), and when (ns).
    pub(crate) fn largest(&self) -> (f64, i64) {
        let start = (0.0, self.start_ns);
        self.angles.iter().fold(
            start,
            |best, &(at_ns, angle)| {
                if angle > best.0 { (angle, at_ns) } else { best }
            },
        )
    }

    /// Returns the time (ns) at which the rotation first reached an angle (rad).
    pub(crate) fn reached(&self, angle: f64) -> Option<i64> {
        let mut angles = self.angles.iter();
        angles.find(|(_, at)| *at >= angle).map(|(at_ns, _)| *at_ns)
    }

    /// Returns the onset, in seconds after a time (ns), if gyro and attitude show it.
    pub(super) fn onset(&self, since_ns: i64) -> Option<Onset> {
        Some(Onset {
            at_s: (self.start_ns - since_ns) as f64 * 1e-9,
            sigma_s: self.start_sigma_s?,
            level_n: None,
        })
    }

    /// Returns the time (ns) until which the wheels off the edge were off the ground for certain: when the platform comes back,
    /// they touch it while the tyres still let the platform lean.
    pub(super) fn off_ground_until_ns(&self) -> i64 {
        if self.end_ns.is_none() {
            return i64::MAX;
        }
        let mut angles = self.angles.iter().rev();
        let leans = angles.find(|(_, angle)| *angle > self.spell.sigma);
        leans.map_or(self.start_ns, |(at_ns, _)| *at_ns)
    }

    /// Returns the first and the last time (ns) in which the platform stood on no wheel: it lay on its side, or tumbled. Gyro and
    /// attitude must agree on the rotation, and have seen how the platform got there: of a log without a reference before it, at
    /// least a part of the way.
    pub(crate) fn on_side_ns(&self) -> Option<[i64; 2]> {
        let is_seen = !self.spell.is_from_start || self.is_seen_to_fall();
        let is_sure = self.spell.witness.is_both() && is_seen;
        let tumbled = self.reached(RotationSpell::TUMBLES);
        let since = [tumbled, self.spell.at_rest_ns].into_iter().flatten().min();
        let since = since.filter(|_| is_sure)?;
        Some([since, self.span_ns()[1]])
    }

    /// Whether gyro and attitude together turn so far within the log that no error of a mounting explains the rotation.
    pub(crate) fn is_seen_to_fall(&self) -> bool {
        let angles = self.angles.iter().map(|(_, angle)| *angle);
        let [least, most] = [f64::min, f64::max].map(|of| angles.clone().reduce(of).unwrap_or(0.0));
        self.spell.witness.is_both() && most - least > FALL_RAD
    }

    /// Probability of it: where the platform crept, or rested between wheels and side, and the loads show it on its wheels, the
    /// ground gave way under it, or something that is not measured holds it. Nothing tells which.
    pub(super) fn certainty(&self, is_by_loads: bool) -> f64 {
        let is_as_of_ground =
            self.spell.rested_ns.is_some() || (self.creeps && self.largest().0 < GROUND_RAD);
        match is_as_of_ground && !is_by_loads {
            true => HELD * self.spell.certainty,
            false => self.spell.certainty,
        }
    }

    /// Returns the probability that the rotation happened about this edge.
    pub(super) fn certainty_of_edge(&self, is_by_loads: bool) -> f64 {
        let certainty = self.certainty(is_by_loads);
        match self.other_edge {
            Some(_) => THIS_EDGE * certainty,
            None => certainty,
        }
    }

    /// Returns the measurement that shows the rotation.
    pub(crate) fn witness(&self) -> RotationWitness {
        self.spell.witness
    }

    /// Rotation at a time (rad): zero before the start.
    pub(crate) fn angle_at(&self, time_ns: i64) -> f64 {
        last_until(&self.angles, time_ns).map_or(0.0, |(_, angle)| *angle)
    }

    /// Its time, first and last (ns); without an end, all that follows.
    pub(crate) fn span_ns(&self) -> [i64; 2] {
        [self.start_ns, self.end_ns.unwrap_or(i64::MAX)]
    }
}

/// Rotations that gyro and attitude show in a log.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rotations {
    /// The rotations about edges.
    pub(crate) found: Vec<FoundRotation>,
    /// Rotation of the platform about each edge at the end, the farthest first, if a fall may have begun.
    pub(crate) turning: Vec<Turning>,
}

/// Evidence of gyro and attitude at a time.
#[derive(Debug, Clone, Copy)]
struct Point {
    at_ns: i64,
    shown: [Option<ShownUp>; 2],
}

/// Collects the rotations of a log from a watch over its samples.
#[derive(Debug, Default)]
pub(crate) struct RotationTrace {
    first_ns: Option<i64>,
    recent: VecDeque<Point>,
    open: Option<RotationSpell>,
    found: Vec<FoundRotation>,
}

impl RotationTrace {
    /// Takes the evidence of the watch in a sample.
    pub(crate) fn take(&mut self, watch: &PlatformRotation, stamp_ns: i64) {
        let shown = watch.shown_at(stamp_ns);
        if shown.iter().any(Option::is_some) {
            self.first_ns.get_or_insert(stamp_ns);
            let certain_ns = self.open.map(|spell| spell.certain_ns);
            if certain_ns.is_none_or(|certain| stamp_ns.saturating_sub(certain) < AFTER_NS) {
                self.recent.push_back(Point {
                    at_ns: stamp_ns,
                    shown,
                });
            }
        }
        match (watch.spell(), watch.ended()) {
            (_, Some(ended)) => self.close(watch, ended, Some(ended.last_ns)),
            (Some(spell), None) => self.open = Some(*spell),
            (None, None) => {
                while let Some(point) = self.recent.front()
                    && stamp_ns.saturating_sub(point.at_ns) > KEPT_NS
                {
                    self.recent.pop_front();
                }
            }
        }
    }

    /// The rotations, and one that may have begun, after the last sample.
    pub(crate) fn finish(mut self, watch: &PlatformRotation) -> Rotations {
        let turning = match watch.spell() {
            Some(spell) => {
                self.close(watch, spell, None);
                Vec::new()
            }
            None => {
                let last = self.recent.back().map(|point| point.at_ns);
                last.map_or_else(Vec::new, |at_ns| Turning::at_end(watch, at_ns))
            }
        };
        Rotations {
            found: self.found,
            turning,
        }
    }

    fn close(&mut self, watch: &PlatformRotation, spell: &RotationSpell, end_ns: Option<i64>) {
        self.open = None;
        let points = std::mem::take(&mut self.recent);
        self.found.push(self.found_in(points, watch, spell, end_ns));
    }

    fn found_in(
        &self,
        points: VecDeque<Point>,
        watch: &PlatformRotation,
        spell: &RotationSpell,
        end_ns: Option<i64>,
    ) -> FoundRotation {
        let axis = watch.axis(spell.edge);
        let source = usize::from(!spell.witness.is_by_gyro());
        let mut shown: Vec<(i64, ShownUp)> = (points.into_iter())
            .filter_map(|point| Some((point.at_ns, point.shown[source]?)))
            .collect();
        let from_ns = searched_from_ns(&shown, &axis, spell.left_ns);
        shown.retain(|(at_ns, _)| *at_ns >= from_ns);
        let rates = rates(&shown, &axis, from_ns, spell.left_ns);
        let seconds = |at_ns: i64| at_ns.saturating_sub(from_ns) as f64 * 1e-9;
        let rotation =
            |from: &ShownUp, to: &ShownUp| RotationSpell::rotation_between(&axis, &from.up, &to.up);
        let fitted_s = rates.times_s.first().copied().zip(
            (shown.get(rates.times_s.len()).or(shown.last())).map(|(at_ns, _)| seconds(*at_ns)),
        );
        let has_gap = fitted_s.is_some_and(|(from_s, to_s)| rates.has_gap(from_s, to_s));
        let first_s = seconds(self.first_ns.unwrap_or(from_ns));
        let point_at = |at_s: f64| {
            let next = shown.partition_point(|(at_ns, _)| seconds(*at_ns) < at_s);
            shown.get(next).or(shown.last()).map(|(_, point)| point)
        };
        // from the reference of that time: a machine that drives takes the first degrees of its fall for the ground
        let lean_at = |at_s: f64| {
            point_at(at_s).map_or(0.0, |point| {
                RotationSpell::rotation_between(&axis, &point.reference_up, &point.up)
            })
        };
        let lean_rad = if spell.is_from_start {
            f64::INFINITY
        } else {
            spell.sigma
        };
        // without a reference it must be seen that the platform stood at first; until the onset it may lean under a moving arm,
        // or on fewer wheels
        let since_first = |at_s: f64| {
            let points = point_at(first_s).zip(point_at(at_s));
            points.map_or(0.0, |(first, point)| rotation(first, point).abs())
        };
        let stood = |onset: &Onset| {
            // at the same rate in the shorter time that a log may contain
            let for_s = (onset.at_s - first_s).min(STOOD_S);
            !spell.is_from_start
                || (since_first(first_s + for_s) < STOOD_RAD * for_s / STOOD_S
                    && since_first(onset.at_s) < FITTED_RAD)
        };
        // without a reference, what turns already when the log begins had begun to, however much faster it turns later
        let begins_with_log =
            spell.is_from_start && self.first_ns.is_some_and(|first_ns| first_ns >= from_ns);
        let had_begun = match begins_with_log && !has_gap {
            true => onset::had_begun(&rates),
            false => 0.0,
        };
        let onset: Option<Onset> = (!has_gap && had_begun < BEYOND_SURE)
            .then(|| onset::of_rates(&rates, lean_at, lean_rad))
            .flatten()
            .filter(|onset| onset.at_s > first_s + FIRST_S && stood(onset));
        let shown_first = || {
            let stood_at_first = lean_at(first_s) < SURE_SIGMAS * spell.sigma
                && since_first(first_s + FIRST_S) < FITTED_RAD * FIRST_S / STOOD_S;
            let shows = |(_, point): &&(i64, ShownUp)| {
                point_at(first_s).is_some_and(|first| rotation(first, point) > FITTED_RAD)
            };
            (shown.iter().filter(|_| stood_at_first))
                .find(shows)
                .map(|(at_ns, _)| *at_ns)
        };
        let start_ns = match onset {
            Some(onset) => from_ns + (onset.at_s * 1e9).round() as i64,
            None if spell.is_from_start && !has_gap => {
                // one that may have stood on some wheels at first began at or before the sample that shows it, not before the log
                (had_begun <= 1.0 - BEYOND_SURE)
                    .then(shown_first)
                    .flatten()
                    .or(self.first_ns)
                    .unwrap_or(spell.left_ns)
            }
            None => spell.left_ns,
        };
        let begins = shown.partition_point(|(at_ns, _)| *at_ns < start_ns);
        let since = &shown[begins.min(shown.len())..];
        // one that began before the log, or in a gap, is counted from its reference
        let offset = match (since.first(), onset.is_none()) {
            (Some(_), true) => {
                let last = since.iter().rfind(|(at_ns, _)| *at_ns <= spell.largest_ns);
                let of_last = (since.first().zip(last))
                    .map_or(0.0, |(first, last)| rotation(&first.1, &last.1));
                spell.largest - of_last
            }
            _ => 0.0,
        };
        let mut angles: Vec<(i64, f64)> = Vec::with_capacity(since.len());
        if let Some((_, first)) = since.first() {
            for (at_ns, point) in since {
                angles.push((*at_ns, offset + rotation(first, point)));
            }
        }
        FoundRotation {
            creeps: onset.is_some() && creeps(&angles, start_ns),
            edge: watch.edge_name(spell.edge).to_lowercase(),
            other_edge: (spell.other_edge).map(|edge| watch.edge_name(edge).to_lowercase()),
            spell: *spell,
            start_ns,
            start_sigma_s: onset.map(|onset| onset.sigma_s),
            end_ns,
            angles,
            on_tyres_rad: watch.turn_on_tyres(spell.edge),
        }
    }
}

/// Rates of outward rotation about an axis from a time on (ns), up to where the onset of a rotation is fitted, of a platform that left its
/// reference at another (ns).
fn rates(shown: &[(i64, ShownUp)], axis: &Vector3<f64>, from_ns: i64, left_ns: i64) -> Curve {
    let at_left = shown
        .iter()
        .find(|(at_ns, _)| *at_ns >= left_ns)
        .or(shown.last());
    let is_fitted = |(at_ns, point): &&(i64, ShownUp)| {
        // before it, the platform may have stood on other ground
        *at_ns < left_ns
            || at_left.is_none_or(|(_, left)| {
                RotationSpell::rotation_between(axis, &left.up, &point.up) <= FITTED_RAD
            })
    };
    let from = shown.partition_point(|(at_ns, _)| *at_ns < from_ns);
    let mut rates = Curve::default();
    for (at_ns, point) in shown[from..].iter().take_while(is_fitted) {
        let since_s = at_ns.saturating_sub(from_ns) as f64 * 1e-9;
        rates.push(since_s, axis.dot(&point.rate));
    }
    rates
}

/// Returns the time (ns) from which on the onset of a rotation is searched: earlier where the onset found lies at the beginning,
/// as long as the rates have no gap there and show an onset.
fn searched_from_ns(shown: &[(i64, ShownUp)], axis: &Vector3<f64>, left_ns: i64) -> i64 {
    let onset = |from_ns: i64| {
        let rates = rates(shown, axis, from_ns, left_ns);
        let has_gap = (rates.times_s.first().zip(rates.times_s.last()))
            .is_some_and(|(first_s, last_s)| rates.has_gap(*first_s, *last_s));
        onset::of_rates(&rates, |_| 0.0, f64::INFINITY).filter(|_| !has_gap)
    };
    let mut from_ns = left_ns.saturating_sub(BEFORE_NS);
    let mut found = onset(from_ns);
    let has_earlier = |from_ns: i64| {
        shown
            .first()
            .is_some_and(|(first_ns, _)| *first_ns < from_ns)
    };
    while found.is_some_and(|onset| onset.at_s < AT_BEGINNING_S) && has_earlier(from_ns) {
        let earlier_ns = from_ns.saturating_sub(BEFORE_NS);
        found = onset(earlier_ns);
        if found.is_none() {
            break;
        }
        from_ns = earlier_ns;
    }
    from_ns
}

/// Whether the rotation of a platform goes on at its mean rate, unlike that of a fall. The moment that turns a falling platform
/// grows with the rotation: from rest, the angle grows at least with the cube of time,
/// ```text
///     angle = a t^3:      rate = 3 angle / t
/// ```
/// Ground that gives way, or a force that holds, sets the rate otherwise.
fn creeps(angles: &[(i64, f64)], start_ns: i64) -> bool {
    let Some(at) = angles.iter().position(|(_, angle)| *angle >= GROWN_RAD) else {
        return false;
    };
    let since_s = |place: usize| angles[place].0.saturating_sub(start_ns) as f64 * 1e-9;
    let mean = angles[at].1 / since_s(at);
    // over the last quarter of the time
    let before = angles.partition_point(|(at_ns, _)| {
        at_ns.saturating_sub(start_ns) as f64 * 1e-9 < 0.75 * since_s(at)
    });
    let last = (angles[at].1 - angles[before.min(at)].1) / (since_s(at) - since_s(before.min(at)));
    last < GROWN * mean
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};
    use tipwatch_mechanics::state::{Sample, Sensor, Sensors};

    use super::*;
    use crate::base::rigid::rigid;

    const GRAVITY: f64 = 9.8066;
    const PERIOD_NS: i64 = 8_000_000;

    /// The rotations of a platform on level ground that rolls (rad, to the right, by time in s) while it travels (m/s).
    fn found(speed: f64, until_s: f64, roll: impl Fn(f64) -> f64) -> Vec<FoundRotation> {
        rotations(speed, until_s, roll).found
    }

    /// Finds the rotations of a platform on level ground that rolls (rad, to the right, by time in s) while it travels (m/s), and
    /// how it turns at the end.
    fn rotations(speed: f64, until_s: f64, roll: impl Fn(f64) -> f64) -> Rotations {
        let machine = rigid();
        let sensors = Sensors {
            imu: true,
            odometry: true,
            ..Sensors::default()
        };
        let mut watch = PlatformRotation::new(&machine, &sensors);
        let mut trace = RotationTrace::default();
        for step in 0..(until_s * 1e9) as i64 / PERIOD_NS {
            let stamp_ns = step * PERIOD_NS;
            let at_s = stamp_ns as f64 * 1e-9;
            let attitude = UnitQuaternion::from_euler_angles(roll(at_s), 0.0, 0.0);
            let force = attitude.inverse_transform_vector(&(Vector3::z() * GRAVITY));
            let rate = (roll(at_s + 1e-4) - roll(at_s)) * 1e4;
            // noise of a gyro, so that a fall has to stand out of something
            let noise = 1e-3 * (91.0 * at_s).sin();
            let mut values = [0.0; 10];
            values[..3].copy_from_slice(force.as_slice());
            values[3] = rate + noise;
            values[6..].copy_from_slice(attitude.coords.as_slice());
            let mut odometry = [0.0; 10];
            (odometry[0], odometry[9]) = (speed, 1.0);
            for (sensor, values) in [(Sensor::Odometry, odometry), (Sensor::Imu, values)] {
                watch.step(&Sample {
                    sensor,
                    stamp_ns,
                    values: &values,
                });
            }
            trace.take(&watch, stamp_ns);
        }
        trace.finish(&watch)
    }

    #[test]
    fn a_fall_that_has_begun_when_the_log_ends_is_not_unseen() {
        for since_s in [0.4, 0.45, 0.5] {
            let ended = rotations(0.0, 3.0 + since_s, fall(3.0));
            let turning = &ended.turning[0];
            assert!(ended.found.is_empty(), "{since_s} s: {:?}", ended.found);
            assert_eq!(turning.edge, "right", "{since_s} s");
            assert!(turning.is_beyond_ground, "{since_s} s: {turning:?}");
            let angle = fall(3.0)(turning.at_ns as f64 * 1e-9);
            assert!(
                (turning.rotation_rad / angle - 1.0).abs() < 0.3,
                "{since_s} s: {turning:?}, {angle} rad"
            );
        }
    }

    #[test]
    fn a_platform_that_rocks_on_its_tyres_when_the_log_ends_does_not_fall() {
        let rocks = |at_s: f64| 0.3_f64.to_radians() * (12.0 * at_s).sin();
        for step in 0..40 {
            let ended = rotations(0.0, 3.0 + 0.025 * f64::from(step), rocks);
            let mut turning = ended.turning.iter();
            assert!(turning.all(|it| !it.is_beyond_tyres), "{step}");
        }
    }

    /// The ground turns a machine that drives as fast as a fall does: the loads decide.
    #[test]
    fn ground_that_turns_a_driving_machine_when_the_log_ends_is_no_fall_by_itself() {
        let over = |at_s: f64| 6.0_f64.to_radians() * (at_s - 3.0).clamp(0.0, 1.0);
        for until_s in [3.3, 3.5, 3.7] {
            let ended = rotations(1.5, until_s, over);
            let mut turning = ended.turning.iter();
            assert!(turning.all(|it| !it.is_beyond_ground), "{until_s} s");
        }
    }

    /// Returns the angle of a fall that begins at a time (s): the moment that turns the machine grows from zero.
    fn fall(from_s: f64) -> impl Fn(f64) -> f64 {
        move |at_s: f64| {
            let since_s = (at_s - from_s).max(0.0);
            (0.3 * ((2.5 * since_s).sinh() / 2.5 - since_s)).min(1.5)
        }
    }

    #[test]
    fn the_onset_of_a_fall_does_not_depend_on_the_speed() {
        for speed in [0.0, 1.0, 3.0, 5.0, 8.0] {
            let found = found(speed, 6.0, fall(3.0));
            assert_eq!(found.len(), 1, "{speed} m/s: {found:?}");
            let error_s = found[0].start_ns as f64 * 1e-9 - 3.0;
            let sigma_s = found[0].start_sigma_s.unwrap();
            assert!(error_s.abs() < 0.25, "{speed} m/s: {error_s} s");
            assert!(
                error_s.abs() < 2.0 * sigma_s,
                "{speed} m/s: {error_s} +- {sigma_s} s"
            );
        }
    }

    /// The reference of a machine whose wheels creep follows the first degrees of a fall that begins in balance.
    #[test]
    fn the_onset_of_a_slow_fall_on_wheels_that_creep_is_not_where_it_is_found() {
        for (speed, growth) in [(0.12, 1.0), (0.15, 0.8), (0.15, 1.3)] {
            let fall = |at_s: f64| {
                let since = growth * (at_s - 6.0_f64).max(0.0);
                (0.006 * (since.sinh() - since)).min(1.2)
            };
            let found = found(speed, 16.0, fall);
            assert_eq!(found.len(), 1, "{speed} m/s, {growth}: {found:?}");
            let error_s = found[0].start_ns as f64 * 1e-9 - 6.0;
            let sigma_s = found[0].start_sigma_s.unwrap();
            assert!(
                error_s.abs() < 0.5 && sigma_s < 2.0,
                "{speed} m/s, {growth}: {error_s} +- {sigma_s} s"
            );
        }
    }

    #[test]
    fn a_platform_that_comes_to_rest_below_its_side_is_propped_or_on_ground_that_gave_way() {
        let gives_way = |at_s: f64| {
            let share = ((at_s - 3.0) / 1.5).clamp(0.0, 1.0);
            0.3 * share * share * (3.0 - 2.0 * share)
        };
        let settled = found(0.0, 9.0, gives_way);
        assert_eq!(settled.len(), 1, "{settled:?}");
        let rested_s = settled[0].spell.rested_ns.unwrap() as f64 * 1e-9;
        assert!((4.0..4.7).contains(&rested_s), "{rested_s}");
        assert!(settled[0].certainty(false) <= 0.5);
        assert!(settled[0].certainty(true) > 0.9, "a fall by the loads, too");
        let creeping = found(0.0, 12.0, |at_s: f64| ((at_s - 3.0) * 0.04).clamp(0.0, 1.0));
        assert!(creeping[0].creeps, "{creeping:?}");
        assert!(creeping[0].certainty(false) <= 0.5);
        let fallen = found(0.0, 9.0, fall(3.0));
        assert!(
            fallen[0].spell.rested_ns.is_none() && !fallen[0].creeps,
            "{fallen:?}"
        );
        assert!(fallen[0].certainty(false) > 0.9);
    }

    #[test]
    fn a_fall_in_the_first_moments_of_a_log_is_not_one_from_before_it() {
        for begins_s in [0.05, 0.15, 0.3, 0.6] {
            let found = found(0.0, 4.0, fall(begins_s));
            assert_eq!(found.len(), 1, "{begins_s} s: {found:?}");
            let error_s = found[0].start_ns as f64 * 1e-9 - begins_s;
            // it began then, or at or before
            match found[0].start_sigma_s {
                Some(sigma_s) => {
                    assert!(error_s.abs() < 2.0 * sigma_s, "{begins_s} s: {error_s} s");
                }
                None => assert!((0.0..0.8).contains(&error_s), "{begins_s} s: {error_s} s"),
            }
        }
        let before = found(0.0, 4.0, fall(-0.5));
        assert!(
            before[0].start_sigma_s.is_none() && before[0].start_ns < 50_000_000,
            "{before:?}"
        );
    }

    #[test]
    fn a_slow_fall_that_is_under_way_in_the_first_samples_begins_with_the_log() {
        let slow = |at_s: f64| {
            let since_s = (at_s + 1.0).max(0.0);
            (0.05 * ((1.5 * since_s).sinh() / 1.5 - since_s)).min(1.5)
        };
        let found = found(0.0, 5.0, slow);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].start_sigma_s, None);
        assert!(found[0].start_ns < 50_000_000, "{}", found[0].start_ns);
    }

    #[test]
    fn a_log_that_begins_in_the_fall_ends_on_its_side() {
        let falls = found(0.0, 4.0, |at_s| (0.9 + 0.8 * at_s).min(1.6));
        assert_eq!(falls.len(), 1, "{falls:?}");
        assert!(falls[0].start_sigma_s.is_none(), "{falls:?}");
        let [since_ns, until_ns] = falls[0].on_side_ns().unwrap();
        let angle = falls[0].angle_at(since_ns);
        assert!((angle - RotationSpell::TUMBLES).abs() < 0.05, "{angle}");
        assert_eq!(until_ns, i64::MAX);
        // nothing shows that one which lies there from the first sample on did not stand, with its IMU mounted otherwise
        let lies = found(0.0, 4.0, |_| 1.4);
        assert!(lies.iter().all(|it| it.on_side_ns().is_none()), "{lies:?}");
    }
}
