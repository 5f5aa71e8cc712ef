//! Measured loads of supports whose samples are too far apart for the estimator, each held until the next one.

use tipwatch_mechanics::estimation::plausibility::are_shown_to_be_measured;
use tipwatch_mechanics::estimation::sorted_stamps;
use tipwatch_mechanics::machine::{ForceSource, Machine};
use tipwatch_mechanics::state::{NumberKind, Sensor, Sensors};

use super::recording::Recording;
use crate::base::rows::last_until;

/// Time for which a sample holds, as a multiple of the median time between two.
const HOLDS_PERIODS: f64 = 1.5;
/// A sample never holds longer (ns): a jack lifts within seconds.
const LONGEST_NS: f64 = 3e9;

/// The loads of supports that are measured slowly.
#[derive(Debug, Clone, Default)]
pub(crate) struct HeldForces {
    forces: Vec<HeldForce>,
}

#[derive(Debug, Clone)]
struct HeldForce {
    /// Index of the actuated joint.
    joint: usize,
    /// Stamps (ns), rising, and forces (N); NaN where nothing shows that the force is measured.
    samples: Vec<(i64, f64)>,
    period_ns: i64,
}

impl HeldForces {
    /// Collects the forces that are held, among the recordings of these sensors.
    pub(super) fn of<'r>(
        machine: &Machine,
        sensors: &Sensors,
        recordings: impl Iterator<Item = (Sensor, &'r Recording)>,
    ) -> Self {
        let joints = &machine.contact().actuated_joints;
        let of_signal = |(sensor, recording): (Sensor, &Recording)| {
            let Sensor::Number(NumberKind::Actuator, at) = sensor else {
                return None;
            };
            let of_joint = &sensors.actuators[at];
            let joint = &joints[of_joint.joint];
            if !matches!(joint.source, ForceSource::Support { .. }) {
                return None;
            }
            let sorted = sorted_stamps(&recording.stamps_ns);
            let mut steps: Vec<i64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
            steps.sort_unstable();
            let period_ns = *steps.get(steps.len() / 2)?;
            if period_ns <= machine.longest_known_gap_ns() {
                return None;
            }
            let factor = joint.signals[of_joint.signal];
            let mut reader = recording.reader();
            let stamps = recording.stamps_ns.iter().enumerate();
            let mut samples: Vec<(i64, f64)> = stamps
                .map(|(at, &stamp)| (stamp, factor * reader.sample(at)[0]))
                .collect();
            samples.sort_by_key(|(stamp, _)| *stamp);
            // as of those that are sampled often enough, which split the load
            let shown = are_shown_to_be_measured(machine, &samples);
            for ((_, force), is_shown) in samples.iter_mut().zip(shown) {
                *force = if is_shown { *force } else { f64::NAN };
            }
            Some(HeldForce {
                joint: of_joint.joint,
                samples,
                period_ns,
            })
        };
        Self {
            forces: recordings.filter_map(of_signal).collect(),
        }
    }

    /// The median time between two samples of an actuated joint that is measured slowly (ns).
    pub(crate) fn period_ns(&self, joint: usize) -> Option<i64> {
        self.of_joint(joint).map(|force| force.period_ns)
    }

    /// The force of an actuated joint at a time (N): the last sample until then; NaN if it is too old, or if the joint is
    /// not measured slowly.
    pub(crate) fn at(&self, joint: usize, time_ns: i64) -> f64 {
        let held = || {
            let force = self.of_joint(joint)?;
            let &(stamp, value) = last_until(&force.samples, time_ns)?;
            let longest_ns = (HOLDS_PERIODS * force.period_ns as f64).min(LONGEST_NS);
            let is_young = (time_ns.saturating_sub(stamp) as f64) <= longest_ns;
            is_young.then_some(value)
        };
        held().unwrap_or(f64::NAN)
    }

    fn of_joint(&self, joint: usize) -> Option<&HeldForce> {
        self.forces.iter().find(|force| force.joint == joint)
    }
}
