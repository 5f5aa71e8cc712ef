//! A load or a force that the machine file does not state: where it acts, and the machine with it.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::{Inertia, LinkGroup, Machine, MassMoments, Mount, MountSource, Payload};

/// Where a load on the tool is carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadOnTool {
    /// Index of the link.
    pub link: usize,
    /// The body that the link belongs to.
    pub body: usize,
    /// Centre of mass of the link, in the body's frame (m).
    pub place: Vector3<f64>,
}

impl Machine {
    /// Where a load on the tool is carried: by `arm.tool` of the machine file, else by the link with mass at the end of the
    /// arm. `None` without an arm.
    #[must_use]
    pub fn load_on_tool(&self) -> Option<LoadOnTool> {
        let depth = |link: &usize| {
            let mut body = self.links[*link].body;
            let mut depth = 0;
            while body > 0 {
                body = self.bodies[body].parent;
                depth += 1;
            }
            depth
        };
        let is_arm = |link: &usize| {
            let link = &self.links[*link];
            link.group == LinkGroup::Arm && link.inertia.mass > 0.0
        };
        let last = || (0..self.links.len()).filter(is_arm).max_by_key(depth);
        let link = self.tool_link.or_else(last)?;
        let Inertia { mass, com, .. } = self.links[link].inertia;
        let origin = self.links[link].body_from_link.translation.vector;
        Some(LoadOnTool {
            link,
            body: self.links[link].body,
            place: if mass > 0.0 { com } else { origin },
        })
    }

    /// This machine with one payload more: a point mass (kg) at a place of a body (m), attached all the time. A state of
    /// this machine needs one payload share more.
    #[must_use]
    pub fn with_load(&self, body: usize, place: Vector3<f64>, mass: f64) -> Self {
        let mut machine = self.clone();
        let inertia = Inertia {
            mass,
            com: place,
            about_com: Matrix3::zeros(),
        };
        machine.payloads.push(Payload {
            body,
            group: LinkGroup::Arm,
            inertia,
            moments: MassMoments::from(&inertia),
            mass_sigma: None,
            is_estimated: false,
            is_by_row: false,
            signal: None,
            lift: None,
            window_s: [f64::NEG_INFINITY, f64::INFINITY],
        });
        machine
    }

    /// This machine with so much more mass (kg), less where negative, where it carries a load on the tool. `None` without an
    /// arm, and where less than nothing would remain.
    #[must_use]
    pub fn with_more_on_tool(&self, more: f64) -> Option<Self> {
        let LoadOnTool { link, place, .. } = self.load_on_tool()?;
        let mut machine = self.clone();
        let inertia = &mut machine.links[link].inertia;
        (inertia.mass, inertia.com) = (inertia.mass + more, place);
        (inertia.mass >= 0.0).then(|| {
            machine.gather();
            machine
        })
    }

    /// This machine with the frame of the base as the frame of the tool wrench, so that a state can hold any wrench on the
    /// machine in base axes.
    #[must_use]
    pub fn with_wrench_on_base(&self) -> Self {
        let mut machine = self.clone();
        machine.tool = Some(Mount {
            body: 0,
            body_from_mount: Isometry3::identity(),
            source: MountSource::Base,
        });
        machine
    }
}
