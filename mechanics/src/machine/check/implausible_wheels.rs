//! Refuses wheels that no machine has: two at one place, radii in another unit, names that contradict sides.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::checker::Checker;
use super::wheel_side::{End, Side, place_in_name};
use crate::machine::outline::Shape;
use crate::machine::{MachineError, SupportKind, Wheel};

/// Ratio of a stated radius to that of the URDF's round shape from which they contradict each other: above
/// the difference of tyre and rim, below that of diameter and radius.
const CONTRADICTING_RADIUS: f64 = 1.6;
/// That ratio for a link that also has a mesh: the round shape may then be the hub.
const CONTRADICTING_RADIUS_WITH_MESH: f64 = 4.0;
/// Distance up to which two wheels are at one place (m).
const ONE_PLACE_M: f64 = 1e-4;
/// Overlap of two wheels in line, as a fraction of the distance of their centres, that a rough model may have.
const OVERLAP: f64 = 0.3;
/// Lateral distance, as a fraction of the radius, up to which two wheels run in one line.
const IN_LINE: f64 = 0.5;
/// Largest and smallest distance between wheels (m).
const WHEEL_DISTANCE_M: [f64; 2] = [0.02, 100.0];
/// Largest distance between wheels as a multiple of a radius.
const DISTANCE_IN_RADII: f64 = 200.0;
/// Lateral position as a fraction of the largest from which a wheel is on one side.
const CLEARLY_ASIDE: f64 = 0.2;

impl Checker<'_> {
    /// Checks the wheels against each other, the shapes of their links and their names.
    pub(super) fn check_wheel_plausibility(
        &self,
        wheels: &[Wheel],
        shapes: &HashMap<String, Vec<Shape>>,
    ) -> Result<(), MachineError> {
        self.check_places(wheels)?;
        let widest = self.widest(wheels)?;
        let rolls = |wheel: &&Wheel| wheel.kind == SupportKind::Wheel;
        let rolling: Vec<Wheel> = wheels.iter().filter(rolls).cloned().collect();
        for wheel in &rolling {
            self.check_against_shape(wheel, shapes)?;
        }
        self.check_radii(&rolling, widest)?;
        self.check_overlap(&rolling)?;
        self.check_sides(wheels)?;
        self.check_ends(&rolling)
    }

    fn check_places(&self, wheels: &[Wheel]) -> Result<(), MachineError> {
        for (index, wheel) in wheels.iter().enumerate() {
            for other in &wheels[..index] {
                let [link, of_other] = [wheel, other].map(|w| &self.spec.wheels[&w.name].link);
                let apart = (wheel.centre_at_zero - other.centre_at_zero).norm();
                let roll = [wheel, other].map(|w| w.kind == SupportKind::Wheel);
                let share_link = link == of_other && roll == [true; 2];
                if !share_link && apart > ONE_PLACE_M {
                    continue;
                }
                let found = match link == of_other {
                    true => format!("\"{link}\" for {} too", other.name),
                    false => format!(
                        "\"{link}\", {:.1} mm from the centre of {}",
                        1e3 * apart,
                        other.name
                    ),
                };
                return Err(self.implausible(
                    format!("{}.{}.link", wheel.kind.table(), wheel.name),
                    "a link and a place of its own",
                    found,
                    "Name the link of each wheel.",
                ));
            }
        }
        Ok(())
    }

    /// The largest distance between wheels (m).
    fn widest(&self, wheels: &[Wheel]) -> Result<f64, MachineError> {
        let [least, largest] = WHEEL_DISTANCE_M;
        let widest = widest_distance(wheels);
        if !(least..=largest).contains(&widest) {
            return Err(self.implausible(
                "wheels",
                format!("wheels {least} to {largest} m apart"),
                format!("{widest} m"),
                "Lengths are in metres; these look like another unit: scale the URDF.",
            ));
        }
        Ok(widest)
    }

    fn check_radii(&self, wheels: &[Wheel], widest: f64) -> Result<(), MachineError> {
        for wheel in wheels {
            let expected = if wheel.radius > widest {
                format!("a radius below the distance between the wheels, {widest:.3} m")
            } else if wheel.radius * DISTANCE_IN_RADII < widest {
                format!(
                    "a radius of at least 1/{DISTANCE_IN_RADII:.0} of the distance between the wheels, {widest:.3} m"
                )
            } else {
                continue;
            };
            let likely = unit_of(wheel.radius / 0.3).filter(|_| wheel.radius > widest);
            return Err(self.implausible(
                format!("wheels.{}.radius", wheel.name),
                expected,
                format!("{} m", wheel.radius),
                advice(wheel.radius, likely),
            ));
        }
        Ok(())
    }

    /// Compares the stated radius with the largest round shape of the wheel's link whose axis lies.
    fn check_against_shape(
        &self,
        wheel: &Wheel,
        shapes: &HashMap<String, Vec<Shape>>,
    ) -> Result<(), MachineError> {
        let Some(link) = self.tree.link(&self.spec.wheels[&wheel.name].link) else {
            return Ok(());
        };
        let link = &self.tree.links[link];
        let Some(shapes) = shapes.get(&link.name) else {
            return Ok(());
        };
        let base_from_link =
            self.tree.bodies[link.body].base_from_body.rotation * link.body_from_link.rotation;
        let lies = |axis: &Vector3<f64>| (base_from_link * axis).z.abs() < 0.5;
        let radius = |shape: &Shape| match shape {
            Shape::Cylinder {
                radius,
                axis_in_link,
            } if lies(axis_in_link) => Some(*radius),
            Shape::Sphere { radius } => Some(*radius),
            _ => None,
        };
        let round = shapes.iter().filter_map(radius).filter(|r| *r > 0.0);
        let Some(shape) = round.reduce(f64::max) else {
            return Ok(());
        };
        let is_mesh = |shape: &Shape| matches!(shape, Shape::Mesh { .. });
        let most = match shapes.iter().any(is_mesh) {
            true => CONTRADICTING_RADIUS_WITH_MESH,
            false => CONTRADICTING_RADIUS,
        };
        let ratio = wheel.radius / shape;
        if (1.0 / most..=most).contains(&ratio) {
            return Ok(());
        }
        Err(self.implausible(
            format!("wheels.{}.radius", wheel.name),
            format!(
                "about {shape} m, the radius of the shape of link \"{}\" in {}",
                link.name, self.urdf_name
            ),
            format!("{} m", wheel.radius),
            advice(wheel.radius, unit_of(ratio)),
        ))
    }

    /// Two wheels that run in one line cannot overlap.
    fn check_overlap(&self, wheels: &[Wheel]) -> Result<(), MachineError> {
        for (index, wheel) in wheels.iter().enumerate() {
            for other in &wheels[..index] {
                let apart = wheel.centre_at_zero - other.centre_at_zero;
                let in_line = apart.y.abs() < IN_LINE * wheel.radius.min(other.radius);
                let along = apart.xz().norm();
                // twin wheels share an axle
                let share_axle = along < 0.05 * wheel.radius.min(apart.y.abs());
                if in_line && !share_axle && wheel.radius + other.radius > (1.0 + OVERLAP) * along {
                    return Err(self.implausible(
                        format!("wheels.{}.radius", wheel.name),
                        format!(
                            "wheels {} and {}, whose centres are {along:.3} m apart, not to overlap",
                            other.name, wheel.name
                        ),
                        format!("radii of {} m and {} m", other.radius, wheel.radius),
                        "Check the unit of the radii (m, not the diameter) and the positions of the wheels in the URDF.",
                    ));
                }
            }
        }
        Ok(())
    }

    /// A wheel that is named left is on the left: y > 0.
    fn check_sides(&self, wheels: &[Wheel]) -> Result<(), MachineError> {
        let names: Vec<&str> = wheels.iter().map(|wheel| wheel.name.as_str()).collect();
        let widest = wheels.iter().map(|wheel| wheel.centre_at_zero.y.abs());
        let widest = widest.fold(0.0, f64::max);
        for wheel in wheels {
            let y = wheel.centre_at_zero.y;
            let (side, is_there) = match place_in_name(&wheel.name, &names).side {
                Some(Side::Left) => ("left", y > 0.0),
                Some(Side::Right) => ("right", y < 0.0),
                None => continue,
            };
            if is_there || y.abs() < CLEARLY_ASIDE * widest {
                continue;
            }
            let is = if y > 0.0 { "left" } else { "right" };
            return Err(self.implausible(
                format!("wheels.{}", wheel.name),
                format!("a wheel on the {side}, as its name says"),
                format!(
                    "link \"{}\" on the {is}, at y = {y:.3} m (y points to the left)",
                    self.spec.wheels[&wheel.name].link
                ),
                "Exchange the links, rename the wheels, or turn the base frame of the URDF: x forward, y left.",
            ));
        }
        Ok(())
    }

    /// Wheels that are named front are in front of those that are named rear.
    fn check_ends(&self, wheels: &[Wheel]) -> Result<(), MachineError> {
        let names: Vec<&str> = wheels.iter().map(|wheel| wheel.name.as_str()).collect();
        let mean_x = |end: End| {
            let named =
                (wheels.iter()).filter(|wheel| place_in_name(&wheel.name, &names).end == Some(end));
            let x: Vec<f64> = named.map(|wheel| wheel.centre_at_zero.x).collect();
            (!x.is_empty()).then(|| x.iter().sum::<f64>() / x.len() as f64)
        };
        let (Some(front), Some(rear)) = (mean_x(End::Front), mean_x(End::Rear)) else {
            return Ok(());
        };
        if front >= rear {
            return Ok(());
        }
        Err(self.implausible(
            "wheels",
            "the wheels named front ahead of those named rear (x points forward)",
            format!("x = {front:.3} m for the front ones, x = {rear:.3} m for the rear ones"),
            "Exchange the links, rename the wheels, or turn the base frame of the URDF: x forward, y left.",
        ))
    }
}

/// The largest distance between two wheels (m).
pub(super) fn widest_distance(wheels: &[Wheel]) -> f64 {
    let centres = wheels.iter().map(|wheel| wheel.centre_at_zero);
    let pairs = centres
        .clone()
        .flat_map(|a| centres.clone().map(move |b| (a - b).norm()));
    pairs.fold(0.0, f64::max)
}

/// Returns the name of the unit in which a length was probably given, by its ratio to the expected length, with the factor to
/// metres; "a diameter" for twice the expected radius.
fn unit_of(ratio: f64) -> Option<(&'static str, f64)> {
    let units = [
        ("a diameter", 2.0, 0.5),
        ("feet", 1.0 / 0.3048, 0.3048),
        ("inches", 1.0 / 0.0254, 0.0254),
        ("centimetres", 100.0, 0.01),
        ("millimetres", 1000.0, 0.001),
    ];
    let fits = |in_unit: f64| (ratio / in_unit).ln().abs() < 0.25;
    let found = units.into_iter().find(|&(_, in_unit, _)| fits(in_unit));
    // without a measure to compare with, only the order of magnitude is known
    let is_large = ratio > 200.0;
    found
        .map(|(name, _, factor)| (name, factor))
        .or(is_large.then_some(("millimetres", 0.001)))
}

fn advice(radius: f64, likely: Option<(&'static str, f64)>) -> String {
    match likely {
        Some((unit, factor)) => {
            let metres = radius * factor;
            format!(
                "It looks like {unit}: write radius = {} (m).",
                (metres * 1e6).round() * 1e-6
            )
        }
        None => {
            "Check the unit (m) of the radius and of the URDF, and that it is not the diameter."
                .into()
        }
    }
}
