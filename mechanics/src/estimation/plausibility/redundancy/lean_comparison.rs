//! The lean of the platform compared with the motion of the joints, and what the joints tell the other comparisons.

use nalgebra::Vector3;

use super::super::fault::{Finding, Part};
use super::super::notice::{Note, Rules};
use super::super::signals::Sound;
use super::lean::LeanWatch;
use super::rolling::Rolled;
use super::travel::Travel;
use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors};

/// Compares samples of all sensors, in stamp order. It takes as long as all other comparisons together.
#[derive(Debug, Clone)]
pub(in crate::estimation) struct LeanComparison {
    rules: Rules,
    travel: Travel,
    /// Of an IMU on the base.
    lean: Option<LeanWatch>,
    /// By stream: its joints, and of each the radius of the wheel that it spins, else NaN.
    joints: Vec<Vec<(usize, f64)>>,
}

/// What a sample tells of the wheels.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::estimation) struct ByWheels {
    /// Largest circumferential speed (m/s).
    pub(super) fastest: Option<f64>,
    /// The motion of the machine by them, if the sample changes what is known of it; `None` within: it is not known.
    pub(super) rolled: Option<Option<Rolled>>,
}

impl LeanComparison {
    /// The comparison before its first sample.
    pub(in crate::estimation) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let imu_on_base = sensors.imu && machine.imu().body == 0;
        let with_radius = |&joint: &usize| {
            let wheel = machine.joints()[joint].spins_wheel;
            let radius = wheel.map_or(f64::NAN, |wheel| machine.wheels()[wheel].radius);
            (joint, radius)
        };
        let streams = sensors.joints.iter();
        Self {
            rules: Rules::of(machine),
            travel: Travel::default(),
            lean: imu_on_base.then(|| LeanWatch::new(machine)).flatten(),
            joints: streams
                .map(|stream| stream.joints.iter().map(with_radius).collect())
                .collect(),
        }
    }

    /// Compares a sample that was checked by itself, and appends its faults to `findings`.
    pub(in crate::estimation) fn step(
        &mut self,
        sample: &Sample<'_>,
        sound: Sound,
        findings: &mut Vec<Finding>,
    ) -> ByWheels {
        match sample.sensor {
            Sensor::Joints(stream) if sound.whole => return self.take_joints(stream, sample),
            Sensor::Joints(_) => {
                if let Some(lean) = &mut self.lean {
                    lean.distrust_joints(sample.stamp_ns);
                }
                return ByWheels {
                    fastest: None,
                    rolled: Some(None),
                };
            }
            Sensor::Imu => self.compare_imu(sample, sound, findings),
            Sensor::Odometry if sound.velocity => {
                let velocity = Vector3::from_column_slice(&sample.values[..3]);
                self.travel.take_odometry(sample.stamp_ns, velocity);
            }
            Sensor::ToolWrench => {
                if let Some(lean) = &mut self.lean
                    && sound.whole
                {
                    let wrench =
                        [0, 3].map(|at| Vector3::from_column_slice(&sample.values[at..at + 3]));
                    lean.take_tool(sample.stamp_ns, wrench);
                }
            }
            Sensor::Odometry | Sensor::Actuator(_) => {}
        }
        ByWheels::default()
    }

    fn compare_imu(&mut self, sample: &Sample<'_>, sound: Sound, findings: &mut Vec<Finding>) {
        let Some(lean) = self.lean.as_mut().filter(|_| sound.force && sound.turning) else {
            return;
        };
        let Rules { limits, policies } = &self.rules;
        let mut note = Note::new(findings, policies, sample);
        let (force, turning) = (&sample.values[..3], &sample.values[3..6]);
        let [force, turning] = [force, turning].map(Vector3::from_column_slice);
        let found = &mut note.of(Part::Lean);
        lean.check(
            sample.stamp_ns,
            [&force, &turning],
            &self.travel,
            limits,
            found,
        );
    }

    fn take_joints(&mut self, stream: usize, sample: &Sample<'_>) -> ByWheels {
        let stamp_ns = sample.stamp_ns;
        let (positions, rates) = sample.values.split_at(sample.values.len() / 2);
        let speeds = self.joints[stream].iter().zip(rates);
        let speeds = speeds.map(|((_, radius), rate)| (radius * rate).abs());
        let fastest = speeds.filter(|speed| speed.is_finite()).reduce(f64::max);
        if let Some(fastest) = fastest {
            self.travel.take_wheels(stamp_ns, fastest);
        }
        let rolled = self.lean.as_mut().map(|lean| {
            let motions = self.joints[stream].iter().zip(positions.iter().zip(rates));
            let motions = motions.map(|(&(joint, _), (&position, &rate))| (joint, position, rate));
            lean.take_joints(stamp_ns, motions, &self.rules.limits);
            lean.rolled
        });
        ByWheels { fastest, rolled }
    }
}
