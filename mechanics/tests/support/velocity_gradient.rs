//! Derivatives of the loads and of the tip-over avoidance function sigma with respect to the velocities.

use tipwatch_mechanics::Real;
use tipwatch_mechanics::closed_form::{Demand, PlanarMotion, Platform};

/// Partial derivatives of the loads FL FR RR RL at constant arm wrench and attitude.
///
/// The derivatives with respect to velocity are at constant accelerations, so at rest they vanish even if the
/// machine is close to tipping. Braking appears in `by_acceleration`: within a control step dt, where
/// vdot = (xi_k - xi_(k-1)) / dt, add `by_acceleration / dt`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoadGradient<T> {
    /// Derivatives with respect to xi = (v_x, v_y, Psidot), from zeta_9 and zeta_10 (N s/m, N s/m, N s/rad).
    pub(crate) by_velocity: [[T; 3]; 4],
    /// Derivatives with respect to (vdot_x, vdot_y, Psiddot), from zeta_7, zeta_8 and zeta_11 (N s^2/m, N s^2/m, N s^2/rad).
    pub(crate) by_acceleration: [[T; 3]; 4],
}

impl<T: Real> LoadGradient<T> {
    /// The derivatives for a motion.
    ///
    /// ```text
    ///     db/dv_x = (-m z_C Psidot, 0)    db/dv_y = (0, -m z_C Psidot)
    ///     db/dPsidot  = (-m z_C v_x - 2 I_yz Psidot, -m z_C v_y + 2 I_xz Psidot)
    ///     db/dvdot_x  = (0, m z_C)    db/dvdot_y = (-m z_C, 0)    db/dPsiddot = (I_xz, I_yz)
    /// ```
    pub(crate) fn of(platform: &Platform<T>, motion: &PlanarMotion<T>) -> Self {
        let zero = T::zero();
        let lever = platform.mass * platform.com_height;
        let (xz, yz) = (platform.inertia_xz, platform.inertia_yz);
        let rate = motion.yaw_rate;
        let by_velocity = [
            Demand::moments(-(lever * rate), zero),
            Demand::moments(zero, -(lever * rate)),
            Demand::moments(
                -(lever * motion.v_x) - (yz + yz) * rate,
                (xz + xz) * rate - lever * motion.v_y,
            ),
        ];
        let by_acceleration = [
            Demand::moments(zero, lever),
            Demand::moments(-lever, zero),
            Demand::moments(xz, yz),
        ];
        Self {
            by_velocity: by_wheel(&by_velocity, platform),
            by_acceleration: by_wheel(&by_acceleration, platform),
        }
    }
}

fn by_wheel<T: Real>(demands: &[Demand<T>; 3], platform: &Platform<T>) -> [[T; 3]; 4] {
    let loads = demands.each_ref().map(|demand| demand.loads(platform));
    std::array::from_fn(|wheel| std::array::from_fn(|k| loads[k][wheel]))
}

/// dsigma/dxi = sum (OTF_i - OTF_i,opt) dOTF_i/dxi, from the derivatives of the loads with respect to any xi.
pub(crate) fn sigma_gradient<T: Real>(
    loads: &[T; 4],
    optimal: &[T; 4],
    load_gradient: &[[T; 3]; 4],
) -> [T; 3] {
    let mut gradient = [T::zero(); 3];
    for ((&load, &optimal), by) in loads.iter().zip(optimal).zip(load_gradient) {
        for (sum, &by) in gradient.iter_mut().zip(by) {
            *sum += (load - optimal) * by;
        }
    }
    gradient
}
