//! Refuses masses and inertias that no machine has: a base without mass, an inertia beyond the size of the
//! machine, masses or lengths in another unit.

use nalgebra::{Point3, SymmetricEigen, Vector3};

use super::checker::Checker;
use crate::machine::tree::TreeLink;
use crate::machine::{MachineError, Wheel};

/// Mass per volume of the space around the wheels (kg/m^3): a machine of the thinnest frame and one of solid
/// steel that stands far over its wheels are within.
const DENSITY: [f64; 2] = [3.0, 30_000.0];
/// Share of the mass that the parts between wheels and arm have at least.
const LEAST_CARRIER_SHARE: f64 = 0.02;
/// The same where the root body has no mass at all, as of an articulated machine.
const LEAST_CARRIER_SHARE_WITHOUT_ROOT: f64 = 0.4;
/// A link with this share of the mass needs an inertia.
const NEEDS_INERTIA_SHARE: f64 = 0.01;
/// Largest radius of gyration of a link as a multiple of the distance between the wheels.
const LARGEST_GYRATION: f64 = 1.5;
/// Inertias up to this one are common placeholders of parts without effect (kg m^2): noted, not refused.
const PLACEHOLDER_INERTIA: f64 = 0.01;
/// Farthest point as a multiple of the distance between the wheels, and its smallest implausible value (m).
const FARTHEST: (f64, f64) = (50.0, 20.0);

impl Checker<'_> {
    /// Checks the masses of the links against the machine's size and against each other. Returns a note on
    /// each inertia that is impossible but without effect.
    pub(super) fn check_mass_plausibility(
        &self,
        wheels: &[Wheel],
    ) -> Result<Vec<String>, MachineError> {
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
        let mut notes = Vec::new();
        for link in &self.tree.links {
            notes.extend(self.check_inertia(link, mass, apart)?);
        }
        Ok(notes)
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
        let extent = |of: fn(&Wheel) -> f64| {
            let values = || wheels.iter().map(of);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let base = extent(|w| w.centre_at_zero.x) * extent(|w| w.centre_at_zero.y);
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

    fn check_inertia(
        &self,
        link: &TreeLink,
        mass: f64,
        apart: f64,
    ) -> Result<Option<String>, MachineError> {
        let of_link = &link.inertia;
        if !(of_link.mass > 0.0) {
            return Ok(None);
        }
        let largest = SymmetricEigen::new(of_link.about_com).eigenvalues.max();
        let place = format!("link \"{}\"", link.name);
        if largest == 0.0 && of_link.mass >= NEEDS_INERTIA_SHARE * mass {
            return Err(self.implausible_in_urdf(
                &place,
                &format!("an inertia for its mass of {} kg", of_link.mass),
                "none",
                "Add <inertia> about the centre of mass; a box of the same size is a good approximation.",
            ));
        }
        // k = sqrt(I / m): a body reaches at least that far from its axis
        let gyration = (largest / of_link.mass).sqrt();
        if gyration <= LARGEST_GYRATION * apart {
            return Ok(None);
        }
        if largest <= PLACEHOLDER_INERTIA {
            return Ok(Some(format!(
                "Link {}: {} kg cannot have an inertia of {} kg m^2, a radius of gyration of {gyration:.2} m. It is used \
                 as stated; its effect is small.",
                link.name,
                of_link.mass,
                short(largest)
            )));
        }
        Err(self.implausible_in_urdf(
            &place,
            &format!(
                "an inertia that its mass of {} kg can have on a machine whose wheels are {apart:.2} m apart",
                of_link.mass
            ),
            &format!("{} kg m^2, a radius of gyration of {gyration:.2} m", short(largest)),
            "Check mass (kg) and inertia (kg m^2) of the link.",
        ))
    }
}

/// Without the noise of a rotation.
fn short(value: f64) -> f64 {
    (value * 1e9).round() * 1e-9
}
