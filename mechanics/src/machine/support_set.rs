//! Sets of supports: the same machine on other wheels, outriggers or tracks.
//!
//! A machine stands on some of its supports at a time. [`Machine::standing_on`] gives the machine on any set of them:
//! the same bodies and joints, with contact points, support polygon, split rule and free joints of that set. What
//! follows from the loads is computed by the same equations for every set.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use super::contact::Contact;
use super::split::Split;
use super::support_id::SupportId;
use super::support_polygon::{Edge, SupportPolygon};
use super::support_spec::SupportKind;
use super::wheel::{MAX_WHEELS, Wheel};
use super::{Machine, TorqueJoint};
use crate::geometry::contact_plane::ContactPlane;

/// A set of supports on which a machine cannot be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SupportSetError {
    /// Too few or too many.
    #[error("expected 3 to {MAX_WHEELS} supports on the ground, found {0}")]
    Count(usize),
    /// They span no area.
    #[error("expected supports that span an area, found {0} in one line")]
    InLine(String),
    /// More joints without torque than the supports leave open.
    #[error("expected at most {most} free joints for {supports} supports, found {found}")]
    FreeJoints {
        /// Supports on the ground.
        supports: usize,
        /// Largest number of such joints that the supports can balance.
        most: usize,
        /// Joints that carry some of them.
        found: usize,
    },
}

impl Machine {
    /// The polygon around all supports, on the ground or not, for a machine whose supports come and go.
    pub(crate) fn outer_polygon(&self) -> Option<SupportPolygon> {
        (self.supports.vary())
            .then(|| polygon_of(&self.supports.all))
            .flatten()
    }

    /// Returns the place of a support in [`Machine::wheels`] and in every list by wheel; `None` while it is off the ground.
    #[must_use]
    pub fn place_of(&self, support: SupportId) -> Option<usize> {
        self.stands_on.iter().position(|&on| on == support)
    }

    /// A support as it is now, on the ground or not.
    #[must_use]
    pub(crate) fn support(&self, id: SupportId) -> &Wheel {
        let place = self.place_of(id);
        place.map_or_else(|| self.supports.support(id), |place| &self.wheels[place])
    }

    /// Returns the machine on these supports, in any order; reference loads are unknown.
    ///
    /// # Errors
    /// The machine cannot stand on them.
    pub fn standing_on(&self, on: &[SupportId]) -> Result<Self, SupportSetError> {
        let supports = Arc::clone(&self.supports);
        let on: Vec<SupportId> = supports.ids().filter(|id| on.contains(id)).collect();
        if !(3..=MAX_WHEELS).contains(&on.len()) {
            return Err(SupportSetError::Count(on.len()));
        }
        let mut wheels: Vec<Wheel> = on.iter().map(|&s| supports.support(s).clone()).collect();
        share_stiffness(&mut wheels);
        let polygon =
            polygon_of(&wheels).ok_or_else(|| SupportSetError::InLine(supports.names(&on)))?;
        let of_set = |joint: &TorqueJoint| TorqueJoint {
            supports_wheel: on.iter().map(|s| joint.supports_wheel[s.index()]).collect(),
            ..joint.clone()
        };
        // a joint with a raised wheel beyond it is not free: it rests against its stop
        let is_free = |joint: &&TorqueJoint| {
            let mut carried = supports.ids().filter(|s| joint.supports_wheel[s.index()]);
            let beyond = carried.clone().count();
            carried.all(|s| on.contains(&s)) && beyond < on.len()
        };
        let free_joints: Vec<TorqueJoint> = supports
            .free_joints
            .iter()
            .filter(is_free)
            .map(of_set)
            .collect();
        if free_joints.len() + 3 > on.len() {
            return Err(SupportSetError::FreeJoints {
                supports: on.len(),
                most: on.len() - 3,
                found: free_joints.len(),
            });
        }
        let contact = self.contact_on(&on, &wheels, &polygon, free_joints);
        let mut joints = self.joints.clone();
        for (joint, spins) in joints.iter_mut().zip(&supports.spins) {
            joint.spins_wheel = spins.and_then(|wheel| on.iter().position(|&s| s == wheel));
        }
        let mut reference = self.reference.clone();
        reference.static_load = vec![f64::NAN; on.len()];
        reference.optimal_load = on
            .iter()
            .map(|s| supports.optimal_load[s.index()])
            .collect();
        Ok(Self {
            wheels,
            polygon,
            contact,
            joints,
            reference,
            stands_on: on,
            ..self.clone()
        })
    }

    fn contact_on(
        &self,
        on: &[SupportId],
        wheels: &[Wheel],
        polygon: &SupportPolygon,
        free_joints: Vec<TorqueJoint>,
    ) -> Contact {
        let supports = &self.supports;
        let mut actuated_joints = supports.actuated_joints.clone();
        if self.contact.actuated_joints.is_empty() {
            // nobody has measured their forces
            actuated_joints.clear();
        }
        for joint in &mut actuated_joints {
            joint.stand_on(on);
        }
        let by_rule = |wheel: &Wheel| wheel.kind == SupportKind::Wheel;
        let rule = supports.roll_moment_distribution;
        let rule = rule.filter(|_| wheels.iter().all(by_rule) && free_joints.is_empty());
        let mut contact = Contact {
            split: rule
                .and_then(|share| Split::by_roll_moment(share, polygon, wheels.len()))
                .unwrap_or(Split::Springs),
            free_joints,
            actuated_joints,
            radii_differ: wheels.iter().any(|w| w.radius != wheels[0].radius),
            mean_stiffness: None,
            warp: None,
            ..self.contact.clone()
        };
        contact.set_warp(wheels);
        contact
    }

    /// A machine for the names and the order of results on several sets of supports: all supports, and the edges of
    /// all these sets by name. Loads cannot be computed with it: it would stand on all supports at once.
    #[must_use]
    pub fn for_names_of(&self, sets: &[Self]) -> Self {
        let mut edges: Vec<Edge> = Vec::new();
        for set in sets {
            for edge in set.polygon.edges() {
                if edges.iter().any(|known| known.name == edge.name) {
                    continue;
                }
                let place = |wheel: usize| set.stands_on[wheel].index();
                let mut carries = vec![false; self.supports.all.len()];
                for (wheel, &carried) in edge.carries.iter().enumerate() {
                    carries[place(wheel)] = carried;
                }
                edges.push(Edge {
                    name: edge.name.clone(),
                    from: place(edge.from),
                    to: place(edge.to),
                    carries,
                });
            }
        }
        let supports = &self.supports;
        let mut joints = self.joints.clone();
        for (joint, &spins) in joints.iter_mut().zip(&supports.spins) {
            joint.spins_wheel = spins.map(SupportId::index);
        }
        let mut reference = self.reference.clone();
        let of_sets = |load: fn(&Self) -> &Vec<f64>| -> Vec<f64> {
            // while a machine goes from its wheels to its outriggers it stands on both for a moment, and each carries half
            let of_fewest = |support: SupportId| {
                let loads = sets.iter().filter_map(|set| {
                    Some((set.stands_on.len(), load(set)[set.place_of(support)?]))
                });
                loads.min_by_key(|(supports, _)| *supports)
            };
            supports
                .ids()
                .map(|support| of_fewest(support).map_or(f64::NAN, |(_, load)| load))
                .collect()
        };
        reference.static_load = of_sets(|set| &set.reference.static_load);
        reference.optimal_load = of_sets(|set| &set.reference.optimal_load);
        let all: Vec<SupportId> = supports.ids().collect();
        let polygon = SupportPolygon { edges };
        let free_joints = supports.free_joints.clone();
        Self {
            contact: Contact {
                split: Split::Springs,
                warp: None,
                ..self.contact_on(&all, &supports.all, &polygon, free_joints)
            },
            wheels: supports.all.clone(),
            polygon,
            joints,
            reference,
            stands_on: all,
            ..self.clone()
        }
    }
}

/// Relative stiffness of some wheels: one where none is stated.
pub(super) fn share_stiffness(wheels: &mut [Wheel]) {
    if !Wheel::have_stiffness(wheels) {
        return;
    }
    let sum: f64 = wheels.iter().filter_map(|wheel| wheel.stiffness).sum();
    let mean = sum / wheels.len() as f64;
    for wheel in wheels {
        wheel.relative_stiffness = wheel.stiffness.unwrap_or(mean) / mean;
    }
}

/// The support polygon of some wheels with all joints at zero; `None` if they span no area.
pub(super) fn polygon_of(wheels: &[Wheel]) -> Option<SupportPolygon> {
    let centres: Vec<Vector3<f64>> = wheels.iter().map(|w| w.centre_at_zero).collect();
    let radii: Vec<f64> = wheels.iter().map(|w| w.radius).collect();
    let plane = ContactPlane::through(&centres, &radii, true);
    let points: Vec<Vector2<f64>> = centres
        .iter()
        .zip(wheels)
        .map(|(c, w)| (c - plane.normal * w.radius).xy())
        .collect();
    let names: Vec<&str> = wheels.iter().map(|w| w.name.as_str()).collect();
    SupportPolygon::build(&points, &names)
}
