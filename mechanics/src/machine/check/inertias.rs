//! Finds the inertias of the URDF that no body has, and what to use instead.

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};
use tipwatch_language::say;

use crate::machine::impossible_inertia::{
    ANGULAR_ACCELERATION, ball_radius, nearest, of_box, principal_moments,
};
use crate::machine::urdf::Urdf;
use crate::machine::{
    ImpossibleInertia, Inertia, InertiaFault, MachineError, MachineSpec, Replacement, Wheel,
};

/// A link with this share of the mass needs an inertia.
const NEEDS_INERTIA_SHARE: f64 = 0.01;
/// Largest radius of gyration of a link as a multiple of the distance between the wheels.
const LARGEST_GYRATION: f64 = 1.5;
/// Inertias up to this one are common placeholders of parts without effect (kg m^2): noted, not refused.
const PLACEHOLDER_INERTIA: f64 = 0.01;
/// A link below this share of the mass is too small for its rotation to matter, whatever its inertia.
const SMALL_MASS_SHARE: f64 = 1e-3;
/// A change of a load below this share of the mean one is too small to matter.
const SMALL_LOAD_SHARE: f64 = 1e-3;

/// Replaced inertias of a URDF, and notes about them.
#[derive(Debug, Default)]
pub(super) struct FoundInertias {
    /// Inertias that are replaced.
    pub(super) replaced: Vec<ImpossibleInertia>,
    pub(super) notes: Vec<String>,
}

impl FoundInertias {
    /// Checks all inertias against those that a body can have on a machine of this mass (kg) with wheels this far apart (m).
    /// Impossible ones are refused, all at once, unless their effect is too small to matter or the machine file accepts their
    /// replacements.
    pub(super) fn of(
        (urdf, urdf_name): (&Urdf, &str),
        spec: &MachineSpec,
        boxes: &HashMap<String, Vector3<f64>>,
        wheels: &[Wheel],
        mass: f64,
        apart: f64,
    ) -> Result<Self, MachineError> {
        let [along, across] = Wheel::extents(wheels);
        let scale = Scale {
            mass,
            apart,
            width: along.min(across),
            mean_load: mass * spec.gravity / wheels.len() as f64,
        };
        let mut found = Self::default();
        let mut refused = Vec::new();
        for link in &urdf.links {
            if link.lacks_mass {
                found.notes.push(say!(
                    "Link {} has an inertia but no mass: it is used as a frame, without inertia.",
                    link.name
                ));
            }
            let Some(inertia) = &link.inertia else {
                continue;
            };
            let moments = principal_moments(&inertia.about_com);
            if !(moments.iter().all(|m| m.is_finite()) && inertia.com.norm().is_finite()) {
                let place = format!("link \"{}\"", link.name);
                let expected = "finite inertial parameters";
                return Err(MachineError::value(
                    urdf_name,
                    place,
                    expected,
                    "numbers whose products are not finite",
                ));
            }
            let Some(fault) = scale.fault(inertia, moments) else {
                found.notes.extend(scale.note(&link.name, inertia, moments));
                continue;
            };
            let impossible = scale.replaced(&link.name, inertia, fault, boxes.get(&link.name));
            let is_small = scale.is_small(&impossible);
            let is_accepted = spec.accept_inertias == Some(true);
            match is_accepted || is_small {
                true => {
                    found.notes.push(impossible.note(!is_small));
                    found.replaced.push(impossible);
                }
                false => refused.push(impossible),
            }
        }
        match refused.is_empty() {
            true => Ok(found),
            false => Err(MachineError::Inertias {
                file: urdf_name.into(),
                inertias: refused,
            }),
        }
    }
}

/// Size and load of the machine that an inertia is compared with.
struct Scale {
    /// Mass of the machine (kg).
    mass: f64,
    /// Distance between the wheels (m).
    apart: f64,
    /// The smaller of track and wheelbase (m).
    width: f64,
    /// Mean load of a wheel (N).
    mean_load: f64,
}

impl Scale {
    fn fault(&self, inertia: &Inertia, moments: [f64; 3]) -> Option<InertiaFault> {
        if let Some(fault) = InertiaFault::of(moments) {
            return Some(fault);
        }
        let largest = moments[2];
        if largest == 0.0 && inertia.mass >= NEEDS_INERTIA_SHARE * self.mass {
            return Some(InertiaFault::Missing);
        }
        // k = sqrt(I / m): a body reaches at least that far from its axis
        let gyration_m = (largest / inertia.mass).sqrt();
        let is_possible = gyration_m <= LARGEST_GYRATION * self.apart;
        (!is_possible && largest > PLACEHOLDER_INERTIA).then_some(InertiaFault::TooLarge {
            gyration_m,
            wheels_m: self.apart,
        })
    }

    /// The note on a placeholder.
    fn note(&self, link: &str, inertia: &Inertia, moments: [f64; 3]) -> Option<String> {
        let gyration = (moments[2] / inertia.mass).sqrt();
        (gyration > LARGEST_GYRATION * self.apart).then(|| {
            say!(
                "Link {link}: {} kg cannot have an inertia of {} kg m^2, a radius of gyration of {gyration:.2} m. It is \
                 used as stated; its effect is small.",
                inertia.mass,
                short(moments[2])
            )
        })
    }

    fn replaced(
        &self,
        link: &str,
        inertia: &Inertia,
        fault: InertiaFault,
        edges: Option<&Vector3<f64>>,
    ) -> ImpossibleInertia {
        let mass = inertia.mass;
        let fits = |tensor: &Matrix3<f64>| {
            let [.., largest] = principal_moments(tensor);
            largest > 0.0 && (largest / mass).sqrt() <= LARGEST_GYRATION * self.apart
        };
        let of_shape = edges
            .map(|edges| (Replacement::Box((*edges).into()), of_box(mass, edges)))
            .filter(|(_, tensor)| fits(tensor));
        let clamped = (Replacement::Nearest, nearest(&inertia.about_com));
        let clamped = Some(clamped).filter(|(_, tensor)| fits(tensor));
        let (replacement, about_com) = of_shape.or(clamped).unwrap_or_else(|| {
            let radius = ball_radius(mass);
            let tensor = Matrix3::identity() * (0.4 * mass * radius * radius);
            (Replacement::Ball(radius), tensor)
        });
        let difference = principal_moments(&(inertia.about_com - about_com));
        let largest = difference.into_iter().map(f64::abs).fold(0.0, f64::max);
        ImpossibleInertia {
            link: link.into(),
            mass_kg: mass,
            mass_share: mass / self.mass,
            fault,
            stated_kg_m2: principal_moments(&inertia.about_com),
            used_kg_m2: principal_moments(&about_com),
            replacement,
            load_change_n: largest * ANGULAR_ACCELERATION / self.width,
            used: Inertia {
                about_com,
                ..*inertia
            },
        }
    }

    /// Whether the replacement changes no load by an amount that matters. An inertia beyond the size of the machine suggests a
    /// mass in another unit, and a missing one an omission: neither is small.
    fn is_small(&self, impossible: &ImpossibleInertia) -> bool {
        let of_figures = matches!(
            impossible.fault,
            InertiaFault::Negative | InertiaFault::Triangle { .. }
        );
        of_figures
            && (impossible.mass_share < SMALL_MASS_SHARE
                || impossible.load_change_n < SMALL_LOAD_SHARE * self.mean_load)
    }
}

/// Rounds a value to drop the rounding noise of a rotation.
fn short(value: f64) -> f64 {
    (value * 1e9).round() * 1e-9
}
