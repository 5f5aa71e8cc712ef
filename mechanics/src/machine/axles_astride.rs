//! Axles that swing about a pivot, seen from an edge of the support polygon.

use super::actuated_joint::TorqueJoint;
use super::checked::Machine;
use super::support_polygon::Edge;

impl Machine {
    /// The free joints that bear wheels on an edge and off it: axles that swing about a pivot, astride the edge. One that bears the
    /// edge as a whole tips with it.
    pub fn axles_astride(&self, edge: &Edge) -> impl Iterator<Item = &TorqueJoint> {
        let joints = self.contact().free_joints.iter();
        joints.filter(|joint| {
            let own = &joint.supports_wheel;
            let bears = |is_on: bool| {
                let mut wheels = own.iter().zip(&edge.carries);
                wheels.any(|(is_own, on)| *is_own && *on == is_on)
            };
            !(own[edge.from] && own[edge.to]) && bears(true) && bears(false)
        })
    }

    /// Whether each wheel stays on the ground while the machine tips over an edge: those on it, and those of axles astride it.
    #[must_use]
    pub fn stays_on_ground(&self, edge: &Edge) -> Vec<bool> {
        let mut stays = edge.carries.clone();
        for axle in self.axles_astride(edge) {
            let wheels = stays.iter_mut().zip(&axle.supports_wheel);
            wheels.for_each(|(stays, is_own)| *stays |= is_own);
        }
        stays
    }

    /// Whether a wheel leaves the ground when the machine tips about an edge, both by their names in lower case.
    #[must_use]
    pub fn is_off(&self, edge: &str, wheel: &str) -> bool {
        let both = self.edge_named(edge).zip(self.wheel_named(wheel));
        both.is_some_and(|(edge, wheel)| {
            !self.stays_on_ground(&self.polygon().edges()[edge])[wheel]
        })
    }
}
