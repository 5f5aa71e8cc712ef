//! Refuses masses that no machine has: a base without mass, masses or lengths in another unit.

use nalgebra::{Point3, Vector3};

use super::checker::Checker;
use crate::machine::{MachineError, Wheel};

/// Mass per volume of the space around the wheels (kg/m^3): a machine of the thinnest frame and one of solid
/// steel that stands far over its wheels are within.
const DENSITY: [f64; 2] = [3.0, 30_000.0];
/// Share of the mass that the parts between wheels and arm have at least.
const LEAST_CARRIER_SHARE: f64 = 0.02;
/// That share where the root body has no mass at all, as of an articulated machine.
const LEAST_CARRIER_SHARE_WITHOUT_ROOT: f64 = 0.4;
/// Farthest point as a multiple of the distance between the wheels, and its smallest implausible value (m).
const FARTHEST: (f64, f64) = (50.0, 20.0);

impl Checker<'_> {
    /// Checks the masses of the links against the machine's size and against each other. Returns the mass of the
    /// machine (kg) and the extent of its wheels (m).
    pub(super) fn check_mass_plausibility(
        &self,
        wheels: &[Wheel],
    ) -> Result<[f64; 2], MachineError> {
        let mass: f64 = self.tree.links.iter().map(|link| link.inertia.mass).sum();
        if !(mass > 0.0) {
            return Err(self.implausible_in_urdf(
                "links",
                "links with a mass",
                "none",
                "Add <inertial> with the mass, centre of mass and inertia of every part.",
            ));
        }
        let apart = self.check_lengths(wheels)?;
        self.check_density(mass, wheels)?;
        self.check_carrier(mass, wheels)?;
        Ok([mass, apart])
    }

    /// No link is far from the wheels. Returns the extent of the wheels (m).
    fn check_lengths(&self, wheels: &[Wheel]) -> Result<f64, MachineError> {
        let sum: Vector3<f64> = wheels.iter().map(|wheel| wheel.centre_at_zero).sum();
        let middle = sum / wheels.len() as f64;
        let from_middle = |wheel: &Wheel| (wheel.centre_at_zero - middle).norm();
        let apart = 2.0 * wheels.iter().map(from_middle).fold(0.0, f64::max);
        for link in &self.tree.links {
            let base_from_body = &self.tree.bodies[link.body].base_from_body;
            let origin = base_from_body * Point3::from(link.body_from_link.translation.vector);
            let com =
                (link.inertia.mass > 0.0).then(|| base_from_body * Point3::from(link.inertia.com));
            for point in [Some(origin), com].into_iter().flatten() {
                let away = (point.coords - middle).norm();
                let (multiple, least) = FARTHEST;
                if away > multiple * apart && away > least {
                    return Err(self.implausible_in_urdf(
                        &format!("link \"{}\"", link.name),
                        &format!("its frame and centre of mass near the wheels, which are {apart:.2} m apart"),
                        &format!("{away:.1} m away"),
                        "Lengths are in metres; these look like millimetres.",
                    ));
                }
            }
        }
        Ok(apart)
    }

    fn check_density(&self, mass: f64, wheels: &[Wheel]) -> Result<(), MachineError> {
        let [along, across] = Wheel::extents(wheels);
        let base = along * across;
        let radius = wheels.iter().map(|w| w.radius).fold(0.0, f64::max);
        let density = mass / (base * base.sqrt().max(2.0 * radius));
        let [least, largest] = DENSITY;
        if !(density.is_finite()) || (least..=largest).contains(&density) {
            return Ok(());
        }
        let (likely, tonnes) = match density > largest {
            true => ("grams", false),
            false => ("tonnes", true),
        };
        Err(self.implausible_in_urdf(
            "links",
            &format!("a mass [kg] that fits wheels around {base:.3} m^2 of ground"),
            &format!("{mass} kg, {density:.3} kg for each cubic metre"),
            &format!(
                "Masses are in kilograms and lengths in metres; {}.",
                match tonnes {
                    true => format!("the masses look like {likely}"),
                    false =>
                        format!("the masses look like {likely}, or the lengths like another unit"),
                }
            ),
        ))
    }

    /// The bodies that carry wheels, the root included, have mass.
    fn check_carrier(&self, mass: f64, wheels: &[Wheel]) -> Result<(), MachineError> {
        let is_wheel = |body: usize| wheels.iter().any(|wheel| wheel.body == body);
        let carries =
            |body: usize| (wheels.iter()).any(|wheel| self.tree.is_carried_by(wheel.body, body));
        let of_carriers: f64 = (self.tree.bodies.iter().enumerate())
            .filter(|&(body, _)| body == 0 || (carries(body) && !is_wheel(body)))
            .map(|(_, body)| body.inertia.mass)
            .sum();
        let root = self.tree.bodies[0].inertia.mass;
        let least = match root > 0.0 {
            true => LEAST_CARRIER_SHARE,
            false => LEAST_CARRIER_SHARE_WITHOUT_ROOT,
        };
        if of_carriers >= least * mass {
            return Ok(());
        }
        let fixed: Vec<&str> = (self.tree.links.iter())
            .filter(|link| link.body == 0)
            .map(|link| link.name.as_str())
            .take(4)
            .collect();
        Err(self.implausible_in_urdf(
            &format!("link \"{}\"", self.tree.base_link),
            "a base with mass",
            &format!(
                "{root} kg for the base ({}) and {of_carriers:.3} kg for all parts that carry the wheels, of {mass:.1} kg",
                fixed.join(", ")
            ),
            "Add <inertial> with the mass, centre of mass and inertia of the chassis.",
        ))
    }
}
