//! Overturning moments about the edges of the wheel rectangle: MHS-type (moment-height stability), TOM
//! (tip-over moment), ITOM (improved tip-over moment).

use super::{Demand, DemandContributions, Platform};
use crate::number::Real;

/// Terms that an overturning moment includes besides the arm, after the first paper's remarks on (44)-(46).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counted {
    /// Weight of the platform without wheels.
    pub chassis_weight: bool,
    /// Its inertial force and moment.
    pub chassis_inertia: bool,
    /// Weight of the wheels.
    pub wheel_weights: bool,
}

impl Counted {
    /// The arm alone: the left side of (45) set to zero, the paper's version of the MHS (Moosavian and Alipour).
    /// The full measure also scales by inertia and height.
    pub const MHS: Self = Self {
        chassis_weight: false,
        chassis_inertia: false,
        wheel_weights: false,
    };

    /// TOM (Guo): includes the weight of the chassis.
    pub const TOM: Self = Self {
        chassis_weight: true,
        ..Self::MHS
    };

    /// ITOM (Ding): includes the whole left side of (45), with massless wheels.
    pub const ITOM: Self = Self {
        chassis_inertia: true,
        ..Self::TOM
    };
}

/// Moments about the edges of the wheel rectangle, counter-clockwise seen from above (N m): negative is
/// stable, zero where the wheels off the edge carry no load, positive overturns about the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeMoments<T> {
    /// About the line from FR to FL.
    pub front: T,
    /// About the line from FL to RL.
    pub left: T,
    /// About the line from RL to RR.
    pub rear: T,
    /// About the line from RR to FR.
    pub right: T,
}

impl<T: Real> EdgeMoments<T> {
    /// The largest moment, closest to overturning (N m); NaN if any is unknown.
    #[must_use]
    pub fn largest(&self) -> T {
        // `max` ignores NaN, a sum does not.
        let sum = self.front + self.left + self.rear + self.right;
        let largest = self.front.max(self.left).max(self.rear).max(self.right);
        largest + sum * T::zero()
    }
}

impl<T: Real> DemandContributions<T> {
    /// Overturning moments of the arm and of the `counted` terms.
    ///
    /// ```text
    ///     M_front = -(l2 b3 + b2)    M_rear  = -(l1 b3 - b2)
    ///     M_left  = -(w_L b3 - b1)   M_right = -(w_R b3 + b1)
    /// ```
    #[must_use]
    pub fn edge_moments(&self, platform: &Platform<T>, counted: Counted) -> EdgeMoments<T> {
        let b = self.counted(counted);
        EdgeMoments {
            front: -(platform.to_front * b.b3 + b.b2),
            left: -(platform.half_track_left * b.b3 - b.b1),
            rear: -(platform.to_rear * b.b3 - b.b2),
            right: -(platform.half_track_right * b.b3 + b.b1),
        }
    }

    fn counted(&self, counted: Counted) -> Demand<T> {
        let mut b = Demand::sum(&self.arm);
        if counted.chassis_weight {
            b = b.plus(&self.chassis_weight);
        }
        if counted.chassis_inertia {
            b = b.plus(&Demand::sum(&self.acceleration));
            b = b.plus(&Demand::sum(&self.yaw));
        }
        if counted.wheel_weights {
            b = b.plus(&self.wheel_weights);
        }
        b
    }
}
