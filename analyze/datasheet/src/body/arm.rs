//! The arm: its segments, telescopes and tool, and their masses.

use super::build::{Build, DARK, YELLOW};
use super::machine::{Joint, JointKind, Role, Solid};
use crate::error::SheetError;
use crate::sheet::{Segment, SegmentKind};

/// Positive angles lift.
const LIFT: [f64; 3] = [0.0, -1.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
/// Centre of mass of a segment along its length: arms taper.
const COM_ALONG: f64 = 0.45;
/// Share of a telescopic segment's mass in its outer, fixed part.
const FIXED_PART: f64 = 0.45;
/// A segment is this much lighter than the one before it, for its length.
const TAPER: f64 = 0.75;
/// Share of an arm's mass in a tool without a mass of its own.
const TOOL_SHARE: f64 = 0.15;

/// Standard deviation of a centre of mass of the arm, as a share of the size of its part.
const PLACE_SIGMA: f64 = 0.08;
/// Standard deviation of the place of a tool that hangs, in every direction (m).
const SWING: f64 = 0.15;

/// Standard deviation of a mass of the arm, as a share.
fn mass_sigma(is_stated: bool) -> f64 {
    if is_stated { 0.04 } else { 1.0 / 3.0 }
}

/// The tip of the arm.
pub(super) struct Tip {
    pub(super) link: usize,
    /// The point in that link (m).
    pub(super) point: [f64; 3],
}

/// Masses of segments and tool (kg).
struct Masses {
    segments: Vec<f64>,
    tool: f64,
}

impl Build<'_> {
    /// Adds the arm to the link that carries it.
    pub(super) fn arm(&mut self, parent: usize) -> Result<Tip, SheetError> {
        let arm = &self.sheet.arm;
        let axis = self.machine.slew_x.unwrap_or(self.size.front);
        let start = [axis + arm.ahead.si, 0.0, arm.height.si];
        let origin = self.origins[parent];
        let mut tip = Tip {
            link: parent,
            point: [
                start[0] - origin[0],
                start[1] - origin[1],
                start[2] - origin[2],
            ],
        };
        let lengths = self.lengths();
        let masses = self.masses(&lengths)?;
        for (index, segment) in arm.segments.iter().enumerate() {
            let length = lengths[index];
            let first = self.machine.links.len();
            tip = self.segment(segment, length, masses.segments[index], &tip)?;
            self.known_within(first, mass_sigma(segment.mass.is_some()), PLACE_SIGMA);
            if index == 0 && self.machine.arm_root.is_empty() {
                self.machine.arm_root = format!("{}_link", segment.name);
            }
        }
        let first = self.machine.links.len();
        let end = self.tool(&tip, masses.tool)?;
        let is_stated = arm.tool.as_ref().is_some_and(|tool| tool.mass.is_some());
        self.known_within(first, mass_sigma(is_stated), PLACE_SIGMA);
        if self.prior.hangs && arm.tool.is_some() {
            self.machine.links[end.link].com_sigma = [SWING; 3];
        }
        Ok(end)
    }

    /// Lengths of the segments; one that is left out follows from the reach.
    fn lengths(&mut self) -> Vec<f64> {
        let arm = &self.sheet.arm;
        let stated = |segment: &Segment| segment.length.map(|l| l.si);
        let is_flat = |segment: &&Segment| segment.kind != SegmentKind::Mast;
        let out = |segment: &Segment| {
            stated(segment).unwrap_or(0.0) + segment.extension.map_or(0.0, |e| e.si)
        };
        let others: f64 = arm.segments.iter().filter(is_flat).map(out).sum();
        let tool = match self.prior.hangs {
            true => 0.0,
            false => arm
                .tool
                .as_ref()
                .and_then(|tool| tool.length)
                .map_or(0.0, |l| l.si),
        };
        let left = arm.reach.map_or(0.0, |r| r.si) - arm.ahead.si - others - tool;
        let missing = arm.segments.iter().find(|s| s.length.is_none());
        if let Some(segment) = missing {
            let name = segment.name.clone();
            self.assumed.add(
                format!("length of {name} {left:.3} m"),
                "the sheet does not say it; it is what the reach leaves",
            );
        }
        arm.segments
            .iter()
            .map(|s| stated(s).unwrap_or(left.max(0.0)))
            .collect()
    }

    /// Returns the masses of the segments: as stated, or shares of the remaining mass of the arm.
    fn masses(&mut self, lengths: &[f64]) -> Result<Masses, SheetError> {
        let arm = &self.sheet.arm;
        let stated: Vec<Option<f64>> = arm.segments.iter().map(|s| s.mass.map(|m| m.si)).collect();
        let tool = arm.tool.as_ref().map(|tool| tool.mass.map(|m| m.si));
        let known: f64 = stated.iter().flatten().sum::<f64>() + tool.flatten().unwrap_or(0.0);
        let is_open = stated.iter().any(Option::is_none) || tool == Some(None);
        if !is_open {
            if let Some(total) = arm.mass.map(|m| m.si)
                && (total - known).abs() > 0.02 * total
            {
                let expected = format!("{known} kg, the sum of its segments and the tool");
                return Err(self
                    .sheet
                    .wrong("arm.mass", expected, format!("{total} kg"), ""));
            }
            return Ok(Masses {
                segments: stated.into_iter().flatten().collect(),
                tool: tool.flatten().unwrap_or(0.0),
            });
        }
        let share = self.prior.arm;
        let kind = self.sheet.template;
        let prior = (share * self.sheet.mass.si).max(1.2 * known);
        let total = self.assumed.or(
            arm.mass.map(|m| m.si),
            prior,
            |v| format!("mass of the arm with its tool {v:.0} kg"),
            &format!(
                "arms of a {kind} have some {:.0} % of the operating mass, within a third",
                100.0 * share
            ),
        );
        let left = total - known;
        if !(left > 0.0) {
            let expected =
                format!("more than the {known} kg of its segments and tool that state a mass");
            return Err(self
                .sheet
                .wrong("arm.mass", expected, format!("{total} kg"), ""));
        }
        let weight = |index: usize| {
            let segment = &arm.segments[index];
            let length = lengths[index] + 0.6 * segment.extension.map_or(0.0, |e| e.si);
            (length + 0.02) * TAPER.powi(i32::try_from(index).unwrap_or(0))
        };
        let of_tool = match tool {
            Some(None) => TOOL_SHARE * left,
            _ => 0.0,
        };
        let open: Vec<usize> = (0..stated.len()).filter(|&i| stated[i].is_none()).collect();
        let weights: f64 = open.iter().map(|&i| weight(i)).sum();
        let segment = |(index, stated): (usize, Option<f64>)| {
            stated.unwrap_or_else(|| (left - of_tool) * weight(index) / weights)
        };
        self.assumed.add(
            "the arm's mass is shared among its parts by their length, each segment a quarter lighter than the one before it",
            "the sheet does not state the masses of all parts",
        );
        let of_tool = match open.is_empty() {
            true => left,
            false => of_tool,
        };
        Ok(Masses {
            segments: stated.into_iter().enumerate().map(segment).collect(),
            tool: tool.flatten().unwrap_or(of_tool),
        })
    }

    fn segment(
        &mut self,
        segment: &Segment,
        length: f64,
        mass: f64,
        before: &Tip,
    ) -> Result<Tip, SheetError> {
        let name = &segment.name;
        let is_mast = segment.kind == SegmentKind::Mast;
        let axis = match segment.kind {
            SegmentKind::Lift | SegmentKind::Mast => LIFT,
            SegmentKind::Yaw => Z,
            SegmentKind::Roll => X,
        };
        let kind = segment.kind;
        let prior = match kind {
            SegmentKind::Mast => [-5.0, 8.0],
            SegmentKind::Lift => [-150.0, 85.0],
            SegmentKind::Yaw | SegmentKind::Roll => [-180.0, 180.0],
        };
        let range = segment.range.map(|range| range.map(|angle| angle.si));
        let range = range.unwrap_or_else(|| {
            self.assumed.add(
                format!("range of {name} {:.0} to {:.0} degrees", prior[0], prior[1]),
                "the sheet does not say it; it bounds plausible positions, not loads",
            );
            prior.map(f64::to_radians)
        });
        let at = segment.at.map(|a| a.si).unwrap_or_else(|| {
            let at = 0.0_f64.max(range[0]).min(range[1]);
            self.assumed.add(
                format!(
                    "{name} at {:.0} degrees in the posture of the sheet",
                    at.to_degrees()
                ),
                "the sheet does not say how the arm lay when the machine was weighed",
            );
            at
        });
        let joint = Joint {
            name: name.clone(),
            kind: JointKind::Revolute,
            parent: before.link,
            xyz: before.point,
            pitch: 0.0,
            axis,
            limits: Some(range),
            mimic: None,
            at,
            role: Role::Arm,
        };
        let origin = self.place(before);
        let link = self.add(&format!("{name}_link"), Some(joint), origin);
        let extension = segment.extension.map_or(0.0, |e| e.si);
        let fixed = if extension > 0.0 { FIXED_PART } else { 1.0 };
        let cylinder = self.cylinder(segment, link, before, mass)?;
        self.fill(link, length, fixed * (mass - cylinder), is_mast, 0);
        if extension == 0.0 {
            return Ok(Tip {
                link,
                point: along(length, is_mast),
            });
        }
        let moving = (1.0 - fixed) * (mass - cylinder);
        let extended = segment.extended.map(|e| e.si).unwrap_or_else(|| {
            self.assumed.add(
                format!("{name} retracted in the posture of the sheet"),
                "machines are weighed as they travel",
            );
            0.0
        });
        Ok(match is_mast {
            true => self.stages(segment, link, length, moving, extension, extended),
            false => self.sections(segment, link, length, moving, extension, extended),
        })
    }

    /// The place of a point in the base frame, all joints at zero.
    fn place(&self, tip: &Tip) -> [f64; 3] {
        let origin = self.origins[tip.link];
        [0, 1, 2].map(|i| origin[i] + tip.point[i])
    }

    /// Mass and shape of a part of a segment.
    fn fill(&mut self, link: usize, length: f64, mass: f64, is_mast: bool, nested: usize) {
        let slim =
            (0.09 * length).clamp(0.04, 0.55) * 0.88_f64.powi(i32::try_from(nested).unwrap_or(0));
        let (extent, solid) = match is_mast {
            false => (
                [length.max(0.02), slim, slim],
                Solid::Box([length.max(0.02), slim, slim]),
            ),
            true => {
                let wide = 0.4 * self.size.width;
                ([0.15, wide, length], Solid::Box([0.12, wide, length]))
            }
        };
        let described = &mut self.machine.links[link];
        described.mass = mass;
        described.extent = extent;
        described.com = along(COM_ALONG * length, is_mast);
        let origin = self.origins[link];
        let middle = along(0.5 * length, is_mast);
        let colour = if is_mast { DARK } else { YELLOW };
        self.draw(
            link,
            solid,
            [0, 1, 2].map(|i| origin[i] + middle[i]),
            colour,
        );
    }

    /// Telescopic sections, which extend alike; the first one's joint is measured as that of one section.
    fn sections(
        &mut self,
        segment: &Segment,
        link: usize,
        length: f64,
        mass: f64,
        extension: f64,
        extended: f64,
    ) -> Tip {
        let count = segment.sections.unwrap_or(1);
        let share = 1.0 / f64::from(count);
        let name = format!("{}_extension", segment.name);
        let mut parent = link;
        for section in 0..count {
            let first = section == 0;
            let joint_name = match first {
                true => name.clone(),
                false => format!("{name}_{}", section + 1),
            };
            let joint = Joint {
                name: joint_name.clone(),
                kind: JointKind::Prismatic,
                parent,
                xyz: [0.0; 3],
                pitch: 0.0,
                axis: X,
                limits: Some([0.0, share * extension]),
                mimic: (!first).then(|| (name.clone(), 1.0)),
                at: share * extended,
                role: if first { Role::Arm } else { Role::Follows },
            };
            let origin = self.origins[parent];
            parent = self.add(&format!("{joint_name}_link"), Some(joint), origin);
            self.fill(
                parent,
                length,
                share * mass,
                false,
                usize::from(section) + 1,
            );
        }
        if count > 1 {
            self.assumed.add(
                format!("the {count} sections of {} extend alike; `{name}` is the extension of one of them", segment.name),
                "one measured length does not tell how each section stands",
            );
        }
        Tip {
            link: parent,
            point: along(length, false),
        }
    }

    /// The inner stage of a mast and the carriage, which goes twice as far.
    fn stages(
        &mut self,
        segment: &Segment,
        link: usize,
        length: f64,
        mass: f64,
        extension: f64,
        extended: f64,
    ) -> Tip {
        let lift = format!("{}_lift", segment.name);
        let origin = self.origins[link];
        let joint = |name: String, limits: [f64; 2], mimic: Option<(String, f64)>, at: f64| Joint {
            name,
            kind: JointKind::Prismatic,
            parent: link,
            xyz: [0.0; 3],
            pitch: 0.0,
            axis: Z,
            limits: Some(limits),
            role: if mimic.is_some() {
                Role::Follows
            } else {
                Role::Arm
            },
            mimic,
            at,
        };
        let carriage = joint(lift.clone(), [0.0, extension], None, extended);
        let carriage = self.add(&format!("{lift}_link"), Some(carriage), origin);
        let low = 0.25 * length;
        self.fill(carriage, low, 0.5 * mass, true, 0);
        let stage_name = format!("{}_stage", segment.name);
        let mimic = Some((lift, 0.5));
        let stage = joint(
            stage_name.clone(),
            [0.0, 0.5 * extension],
            mimic,
            0.5 * extended,
        );
        let stage = self.add(&format!("{stage_name}_link"), Some(stage), origin);
        self.fill(stage, length, 0.5 * mass, true, 0);
        self.assumed.add(
            "the inner mast goes half as far as the carriage",
            "that is how a mast of two stages works",
        );
        let drop = self.sheet.arm.height.si;
        Tip {
            link: carriage,
            point: [0.0, 0.0, -0.9 * drop],
        }
    }

    fn tool(&mut self, tip: &Tip, mass: f64) -> Result<Tip, SheetError> {
        let sheet = self.sheet;
        let Some(tool) = sheet.arm.tool.as_ref() else {
            return Ok(Tip {
                link: tip.link,
                point: tip.point,
            });
        };
        let is_turning = tool.range.is_some() && !self.prior.hangs;
        let at = match (is_turning, tool.at, tool.range) {
            (true, Some(at), _) => at.si,
            (true, None, Some([least, most])) => {
                let at = 0.0_f64.max(least.si).min(most.si);
                self.assumed.add(
                    format!(
                        "{} at {:.0} degrees in the posture of the sheet",
                        tool.name,
                        at.to_degrees()
                    ),
                    "the sheet does not say how the tool lay when the machine was weighed",
                );
                at
            }
            _ => 0.0,
        };
        let joint = Joint {
            name: match is_turning {
                true => tool.name.clone(),
                false => format!("{}_fixed", tool.name),
            },
            kind: if is_turning {
                JointKind::Revolute
            } else {
                JointKind::Fixed
            },
            parent: tip.link,
            xyz: tip.point,
            pitch: 0.0,
            axis: LIFT,
            limits: tool
                .range
                .filter(|_| is_turning)
                .map(|range| range.map(|a| a.si)),
            mimic: None,
            at,
            role: if is_turning { Role::Arm } else { Role::Fixed },
        };
        let origin = self.place(tip);
        let name = match is_turning {
            true => format!("{}_link", tool.name),
            false => tool.name.clone(),
        };
        let link = self.add(&name, Some(joint), origin);
        self.machine.tool = Some(name);
        let length = tool.length.map_or(0.0, |l| l.si);
        if self.prior.hangs {
            let side = mass.max(1.0).cbrt() * 0.06;
            self.machine.links[link].mass = mass;
            self.machine.links[link].extent = [side; 3];
            self.draw(link, Solid::Box([side; 3]), origin, DARK);
            self.assumed.add(
                format!(
                    "{} hangs freely: its weight acts at the pin of the tip",
                    tool.name
                ),
                "its swing is not measured",
            );
            return Ok(Tip {
                link,
                point: [0.0; 3],
            });
        }
        let length = length.max(0.02);
        let extent = match tool.name.contains("fork") {
            true => [length, 0.3 * self.size.width, 0.05],
            false => [
                length,
                if self.machine.slew_x.is_some() {
                    0.4
                } else {
                    0.95
                } * self.size.width,
                0.45 * length,
            ],
        };
        let described = &mut self.machine.links[link];
        described.mass = mass;
        described.extent = extent;
        // forks are heaviest at their heel, buckets in the middle
        described.com = [
            if tool.name.contains("fork") {
                0.25
            } else {
                0.45
            } * length,
            0.0,
            0.0,
        ];
        self.draw(
            link,
            Solid::Box(extent),
            [origin[0] + length / 2.0, origin[1], origin[2]],
            DARK,
        );
        Ok(Tip {
            link,
            point: [tool.length.map_or(0.0, |l| l.si), 0.0, 0.0],
        })
    }
}

/// A point along a segment.
fn along(length: f64, is_mast: bool) -> [f64; 3] {
    match is_mast {
        true => [0.0, 0.0, length],
        false => [length, 0.0, 0.0],
    }
}
