//! Lean of the platform by the measured joints of a suspension.
//!
//! The plane through the wheels' centres, `z = s0 + s1 x + s2 y` above their places at zero posture, leans the platform
//! by `(-s2, s1)`.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::dynamics::kinematics::RestingBodies;
use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors, State};

/// Displacement of a joint that shows whether it moves a wheel up or down (rad or m), and the least motion that counts (m).
const TRIED: f64 = 0.05;
const MOVES: f64 = 1e-6;

/// The plane of the wheels.
#[derive(Debug, Clone)]
pub(super) struct SuspensionPlane {
    /// The machine, in the heap: the estimator is moved by value, and this is most of it.
    machine: Box<Machine>,
    /// Joints of each stream of joint states; none where no joint in it moves a wheel up or down.
    streams: Vec<Vec<usize>>,
    state: State<f64>,
    bodies: RestingBodies,
    /// (s0, s1, s2) from the sums of the raised centres.
    solve: Matrix3<f64>,
    is_known: Vec<bool>,
    /// The last lean.
    lean: Option<Vector2<f64>>,
}

impl SuspensionPlane {
    /// `None` where no measured joint moves a wheel up or down.
    pub(super) fn new(machine: &Machine, sensors: &Sensors) -> Option<Self> {
        let mut sum = Matrix3::zeros();
        for wheel in machine.wheels() {
            let row = Vector3::new(1.0, wheel.centre_at_zero.x, wheel.centre_at_zero.y);
            sum += row * row.transpose();
        }
        let mut plane = Self {
            machine: Box::new(machine.clone()),
            streams: Vec::new(),
            state: State::with_constants(machine),
            bodies: RestingBodies::new(machine),
            solve: sum.try_inverse()?,
            is_known: vec![true; machine.joints().len()],
            lean: None,
        };
        let at_zero = plane.heights();
        let mut moves = vec![false; machine.joints().len()];
        for (joint, moves) in moves.iter_mut().enumerate() {
            if machine.joints()[joint].spins_wheel.is_some() {
                continue;
            }
            let before = plane.state.joints[joint].position;
            plane.state.joints[joint].position = before + TRIED;
            let raised = plane.heights();
            plane.state.joints[joint].position = before;
            let mut changes = raised.iter().zip(&at_zero).map(|(a, b)| (a - b).abs());
            *moves = changes.any(|change| change > MOVES);
        }
        let streams = sensors.joints.iter().map(|stream| {
            let is_used = stream.joints.iter().any(|&joint| moves[joint]);
            if is_used {
                stream.joints.clone()
            } else {
                Vec::new()
            }
        });
        plane.streams = streams.collect();
        for stream in &plane.streams {
            for &joint in stream.iter().filter(|&&joint| moves[joint]) {
                plane.is_known[joint] = false;
            }
        }
        (plane.is_known.iter().any(|known| !known)).then_some(plane)
    }

    /// Takes joint states; returns the rotation of the platform by them, about x and y (rad).
    pub(super) fn take(&mut self, sample: &Sample<'_>) -> Option<Vector2<f64>> {
        let Sensor::Joints(stream) = sample.sensor else {
            return None;
        };
        let joints = self
            .streams
            .get(stream)
            .filter(|joints| !joints.is_empty())?;
        for (&joint, &position) in joints.iter().zip(sample.values) {
            if position.is_finite() {
                self.state.joints[joint].position = position;
                self.is_known[joint] = true;
            }
        }
        if !self.is_known.iter().all(|known| *known) {
            return None;
        }
        self.bodies.place(&self.machine, &self.state);
        let mut sums = Vector3::zeros();
        for wheel in self.machine.wheels() {
            let (motion, at_zero) = (&self.bodies.motions[wheel.body], wheel.centre_at_zero);
            let centre = motion.origin + motion.rotation * wheel.centre_in_body;
            sums += Vector3::new(1.0, at_zero.x, at_zero.y) * (centre.z - at_zero.z);
        }
        let plane = self.solve * sums;
        let lean = Vector2::new(-plane.z, plane.y);
        if !lean.iter().all(|v| v.is_finite()) {
            return None;
        }
        Some(lean - self.lean.replace(lean)?)
    }

    fn heights(&mut self) -> Vec<f64> {
        self.bodies.place(&self.machine, &self.state);
        let heights = self.machine.wheels().iter().map(|wheel| {
            let motion = &self.bodies.motions[wheel.body];
            (motion.origin + motion.rotation * wheel.centre_in_body).z
        });
        heights.collect()
    }
}
