//! Random variation of a machine's parameters: the first paper's study of parametric uncertainty.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Inertia, Machine};

/// A stream of random numbers: SplitMix64 (Steele, Lea and Flood). Implemented here so that a study samples
/// the same machines with every version of every library.
#[derive(Debug, Clone)]
pub(crate) struct ParameterSampler {
    state: u64,
    /// Largest relative deviation.
    spread: f64,
}

impl ParameterSampler {
    pub(crate) fn new(seed: u64, spread: f64) -> Self {
        Self {
            state: seed,
            spread,
        }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// 1 + delta, with delta uniform in plus or minus the spread.
    pub(crate) fn factor(&mut self) -> f64 {
        let uniform = (self.next() >> 11) as f64 / (1_u64 << 53) as f64;
        1.0 + self.spread * (2.0 * uniform - 1.0)
    }

    fn length(&mut self, vector: &mut Vector3<f64>) {
        vector
            .iter_mut()
            .for_each(|component| *component *= self.factor());
    }

    /// Scales the angle of a rotation, keeping its axis.
    fn angle(&mut self, rotation: &mut UnitQuaternion<f64>) {
        *rotation = UnitQuaternion::from_scaled_axis(rotation.scaled_axis() * self.factor());
    }

    fn inertia(&mut self, inertia: &mut Inertia) {
        inertia.mass *= self.factor();
        self.length(&mut inertia.com);
        inertia.about_com *= self.factor();
    }
}

impl Machine {
    /// This machine with every length, fixed angle, mass and inertia multiplied by a random factor of its own.
    /// An inertia tensor has a single factor, so that it remains physically valid. The sides of a closed
    /// triangle have factors of their own besides those of the tree, so the triangle may fail to close in some
    /// postures.
    pub(crate) fn sampled(&self, draws: &mut ParameterSampler) -> Self {
        let mut sampled = self.clone();
        for body in &mut sampled.bodies[1..] {
            draws.length(&mut body.joint_in_parent);
            let rotation = nalgebra::Rotation3::from_matrix_unchecked(body.parent_from_joint);
            let mut rotation = UnitQuaternion::from_rotation_matrix(&rotation);
            draws.angle(&mut rotation);
            body.parent_from_joint = *rotation.to_rotation_matrix().matrix();
        }
        for link in sampled.links.iter_mut().filter(|l| l.inertia.mass > 0.0) {
            draws.inertia(&mut link.inertia);
        }
        for payload in &mut sampled.payloads {
            draws.inertia(&mut payload.inertia);
        }
        for wheel in &mut sampled.wheels {
            wheel.radius *= draws.factor();
            draws.length(&mut wheel.centre_in_body);
        }
        for linkage in &mut sampled.linkages {
            linkage.scale_sides(draws.factor(), draws.factor());
        }
        draws.length(&mut sampled.imu.body_from_mount.translation.vector);
        draws.angle(&mut sampled.imu.body_from_mount.rotation);
        sampled.gather();
        sampled
    }
}
