//! The signals of a recording on one grid, as measured and as corrected.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::correction::Correction;
use super::grid::{Grid, SMOOTHED, derivative, noise, of_vectors, second_derivative, smooth};
use super::recording::{Recording, Series};
use tipwatch_mechanics::dynamics::kinematics::{self, SensorFrame};
use tipwatch_mechanics::geometry::coordinate::{Coordinate, Motion};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{ImuState, Sensor, State};

/// Change of the specific force beyond which a machine falls, as a share of it.
const FALLING: f64 = 0.45;

/// Signals as measured: means over the bins of a grid.
#[derive(Debug, Clone)]
pub(super) struct Signals {
    pub(super) bins: usize,
    /// Specific force, angular velocity, up direction and angular velocity by the attitude, all in IMU axes.
    imu: [Vec<Vector3<f64>>; 4],
    /// Velocity and angular velocity by the odometry (base axes).
    odometry: [Vec<Vector3<f64>>; 2],
    /// See [`Signals::gyro_variance`].
    gyro_variance: f64,
    /// Positions, unwrapped, by joint.
    positions: Vec<Vec<f64>>,
    /// Velocities, by joint.
    velocities: Vec<Vec<f64>>,
}

/// Signals under a correction, in base axes, smoothed alike (K of the grid).
#[derive(Debug, Clone)]
pub(super) struct View {
    pub(super) bins: usize,
    /// Whether the machine stands upright in each bin, neither falling nor on its side.
    pub(super) is_upright: Vec<bool>,
    /// Specific force at the base origin (m/s^2).
    pub(super) force: Vec<Vector3<f64>>,
    /// Angular velocity (rad/s).
    pub(super) turning: Vec<Vector3<f64>>,
    /// Up direction by the IMU's attitude.
    pub(super) up: Vec<Vector3<f64>>,
    /// Angular velocity by the change of the IMU's attitude (rad/s).
    pub(super) attitude_turning: Vec<Vector3<f64>>,
    /// Velocity of the base origin by the odometry (m/s), not smoothed.
    pub(super) velocity: Vec<Vector3<f64>>,
    /// Angular velocity by the odometry (rad/s).
    pub(super) odometry_turning: Vec<Vector3<f64>>,
    /// Position (not smoothed), velocity by the position, acceleration by the position, and measured velocity, by joint.
    pub(super) joints: Vec<JointColumns>,
}

/// Signals of one joint, by bin.
#[derive(Debug, Clone)]
pub(super) struct JointColumns {
    pub(super) position: Vec<f64>,
    /// D of the position.
    pub(super) rate: Vec<f64>,
    pub(super) acceleration: Vec<f64>,
    /// K of the measured velocity.
    pub(super) measured_rate: Vec<f64>,
}

impl Signals {
    /// `None` for a recording without joint states.
    pub(super) fn read(
        machine: &Machine,
        recording: &Recording,
        joints: &[Vec<usize>],
    ) -> Option<Self> {
        let used = || recording.series().iter().filter(|series| series.len() > 1);
        let grid = Grid::around(
            used().map(|series| (series.stamps_ns[0], series.stamps_ns[series.len() - 1])),
        )?;
        let unknown = vec![Vector3::repeat(f64::NAN); grid.bins];
        let nothing = vec![f64::NAN; grid.bins];
        let mut signals = Self {
            bins: grid.bins,
            imu: [(); 4].map(|()| unknown.clone()),
            odometry: [(); 2].map(|()| unknown.clone()),
            gyro_variance: 0.0,
            positions: vec![nothing.clone(); machine.joints().len()],
            velocities: vec![nothing; machine.joints().len()],
        };
        for series in used() {
            match series.sensor {
                Sensor::Joints(stream) => {
                    let joints = joints.get(stream)?;
                    for (column, &joint) in joints.iter().enumerate() {
                        let slides = machine.joint_slides(joint);
                        signals.positions[joint] = positions(&grid, series, column, slides);
                        let rate = |k: usize| series.sample(k)[joints.len() + column];
                        signals.velocities[joint] = scalar(&grid, series, rate);
                    }
                }
                Sensor::Imu => {
                    signals.imu = [
                        vector(&grid, series, |s| triple(&s[0..3])),
                        vector(&grid, series, |s| triple(&s[3..6])),
                        vector(&grid, series, |s| up_of(&s[6..10])),
                        turning_of(&grid, series, 6),
                    ];
                }
                Sensor::Odometry => {
                    signals.odometry = [
                        vector(&grid, series, |s| triple(&s[0..3])),
                        vector(&grid, series, |s| triple(&s[3..6])),
                    ];
                }
                Sensor::ToolWrench | Sensor::Number(..) => {}
            }
        }
        let variance = |axis: usize| {
            let component: Vec<f64> = signals.imu[1].iter().map(|v| v[axis]).collect();
            (SMOOTHED * noise(&component)).powi(2)
        };
        signals.gyro_variance = (0..3).map(variance).fold(0.0, f64::max);
        for (joint, constant) in machine.joints().iter().enumerate() {
            if let Some(position) = constant.constant {
                signals.positions[joint].fill(position);
                signals.velocities[joint].fill(0.0);
            }
        }
        Some(signals)
    }

    /// Largest variance of the smoothed angular velocity about an axis of the IMU, due to noise.
    pub(super) fn gyro_variance(&self) -> f64 {
        self.gyro_variance
    }

    /// Returns the signals in base axes, under a correction.
    pub(super) fn view(&self, machine: &Machine, correction: &Correction) -> View {
        let mount = machine.imu().rotation_in_body();
        let mut turn_all = Matrix3::identity();
        let (mut turn_gyro, mut turn_force) = (Matrix3::identity(), Matrix3::identity());
        let mut turn_odometry = Matrix3::identity();
        match *correction {
            Correction::TurnImu(back) => turn_all = back,
            Correction::GyroAxes(axes) => turn_gyro = axes,
            Correction::ScaleGyro(factor) => turn_gyro *= factor,
            Correction::ForceAxes(axes) => turn_force = axes,
            Correction::ScaleForce(factor) => turn_force *= factor,
            Correction::TurnOdometry(quarters) => turn_odometry = quarter_turns(quarters),
            Correction::ScaleOdometry(factor) => turn_odometry *= factor,
            Correction::Reverse => {
                turn_all = quarter_turns(2);
                turn_odometry = quarter_turns(2);
            }
            _ => {}
        }
        let in_imu = |turn: Matrix3<f64>| mount.transpose() * turn * mount;
        let (all, gyro) = (in_imu(turn_all), in_imu(turn_all * turn_gyro));
        let accelerometer = in_imu(turn_all * turn_force);
        let [force, turning, up, attitude_turning] = &self.imu;
        let joints = self.joints(machine, correction);
        let turn = |vectors: &[Vector3<f64>], by: Matrix3<f64>| -> Vec<Vector3<f64>> {
            vectors.iter().map(|v| by * v).collect()
        };
        let imu = [
            turn(force, accelerometer),
            turn(turning, gyro),
            turn(up, all),
            turn(attitude_turning, all),
        ];
        let [force, turning, up, attitude_turning] = in_base(machine, &imu, &joints);
        let (mut up, mut attitude_turning) = (up, attitude_turning);
        let mut odometry_turning = self.odometry[1].clone();
        match *correction {
            Correction::WithoutAttitude => {
                up.fill(Vector3::repeat(f64::NAN));
                attitude_turning.fill(Vector3::repeat(f64::NAN));
            }
            // Roll tilts the up direction along y, pitch along x.
            Correction::AttitudeSigns(roll, pitch) => {
                let signs = Vector3::new(pitch, roll, 1.0);
                up.iter_mut().for_each(|up| up.component_mul_assign(&signs));
            }
            Correction::WithoutOdometryTurning => odometry_turning.fill(Vector3::repeat(f64::NAN)),
            _ => {}
        }
        let force = of_vectors(&force, smooth);
        View {
            bins: self.bins,
            is_upright: upright(&force),
            force,
            turning: of_vectors(&turning, smooth),
            up: of_vectors(&up, smooth),
            attitude_turning: of_vectors(&attitude_turning, smooth),
            velocity: turn(&self.odometry[0], turn_odometry),
            odometry_turning: of_vectors(&odometry_turning, smooth),
            joints,
        }
    }

    fn joints(&self, machine: &Machine, correction: &Correction) -> Vec<JointColumns> {
        let column = |joint: usize| {
            let (from, factor) = match *correction {
                Correction::ScaleJoint(changed, factor) if changed == joint => (joint, factor),
                Correction::FlipJoints(set) if set.contains(joint) => (joint, -1.0),
                Correction::SwapJoints(a, b) if a == joint => (b, 1.0),
                Correction::SwapJoints(a, b) if b == joint => (a, 1.0),
                Correction::Reverse if machine.joints()[joint].spins_wheel.is_some() => {
                    (joint, -1.0)
                }
                _ => (joint, 1.0),
            };
            let scaled = |values: &[f64]| values.iter().map(|v| v * factor).collect::<Vec<f64>>();
            let position = scaled(&self.positions[from]);
            JointColumns {
                rate: derivative(&position),
                acceleration: second_derivative(&position),
                measured_rate: smooth(&scaled(&self.velocities[from])),
                position,
            }
        };
        (0..machine.joints().len()).map(column).collect()
    }
}

impl View {
    /// Sets the motion of all joints in a bin; wheels and unknown ones keep their values.
    pub(super) fn set_joints(&self, bin: usize, state: &mut State<f64>) {
        for (columns, motion) in self.joints.iter().zip(&mut state.joints) {
            let known = |value: f64, other: f64| if value.is_finite() { value } else { other };
            *motion = Motion {
                position: known(columns.position[bin], motion.position),
                rate: known(columns.rate[bin], 0.0),
                acceleration: known(columns.acceleration[bin], 0.0),
            };
        }
    }
}

/// Bins in which the specific force is near its median: the machine neither falls nor lies. Without one, all.
fn upright(force: &[Vector3<f64>]) -> Vec<bool> {
    let median = |i: usize| {
        let mut known: Vec<f64> = force
            .iter()
            .map(|f| f[i])
            .filter(|x| x.is_finite())
            .collect();
        known.sort_by(f64::total_cmp);
        known.get(known.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let middle = Vector3::new(median(0), median(1), median(2));
    let is_near = |f: &Vector3<f64>| !((f - middle).norm() > FALLING * middle.norm());
    force.iter().map(is_near).collect()
}

/// A turn about z by so many quarters.
fn quarter_turns(quarters: u8) -> Matrix3<f64> {
    let (sin, cos) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][usize::from(quarters % 4)];
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

/// Specific force at the base origin, angular velocity, up direction and angular velocity by the attitude, in base axes.
fn in_base(
    machine: &Machine,
    imu: &[Vec<Vector3<f64>>; 4],
    joints: &[JointColumns],
) -> [Vec<Vector3<f64>>; 4] {
    let angular_acceleration = of_vectors(&imu[1], derivative);
    let mut state = State::<f64>::zero(machine);
    let mut coordinates = vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies().len()];
    let mut result = [(); 4].map(|()| Vec::with_capacity(imu[0].len()));
    let moves = machine.imu().body != 0;
    kinematics::coordinates(machine, &state, &mut coordinates);
    let mut frame = SensorFrame::of(machine, &coordinates);
    for bin in 0..imu[0].len() {
        if moves {
            for (columns, motion) in joints.iter().zip(&mut state.joints) {
                (motion.position, motion.rate) = (columns.position[bin], columns.rate[bin]);
            }
            kinematics::coordinates(machine, &state, &mut coordinates);
            frame = SensorFrame::of(machine, &coordinates);
        }
        let known = |v: &Vector3<f64>| {
            if v.iter().all(|x| x.is_finite()) {
                *v
            } else {
                Vector3::zeros()
            }
        };
        let measured = ImuState {
            specific_force: imu[0][bin],
            angular_velocity: imu[1][bin],
            angular_acceleration: known(&angular_acceleration[bin]),
        };
        let base = frame.base_motion(&measured, moves);
        result[0].push(base.specific_force);
        result[1].push(base.angular_velocity);
        result[2].push(frame.rotation * imu[2][bin]);
        result[3].push(frame.rotation * imu[3][bin] - frame.angular_velocity);
    }
    result
}

fn scalar(grid: &Grid, series: &Series, value: impl Fn(usize) -> f64) -> Vec<f64> {
    grid.means((0..series.len()).map(|k| (series.stamps_ns[k], value(k))))
}

fn vector(
    grid: &Grid,
    series: &Series,
    value: impl Fn(&[f64]) -> Vector3<f64>,
) -> Vec<Vector3<f64>> {
    let [x, y, z] = [0, 1, 2].map(|i| scalar(grid, series, |k| value(series.sample(k))[i]));
    (0..grid.bins)
        .map(|k| Vector3::new(x[k], y[k], z[k]))
        .collect()
}

fn triple(values: &[f64]) -> Vector3<f64> {
    Vector3::new(values[0], values[1], values[2])
}

/// Positions of a joint; the jump of an angle that wraps is undone.
fn positions(grid: &Grid, series: &Series, column: usize, slides: bool) -> Vec<f64> {
    let turn = std::f64::consts::TAU;
    let (mut turns, mut last) = (0.0, f64::NAN);
    let unwrapped = (0..series.len()).map(|k| {
        let position = series.sample(k)[column];
        let step = position - last;
        // Only a step of nearly a whole turn is a wrap: degrees and fast wheels step by less or by more.
        if !slides && (step.abs() - turn).abs() < 1.0 {
            turns -= step.signum();
        }
        if position.is_finite() {
            last = position;
        }
        (series.stamps_ns[k], position + turns * turn)
    });
    grid.means(unwrapped)
}

fn attitude(xyzw: &[f64]) -> Option<UnitQuaternion<f64>> {
    let &[x, y, z, w] = xyzw else { return None };
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)
}

/// Up direction in the axes of a body with this orientation.
fn up_of(xyzw: &[f64]) -> Vector3<f64> {
    attitude(xyzw).map_or(Vector3::repeat(f64::NAN), |attitude| {
        attitude.inverse_transform_vector(&Vector3::z())
    })
}

/// Angular velocity, in body axes, by the change of an orientation.
fn turning_of(grid: &Grid, series: &Series, at: usize) -> Vec<Vector3<f64>> {
    let mut stamps = Vec::with_capacity(series.len());
    let mut rates = Vec::with_capacity(series.len());
    for k in 1..series.len() {
        let [before, after] = [k - 1, k].map(|k| attitude(&series.sample(k)[at..at + 4]));
        let (t0, t1) = (series.stamps_ns[k - 1], series.stamps_ns[k]);
        let dt = (t1 - t0) as f64 * 1e-9;
        stamps.push(t0 + (t1 - t0) / 2);
        rates.push(match (before, after) {
            (Some(before), Some(after)) => (before.inverse() * after).scaled_axis() / dt,
            _ => Vector3::repeat(f64::NAN),
        });
    }
    let component = |i: usize| grid.means(stamps.iter().copied().zip(rates.iter().map(|r| r[i])));
    let [x, y, z] = [0, 1, 2].map(component);
    (0..grid.bins)
        .map(|k| Vector3::new(x[k], y[k], z[k]))
        .collect()
}
