//! Check that the links and joints of a URDF form a tree; everything that prevents that is reported at once.

use std::collections::HashMap;

use super::error::MachineError;
use super::urdf::{JOINT_TYPES, Urdf, UrdfJoint, UrdfJointKind, UrdfLink};

/// The links and joints of a URDF by name, and their faults.
pub(super) struct Structure<'a> {
    urdf: &'a Urdf,
    pub(super) link_index: HashMap<&'a str, usize>,
    /// The joints that each link carries.
    pub(super) children: Vec<Vec<&'a UrdfJoint>>,
    /// The joint that carries each link.
    parents: Vec<Option<&'a UrdfJoint>>,
    joints: HashMap<&'a str, &'a UrdfJoint>,
    pub(super) faults: Vec<MachineError>,
}

impl<'a> Structure<'a> {
    pub(super) fn of(urdf: &'a Urdf) -> Self {
        let mut structure = Self {
            urdf,
            link_index: HashMap::new(),
            children: vec![Vec::new(); urdf.links.len()],
            parents: vec![None; urdf.links.len()],
            joints: HashMap::new(),
            faults: Vec::new(),
        };
        for (index, link) in urdf.links.iter().enumerate() {
            let name = link.name.as_str();
            if let Some(first) = structure.link_index.insert(name, index) {
                let found = format!("another one in line {}", urdf.links[first].line);
                structure.note(of_link(link), "one link with this name", found);
            }
        }
        for joint in &urdf.joints {
            structure.add(joint);
        }
        structure
    }

    fn note(&mut self, place: String, expected: &str, found: impl Into<String>) {
        let fault = MachineError::value(&self.urdf.file, place, expected, found.into());
        self.faults.push(fault);
    }

    fn add(&mut self, joint: &'a UrdfJoint) {
        let place = || of_joint(joint);
        if let Some(first) = self.joints.insert(&joint.name, joint) {
            let found = format!("another one in line {}", first.line);
            self.note(place(), "one joint with this name", found);
        }
        let ends = [&joint.parent, &joint.child];
        let [parent, child] = ends.map(|name| self.link_index.get(name.as_str()).copied());
        for (name, link) in ends.into_iter().zip([parent, child]) {
            if link.is_none() {
                self.note(place(), "existing links", format!("no link \"{name}\""));
            }
        }
        let (Some(parent), Some(child)) = (parent, child) else {
            return;
        };
        match self.parents[child] {
            Some(other) => {
                let found = format!(
                    "joint \"{}\" in line {} also carries \"{}\"",
                    other.name, other.line, joint.child
                );
                self.note(place(), "one parent joint per link", found);
            }
            None => {
                self.parents[child] = Some(joint);
                self.children[parent].push(joint);
            }
        }
    }

    /// The one root. Notes several ones, links that hang on none, and worlds that a machine cannot stand in.
    pub(super) fn root(&mut self) -> Option<usize> {
        // links without a readable joint would be roots in appearance only
        if !(self.faults.is_empty() && self.urdf.faults.is_empty()) {
            return None;
        }
        let links = &self.urdf.links;
        let roots: Vec<usize> = (0..links.len())
            .filter(|&link| self.parents[link].is_none())
            .collect();
        let &[root] = roots.as_slice() else {
            let of_root = |&link: &usize| format!("\"{}\"", links[link].name);
            let names: Vec<String> = roots.iter().map(of_root).collect();
            let lines = roots.iter().map(|&link| links[link].line.to_string());
            let lines = lines.collect::<Vec<_>>().join(", ");
            let found = match (links.is_empty(), names.is_empty()) {
                (true, _) => "no <link> at all".into(),
                (_, true) => "a cycle of joints through all links".into(),
                _ => format!(
                    "{}: {} in lines {lines}; connect them with joints (type fixed for a rigid connection)",
                    names.len(),
                    names.join(", ")
                ),
            };
            self.note(
                "links".into(),
                "one root link, without a parent joint",
                found,
            );
            return None;
        };
        self.note_cycles(root);
        self.note_worlds(root);
        Some(root)
    }

    fn note_cycles(&mut self, root: usize) {
        let mut is_reached = vec![false; self.urdf.links.len()];
        let mut pending = vec![root];
        while let Some(link) = pending.pop() {
            is_reached[link] = true;
            let children = self.children[link].iter();
            pending.extend(children.map(|joint| self.link_index[joint.child.as_str()]));
        }
        for (link, _) in is_reached
            .iter()
            .enumerate()
            .filter(|(_, reached)| !**reached)
        {
            let place = of_link(&self.urdf.links[link]);
            self.note(place, "a chain of joints to the root", "a cycle");
        }
    }

    /// A floating or planar joint stands between a massless world and the machine.
    fn note_worlds(&mut self, root: usize) {
        let joints = self.urdf.joints.iter();
        let free: Vec<&UrdfJoint> = joints.filter(|j| j.kind == UrdfJointKind::Free).collect();
        for joint in &free {
            let mut link = self.link_index[joint.parent.as_str()];
            let mut is_world = free.len() == 1;
            for _ in 0..=self.urdf.links.len() {
                is_world &= self.urdf.links[link].inertia.is_none();
                let Some(above) = self.parents[link].filter(|_| link != root) else {
                    break;
                };
                is_world &= above.kind == UrdfJointKind::Fixed;
                link = self.link_index[above.parent.as_str()];
            }
            if !is_world {
                let found = format!(
                    "a floating or planar joint from \"{}\" to \"{}\"",
                    joint.parent, joint.child
                );
                self.note(of_joint(joint), JOINT_TYPES, found);
            }
        }
    }

    /// The positions of joints that mimic a joint that cannot move: their offset. Notes rules that lead nowhere.
    pub(super) fn resting(&mut self) -> HashMap<&'a str, f64> {
        let mut resting = HashMap::new();
        for joint in &self.urdf.joints {
            let Some(rule) = &joint.mimic else { continue };
            let (mut followed, mut multiplier, mut offset) =
                (rule.joint.as_str(), rule.multiplier, rule.offset);
            let mut ends = None;
            for _ in 0..=self.urdf.joints.len() {
                let Some(&next) = self.joints.get(followed) else {
                    ends = Some(format!("no joint \"{followed}\""));
                    break;
                };
                let Some(rule) = &next.mimic else {
                    let moves = matches!(
                        next.kind,
                        UrdfJointKind::Revolute | UrdfJointKind::Prismatic
                    );
                    if !moves {
                        resting.insert(joint.name.as_str(), offset);
                    }
                    ends = Some(String::new());
                    break;
                };
                offset += multiplier * rule.offset;
                multiplier *= rule.multiplier;
                followed = &rule.joint;
            }
            let found = ends.unwrap_or_else(|| "rules that follow each other in a circle".into());
            if !found.is_empty() {
                let place = format!("{}, <mimic>", of_joint(joint));
                self.note(place, "a rule that leads to an existing joint", found);
            }
        }
        resting
    }
}

fn of_link(link: &UrdfLink) -> String {
    format!("line {}, link \"{}\"", link.line, link.name)
}

fn of_joint(joint: &UrdfJoint) -> String {
    format!("line {}, joint \"{}\"", joint.line, joint.name)
}
