//! Joints that are asked to move, and whose encoders show that they stand.
//!
//! An encoder that sticks while its noise goes on looks like a joint at rest. What the controller asks of the joint tells the two apart:
//! ```text
//!     asked = integral of the rate that is asked, while it keeps its direction
//!     shown = position less that at its start, as a share of it
//! ```
//! A joint of which a second and a tenth of a radian or metre show less than a tenth does not move, or its encoder does not show it: the
//! hydraulics are off, a valve is stuck, something blocks it. Which of them is not known, so nothing is contradicted. But nothing proves
//! its encoder, also in the sessions that follow, until it shows half of what is asked, or a person trusts it. A joint that is pushed
//! against its limit is not asked.

use super::plausibility::SignalDoubt;
use super::turns::shorter_way;
use super::white_jerk::seconds;
use crate::geometry::coordinate::Motion;
use crate::machine::{Machine, Proof, Proofs};

/// Least motion (rad or m) and time (s) that are asked for before a joint is judged.
const LEAST_ASKED: f64 = 0.1;
const LEAST_S: f64 = 1.0;
/// Share of what is asked below which a joint stands, and from which it follows.
const STANDS: f64 = 0.1;
const FOLLOWS: f64 = 0.5;

/// The joints of a machine, commanded or not: one that a file of before commanded stays doubted.
#[derive(Debug, Clone)]
pub(super) struct Obedience {
    joints: Vec<Commanded>,
    last_ns: Option<i64>,
    /// Longest time for which a rate counts as asked (s).
    max_gap_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Commanded {
    joint: usize,
    turns: bool,
    /// Positions from which it is at its limits (rad or m).
    stops: [f64; 2],
    /// Integral of the rate that is asked (rad or m), for how long (s), and the position at its start.
    asked: f64,
    for_s: f64,
    from: f64,
    stands: bool,
}

impl Obedience {
    pub(super) fn new(machine: &Machine) -> Self {
        let commanded = |joint: usize| Commanded {
            joint,
            turns: machine.joint_turns(joint),
            stops: machine.joint_stops(joint),
            asked: 0.0,
            for_s: 0.0,
            from: f64::NAN,
            stands: false,
        };
        let joints = 0..machine.joints().len();
        // the angle of a wheel does not matter
        let joints = joints.filter(|&joint| machine.joints()[joint].spins_wheel.is_none());
        Self {
            joints: joints.map(commanded).collect(),
            last_ns: None,
            max_gap_s: machine.estimator().max_gap,
        }
    }

    /// Takes a row: the rate that is asked of each joint (rad/s or m/s, NaN: nothing is known), and where the joints are.
    pub(super) fn row(&mut self, time_ns: i64, rates: &[f64], joints: &[Motion<f64>]) {
        let last_ns = self.last_ns.replace(time_ns);
        let step_s = last_ns.map_or(0.0, |last_ns| seconds(time_ns.saturating_sub(last_ns)));
        // what was asked in a hole is not known
        let step_s = step_s.min(self.max_gap_s);
        for it in &mut self.joints {
            it.row(step_s, rates[it.joint], joints[it.joint].position);
        }
    }

    /// Trusts these joints, as a person says, until they do not follow once more.
    pub(super) fn trust(&mut self, signals: Proofs) {
        let joints = self.joints.iter_mut();
        for it in joints.filter(|it| signals.has(Proof::Joint(it.joint))) {
            it.stands = false;
            it.begin(0.0, f64::NAN);
        }
    }

    /// Takes over from an earlier session which joints did not show what was asked.
    pub(super) fn inherit(&mut self, doubts: &[SignalDoubt]) {
        for it in &mut self.joints {
            it.stands |= doubts.contains(&SignalDoubt::disobedient(it.joint));
        }
    }

    /// The doubts of joints whose encoders nothing proves, because they do not show what is asked.
    pub(super) fn doubts(&self) -> impl Iterator<Item = SignalDoubt> {
        let standing = self.joints.iter().filter(|it| it.stands);
        standing.map(|it| SignalDoubt::disobedient(it.joint))
    }
}

impl Commanded {
    fn row(&mut self, step_s: f64, rate: f64, position: f64) {
        let [least, greatest] = self.stops;
        let is_stopped = (rate < 0.0 && position <= least) || (rate > 0.0 && position >= greatest);
        let goes_on = rate * self.asked > 0.0 && self.from.is_finite();
        if !goes_on || is_stopped {
            // unknown, at rest, turned round, or at its limit
            self.begin(if is_stopped { 0.0 } else { rate * step_s }, position);
            return;
        }
        self.asked += rate * step_s;
        self.for_s += step_s;
        let way = position - self.from;
        let way = if self.turns { shorter_way(way) } else { way };
        let share = way / self.asked;
        if self.asked.abs() < LEAST_ASKED {
            return;
        }
        if share >= FOLLOWS {
            self.stands = false;
        } else if self.for_s >= LEAST_S {
            self.stands |= share < STANDS;
        } else {
            return;
        }
        self.begin(rate * step_s, position);
    }

    /// Begins with what is asked in the first step; nothing if that is unknown.
    fn begin(&mut self, asked: f64, position: f64) {
        self.asked = if asked.is_finite() { asked } else { 0.0 };
        (self.for_s, self.from) = (0.0, position);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEW: Commanded = Commanded {
        joint: 0,
        turns: false,
        stops: [-1.0, 1.0],
        asked: 0.0,
        for_s: 0.0,
        from: f64::NAN,
        stands: false,
    };

    #[test]
    fn what_is_asked_before_and_after_a_hole_is_not_asked_in_it_and_a_person_may_trust_the_joint() {
        let mut obedience = Obedience {
            joints: vec![NEW],
            last_ns: None,
            max_gap_s: 0.25,
        };
        let mut stands_after = |times_ms: std::ops::Range<i64>| {
            for time_ms in times_ms.step_by(10) {
                obedience.row(time_ms * 1_000_000, &[0.2], &[Motion::at_rest(0.3)]);
            }
            let stands: Proofs = obedience.doubts().map(|doubt| doubt.signal).collect();
            obedience.trust(stands);
            stands.has(Proof::Joint(0))
        };
        assert!(!stands_after(0..500));
        assert!(!stands_after(60_000..60_100));
        // by a second of rows, and once more after it was trusted
        assert!(stands_after(60_100..61_000));
        assert!(!stands_after(61_000..61_500));
        assert!(stands_after(61_500..62_500));
    }

    #[test]
    fn a_joint_that_did_not_obey_before_a_restart_is_doubted_until_it_follows() {
        let with_it = |doubts: &[SignalDoubt], asked: f64| {
            let mut obedience = Obedience {
                joints: vec![NEW],
                last_ns: None,
                max_gap_s: 0.25,
            };
            obedience.inherit(doubts);
            for step in 0..200 {
                let position = asked * f64::from(step) * 0.01;
                let joints = [Motion::at_rest(position)];
                obedience.row(i64::from(step) * 10_000_000, &[asked], &joints);
            }
            obedience.doubts().collect::<Vec<_>>()
        };
        let doubt = SignalDoubt::disobedient(0);
        // of another joint, or another doubt
        let frozen = SignalDoubt {
            moved: 0.3,
            ..doubt
        };
        assert!(with_it(&[SignalDoubt::disobedient(1), frozen], 0.0).is_empty());
        for asked in [0.0, f64::NAN] {
            assert_eq!(with_it(&[doubt], asked), [doubt], "{asked}");
        }
        assert!(with_it(&[doubt], 0.2).is_empty());
    }

    /// Whether a joint with limits at -1 and 1 stands after each second; `asked` gives the rate (rad/s) and `shown` the position (rad)
    /// at a time (s).
    fn stands(asked: impl Fn(f64) -> f64, shown: impl Fn(f64) -> f64) -> Vec<bool> {
        let mut joint = NEW;
        let after = |second: usize| {
            for step in 100 * second..100 * (second + 1) {
                let time_s = step as f64 * 0.01;
                let noise = 2e-4 * (time_s * 71.0).sin();
                joint.row(0.01, asked(time_s), shown(time_s) + noise);
            }
            joint.stands
        };
        (0..6).map(after).collect()
    }

    #[test]
    fn an_encoder_that_sticks_while_the_joint_is_asked_to_move_is_not_proven_until_it_follows() {
        let none = [false; 6];
        let rests = |t: f64| if (1.0..4.0).contains(&t) { 0.2 } else { 0.0 };
        // it sticks from the start, or in mid-motion, and is mended
        assert_eq!(
            stands(rests, |_| 0.3),
            [false, false, true, true, true, true]
        );
        let sticks = |t: f64| 0.2 * t.min(1.5);
        assert_eq!(
            stands(|_| 0.2, sticks),
            [false, false, true, true, true, true]
        );
        let mended = |t: f64| -0.5 + if t < 3.0 { 0.0 } else { 0.2 * (t - 3.0) };
        assert_eq!(stands(|_| 0.2, mended)[2..], [true, false, false, false]);
        // it follows, late or slowly; nothing is asked; the lever plays about zero; it is pushed against its limit
        assert_eq!(stands(|_| 0.2, |t| -0.5 + 0.2 * (t - 0.4).max(0.0)), none);
        assert_eq!(stands(|_| 0.2, |t| -0.5 + 0.06 * t), none);
        assert_eq!(stands(|_| 0.0, |_| 0.3), none);
        assert_eq!(stands(|_| f64::NAN, |_| 0.3), none);
        assert_eq!(stands(|_| 0.2, |_| f64::NAN), none);
        assert_eq!(stands(|t| 0.2 * (20.0 * t).sin(), |_| 0.3), none);
        assert_eq!(stands(|_| 0.2, |_| 1.01), none);
    }
}
