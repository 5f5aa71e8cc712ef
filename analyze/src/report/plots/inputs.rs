//! The inputs over time: joints and IMU.

use tipwatch_language::word;

use super::plotter::{Part, Plotter};
use crate::page::Figure;
use crate::report::sketch::Curve;

/// A curve with its name.
struct Named {
    name: String,
    /// Whether the curve is hidden at first: the turns of a wheel would dwarf every other joint.
    hidden: bool,
    curve: Curve,
}

impl Plotter<'_> {
    pub(super) fn inputs(&self) -> Vec<Figure> {
        let [revolute, prismatic, force, rate] = self.input_curves();
        [
            (
                word!("Positions of revolute joints"),
                word!("Position [rad]"),
                revolute,
            ),
            (
                word!("Positions of prismatic joints"),
                word!("Position [m]"),
                prismatic,
            ),
            (
                word!("Specific force measured by the IMU, in its own frame"),
                word!("Specific force [m/s²]"),
                force,
            ),
            (
                word!("Angular velocity measured by the IMU, in its own frame"),
                word!("Angular velocity [rad/s]"),
                rate,
            ),
        ]
        .into_iter()
        .filter(|(_, _, curves)| !curves.is_empty())
        .map(|(title, unit, curves)| {
            let mut figure = self.figure(Part::Inputs, title, unit, 220);
            for (index, curve) in curves.iter().enumerate() {
                let trace = self.curve(index, &curve.name, curve.curve);
                figure.add(trace.hidden(curve.hidden));
            }
            figure
        })
        .collect()
    }

    /// Revolute joints, prismatic joints, specific force, angular velocity.
    fn input_curves(&self) -> [Vec<Named>; 4] {
        let machine = &self.analysis.machine;
        let axes = |curve: fn(usize) -> Curve| -> Vec<Named> {
            let axes = ["x", "y", "z"].into_iter().enumerate();
            axes.map(|(axis, name)| Named {
                name: name.into(),
                hidden: false,
                curve: curve(axis),
            })
            .collect()
        };
        let (mut revolute, mut prismatic) = (Vec::new(), Vec::new());
        for (index, joint) in machine
            .joints()
            .iter()
            .enumerate()
            .filter(|(_, j)| j.logged)
        {
            let named = Named {
                name: joint.name.clone(),
                hidden: joint.spins_wheel.is_some(),
                curve: Curve::Position(index),
            };
            match machine.joint_slides(index) {
                true => prismatic.push(named),
                false => revolute.push(named),
            }
        }
        [
            revolute,
            prismatic,
            axes(Curve::SpecificForce),
            axes(Curve::AngularVelocity),
        ]
    }
}
