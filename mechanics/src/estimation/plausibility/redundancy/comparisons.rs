//! The sensors compared with each other.

use nalgebra::{Matrix3, Vector3};

use super::super::fault::{Finding, Part};
use super::super::notice::{Note, Rules};
use super::super::signals::Sound;
use super::drive::DriveWatch;
use super::lean_comparison::{ByWheels, LeanComparison};
use super::rolling::skids;
use super::rotation::RotationWatch;
use super::specific_force::SpecificForceWatch;
use super::tilt::{TiltWatch, up_direction};
use super::travel::Travel;
use super::yaw::YawWatch;
use crate::machine::{Machine, rotation_in_body};
use crate::state::{Sample, Sensor, Sensors, tilt_is_measured};

/// Compares samples of all sensors, in stamp order, as far as they are sound by themselves.
#[derive(Debug, Clone)]
pub(in crate::estimation) struct Comparisons {
    lean: LeanComparison,
    others: OtherComparisons,
}

impl Comparisons {
    /// Comparisons before their first sample.
    pub(in crate::estimation) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        Self {
            lean: LeanComparison::new(machine, sensors),
            others: OtherComparisons::new(machine, sensors),
        }
    }

    /// Compares a sample that was checked by itself, and appends its faults to `findings`.
    pub(in crate::estimation) fn step(
        &mut self,
        sample: &Sample<'_>,
        sound: Sound,
        findings: &mut Vec<Finding>,
    ) {
        let by_wheels = self.lean.step(sample, sound, findings);
        self.others.step(sample, sound, by_wheels, findings);
    }
}

/// All comparisons but that of the lean.
#[derive(Debug, Clone)]
pub(in crate::estimation) struct OtherComparisons {
    rules: Rules,
    travel: Travel,
    /// Of an IMU on the base.
    specific_force: Option<SpecificForceWatch>,
    tilt: TiltWatch,
    rotation: RotationWatch,
    /// Of an IMU on the base.
    yaw: Option<YawWatch>,
    /// Of an IMU on the base.
    drive: Option<DriveWatch>,
    base_from_imu: Matrix3<f64>,
}

impl OtherComparisons {
    /// Comparisons before their first sample.
    pub(in crate::estimation) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let imu_on_base = sensors.imu && machine.imu().body == 0;
        Self {
            rules: Rules::of(machine),
            travel: Travel::default(),
            specific_force: imu_on_base.then(|| SpecificForceWatch::new(machine)),
            tilt: TiltWatch::new(machine.plausibility().tilt_tolerance),
            rotation: RotationWatch::new(),
            yaw: imu_on_base.then(|| YawWatch::new(skids(machine))),
            drive: imu_on_base
                .then(|| DriveWatch::new(rotation_in_body(machine.imu()), machine.gravity())),
            base_from_imu: rotation_in_body(machine.imu()),
        }
    }

    /// Compares a sample after its [`LeanComparison`], and appends its faults to `findings`.
    pub(in crate::estimation) fn step(
        &mut self,
        sample: &Sample<'_>,
        sound: Sound,
        by_wheels: ByWheels,
        findings: &mut Vec<Finding>,
    ) {
        match sample.sensor {
            Sensor::Joints(_) => self.take_wheels(sample.stamp_ns, by_wheels),
            Sensor::Imu => self.compare_imu(sample, sound, findings),
            Sensor::Odometry => self.compare_odometry(sample, sound, findings),
            Sensor::ToolWrench | Sensor::Actuator(_) => {}
        }
    }

    fn compare_imu(&mut self, sample: &Sample<'_>, sound: Sound, findings: &mut Vec<Finding>) {
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        let Rules { limits, policies } = &self.rules;
        let mut note = Note::new(findings, policies, sample);
        let (force, turning, attitude) = (&values[..3], &values[3..6], &values[6..]);
        let vectors = [force, turning].map(Vector3::from_column_slice);
        let up = sound.attitude && tilt_is_measured(attitude);
        let [_, turning] = &vectors;
        let measured = (sound.turning && sound.attitude).then_some((attitude, turning));
        let rotation = &mut self.rotation;
        rotation.check(stamp_ns, measured, limits, &mut note.of(Part::Rotation));
        if let Some(yaw) = self.yaw.as_mut().filter(|_| sound.turning) {
            let about_z = (self.base_from_imu * turning).z;
            yaw.check(stamp_ns, about_z, limits, &mut |by, notice| {
                note.of(Part::Yaw(by))(notice);
            });
        }
        if let Some(watch) = &mut self.specific_force
            && let Some(up) = up.then(|| up_direction(attitude)).flatten()
        {
            let in_base = self.base_from_imu * up;
            let tilt = &mut self.tilt;
            tilt.check(stamp_ns, &in_base, limits, &mut note.of(Part::Tilt));
            if let Some(drive) = self.drive.as_mut().filter(|_| sound.force) {
                let [force, _] = &vectors;
                let found = &mut note.of(Part::Drive);
                drive.check(stamp_ns, [force, &up], limits, found);
            }
            if sound.force && sound.turning {
                let [force, turning] = &vectors;
                let found = &mut note.of(Part::Acceleration);
                let vectors = [force, turning, &up];
                watch.check(stamp_ns, vectors, &self.travel, limits, found);
            }
        }
    }

    fn compare_odometry(&mut self, sample: &Sample<'_>, sound: Sound, findings: &mut Vec<Finding>) {
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        let Rules { limits, policies } = &self.rules;
        let mut note = Note::new(findings, policies, sample);
        let (velocity, turning, attitude) = (&values[..3], &values[3..6], &values[6..]);
        if sound.velocity {
            let velocity = Vector3::from_column_slice(velocity);
            self.travel.take_odometry(stamp_ns, velocity);
            if let Some(yaw) = &mut self.yaw {
                let found = &mut note.of(Part::Rolling);
                yaw.check_travel(stamp_ns, velocity.x, limits, found);
            }
        }
        if let Some(yaw) = &mut self.yaw {
            let turning = if sound.turning { turning[2] } else { f64::NAN };
            yaw.take_odometry(stamp_ns, turning);
        }
        if sound.attitude && tilt_is_measured(attitude) {
            self.tilt.take_odometry(stamp_ns, attitude);
        }
    }

    fn take_wheels(&mut self, stamp_ns: i64, by_wheels: ByWheels) {
        let ByWheels { fastest, rolled } = by_wheels;
        if let Some(fastest) = fastest {
            self.travel.take_wheels(stamp_ns, fastest);
        }
        let Some(rolled) = rolled else {
            return;
        };
        if let Some(yaw) = &mut self.yaw {
            yaw.take_wheels(stamp_ns, rolled);
        }
        if let Some(drive) = &mut self.drive {
            drive.take_wheels(stamp_ns, rolled);
        }
    }
}
