//! The bias of the accelerometer is found from attitude, odometry and standstill, as far as these determine it.

use crate::support;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use tipwatch_mechanics::estimation::{CausalEstimator, RowClock, SensorSamples, smooth};
use tipwatch_mechanics::state::{MatchedSensors, OtherSensors, Sample, Sensor, Sensors};
use tipwatch_mechanics::{Machine, State};

const SECONDS: f64 = 20.0;
const YAW_RATE: f64 = 0.2;

/// A machine on a slope: mounting and errors of its sensors, and its motion.
#[derive(Clone, Copy)]
struct Case {
    /// Rotation of the IMU in the base: roll, pitch, yaw (rad).
    mount: [f64; 3],
    /// Bias of the accelerometer, base axes (m/s^2).
    bias: [f64; 3],
    /// Constant error of the attitude about the base's axes (rad).
    tilt: [f64; 3],
    /// Heading at the start (rad).
    heading: f64,
    /// Top speed (m/s).
    speed: f64,
    attitude: Attitude,
    odometry: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Attitude {
    Measured,
    Absent,
    Heading,
}

const STANDING: Case = Case {
    mount: [0.0; 3],
    bias: [0.02, -0.03, 0.04],
    tilt: [0.0; 3],
    heading: 0.0,
    speed: 0.0,
    attitude: Attitude::Measured,
    odometry: false,
};
const DRIVING: Case = Case {
    speed: 1.5,
    odometry: true,
    ..STANDING
};

/// The samples of one sensor.
struct Recording {
    sensor: Sensor,
    stamps_ns: Vec<i64>,
    values: Vec<f64>,
    width: usize,
}

/// Noise of standard deviation one, the same in every run.
fn noise(k: usize) -> f64 {
    let fraction = (k as f64 * 12.9898).sin() * 43758.5453;
    (fraction - fraction.floor() - 0.5) * 12.0_f64.sqrt()
}

impl Case {
    fn machine(&self) -> Machine {
        let [r, p, y] = self.mount;
        let mount = format!("rpy = [{r}, {p}, {y}]");
        support::edited("rigid", |text| {
            text.replace("rpy = [0.0, 0.0, 0.0]", &mount)
        })
        .unwrap()
    }

    fn sensors(&self, machine: &Machine) -> Sensors {
        let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
        let others = OtherSensors {
            imu: true,
            odometry: self.odometry,
            tool_wrench: false,
        };
        MatchedSensors::new(machine, &[("all", &names)], others)
            .unwrap()
            .sensors
    }

    /// Speed and acceleration forward.
    fn speed(&self, t: f64) -> [f64; 2] {
        let rate = 0.5;
        [
            self.speed * 0.5 * (1.0 - (rate * t).cos()),
            self.speed * 0.5 * rate * (rate * t).sin(),
        ]
    }

    fn yaw_rate(&self) -> f64 {
        if self.speed > 0.0 { YAW_RATE } else { 0.0 }
    }

    /// Orientation of the base at the start, on a slope.
    fn on_slope(&self) -> Rotation3<f64> {
        Rotation3::from_euler_angles(0.08, -0.05, 0.0)
    }

    /// Specific force without bias, in IMU axes.
    fn true_force(&self, machine: &Machine, t: f64) -> Vector3<f64> {
        let up = self.on_slope().inverse() * Vector3::z();
        let turning = up * self.yaw_rate();
        let [speed, rate] = self.speed(t);
        let place = machine.imu().body_from_mount.translation.vector;
        let acceleration = Vector3::x() * rate
            + turning.cross(&(Vector3::x() * speed))
            + turning.cross(&turning.cross(&place));
        machine.imu().body_from_mount.rotation.inverse() * (acceleration + up * machine.gravity())
    }

    fn recordings(&self, machine: &Machine) -> Vec<Recording> {
        let to_imu = machine.imu().body_from_mount.rotation.inverse();
        let up = self.on_slope().inverse() * Vector3::z();
        let [mut joints, mut imu, mut odometry] = [
            (Sensor::Joints(0), 50.0),
            (Sensor::Imu, 100.0),
            (Sensor::Odometry, 25.0),
        ]
        .map(|(sensor, rate)| {
            (
                Recording {
                    sensor,
                    stamps_ns: Vec::new(),
                    values: Vec::new(),
                    width: 10,
                },
                rate,
            )
        });
        let count = machine.joints().len();
        joints.0.width = 2 * count;
        for (recording, rate) in [&mut joints, &mut imu, &mut odometry] {
            for k in 0..(SECONDS * *rate) as usize {
                let t = k as f64 / *rate;
                recording.stamps_ns.push((t * 1e9) as i64);
                let [speed, _] = self.speed(t);
                let values = &mut recording.values;
                match recording.sensor {
                    Sensor::Joints(_) => {
                        values.extend((0..count).map(|j| 0.1 + 1e-4 * noise(k * count + j)));
                        values.extend(machine.joints().iter().enumerate().map(|(j, joint)| {
                            let wheel = joint
                                .spins_wheel
                                .map(|wheel| machine.wheels()[wheel].radius);
                            wheel.map_or(0.0, |radius| speed / radius) + 1e-3 * noise(k * count + j)
                        }));
                    }
                    Sensor::Imu => {
                        let force = self.true_force(machine, t) + to_imu * Vector3::from(self.bias);
                        let turning = to_imu * up * self.yaw_rate();
                        values.extend((0..3).map(|i| force[i] + 0.005 * noise(7 * k + i)));
                        values.extend((0..3).map(|i| turning[i] + 5e-4 * noise(7 * k + 3 + i)));
                        values.extend(self.quaternion(machine, t));
                    }
                    _ => {
                        let velocity = [speed, 0.0, 0.0];
                        values.extend((0..3).map(|i| velocity[i] + 5e-3 * noise(5 * k + i)));
                        values.extend([f64::NAN; 7]);
                    }
                }
            }
        }
        let all = [joints.0, imu.0, odometry.0];
        all.into_iter()
            .filter(|recording| self.odometry || recording.sensor != Sensor::Odometry)
            .collect()
    }

    /// The measured orientation of the IMU, x y z w.
    fn quaternion(&self, machine: &Machine, t: f64) -> [f64; 4] {
        let heading = Rotation3::from_euler_angles(0.0, 0.0, self.heading + self.yaw_rate() * t);
        let orientation = match self.attitude {
            Attitude::Absent => return [f64::NAN; 4],
            Attitude::Heading => heading,
            Attitude::Measured => {
                let error = Rotation3::from_scaled_axis(Vector3::from(self.tilt));
                let mount = machine.imu().body_from_mount.rotation.to_rotation_matrix();
                heading * self.on_slope() * error * mount
            }
        };
        let q = UnitQuaternion::from_rotation_matrix(&orientation);
        [q.i, q.j, q.k, q.w]
    }

    /// Error of the specific force in base axes and variance of its systematic part along each: of the last row of
    /// the causal estimator, and of a row in the middle of the smoother's.
    fn errors(&self) -> [(Vector3<f64>, Vector3<f64>); 2] {
        let machine = self.machine();
        let sensors = self.sensors(&machine);
        let recordings = self.recordings(&machine);
        let of = |state: &State<f64>, t: f64| {
            let imu = &machine.imu().body_from_mount.rotation;
            let error = imu * (state.imu.specific_force - self.true_force(&machine, t));
            let stated = machine.uncertainty().accelerometer_bias.powi(2);
            let [xx, yy, zz, xy, xz, yz] = state.noise.accelerometer_bias.covariance_change;
            let change = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            let rotation = imu.to_rotation_matrix();
            let in_base = rotation.matrix() * change * rotation.matrix().transpose();
            (error, in_base.diagonal().add_scalar(stated))
        };
        let mut causal = CausalEstimator::new(&machine, &sensors, RowClock::JointStates);
        let mut order: Vec<(i64, usize, usize)> = Vec::new();
        for (which, recording) in recordings.iter().enumerate() {
            let stamps = recording.stamps_ns.iter().enumerate();
            order.extend(stamps.map(|(k, &stamp)| (stamp, which, k)));
        }
        order.sort_unstable();
        for (stamp_ns, which, k) in order {
            let recording = &recordings[which];
            let values = &recording.values[k * recording.width..(k + 1) * recording.width];
            let sample = Sample::new(recording.sensor, stamp_ns, values);
            causal.push(&machine, &sample, &mut |_| ()).unwrap();
        }
        let last = causal.last();
        assert!(last.reasons.is_empty(), "{:?}", last.reasons);
        let samples: Vec<SensorSamples<'_>> = (recordings.iter())
            .map(|recording| SensorSamples {
                sensor: recording.sensor,
                stamps_ns: &recording.stamps_ns,
                values: &recording.values,
            })
            .collect();
        let rows = smooth(&machine, &sensors, &samples, RowClock::JointStates);
        let (middle, mut state) = (rows.times_ns.len() / 2, State::zero(&machine));
        let reasons = rows.estimated.reasons[middle];
        assert!(reasons.is_empty(), "{reasons:?}");
        rows.estimated.states.get(middle, &mut state);
        [
            of(&last.state, last.time_ns as f64 * 1e-9),
            of(&state, rows.times_ns[middle] as f64 * 1e-9),
        ]
    }
}

#[test]
fn bias_is_found_standing_and_driving() {
    for case in [
        STANDING,
        DRIVING,
        Case {
            odometry: true,
            ..STANDING
        },
    ] {
        for (error, variance) in case.errors() {
            // Noise of the filtered signal and the share that the stated priors leave.
            assert!(error.norm() < 0.03 && error.z.abs() < 0.02, "{error:?}");
            assert!(variance.max() < 0.5 * 0.03_f64.powi(2), "{variance:?}");
        }
    }
}

#[test]
fn without_attitude_only_the_length_of_gravity_is_known() {
    for attitude in [Attitude::Absent, Attitude::Heading] {
        let case = Case {
            attitude,
            ..STANDING
        };
        for (error, variance) in case.errors() {
            let remaining = Vector3::from(case.bias);
            assert!((error.x - remaining.x).abs() < 0.02, "{error:?}");
            assert!((error.y - remaining.y).abs() < 0.02, "{error:?}");
            assert!(error.z.abs() < 0.02, "{error:?}");
            assert!(
                variance.x > 0.9 * 9e-4 && variance.z < 0.3 * 9e-4,
                "{variance:?}"
            );
        }
    }
}

#[test]
fn axes_of_the_sensor_and_heading_do_not_matter() {
    let [(expected, by), _] = DRIVING.errors();
    for (mount, heading) in [([0.0; 3], 2.5), ([0.4, -0.7, 2.0], 0.0)] {
        let turned = Case {
            mount,
            heading,
            ..DRIVING
        };
        let [(found, variance), _] = turned.errors();
        // The noise is along the axes of the sensor.
        assert!((found - expected).norm() < 0.01, "{found:?} {expected:?}");
        assert!(
            (variance - by).norm() < 0.1 * by.norm(),
            "{variance:?} {by:?}"
        );
    }
}

#[test]
fn wrong_attitude_does_little_harm() {
    // Half a degree stays within the band; three degrees are credible as no bias.
    for (tilt, most) in [(0.5_f64, 0.06), (3.0, 0.02)] {
        let case = Case {
            bias: [0.0; 3],
            tilt: [tilt.to_radians(), 0.0, 0.0],
            ..STANDING
        };
        for (error, variance) in case.errors() {
            assert!(error.norm() < most, "{tilt}: {error:?}");
            assert!(error.y.powi(2) < 4.5 * variance.y, "{error:?} {variance:?}");
        }
    }
}

#[test]
fn agreement_with_the_attitude_does_not_narrow_the_band_across_gravity() {
    // The attitude is levelled by the biased accelerometer itself.
    let gravity = 9.8066;
    let case = Case {
        bias: [0.02, 0.03, 0.0],
        tilt: [0.03 / gravity, -0.02 / gravity, 0.0],
        ..STANDING
    };
    for (_, variance) in case.errors() {
        assert!(
            variance.x > 0.8 * 9e-4 && variance.y > 0.8 * 9e-4,
            "{variance:?}"
        );
    }
}
