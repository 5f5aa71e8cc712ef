//! Fills the indicators of an evaluation.

use super::balance::Balance;
use super::force_angle::TippingAngles;
use super::values::Indicators;
use super::{edge_moments, load_distribution, velocity_gradient};
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;

/// Fills the indicators that depend on the loads and on gravity alone.
pub(crate) fn fill_wrench_free<T: Real>(balance: &Balance<'_, T>, out: &mut Indicators<T>) {
    let whole = balance.whole.whole();
    let angles = TippingAngles::new(balance, &(whole.first / whole.mass));
    let gravity = balance.state.base.up * T::constant(balance.machine.gravity());
    let resting = Wrench {
        force: gravity,
        ..Wrench::zero()
    };
    let edges = &balance.machine.polygon.edges;
    angles.fill(edges, &resting, &mut out.stability_angle);
    load_distribution::fill(balance, out);
    out.arm_wrench = arm_wrench(balance);
}

/// Fills the indicators of an outcome whose loads are already computed.
pub(crate) fn fill<T: Real>(balance: &Balance<'_, T>, out: &mut Indicators<T>) {
    let machine = balance.machine;
    let gravity = balance.state.base.up * T::constant(machine.gravity());
    edge_moments::fill(balance, &gravity, balance.ground_wrench, out);
    let whole = balance.whole.whole();
    let com = whole.first / whole.mass;
    let angles = TippingAngles::new(balance, &com);
    let reaction = balance.ground_wrench.about(&com);
    angles.fill(&machine.polygon.edges, &reaction, &mut out.force_angle);
    fill_wrench_free(balance, out);
    if let Some(sensitivity) = balance.sensitivity {
        out.sigma_gradient = velocity_gradient::of(balance, sensitivity, balance.otf);
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
