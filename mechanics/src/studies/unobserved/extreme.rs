//! The extreme of a wheel's OTF over a range of motion.

use super::signals::signals;
use crate::estimation::quasi_static::{MotionRange, Span};
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::machine::Machine;
use crate::state::State;

/// Widest step of the search along a position (rad or m).
const STEP: f64 = 0.2;
/// Most points of the search along a position.
const MOST_POINTS: usize = 13;
/// Ranges narrower than this are linear: positions (rad or m) and velocities (rad/s or m/s).
const NARROW: f64 = 0.01;
/// Range below which the angular velocity of the platform is linear (rad/s): at a quarter of a radian per second, centripetal
/// accelerations are some 0.06 m/s^2 a metre from the IMU.
const NARROW_TURN: f64 = 0.5;
/// Number of passes of the search through all positions and velocities.
const SWEEPS: usize = 2;

/// An extreme of `sign` times the OTF.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extreme {
    pub(super) value: f64,
}

/// The search for one wheel and one sign.
pub(super) struct Search<'a> {
    pub(super) machine: &'a Machine,
    pub(super) state: &'a State<f64>,
    pub(super) range: &'a MotionRange,
    pub(super) wheel: usize,
    pub(super) sign: f64,
    pub(super) workspace: &'a mut Workspace<f64>,
    pub(super) scratch: &'a mut State<f64>,
}

/// A signal in which the OTF is not linear.
#[derive(Debug, Clone, Copy)]
enum Curved {
    Position(usize),
    Rate(usize),
    AngularVelocity(usize),
}

impl Curved {
    fn is_wide(self, span: Span) -> bool {
        match self {
            Self::Position(_) | Self::Rate(_) => span.width() > NARROW,
            Self::AngularVelocity(_) => span.width() > NARROW_TURN,
        }
    }
}

/// The signals of a range in which the OTF is not linear.
fn curved(range: &MotionRange) -> Vec<(Curved, Span)> {
    let joints = range.joints.iter().enumerate();
    let joints = joints.flat_map(|(joint, [position, rate, _])| {
        [
            (Curved::Position(joint), *position),
            (Curved::Rate(joint), *rate),
        ]
    });
    let platform = range.angular_velocity.into_iter().enumerate();
    let platform = platform.map(|(axis, span)| (Curved::AngularVelocity(axis), span));
    joints
        .chain(platform)
        .filter(|(_, span)| span.width() > 0.0)
        .collect()
}

/// Whether the OTF is as good as linear over the whole range.
pub(super) fn is_linear(range: &MotionRange) -> bool {
    !curved(range)
        .into_iter()
        .any(|(signal, span)| signal.is_wide(span))
}

/// The largest change of `sign` times a number with these derivatives, over the range of those signals that are
/// `counted`: the sum of the absolute values, signal by signal.
pub(super) fn largest_change(
    sign: f64,
    derivatives: &[f64],
    signals: impl Iterator<Item = (f64, Span)>,
    counted: impl Fn(usize) -> bool,
) -> f64 {
    let each = signals.zip(derivatives).enumerate();
    let counted = each.filter(|(place, _)| counted(*place));
    let changes = counted.map(|(_, ((value, span), by))| {
        let by = sign * by;
        (by * (span.low - value)).max(by * (span.high - value))
    });
    changes.sum()
}

impl Search<'_> {
    pub(super) fn run(mut self) -> Extreme {
        self.scratch.clone_from(self.state);
        let curved = curved(self.range);
        let linear = self.value(true);
        // every signal at the end that its derivative points to
        let ends: Vec<f64> = (curved.iter())
            .map(|&(signal, span)| {
                let rises = self.derivative(signal) * self.sign > 0.0;
                if rises { span.high } else { span.low }
            })
            .collect();
        let mut best = self.value(false);
        let start: Vec<f64> = curved
            .iter()
            .map(|&(signal, _)| *self.signal(signal))
            .collect();
        for (&(signal, _), &end) in curved.iter().zip(&ends) {
            *self.signal(signal) = end;
        }
        let at_ends = self.value(false);
        if at_ends > best {
            best = at_ends;
        } else {
            for (&(signal, _), &value) in curved.iter().zip(&start) {
                *self.signal(signal) = value;
            }
        }
        let mut allowance = 0.0;
        for _ in 0..SWEEPS {
            allowance = 0.0;
            for &(signal, span) in curved.iter().filter(|it| it.0.is_wide(it.1)) {
                let (found, curvature) = self.along(signal, span, best);
                best = best.max(found);
                allowance += curvature;
            }
        }
        // what is linear at the row is a bound of its own where the search stays below it
        Extreme {
            value: (best + allowance).max(linear),
        }
    }

    fn signal(&mut self, signal: Curved) -> &mut f64 {
        match signal {
            Curved::Position(joint) => &mut self.scratch.joints[joint].position,
            Curved::Rate(joint) => &mut self.scratch.joints[joint].rate,
            Curved::AngularVelocity(axis) => &mut self.scratch.imu.angular_velocity[axis],
        }
    }

    /// Derivative of the OTF at the last state evaluated.
    fn derivative(&self, signal: Curved) -> f64 {
        let place = match signal {
            Curved::Position(joint) => 3 * joint,
            Curved::Rate(joint) => 3 * joint + 1,
            Curved::AngularVelocity(axis) => 3 * self.state.joints.len() + 3 + axis,
        };
        self.workspace.sensitivity().otf(self.wheel)[place]
    }

    /// Leaves the signal at its best value; returns the extreme found there, and the largest excess over it of a curve between
    /// the points.
    fn along(&mut self, signal: Curved, span: Span, best: f64) -> (f64, f64) {
        let points = match signal {
            Curved::Position(_) => {
                let steps = (span.width() / STEP).ceil().min(MOST_POINTS as f64);
                (steps as usize + 1).clamp(3, MOST_POINTS)
            }
            Curved::Rate(_) | Curved::AngularVelocity(_) => 3,
        };
        let kept = *self.signal(signal);
        let at = |k: usize| span.low + span.width() * k as f64 / (points - 1) as f64;
        let values: Vec<f64> = (0..points)
            .map(|k| {
                *self.signal(signal) = at(k);
                self.value(false)
            })
            .collect();
        // a linkage that cannot close there does not reach that position
        let known = values
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, value)| value.is_finite());
        let found = known.max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, value)) = found else {
            *self.signal(signal) = kept;
            return (best, 0.0);
        };
        *self.signal(signal) = if value > best { at(k) } else { kept };
        let around = (k > 0 && k + 1 < points).then(|| values[k - 1] - 2.0 * value + values[k + 1]);
        // the vertex of a parabola through three points is at most an eighth of its second difference above them
        let curvature = around
            .filter(|c| c.is_finite())
            .map_or(0.0, |c| c.abs() / 8.0);
        (value.max(best), curvature)
    }

    /// Sign times OTF at the scratch state, everything linear at its worst; with `all`, the other signals too, by
    /// their derivatives.
    fn value(&mut self, all: bool) -> f64 {
        let outcome = evaluate(self.machine, self.scratch, self.workspace);
        let otf = outcome.otf[self.wheel];
        let derivatives = self.workspace.sensitivity().otf(self.wheel);
        let joints = self.state.joints.len();
        let is_linear = |place: usize| match place {
            place if place < 3 * joints => place % 3 == 2,
            place => !(3 * joints + 3..3 * joints + 6).contains(&place),
        };
        let signals = signals(self.machine, self.scratch, self.range);
        let counted = |place: usize| all || is_linear(place);
        self.sign * otf + largest_change(self.sign, &derivatives, signals, counted)
    }
}
