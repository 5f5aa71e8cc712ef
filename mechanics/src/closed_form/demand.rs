//! Demand: the total that the four normal loads must supply, and the map from it to each load.

use super::Platform;
use crate::number::Real;

/// Right side of (55), or a part of it: moments about the point of the contact plane below C, and the force
/// that the normal loads must supply, in platform axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand<T> {
    /// b1 of (56), about x: sum of y_i N_i (N m).
    pub b1: T,
    /// b2 of (57), about y: minus the sum of x_i N_i (N m).
    pub b2: T,
    /// b3 of (58), along z: sum of N_i (N).
    pub b3: T,
}

impl<T: Real> Demand<T> {
    /// Zero demand.
    #[must_use]
    pub fn zero() -> Self {
        Self::moments(T::zero(), T::zero())
    }

    /// Moments about x and y alone (N m).
    #[must_use]
    pub fn moments(b1: T, b2: T) -> Self {
        let b3 = T::zero();
        Self { b1, b2, b3 }
    }

    /// Sum of two demands.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            b1: self.b1 + other.b1,
            b2: self.b2 + other.b2,
            b3: self.b3 + other.b3,
        }
    }

    /// Sum of all demands.
    #[must_use]
    pub fn sum(demands: &[Self]) -> Self {
        demands
            .iter()
            .fold(Self::zero(), |sum, demand| sum.plus(demand))
    }

    /// The signed normal loads FL FR RR RL that supply it (N): the solution of (55) for any roll moment
    /// distribution D of (54) and unequal half tracks.
    ///
    /// ```text
    ///     S_F = (l1 b3 - b2) / L        S_R = (l2 b3 + b2) / L
    ///     d   = S_left - S_right = (2 b1 + (w_R - w_L) b3) / (w_L + w_R)
    ///     N_FL = (S_F + D d) / 2        N_FR = (S_F - D d) / 2
    ///     N_RR = (S_R - (1 - D) d) / 2  N_RL = (S_R + (1 - D) d) / 2
    /// ```
    /// It is linear: the loads of a sum are the sums of the loads. D = 1/2 gives the minimum-norm solution.
    #[must_use]
    pub fn loads(&self, platform: &Platform<T>) -> [T; 4] {
        let half = T::constant(0.5);
        let (left, right) = (platform.half_track_left, platform.half_track_right);
        let wheelbase = platform.wheelbase();
        let front = (platform.to_rear * self.b3 - self.b2) / wheelbase;
        let rear = (platform.to_front * self.b3 + self.b2) / wheelbase;
        let difference = (self.b1 + self.b1 + (right - left) * self.b3) / platform.track();
        let in_front = platform.roll_moment_distribution * difference;
        let behind = (T::one() - platform.roll_moment_distribution) * difference;
        [
            (front + in_front) * half,
            (front - in_front) * half,
            (rear - behind) * half,
            (rear + behind) * half,
        ]
    }
}
