//! The inputs over time: joints and IMU.

use plotly::Traces;
use plotly::common::Visible;
use tipwatch_mechanics::State;

use super::plotter::Plotter;
use crate::page::{Figure, plain};

/// A curve: its name and its value in each row, NaN where it is missing.
struct Curve {
    name: String,
    /// Whether it is hidden at first: the turns of a wheel would dwarf every other joint.
    hidden: bool,
    values: Vec<f64>,
}

impl Plotter<'_> {
    pub(super) fn inputs(&self) -> Vec<Figure> {
        let [revolute, prismatic, force, rate] = self.input_curves();
        [
            ("Positions of revolute joints", "Position [rad]", revolute),
            ("Positions of prismatic joints", "Position [m]", prismatic),
            (
                "Specific force measured by the IMU, in its own frame",
                "Specific force [m/s²]",
                force,
            ),
            (
                "Angular velocity measured by the IMU, in its own frame",
                "Angular velocity [rad/s]",
                rate,
            ),
        ]
        .into_iter()
        .filter(|(_, _, curves)| !curves.is_empty())
        .map(|(title, unit, curves)| {
            let mut traces = Traces::new();
            for (index, curve) in curves.iter().enumerate() {
                let trace = self.curve(index, &plain(&curve.name), &curve.values);
                traces.push(if curve.hidden {
                    trace.visible(Visible::LegendOnly)
                } else {
                    trace
                });
            }
            self.figure(title, unit, 300, traces)
        })
        .collect()
    }

    /// Revolute joints, prismatic joints, specific force, angular velocity.
    fn input_curves(&self) -> [Vec<Curve>; 4] {
        let machine = &self.analysis.machine;
        let rows = self.analysis.rows.len();
        let curve = |name: &str| Curve {
            name: name.into(),
            hidden: false,
            values: Vec::with_capacity(rows),
        };
        let mut joints: Vec<Curve> = machine
            .joints()
            .iter()
            .map(|joint| curve(&joint.name))
            .collect();
        let mut force = ["x", "y", "z"].map(curve);
        let mut rate = ["x", "y", "z"].map(curve);
        let mut state = State::zero(machine);
        for row in 0..rows {
            self.analysis.rows.states.get(row, &mut state);
            for (curve, joint) in joints.iter_mut().zip(&state.joints) {
                curve.values.push(joint.position);
            }
            for axis in 0..3 {
                force[axis].values.push(state.imu.specific_force[axis]);
                rate[axis].values.push(state.imu.angular_velocity[axis]);
            }
        }
        let (mut revolute, mut prismatic) = (Vec::new(), Vec::new());
        for (index, mut curve) in joints
            .into_iter()
            .enumerate()
            .filter(|(index, _)| machine.joints()[*index].logged)
        {
            curve.hidden = machine.joints()[index].spins_wheel.is_some();
            if machine.joint_slides(index) {
                prismatic.push(curve);
            } else {
                revolute.push(curve);
            }
        }
        [revolute, prismatic, force.into(), rate.into()]
    }
}
