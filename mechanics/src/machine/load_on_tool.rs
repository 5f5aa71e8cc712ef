//! A load or a force that the machine file does not state: where it acts, and the machine with it.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::{Inertia, LinkGroup, Machine, MassMoments, Mount, MountSource, Payload};

/// The place where a load on the tool is carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadOnTool {
    /// Index of the link at which it acts.
    pub tool: usize,
    /// Index of the link whose mass is part of it.
    pub link: usize,
    /// The body that carries it.
    pub body: usize,
    /// The place in the body's frame (m): the centre of mass of the tool, or its origin where it has no mass.
    pub place: Vector3<f64>,
}

impl Machine {
    /// Returns the place where a load on the tool is carried: by `arm.tool` of the machine file, else by the link with mass at
    /// the end of the arm. Of a tool without mass, such as a frame at the tip of a bucket, the mass is that of the heaviest link
    /// welded to it, else of the link with mass at the end of the arm. `None` without an arm.
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
        let tool = self.tool_link.or_else(last)?;
        let Inertia { mass, com, .. } = self.links[tool].inertia;
        let origin = self.links[tool].body_from_link.translation.vector;
        let body = self.links[tool].body;
        let mass_of = |link: &usize| self.links[*link].inertia.mass;
        let welded = (0..self.links.len()).filter(|&link| self.links[link].body == body);
        let welded = welded.filter(|link| mass_of(link) > 0.0);
        let heaviest = || welded.max_by(|a, b| mass_of(a).total_cmp(&mass_of(b)));
        let own = Some(tool).filter(|link| mass_of(link) > 0.0);
        Some(LoadOnTool {
            tool,
            link: own.or_else(heaviest).or_else(last).unwrap_or(tool),
            body,
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

    /// Returns this machine with `more` mass (kg), less where negative, where it carries a load on the tool. `None` without an
    /// arm, and where less than nothing would remain.
    #[must_use]
    pub fn with_more_on_tool(&self, more: f64) -> Option<Self> {
        let LoadOnTool { link, place, .. } = self.load_on_tool()?;
        let mut machine = self.clone();
        let inertia = &mut machine.links[link].inertia;
        if inertia.mass == 0.0 {
            inertia.com = place;
        }
        inertia.mass += more;
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

#[cfg(test)]
mod tests {
    use crate::machine::of_tests::rigid_with;

    /// A load acts at a frame at the tip of the tool; the mass that can be taken off is that of the link to which the frame is
    /// welded.
    #[test]
    fn a_tool_without_mass_has_that_of_what_it_is_welded_to() {
        let tip = "<link name='tip'/><joint name='tip_fixed' type='fixed'><parent link='tool'/><child link='tip'/>\
                   <origin xyz='0.5 0 0'/></joint></robot>";
        let machine = rigid_with(
            |file| file.replace("tool = \"tool\"", "tool = \"tip\""),
            |urdf| urdf.replace("</robot>", tip),
        );
        let load = machine.load_on_tool().unwrap();
        let links = machine.links();
        assert_eq!(
            [load.tool, load.link].map(|link| links[link].name.as_str()),
            ["tip", "tool"]
        );
        assert_eq!(
            load.place,
            links[load.tool].body_from_link.translation.vector
        );
        let lighter = machine.with_more_on_tool(-100.0).unwrap();
        let [before, after] = [&machine, &lighter].map(|of| of.links()[load.link].inertia);
        assert_eq!((after.mass, after.com), (before.mass - 100.0, before.com));
    }
}
