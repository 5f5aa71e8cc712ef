//! Validation: a machine file, a URDF and facts about a log give a [`Machine`], or the first error found in
//! them.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Isometry3;

use super::inertias::FoundInertias;
use crate::machine::body::link_parts;
use crate::machine::link_box::boxes_by_link;
use crate::machine::outline::shapes_by_link;
use crate::machine::table::Number;
use crate::machine::tree::{Tree, TreeBody, TreeJoint};
use crate::machine::urdf::Urdf;
use crate::machine::{
    Body, ImpossibleInertia, JointCoupling, JointKind, JointMotionSpec, Link, LinkGroup, Machine,
    MachineError, MachineSpec, MassMoments, MeasuredJoint, Mount, MountSource, Mounting, Note,
    StaticTransform, SupportKind, Wheel,
};

/// Facts about a log against which a machine is checked.
#[derive(Debug, Clone, Copy, Default)]
pub struct LogFacts<'a> {
    /// Names in its joint states; `None` without a log: then every joint counts as measured unless a linkage
    /// moves it.
    pub joint_names: Option<&'a [String]>,
    /// Whether the log lacks an IMU: a measurement at the base origin is then computed in its place.
    pub lacks_imu: bool,
    /// Frame of its IMU messages.
    pub imu_frame: Option<&'a str>,
    /// Frame of its messages with the tool's wrench.
    pub tool_wrench_frame: Option<&'a str>,
    /// Its static transforms (`/tf_static`).
    pub static_transforms: &'a [StaticTransform],
}

impl MachineSpec {
    /// Checks the machine against its URDF (`urdf_name` is for messages) and a log.
    ///
    /// # Errors
    /// [`MachineError`]: the first error that makes the machine impossible or ambiguous.
    pub fn check(
        &self,
        urdf_text: &str,
        urdf_name: &str,
        log: LogFacts<'_>,
    ) -> Result<Machine, MachineError> {
        let mut urdf = Urdf::parse(urdf_text, urdf_name)?;
        let tree = Tree::build(&urdf)?;
        let checker = |tree| Checker {
            spec: self,
            tree,
            urdf_name,
            log,
        };
        let plausible = checker(&tree).plausible(&urdf, urdf_text)?;
        if plausible.inertias.replaced.is_empty() {
            return checker(&tree).machine(plausible);
        }
        urdf.replace(&plausible.inertias.replaced);
        checker(&Tree::build(&urdf)?).machine(plausible)
    }
}

/// Results of the checks before the inertias of the tree are final.
struct Plausible {
    wheels: Vec<Wheel>,
    inertias: FoundInertias,
}

pub(super) struct Checker<'a> {
    pub(super) spec: &'a MachineSpec,
    pub(super) tree: &'a Tree,
    pub(super) urdf_name: &'a str,
    pub(super) log: LogFacts<'a>,
}

impl Checker<'_> {
    fn plausible(&self, urdf: &Urdf, urdf_text: &str) -> Result<Plausible, MachineError> {
        self.check_numbers()?;
        self.check_signals()?;
        self.check_link_sigmas()?;
        let wheels = self.wheels()?;
        self.check_wheel_plausibility(&wheels, &shapes_by_link(urdf_text))?;
        let [mass, apart] = self.check_mass_plausibility(&wheels)?;
        let boxes = boxes_by_link(urdf_text);
        let urdf = (urdf, self.urdf_name);
        let inertias = FoundInertias::of(urdf, self.spec, &boxes, &wheels, mass, apart)?;
        Ok(Plausible { wheels, inertias })
    }

    fn machine(&self, plausible: Plausible) -> Result<Machine, MachineError> {
        let spec = self.spec;
        let Plausible { wheels, inertias } = plausible;
        let polygon = self.polygon(&wheels)?;
        let driving = self.driving(&wheels)?;
        let (measured, of_sparse) = (&driving.joints, &spec.quasi_static);
        self.check_ranges("quasi_static", &of_sparse.numbers())?;
        self.check_joints(
            "quasi_static.joints",
            &of_sparse.joints,
            measured,
            JointMotionSpec::numbers,
        )?;
        self.check_prediction(&driving.joints)?;
        let contact = self.contact(&wheels, &polygon, &driving.linkages)?;
        let reference = self.reference(&driving)?;
        let supports =
            self.supports(&wheels, &contact, &driving.joints, &reference.optimal_load)?;
        let (imu, mut notes) = self.imu(&wheels)?;
        notes.extend(inertias.notes.into_iter().map(Note::from));
        let arm_root = spec
            .arm
            .as_ref()
            .map(|arm| self.link("arm.root", &arm.root))
            .transpose()?;
        let tool_link = (spec.arm.as_ref())
            .and_then(|arm| arm.tool.as_ref())
            .map(|tool| self.link("arm.tool", tool))
            .transpose()?;
        let tool = match tool_link {
            None => None,
            Some(link) => {
                let (mount, note) = self.wrench(link)?;
                notes.extend(note);
                mount
            }
        };
        let links: Vec<Link> = (0..self.tree.links.len())
            .map(|i| Link {
                inertia_sigma: sigma_of(&inertias.replaced, &self.tree.links[i].name),
                ..self.machine_link(i, arm_root, &wheels)
            })
            .collect();
        let mut machine = Machine {
            name: spec.name.clone(),
            gravity: spec.gravity,
            base_link: self.tree.base_link.clone(),
            bodies: machine_bodies(self.tree, &driving.couplings, &links),
            arm_mounting: arm_root.map(|root| self.mounting(root)),
            arm_root: arm_root
                .map(|root| self.mount(root, Isometry3::identity(), MountSource::MachineFile)),
            reference,
            linkages: driving.linkages,
            joints: driving.joints,
            stands_on: supports.ids().collect(),
            wheels,
            supports: Arc::new(supports),
            polygon,
            contact,
            imu,
            notes,
            replaced_inertias: inertias.replaced,
            tool,
            tool_link,
            payloads: self.payloads(&links)?,
            links,
            limits: spec.limits.clone(),
            signals: spec.signals.clone(),
            estimator: spec.estimator,
            uncertainty: spec.uncertainty,
            plausibility: spec.plausibility,
            quasi_static: spec.quasi_static.clone(),
            is_quasi_static: false,
            prediction: spec.prediction.clone(),
            suspension: self.suspension()?,
            load_sensors: Vec::new(),
            joint_commands: Vec::new(),
            payload_signals: Vec::new(),
            arm_forces: Vec::new(),
            force_signals: Vec::new(),
            identified: None,
            corrections: None,
        };
        let weight = machine.mass() * machine.gravity;
        machine.joint_commands = self.joint_commands(&machine.joints);
        self.add_payload_signals(&mut machine)?;
        self.add_arm_forces(&mut machine)?;
        machine.load_sensors = self.load_sensors(&machine.supports, weight)?;
        self.check_against_machine(&machine)?;
        self.add_doubts(&mut machine)?;
        if let Some(supports) = Arc::get_mut(&mut machine.supports) {
            supports.all.clone_from(&machine.wheels);
        }
        spec.check_weighed(&machine)?;
        // parameters belong to supports, whichever of them are on the ground
        self.at_rest(spec.with_identified(machine)?)
    }

    /// The machine on the supports that are there where none comes and goes; on all of them where it cannot stand
    /// on these.
    fn at_rest(&self, machine: Machine) -> Result<Machine, MachineError> {
        let supports = Arc::clone(&machine.supports);
        let at_rest = supports.at_rest();
        if at_rest.len() == supports.all.len() {
            return Ok(machine);
        }
        match machine.standing_on(&at_rest) {
            Ok(machine) => Ok(machine),
            Err(_) if supports.vary() => Ok(machine),
            Err(error) => Err(self.value_error(
                "supports",
                "wheels and supports on which the machine can stand",
                error,
            )),
        }
    }

    pub(super) fn value_error(
        &self,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> MachineError {
        MachineError::value(&self.spec.file, place, expected, found)
    }

    /// The machine file or the URDF states something that no machine has.
    pub(super) fn implausible(
        &self,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> MachineError {
        MachineError::Implausible {
            file: self.spec.file.clone(),
            place: place.into(),
            expected: expected.into(),
            found: found.into(),
            remedy: remedy.into(),
        }
    }

    /// Returns the error of an implausible value in the URDF.
    pub(super) fn implausible_in_urdf(
        &self,
        place: &str,
        expected: &str,
        found: &str,
        remedy: &str,
    ) -> MachineError {
        MachineError::Implausible {
            file: self.urdf_name.into(),
            place: place.into(),
            expected: expected.into(),
            found: found.into(),
            remedy: remedy.into(),
        }
    }

    fn unknown<'n>(
        &self,
        key: &str,
        name: &str,
        kind: &'static str,
        mut existing: impl Iterator<Item = &'n str>,
    ) -> MachineError {
        let folded = name.to_lowercase();
        let near = existing
            .find(|e| e.to_lowercase().contains(&folded) || folded.contains(&e.to_lowercase()));
        MachineError::UnknownName {
            file: self.spec.file.clone(),
            key: key.into(),
            name: name.into(),
            kind,
            urdf: self.urdf_name.into(),
            suggestion: near.map_or(String::new(), |n| format!("; did you mean \"{n}\"?")),
        }
    }

    pub(super) fn link(&self, key: &str, name: &str) -> Result<usize, MachineError> {
        let names = self.tree.links.iter().map(|l| l.name.as_str());
        self.tree
            .link(name)
            .ok_or_else(|| self.unknown(key, name, "link", names))
    }

    pub(super) fn joint(&self, key: &str, name: &str) -> Result<usize, MachineError> {
        let names = self
            .tree
            .bodies
            .iter()
            .filter_map(|b| b.joint.as_ref())
            .map(|j| j.name.as_str());
        self.tree
            .body_of_joint(name)
            .ok_or_else(|| self.unknown(key, name, "joint", names))
    }

    pub(super) fn mount(
        &self,
        link: usize,
        link_from_mount: Isometry3<f64>,
        source: MountSource,
    ) -> Mount {
        let link = &self.tree.links[link];
        Mount {
            body: link.body,
            body_from_mount: link.body_from_link * link_from_mount,
            source,
        }
    }

    fn machine_link(&self, index: usize, arm_root: Option<usize>, wheels: &[Wheel]) -> Link {
        let link = &self.tree.links[index];
        let in_arm = arm_root.is_some_and(|root| self.tree.link_is_below(index, root));
        let is_wheel = self.is_part_of_wheel(index, wheels);
        Link {
            name: link.name.clone(),
            body: link.body,
            body_from_link: link.body_from_link,
            inertia: link.inertia,
            moments: MassMoments::from(&link.inertia),
            group: match (in_arm, is_wheel) {
                (true, _) => LinkGroup::Arm,
                (false, true) => LinkGroup::Wheel,
                (false, false) => LinkGroup::Chassis,
            },
            sigma: self.link_sigma(index),
            inertia_sigma: None,
        }
    }

    /// Whether a link is a wheel, is in its distal subtree, or rotates with it.
    fn is_part_of_wheel(&self, index: usize, wheels: &[Wheel]) -> bool {
        let named = self
            .spec
            .wheels
            .values()
            .filter(|wheel| wheel.origin.kind == SupportKind::Wheel)
            .filter_map(|wheel| self.tree.link(&wheel.link));
        let below = |wheel: usize| self.tree.link_is_below(index, wheel);
        let body = self.tree.links[index].body;
        named.into_iter().any(below)
            || (0..wheels.len())
                .any(|w| wheels[w].body == body && self.wheel_spun_by(body, wheels) == Some(w))
    }

    /// The mount of a link.
    pub(super) fn mounting(&self, link: usize) -> Mounting {
        let carrier = self.tree.links[link].parent_link.unwrap_or(link);
        let carrier = &self.tree.links[carrier];
        Mounting {
            carrier: carrier.body,
            carrier_from_axes: *carrier
                .body_from_link
                .rotation
                .to_rotation_matrix()
                .matrix(),
        }
    }

    /// Checks that the numbers of a table are in their ranges.
    pub(super) fn check_ranges(&self, table: &str, numbers: &[Number]) -> Result<(), MachineError> {
        match numbers.iter().find(|number| !number.is_in_range()) {
            None => Ok(()),
            Some(Number { key, value, range }) => {
                Err(self.value_error(format!("{table}.{key}"), range.expected, value))
            }
        }
    }

    /// Checks that the joints of a table are measured, and that their numbers are in their ranges.
    pub(super) fn check_joints<T>(
        &self,
        table: &str,
        stated: &BTreeMap<String, T>,
        measured: &[MeasuredJoint],
        numbers: fn(&T) -> Vec<Number>,
    ) -> Result<(), MachineError> {
        for (name, joint) in stated {
            self.check_ranges(&format!("{table}.{name}"), &numbers(joint))?;
            if !measured.iter().any(|joint| joint.name == *name) {
                let names: Vec<&str> = measured.iter().map(|joint| joint.name.as_str()).collect();
                let expected = format!("a measured joint: {}", names.join(", "));
                return Err(self.value_error(table, expected, format!("\"{name}\"")));
            }
        }
        Ok(())
    }

    /// Checks the ranges of numbers that do not depend on the URDF.
    fn check_numbers(&self) -> Result<(), MachineError> {
        let spec = self.spec;
        let limits = &spec.limits;
        if !(spec.gravity.is_finite() && spec.gravity > 0.0) {
            return Err(self.value_error("gravity", "a positive number", spec.gravity));
        }
        self.check_ranges("limits", &limits.numbers())?;
        self.check_ranges("estimator", &spec.estimator.numbers())?;
        self.check_ranges("uncertainty", &spec.uncertainty.numbers())?;
        self.check_ranges("plausibility", &spec.plausibility.numbers())?;
        for (topic, offset) in &spec.clock.offset {
            if !offset.is_finite() {
                let place = format!("clock.offset.\"{topic}\"");
                return Err(self.value_error(place, "a number of seconds", *offset));
            }
        }
        if limits.min_load.is_some() && limits.min_load_share.is_some() {
            return Err(self.value_error("limits", "min_load or min_load_share", "both"));
        }
        for name in limits.optimal_load.iter().flat_map(|loads| loads.keys()) {
            if !spec.wheels.contains_key(name) {
                return Err(self.value_error(
                    "limits.optimal_load",
                    "names of [wheels]",
                    format!("\"{name}\""),
                ));
            }
        }
        Ok(())
    }
}

/// Standard deviation of the inertia of a link where it was replaced (kg m^2).
fn sigma_of(replaced: &[ImpossibleInertia], link: &str) -> Option<f64> {
    let of_link = replaced.iter().find(|inertia| inertia.link == link);
    of_link.map(ImpossibleInertia::sigma)
}

fn machine_bodies(tree: &Tree, couplings: &[Option<JointCoupling>], links: &[Link]) -> Vec<Body> {
    tree.bodies
        .iter()
        .zip(couplings)
        .enumerate()
        .map(|(i, (tree_body, coupling))| Body {
            parts: link_parts(links, i),
            ..body(tree_body, coupling.unwrap_or(JointCoupling::Root))
        })
        .collect()
}

fn body(body: &TreeBody, coupling: JointCoupling) -> Body {
    Body {
        name: body.link.clone(),
        parent: body.parent,
        kind: body
            .joint
            .as_ref()
            .map_or(JointKind::Revolute, |j: &TreeJoint| j.kind),
        coupling,
        parent_from_joint: *body
            .parent_from_joint
            .rotation
            .to_rotation_matrix()
            .matrix(),
        joint_in_parent: body.parent_from_joint.translation.vector,
        inertia: body.inertia,
        parts: Vec::new(),
    }
}
