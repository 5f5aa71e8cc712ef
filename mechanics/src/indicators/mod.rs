//! Stability measures besides the loads, for any support polygon.

mod edge_moments;
mod force_angle;
mod load_distribution;
mod velocity_gradient;

use nalgebra::Vector2;

pub(crate) use edge_moments::overturning;
pub(crate) use load_distribution::sigma;
pub(crate) use velocity_gradient::by_travel;
pub use velocity_gradient::{Travel, VelocityGradient};

use crate::closed_form::EdgeMoments;
use crate::contact_plane::ContactPlane;
use crate::groups::Parts;
use crate::kinematics::BodyMotion;
use crate::machine::Machine;
use crate::number::Real;
use crate::outcome::Outcome;
use crate::sensitivity::Sensitivity;
use crate::spatial::Wrench;
use crate::state::State;
pub(crate) use force_angle::Standing;

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

/// An evaluation, with what the indicators need of it.
pub(crate) struct Balance<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) state: &'a State<T>,
    pub(crate) plane: &'a ContactPlane<T>,
    /// The contact points in the plane.
    pub(crate) contacts: &'a [Vector2<T>],
    pub(crate) whole: &'a Parts<T>,
    pub(crate) motions: &'a [BodyMotion<T>],
    /// The derivatives, if computed.
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

/// Fills the indicators that depend on the loads and on gravity alone.
pub(crate) fn fill_what_needs_no_wrench<T: Real>(balance: &Balance<'_, T>, out: &mut Outcome<T>) {
    let whole = balance.whole.whole();
    let standing = Standing::new(balance, &(whole.first / whole.mass));
    let gravity = balance.state.base.up * T::constant(balance.machine.gravity());
    let resting = Wrench {
        force: gravity,
        ..Wrench::zero()
    };
    for (edge, spec) in balance.machine.polygon.edges.iter().enumerate() {
        out.indicators.stability_angle[edge] = standing.angle(spec, &resting);
    }
    load_distribution::fill(balance.machine, out);
    out.indicators.arm_wrench = arm_wrench(balance);
}

/// Fills the indicators of an outcome whose loads are already computed.
pub(crate) fn fill<T: Real>(balance: &Balance<'_, T>, out: &mut Outcome<T>) {
    let machine = balance.machine;
    let gravity = balance.state.base.up * T::constant(machine.gravity());
    edge_moments::fill(balance, &gravity, &out.ground_wrench, &mut out.indicators);
    let whole = balance.whole.whole();
    let com = whole.first / whole.mass;
    let standing = Standing::new(balance, &com);
    let reaction = out.ground_wrench.about(&com);
    for (edge, spec) in machine.polygon.edges.iter().enumerate() {
        out.indicators.force_angle[edge] = standing.angle(spec, &reaction);
    }
    fill_what_needs_no_wrench(balance, out);
    if let Some(sensitivity) = balance.sensitivity {
        out.indicators.sigma_gradient = velocity_gradient::of(balance, sensitivity, &out.otf);
    }
}

/// Negative of the wrench that accelerates the arm, about the arm's root.
fn arm_wrench<T: Real>(balance: &Balance<'_, T>) -> Wrench<T> {
    let parts = balance.whole;
    let by_arm = parts.tool.minus(&parts.arm.wrench);
    arm_wrench_of(balance.machine, balance.motions, &by_arm)
}

/// A wrench about the base origin, moved to the arm's root; zero without an arm.
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
