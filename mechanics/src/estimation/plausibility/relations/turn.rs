//! The motion over the ground: turns by the gyro against odometry, speeds and steering of the wheels; way by the wheels
//! against odometry.

use super::super::explanation::Explanation;
use super::super::fault::YawBy;
use super::likelihood::{Evidence, Mixture, Standing};
use super::window::Window;
use crate::machine::Axis;

/// Turn about the vertical.
///
/// A machine without steered wheels skids: it turns by any part of what the speeds of its wheels say, and so does an odometry
/// that rests on them. There the turn by the gyro is predicted to lie between nothing and that turn.
#[derive(Debug, Clone)]
pub(super) struct TurnRelation {
    pub(super) by: YawBy,
    skids: bool,
    alternatives: Alternatives,
}

/// Turn in a window that has other causes (rad), and the share of a turn that the wheels slip.
const LEAST_TURN: f64 = 0.01;
const ODOMETRY_SHARE: f64 = 0.12;
const WHEELS_SHARE: f64 = 0.35;
/// Lever arm at which wheels that contradict each other turn the machine (m).
const TRACK: f64 = 1.0;
const TURNS: Mixture = Mixture {
    outliers: 0.1,
    range: 0.5,
};

impl TurnRelation {
    pub(super) fn new(by: YawBy, skids: bool, threshold: f64) -> Self {
        let mut alternatives = vec![Explanation::Sign(Axis::Z)];
        if !skids {
            alternatives.push(Explanation::Stopped);
        }
        Self {
            by,
            skids,
            alternatives: Alternatives::new(alternatives, threshold),
        }
    }

    pub(super) fn weigh(&mut self, window: &Window) {
        let (other, share) = match self.by {
            YawBy::Odometry => (window.odometry_turned, ODOMETRY_SHARE),
            YawBy::Speeds => (window.by_speeds, WHEELS_SHARE),
            YawBy::Steering => (window.by_steering, WHEELS_SHARE),
        };
        let rolled = self.by == YawBy::Odometry || window.rolled.is_some();
        let (Some(gyro), Some(other), true) = (window.turned, other, rolled) else {
            self.alternatives.forget();
            return;
        };
        let gyro = gyro.z;
        let slip = match self.by {
            YawBy::Odometry => 0.0,
            YawBy::Speeds | YawBy::Steering => window.slip * window.duration_s / TRACK,
        };
        let nearest = |other: f64| match self.skids {
            true => gyro.clamp(other.min(0.0), other.max(0.0)),
            false => other,
        };
        let scale = |predicted: f64| {
            let largest = share * gyro.abs().max(predicted.abs());
            (LEAST_TURN * LEAST_TURN + slip * slip + largest * largest).sqrt()
        };
        let sound = TURNS.log_density(gyro - nearest(other), scale(other));
        let ratio = |explanation| match explanation {
            Explanation::Stopped => {
                // one shows nothing while the other moves: the smaller of the two is noise
                let least = gyro.abs().min(other.abs());
                let density = TURNS.log_density(least, LEAST_TURN.hypot(slip));
                let moves = gyro.abs().max(other.abs()) > 3.0 * LEAST_TURN.hypot(slip);
                if moves { density - sound } else { 0.0 }
            }
            _ => TURNS.log_density(gyro - nearest(-other), scale(other)) - sound,
        };
        self.alternatives.add(window.start_ns, ratio);
    }

    /// Whether the turns have refuted every alternative: that one of the two angular velocities has the other sign or does not
    /// follow.
    pub(super) fn is_proven(&self) -> bool {
        self.alternatives.list.iter().all(|(_, it)| it.is_refuted())
    }

    pub(super) fn standing(&self) -> Standing {
        self.alternatives.standing()
    }
}

/// Way by the wheels against that by the odometry. Wheels that lock or spin are no contradiction; only the opposite direction
/// is.
#[derive(Debug, Clone)]
pub(super) struct WayRelation {
    alternatives: Alternatives,
}

/// Way in a window that has other causes (m), and the share of it that wheels slip.
const LEAST_WAY: f64 = 0.015;
const WAY_SHARE: f64 = 0.2;
const WAYS: Mixture = Mixture {
    outliers: 0.2,
    range: 1.0,
};

impl WayRelation {
    pub(super) fn new(threshold: f64) -> Self {
        Self {
            alternatives: Alternatives::new(vec![Explanation::Sign(Axis::X)], threshold),
        }
    }

    pub(super) fn weigh(&mut self, window: &Window) {
        let (Some(odometry), Some(_)) = (window.travelled, window.rolled) else {
            self.alternatives.forget();
            return;
        };
        let wheels = window.distance;
        let share = WAY_SHARE * odometry.abs().max(wheels.abs());
        let slip = window.slip * window.duration_s;
        let scale = LEAST_WAY.hypot(share).hypot(slip);
        let sound = WAYS.log_density(odometry - wheels, scale);
        let reversed = WAYS.log_density(odometry + wheels, scale);
        self.alternatives.add(window.start_ns, |_| reversed - sound);
    }

    pub(super) fn standing(&self) -> Standing {
        self.alternatives.standing()
    }
}

/// The alternatives to sound sensors, each with its evidence.
#[derive(Debug, Clone)]
struct Alternatives {
    list: Vec<(Explanation, Evidence)>,
    threshold: f64,
}

impl Alternatives {
    fn new(explanations: Vec<Explanation>, threshold: f64) -> Self {
        let list = explanations.into_iter().map(|it| (it, Evidence::default()));
        Self {
            list: list.collect(),
            threshold,
        }
    }

    /// Adds a window that began at `start_ns`; `ratio` is the log likelihood ratio of an alternative.
    fn add(&mut self, start_ns: i64, ratio: impl Fn(Explanation) -> f64) {
        for (explanation, evidence) in &mut self.list {
            evidence.add(start_ns, ratio(*explanation), self.threshold);
        }
    }

    fn forget(&mut self) {
        self.list.iter_mut().for_each(|(_, it)| it.forget());
    }

    /// The best of the alternatives that stand.
    fn standing(&self) -> Standing {
        let standing = self.list.iter().filter(|(_, it)| it.stands());
        let best = standing.max_by(|a, b| a.1.sum.total_cmp(&b.1.sum))?;
        Some((best.0, best.1, self.threshold))
    }
}
