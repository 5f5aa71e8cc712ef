//! The numbers of the indicators.

use super::velocity_gradient::VelocityGradient;
use crate::closed_form::EdgeMoments;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;

/// Stability measures at one instant; NaN where one cannot be computed.
#[derive(Debug, Clone)]
pub struct Indicators<T> {
    /// Overturning moment of the arm and the tool force alone about each edge, MHS-type (N m); negative =
    /// stable.
    pub mhs: Vec<T>,
    /// TOM: MHS-type plus the weight of the chassis (N m).
    pub tom: Vec<T>,
    /// ITOM: TOM plus the inertia forces of the chassis, with massless wheels (N m).
    pub itom: Vec<T>,
    /// Force-Angle of Papadopoulos and Rey about each edge (rad); positive = stable.
    pub force_angle: Vec<T>,
    /// Stability angle about each edge: the Force-Angle due to gravity alone (rad); positive = stable.
    pub stability_angle: Vec<T>,
    /// Load transfer ratio: right minus left load, divided by the sum of the loads.
    pub load_transfer_ratio: T,
    /// Metric (35) of the second paper: sum of the load differences over all pairs of wheels (N).
    pub spread: T,
    /// sigma (110): half the squared distance of the OTF from the optimal loads (N^2).
    pub sigma: T,
    /// Derivatives of sigma with respect to the motion of the base.
    pub sigma_gradient: VelocityGradient<T>,
    /// Force and moment of the arm, including the tool force, on the link that carries it, about the arm's
    /// root, base axes: B_M F of the first paper (N, N m).
    pub arm_wrench: Wrench<T>,
}

impl<T: Real> Indicators<T> {
    pub(crate) fn blank(machine: &Machine) -> Self {
        let unknown = T::constant(f64::NAN);
        let edges = vec![unknown; machine.polygon.edges.len()];
        Self {
            mhs: edges.clone(),
            tom: edges.clone(),
            itom: edges.clone(),
            force_angle: edges.clone(),
            stability_angle: edges,
            load_transfer_ratio: unknown,
            spread: unknown,
            sigma: unknown,
            sigma_gradient: VelocityGradient::unknown(),
            arm_wrench: Wrench::zero(),
        }
    }
}

impl<T: Real> Indicators<T> {
    /// Sets MHS-type, TOM and ITOM from the analytic model, about the edges of its rectangle.
    pub(crate) fn set_edge_moments(&mut self, [mhs, tom, itom]: &[EdgeMoments<T>; 3]) {
        for (edges, moments) in [
            (&mut self.mhs, mhs),
            (&mut self.tom, tom),
            (&mut self.itom, itom),
        ] {
            edges.copy_from_slice(&[moments.front, moments.left, moments.rear, moments.right]);
        }
    }
}
