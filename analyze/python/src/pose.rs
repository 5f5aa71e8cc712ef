//! Positions of the parts of a machine in a posture.

use anyhow::{Result, bail};
use nalgebra::{Isometry3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tipwatch_mechanics::dynamics::kinematics::RestingBodies;
use tipwatch_mechanics::{Placement, State, machine, resting_state};

use crate::call::error::Mistake;
use crate::inputs::Numbers;

/// A machine at rest in a posture.
pub(crate) struct Posture<'a> {
    machine: &'a machine::Machine,
    state: State<f64>,
    bodies: RestingBodies,
}

impl<'a> Posture<'a> {
    /// The machine with its joints at these positions.
    ///
    /// # Errors
    /// The array has the wrong shape or is not finite, or a linkage cannot close.
    pub(crate) fn new(machine: &'a machine::Machine, positions: &[f64]) -> Result<Self> {
        if let Some(joint) = positions.iter().position(|q| !q.is_finite()) {
            bail!(Mistake(format!(
                "expected finite joint positions, found {} of joint {}",
                positions[joint],
                machine.joints()[joint].name
            )));
        }
        let mut state = resting_state(machine, positions);
        state.imu.specific_force = Vector3::new(0.0, 0.0, machine.gravity());
        let mut bodies = RestingBodies::new(machine);
        if bodies.place(machine, &state) < 0.0 {
            bail!(Mistake(format!(
                "expected joint positions in which every linkage closes, found {positions:?}"
            )));
        }
        Ok(Self {
            machine,
            state,
            bodies,
        })
    }

    /// Pose of each link's frame in the base frame, as 4x4 arrays by name.
    pub(crate) fn links<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let poses = PyDict::new(py);
        for link in self.machine.links() {
            let body = &self.bodies.motions[link.body];
            let base_from_body = Isometry3::from_parts(
                Translation3::from(body.origin),
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                    body.rotation,
                )),
            );
            let pose = (base_from_body * link.body_from_link).to_homogeneous();
            poses.set_item(&link.name, matrix(&pose).into_pyarray(py))?;
        }
        Ok(poses)
    }

    /// Wheels, support polygon and centre of mass in the base frame.
    pub(crate) fn layout<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let machine = self.machine.with_imu_at_base();
        let mut placement = Placement::new(&machine);
        placement.place(&self.state);
        let wheels = self.machine.wheels();
        let centres: Vec<Vector3<f64>> = (wheels.iter())
            .map(|wheel| self.bodies.motions[wheel.body].point(&wheel.centre_in_body))
            .collect();
        let edges = self.machine.polygon().edges();
        let edges = Array2::from_shape_fn((edges.len(), 2), |(edge, end)| {
            let edge = &edges[edge];
            let wheel = if end == 0 { edge.from } else { edge.to };
            i64::try_from(wheel).unwrap_or(i64::MAX)
        });
        let radii: Array1<f64> = wheels.iter().map(|wheel| wheel.radius).collect();
        let arm: Vec<Vector3<f64>> = placement.arm_segments.iter().flatten().copied().collect();
        let layout = PyDict::new(py);
        layout.set_item("wheel_centres", points(py, &centres))?;
        layout.set_item("wheel_radii", radii.into_pyarray(py))?;
        layout.set_item("contacts", points(py, &placement.contacts))?;
        layout.set_item("edges", edges.into_pyarray(py))?;
        layout.set_item("normal", vector(py, &placement.normal))?;
        layout.set_item("centre_of_mass", vector(py, &placement.centre_of_mass))?;
        layout.set_item("arm", points(py, &arm))?;
        Ok(layout)
    }
}

/// The joint positions of one posture; `zero` if none are given.
///
/// # Errors
/// The array has the wrong shape.
pub(crate) fn positions(given: Option<&Numbers<'_>>, zero: Vec<f64>) -> Result<Vec<f64>> {
    let Some(array) = given else {
        return Ok(zero);
    };
    let view = array.as_array();
    if view.shape() != [zero.len()] {
        bail!(Mistake(format!(
            "expected posture of shape ({},), found {:?}",
            zero.len(),
            view.shape()
        )));
    }
    Ok(view.iter().copied().collect())
}

fn matrix(pose: &Matrix4<f64>) -> Array2<f64> {
    Array2::from_shape_fn((4, 4), |place| pose[place])
}

fn points<'py>(py: Python<'py>, points: &[Vector3<f64>]) -> Bound<'py, PyArray2<f64>> {
    Array2::from_shape_fn((points.len(), 3), |(k, axis)| points[k][axis]).into_pyarray(py)
}

fn vector<'py>(py: Python<'py>, vector: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    Array1::from_iter(vector.iter().copied()).into_pyarray(py)
}
