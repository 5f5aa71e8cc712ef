//! Plans: how a motion of the rods may end.
//!
//! ```text
//!     S(16)  return   x = home + (d + c t) exp(-w t),   d = x - home,  c = v + w d
//!            stay     x' = v exp(-w t)
//! ```
//! A return ends where locked rods are, so that it is safe for ever. Started again from any of its own points with the same
//! w, it is the same motion: a return that is safe now leaves one that is safe at the next step.

use super::forecast::ByRod;
use crate::condensed::MAX_ACTUATORS;

/// Times at which a plan is examined, and from one to the next (s).
pub(super) const NODES: usize = 14;
pub(super) const NODE_S: f64 = 0.14;
/// w (1/s).
const RATES: [f64; 4] = [1.0, 1.7, 0.6, 2.8];

/// A way to end a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plan {
    /// Back to where control began, with this rate.
    Return(usize),
    /// To rest, with this rate.
    Stay(usize),
}

/// Position and velocity of the rods.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rods {
    /// (m)
    pub(super) x: ByRod,
    /// (m/s)
    pub(super) v: ByRod,
}

/// exp(-w t) by rate and node.
#[derive(Debug)]
pub(super) struct Plans {
    decay: [[f64; NODES]; RATES.len()],
}

impl Plan {
    /// All that return.
    pub(super) const RETURNS: [Self; RATES.len()] = [
        Self::Return(0),
        Self::Return(1),
        Self::Return(2),
        Self::Return(3),
    ];
    /// To rest.
    pub(super) const STOP: Self = Self::Stay(1);
    /// All.
    pub(super) const ALL: [Self; RATES.len() + 2] = [
        Self::Return(0),
        Self::Return(1),
        Self::Return(2),
        Self::Return(3),
        Self::STOP,
        Self::Stay(3),
    ];
}

impl Plans {
    pub(super) fn new() -> Self {
        Self {
            decay: RATES.map(|w| std::array::from_fn(|node| libm::exp(-w * NODE_S * node as f64))),
        }
    }

    /// The rods at a node of a plan that starts with these, and their accelerations (m/s^2).
    pub(super) fn at(&self, plan: Plan, node: usize, rods: &Rods, home: &ByRod) -> (Rods, ByRod) {
        let t = NODE_S * node as f64;
        let none = [0.0; MAX_ACTUATORS];
        let (mut x, mut v, mut a) = (none, none, none);
        for k in 0..MAX_ACTUATORS {
            match plan {
                Plan::Return(rate) => {
                    let (w, decay) = (RATES[rate], self.decay[rate][node]);
                    let d = rods.x[k] - home[k];
                    let c = rods.v[k] + w * d;
                    let left = d + c * t;
                    x[k] = home[k] + left * decay;
                    v[k] = (c - w * left) * decay;
                    a[k] = w * (w * left - 2.0 * c) * decay;
                }
                Plan::Stay(rate) => {
                    let (w, decay) = (RATES[rate], self.decay[rate][node]);
                    x[k] = rods.x[k] + rods.v[k] * (1.0 - decay) / w;
                    v[k] = rods.v[k] * decay;
                    a[k] = -w * v[k];
                }
            }
        }
        (Rods { x, v }, a)
    }
}
