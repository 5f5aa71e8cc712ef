//! ROS2, a linearly implicit two-stage integrator of second order for stiff equations, L-stable (Verwer, Spee,
//! Blom and Hundsdorfer, SIAM J. Sci. Comput. 20, 1999).
//!
//! ```text
//!     (1 - g h J) k1 = f(y)
//!     (1 - g h J) k2 = f(y + h k1) - 2 k1           g = 1 - 1/sqrt 2
//!     y' = y + h (3 k1 + k2)/2                      error estimate h (k1 + k2)/2
//! ```

use nalgebra::{Matrix4, Vector4};

/// g of the method.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Maximum number of sub-steps of one step, accepted or not.
const MAX_SUBSTEPS: usize = 2000;
/// Largest factor by which the sub-step size may change.
const MAX_GROWTH: f64 = 4.0;

/// A failed step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StepError {
    /// An input or the state is not finite.
    #[error("expected finite numbers in hydraulic state and inputs")]
    NotFinite,
    /// Too many sub-steps would be needed.
    #[error("the step does not converge within {MAX_SUBSTEPS} sub-steps: {left_s} s are left")]
    TooManySubsteps {
        /// Remaining part of the step (s).
        left_s: f64,
    },
}

/// Integrates an autonomous system of four equations for `seconds`. `rates_at` gives f(y) and its Jacobian, `tolerance` the error of each
/// component per sub-step.
pub(super) fn integrate(
    rates_at: impl Fn(&Vector4<f64>) -> (Vector4<f64>, Matrix4<f64>),
    tolerance: Vector4<f64>,
    start: Vector4<f64>,
    seconds: f64,
) -> Result<Vector4<f64>, StepError> {
    let (mut y, mut left, mut h) = (start, seconds, seconds);
    let finite = |v: &Vector4<f64>| v.iter().all(|c| c.is_finite());
    if !(finite(&y) && seconds.is_finite() && seconds >= 0.0) {
        return Err(StepError::NotFinite);
    }
    for _ in 0..MAX_SUBSTEPS {
        if left <= 0.0 {
            return Ok(y);
        }
        h = h.min(left);
        let (rates, jacobian) = rates_at(&y);
        let solver = (Matrix4::identity() - jacobian * (GAMMA * h)).lu();
        let stages = solver.solve(&rates).and_then(|k1| {
            let (ahead, _) = rates_at(&(y + k1 * h));
            Some((k1, solver.solve(&(ahead - k1 * 2.0))?))
        });
        let Some((k1, k2)) = stages else {
            h /= MAX_GROWTH;
            continue;
        };
        let next = y + (k1 * 3.0 + k2) * (0.5 * h);
        let error: f64 = ((k1 + k2) * (0.5 * h)).component_div(&tolerance).amax();
        if !(finite(&next) && error.is_finite()) {
            h /= MAX_GROWTH;
            continue;
        }
        if error <= 1.0 {
            y = next;
            left -= h;
            // A remainder within rounding is zero.
            if left < 1e-12 * seconds {
                left = 0.0;
            }
        }
        h *= (0.9 / error.max(1e-10).sqrt()).clamp(1.0 / MAX_GROWTH, MAX_GROWTH);
    }
    if left <= 0.0 {
        return Ok(y);
    }
    Err(StepError::TooManySubsteps { left_s: left })
}
