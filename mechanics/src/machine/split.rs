//! The rule that splits the load where equilibrium leaves it open.

use super::support_polygon::SupportPolygon;

/// The rule for the load split that equilibrium leaves open.
#[derive(Debug, Clone, PartialEq)]
pub enum Split {
    /// Assumption 8, (54) of the first paper: the front axle carries the share D of the load difference between
    /// the right and the left side.
    RollMomentDistribution {
        /// D, 0 to 1.
        share: f64,
        /// Indices of the wheels front left, front right, rear left, rear right.
        wheels: [usize; 4],
    },
    /// The wheels are springs of their stiffness under a rigid frame.
    Springs,
}

impl Split {
    /// The rule by roll moment distribution; `None` unless four wheels are at four corners.
    pub(super) fn by_roll_moment(
        share: f64,
        polygon: &SupportPolygon,
        wheels: usize,
    ) -> Option<Self> {
        let edges = polygon.edges();
        let [front, _, rear, _] = edges else {
            return None;
        };
        (wheels == 4).then_some(Self::RollMomentDistribution {
            share,
            wheels: [front.to, front.from, rear.from, rear.to],
        })
    }
}
