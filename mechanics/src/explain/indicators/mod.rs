//! Measures of stability beside the loads, for any support polygon.

mod edge_moments;
mod force_angle;
mod load_distribution;
mod velocity_gradient;

use nalgebra::Vector2;

pub(crate) use edge_moments::overturning;
pub use velocity_gradient::VelocityGradient;

use crate::closed_form::EdgeMoments;
use crate::dynamics::groups::Parts;
use crate::dynamics::kinematics::BodyMotion;
use crate::explain::sensitivity::Sensitivity;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;
use crate::state::State;
pub use force_angle::TippingAngles;

/// Measures of stability at one instant; NaN where one cannot be computed.
#[derive(Debug, Clone)]
pub struct Indicators<T> {
    /// Overturning moment of the arm and the tool force alone about each edge, "MHS-type" (N m);
    /// negative = stable.
    pub mhs: Vec<T>,
    /// TOM: that and the weight of the chassis (N m).
    pub tom: Vec<T>,
    /// ITOM: that and the chassis' inertia forces, of massless wheels (N m).
    pub itom: Vec<T>,
    /// Force-Angle of Papadopoulos and Rey about each edge (rad); positive = stable.
    pub force_angle: Vec<T>,
    /// Stability angle about each edge: the Force-Angle of gravity alone (rad); positive = stable.
    pub stability_angle: Vec<T>,
    /// Load transfer ratio: right less left by the sum of the loads.
    pub load_transfer_ratio: T,
    /// Metric (35) of the second paper: differences of the loads over all pairs of wheels (N).
    pub spread: T,
    /// sigma (110): half the squared distance of the OTF from the optimal loads (N^2).
    pub sigma: T,
    /// Derivatives of sigma by the travel of the base.
    pub sigma_gradient: VelocityGradient<T>,
    /// Force and moment by the arm, and by the tool force through it, on what carries it, about the
    /// arm's root, base axes: B_M F of the first paper (N, N m).
    pub arm_wrench: Wrench<T>,
}

/// An evaluation, as the indicators need it.
pub(crate) struct Balance<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) state: &'a State<T>,
    pub(crate) plane: &'a ContactPlane<T>,
    /// The contact points in the plane.
    pub(crate) contacts: &'a [Vector2<T>],
    pub(crate) whole: &'a Parts<T>,
    pub(crate) motions: &'a [BodyMotion<T>],
    /// Force and moment of the ground, about the base origin.
    pub(crate) ground_wrench: &'a Wrench<T>,
    /// Loads with all wheels held to the ground, by wheel.
    pub(crate) otf: &'a [T],
    /// Loads, by wheel.
    pub(crate) load: &'a [T],
    /// The derivatives, if they were computed.
    pub(crate) sensitivity: Option<&'a Sensitivity<T>>,
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
    /// Sets MHS-type, TOM and ITOM as the analytic model has them, about the edges of its rectangle.
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

/// Fills what follows from the loads and from gravity alone.
pub(crate) fn fill_what_needs_no_wrench<T: Real>(
    balance: &Balance<'_, T>,
    out: &mut Indicators<T>,
) {
    let whole = balance.whole.whole();
    let angles = TippingAngles::new(balance, &(whole.first / whole.mass));
    let gravity = balance.state.base.up * T::constant(balance.machine.gravity());
    let resting = Wrench {
        force: gravity,
        ..Wrench::zero()
    };
    for (edge, spec) in balance.machine.polygon.edges.iter().enumerate() {
        out.stability_angle[edge] = angles.angle(spec, &resting);
    }
    load_distribution::fill(balance, out);
    out.arm_wrench = arm_wrench(balance);
}

/// Fills the indicators of an outcome whose loads are known.
pub(crate) fn fill<T: Real>(balance: &Balance<'_, T>, out: &mut Indicators<T>) {
    let machine = balance.machine;
    let gravity = balance.state.base.up * T::constant(machine.gravity());
    edge_moments::fill(balance, &gravity, balance.ground_wrench, out);
    let whole = balance.whole.whole();
    let com = whole.first / whole.mass;
    let angles = TippingAngles::new(balance, &com);
    let reaction = balance.ground_wrench.about(&com);
    for (edge, spec) in machine.polygon.edges.iter().enumerate() {
        out.force_angle[edge] = angles.angle(spec, &reaction);
    }
    fill_what_needs_no_wrench(balance, out);
    if let Some(sensitivity) = balance.sensitivity {
        out.sigma_gradient = velocity_gradient::of(balance, sensitivity, balance.otf);
    }
}

/// Minus what moves the arm, about the arm's root.
fn arm_wrench<T: Real>(balance: &Balance<'_, T>) -> Wrench<T> {
    let parts = balance.whole;
    let by_arm = parts.tool.minus(&parts.arm.wrench);
    arm_wrench_of(balance.machine, balance.motions, &by_arm)
}

/// A wrench about the base origin, about the arm's root; nothing without an arm.
pub(crate) fn arm_wrench_of<T: Real>(
    machine: &Machine,
    motions: &[BodyMotion<T>],
    by_arm: &Wrench<T>,
) -> Wrench<T> {
    let Some(root) = &machine.arm_root else {
        return Wrench::zero();
    };
    let origin = motions[root.body].point(&root.body_from_mount.translation.vector);
    by_arm.about(&origin)
}
