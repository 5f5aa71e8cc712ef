//! Inertias of a URDF that no body has: what is wrong, what is used instead, and by how much that can change a load.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use tipwatch_language::{decimals, say, word};

use super::inertia::{Inertia, ROUNDING_SHARE};

/// Angular acceleration for which the effect on a load is stated (rad/s^2): a hard stop of a machine or of its arm.
pub(super) const ANGULAR_ACCELERATION: f64 = 5.0;
/// Density of the ball that stands in for a body of unknown shape (kg/m^3): of water, between hollow frames and
/// castings.
const BALL_DENSITY: f64 = 1000.0;
/// Standard deviation of a replaced inertia, as a share of its largest principal moment.
const REPLACED_SIGMA_SHARE: f64 = 0.5;

/// An inertia of the URDF that no body has, and its replacement where that is accepted.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpossibleInertia {
    /// Name of the link.
    pub link: String,
    /// Its mass (kg).
    pub mass_kg: f64,
    /// Its share of the machine's mass.
    pub mass_share: f64,
    /// The fault of the inertia.
    pub fault: InertiaFault,
    /// Principal moments as stated, ascending (kg m^2).
    pub stated_kg_m2: [f64; 3],
    /// Principal moments of the replacement, ascending (kg m^2).
    pub used_kg_m2: [f64; 3],
    /// The kind of replacement.
    pub replacement: Replacement,
    /// Its share of a wheel load that the difference can make up (N): the largest moment of the difference times
    /// an angular acceleration of 5 rad/s^2, over the smaller of track and wheelbase.
    pub load_change_n: f64,
    /// Inertial parameters of the replacement in the link's frame.
    pub(crate) used: Inertia,
}

/// A fault of an inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InertiaFault {
    /// A principal moment is negative.
    Negative,
    /// The largest principal moment exceeds the sum of the other two.
    Triangle {
        /// Excess of the largest moment over that sum, as a share of it.
        by: f64,
    },
    /// There is none, for a mass that needs one.
    Missing,
    /// A body of this mass would reach beyond the machine.
    TooLarge {
        /// Its radius of gyration (m).
        gyration_m: f64,
        /// The distance between the wheels (m).
        wheels_m: f64,
    },
}

/// A replacement of an impossible inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Replacement {
    /// The inertia of a box around the shape of the link, with these edges (m).
    Box([f64; 3]),
    /// The nearest possible inertia.
    Nearest,
    /// The inertia of a ball of this radius (m), where neither shape nor stated figures help.
    Ball(f64),
}

impl Replacement {
    /// The replacement in words.
    #[must_use]
    pub fn text(self) -> String {
        match self {
            Self::Box(edges) => {
                let [x, y, z] = edges.map(figure);
                say!("a box of its shape, {x} x {y} x {z} m")
            }
            Self::Nearest => word!("the nearest possible one").into(),
            Self::Ball(radius) => say!("a ball of {} m", figure(radius)),
        }
    }
}

impl InertiaFault {
    /// Returns the fault of principal moments in ascending order; `None` for possible moments, up to rounding.
    pub(super) fn of([small, middle, large]: [f64; 3]) -> Option<Self> {
        let allowed = ROUNDING_SHARE * large.abs();
        if small < -allowed {
            return Some(Self::Negative);
        }
        let sum = small + middle;
        (large > sum + allowed).then(|| Self::Triangle {
            by: (large - sum) / sum.max(f64::MIN_POSITIVE),
        })
    }

    /// The fault in words.
    #[must_use]
    pub fn text(self) -> String {
        match self {
            Self::Negative => word!("one is negative").into(),
            Self::Triangle { by } if by < 100.0 => {
                say!(
                    "the largest is {} % more than the sum of the other two",
                    figure(100.0 * by)
                )
            }
            Self::Triangle { .. } => {
                word!("the largest is larger than the sum of the other two").into()
            }
            Self::Missing => word!("expected an inertia for its mass").into(),
            Self::TooLarge {
                gyration_m,
                wheels_m,
            } => say!(
                "a radius of gyration of {gyration_m:.2} m, where the wheels are {wheels_m:.2} m apart"
            ),
        }
    }
}

impl ImpossibleInertia {
    /// Returns the link, its figures, the fault and its effect, as one line.
    #[must_use]
    pub fn text(&self) -> String {
        let [small, middle, large] = self.stated_kg_m2.map(figure);
        let stated = match self.fault {
            InertiaFault::Missing => word!("no inertia").into(),
            _ => say!("principal moments {small}, {middle}, {large} kg m^2"),
        };
        say!(
            "link \"{}\" ({} kg, {} % of the mass): {stated}: {}; replaced by {} it could change a wheel load by {} N",
            self.link,
            figure(self.mass_kg),
            figure(100.0 * self.mass_share),
            self.fault.text(),
            self.replacement_text(),
            figure(self.load_change_n),
        )
    }

    fn replacement_text(&self) -> String {
        let [small, middle, large] = self.used_kg_m2.map(figure);
        let by = self.replacement.text();
        format!("{by} ({small}, {middle}, {large} kg m^2)")
    }

    /// The note on a machine that uses the replacement.
    #[must_use]
    pub fn note(&self, is_accepted: bool) -> String {
        let why = match is_accepted {
            true => word!("accepted"),
            false => word!("too small to matter"),
        };
        say!(
            "Impossible inertia, {why}: {}. Standard deviation of the replacement: half its largest principal moment.",
            self.text()
        )
    }

    /// Standard deviation of each element of the replacement (kg m^2).
    pub(super) fn sigma(&self) -> f64 {
        REPLACED_SIGMA_SHARE * self.used_kg_m2[2]
    }
}

/// The message on impossible inertias.
pub(super) fn told(inertias: &[ImpossibleInertia]) -> String {
    let lines: String = inertias
        .iter()
        .map(|i| format!("\n- {}", i.text()))
        .collect();
    format!(
        "expected inertias that a body can have (non-negative principal moments of inertia, none larger than the sum of \
         the other two, none beyond the size of the machine), found {} that none can have:{lines}\nThe changes of a wheel \
         load are those of the rotational term: the difference of the inertias times {ANGULAR_ACCELERATION} rad/s^2, over \
         the smaller of track and wheelbase; at rest they are zero. Correct the <inertia> of these links, or accept the \
         replacements with their uncertainty: --accept-inertias, or accept_inertias = true in the machine file.",
        inertias.len()
    )
}

/// Three significant digits, without an exponent where a reader does not need one.
pub(super) fn figure(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&size) {
        return decimals(format!("{value:.2e}"));
    }
    let digits = (2.0 - size.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => decimals(text.trim_end_matches('0').trim_end_matches('.')),
        false => text,
    }
}

/// Principal moments in ascending order (kg m^2).
pub(super) fn principal_moments(tensor: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = SymmetricEigen::new(*tensor).eigenvalues.into();
    moments.sort_by(f64::total_cmp);
    moments
}

/// The nearest tensor of a body: the one whose second moments of mass along its axes are those of the stated one,
/// negative ones set to zero.
///
/// ```text
///     s_i = (I_1 + I_2 + I_3) / 2 - I_i >= 0        I_i = s_1 + s_2 + s_3 - s_i
/// ```
pub(super) fn nearest(tensor: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(*tensor);
    let half = 0.5 * eigen.eigenvalues.sum();
    let second = eigen.eigenvalues.map(|moment| (half - moment).max(0.0));
    let moments = second.map(|own| second.sum() - own);
    eigen.eigenvectors * Matrix3::from_diagonal(&moments) * eigen.eigenvectors.transpose()
}

/// Inertia tensor of a homogeneous box with these edges.
pub(super) fn of_box(mass: f64, edges: &Vector3<f64>) -> Matrix3<f64> {
    let squares = edges.component_mul(edges);
    Matrix3::from_diagonal(&squares.map(|own| mass / 12.0 * (squares.sum() - own)))
}

/// Radius of the ball of this mass (m).
pub(super) fn ball_radius(mass: f64) -> f64 {
    (3.0 * mass / (4.0 * std::f64::consts::PI * BALL_DENSITY)).cbrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_inertias_are_possible_and_possible_ones_stay() {
        let rotation = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1);
        let turned = |moments: [f64; 3]| {
            rotation.matrix()
                * Matrix3::from_diagonal(&Vector3::from(moments))
                * rotation.matrix().transpose()
        };
        for moments in [
            [1.0, 1.0, 9.0],
            [-1.0, 2.0, 2.0],
            [-3.0, -2.0, -1.0],
            [0.0, 0.0, 5.0],
        ] {
            let found = principal_moments(&nearest(&turned(moments)));
            assert_eq!(InertiaFault::of(found), None, "{moments:?}: {found:?}");
        }
        let sound = turned([2.0, 3.0, 4.0]);
        assert!((nearest(&sound) - sound).norm() < 1e-12);
        // the second moments are 4.5, 4.5 and -3.5; without the last one:
        let found = principal_moments(&nearest(&turned([1.0, 1.0, 9.0])));
        assert!((found[2] - 9.0).abs() < 1e-12 && (found[0] - 4.5).abs() < 1e-12);
    }

    #[test]
    fn figures_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (12.345_6, "12.3"),
            (0.000_123_4, "0.000123"),
            (1.5e-7, "1.50e-7"),
            (1234.5, "1234"),
            (3.0, "3"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
