//! The arm: its segments and its tool.

use super::range::{LENGTH_UNITS, in_other_unit};
use crate::error::SheetError;
use crate::sheet::spec::{Segment, SegmentKind, Sheet};

/// Mass of an arm with its tool as a share of the operating mass, at least.
const LEAST_ARM_SHARE: f64 = 2e-3;
/// Mass of a segment or a tool as a share of the operating mass, at least.
const LEAST_PART_SHARE: f64 = 1e-4;
/// Rated load as a share of the operating mass, at least.
const LEAST_LOAD_SHARE: f64 = 2e-3;
/// Longest tool: forks and buckets of the largest machines (m).
const LONGEST_TOOL: f64 = 5.0;
/// Diameter of the largest pistons (m).
const LARGEST_BORE: f64 = 0.8;
/// Largest range of a joint that does not turn endlessly (degrees): those of arms of robots go one turn either way.
pub(super) const TWO_TURNS: f64 = 720.0;

impl Sheet {
    pub(super) fn check_arm(&self) -> Result<(), SheetError> {
        let arm = &self.arm;
        self.offset_in("arm.ahead", arm.ahead.si, 30.0)?;
        self.length_in("arm.height", arm.height.si, [0.01, 15.0])?;
        if let Some(mass) = arm.mass {
            self.part_in("arm.mass", mass.si, LEAST_ARM_SHARE)?;
        }
        if let Some(reach) = arm.reach {
            self.length_in("arm.reach", reach.si, [0.05, 150.0])?;
        }
        if !(1..=10).contains(&arm.segments.len()) {
            let found = arm.segments.len().to_string();
            return Err(self.wrong("arm.segments", "1 to 10 tables [[arm.segments]]", found, ""));
        }
        let mut names: Vec<&str> = vec![
            "base_link",
            "slew",
            "superstructure",
            "front_frame",
            "rear_frame",
            "articulation",
            "frame_roll",
            "tool",
        ];
        for (index, segment) in arm.segments.iter().enumerate() {
            self.check_segment(index, segment)?;
            if names.contains(&segment.name.as_str()) {
                let place = format!("arm.segments[{index}].name");
                let expected = "a name of its own";
                return Err(self.wrong(place, expected, format!("\"{}\"", segment.name), ""));
            }
            names.push(&segment.name);
        }
        let open = arm.segments.iter().filter(|s| s.length.is_none()).count();
        if open > 1 || (open == 1 && arm.reach.is_none()) {
            let expected = "the length of every segment, or of all but one and arm.reach";
            return Err(self.wrong(
                "arm.segments",
                expected,
                format!("{open} without a length"),
                "",
            ));
        }
        if let Some(tool) = &arm.tool {
            if !is_name(&tool.name) || names.contains(&tool.name.as_str()) {
                let expected = "a name of letters, digits and _ of its own";
                return Err(self.wrong(
                    "arm.tool.name",
                    expected,
                    format!("\"{}\"", tool.name),
                    "",
                ));
            }
            if let Some(mass) = tool.mass.filter(|mass| mass.si != 0.0) {
                let shares = [LEAST_PART_SHARE, self.template.prior().tool];
                let range = shares.map(|share| share * self.mass.si);
                self.mass_in("arm.tool.mass", mass.si, range)?;
            }
            if let Some(length) = tool.length {
                self.length_in("arm.tool.length", length.si, [0.0, LONGEST_TOOL])?;
            }
            self.range(
                "arm.tool",
                tool.range.map(|r| r.map(|a| a.si)),
                tool.at.map(|a| a.si),
                TWO_TURNS,
            )?;
        }
        if let Some(tool) = &arm.tool {
            let hangs = self.template.prior().hangs;
            if hangs && tool.range.is_some() {
                let expected = "none for a tool that hangs freely";
                return Err(self.wrong("arm.tool.range", expected, "a range", ""));
            }
            if tool.at.is_some() && tool.range.is_none() {
                let expected = "range beside at, for a tool that turns";
                return Err(self.wrong("arm.tool.range", expected, "none", ""));
            }
        }
        if self.rated_load.is_some() && arm.tool.is_none() {
            let expected = "[arm.tool] that carries the rated load";
            return Err(self.wrong("arm.tool", expected, "none", ""));
        }
        if let Some(load) = &self.rated_load {
            if load.mass.si != 0.0 {
                let shares = [LEAST_LOAD_SHARE, self.template.prior().rated];
                let range = shares.map(|share| share * self.mass.si);
                self.mass_in("rated_load.mass", load.mass.si, range)?;
            }
            self.length_in("rated_load.centre", load.centre.si, [0.0, LONGEST_TOOL])?;
        }
        Ok(())
    }

    fn check_segment(&self, index: usize, segment: &Segment) -> Result<(), SheetError> {
        let place = |key: &str| format!("arm.segments[{index}].{key}");
        if !is_name(&segment.name) {
            let expected = "1 to 40 letters, digits and _, a letter first";
            return Err(self.wrong(place("name"), expected, format!("\"{}\"", segment.name), ""));
        }
        if let Some(length) = segment.length {
            self.length_in(&place("length"), length.si, [0.0, 100.0])?;
        }
        if let Some(mass) = segment.mass {
            self.part_in(&place("mass"), mass.si, LEAST_PART_SHARE)?;
        }
        let limits = segment.range.map(|r| r.map(|a| a.si));
        self.range(
            &format!("arm.segments[{index}]"),
            limits,
            segment.at.map(|a| a.si),
            TWO_TURNS,
        )?;
        let extension = segment.extension.map_or(0.0, |e| e.si);
        self.length_in(&place("extension"), extension, [0.0, 120.0])?;
        let extended = segment.extended.map_or(0.0, |e| e.si);
        if !(0.0..=extension).contains(&extended) {
            let expected = format!("0 to the extension of {extension} m");
            return Err(self.wrong(place("extended"), expected, format!("{extended} m"), ""));
        }
        if let Some(sections) = segment.sections
            && (!(1..=8).contains(&sections) || extension == 0.0)
        {
            let expected = "1 to 8 telescopic sections beside extension";
            return Err(self.wrong(place("sections"), expected, sections.to_string(), ""));
        }
        if segment.kind == SegmentKind::Mast && segment.sections.is_some() {
            let expected = "none for a mast, which has two stages";
            return Err(self.wrong(place("sections"), expected, "sections", ""));
        }
        if let Some(cylinder) = &segment.cylinder {
            for (key, length, range) in [
                ("closed", cylinder.closed, [0.01, 10.0]),
                ("stroke", cylinder.stroke, [0.01, 10.0]),
                ("bore", cylinder.bore, [0.005, LARGEST_BORE]),
                ("rod", cylinder.rod, [0.003, LARGEST_BORE]),
            ] {
                self.length_in(&place(&format!("cylinder.{key}")), length.si, range)?;
            }
            for (key, pin) in [("base", cylinder.base), ("eye", cylinder.eye)] {
                if let Some(wrong) = pin.iter().find(|p| !(p.si.abs() <= 20.0)) {
                    let likely = in_other_unit(wrong.si.abs(), [0.0, 20.0], LENGTH_UNITS);
                    let place = place(&format!("cylinder.{key}"));
                    return Err(self.wrong(
                        place,
                        "-20 to 20 m",
                        format!("{} m", wrong.si),
                        likely,
                    ));
                }
            }
            if cylinder.rod.si >= cylinder.bore.si {
                let expected = format!("less than the bore of {} m", cylinder.bore.si);
                let found = format!("{} m", cylinder.rod.si);
                return Err(self.wrong(
                    place("cylinder.rod"),
                    expected,
                    found,
                    "Exchange bore and rod",
                ));
            }
        }
        Ok(())
    }
}

/// Names are parts of a URDF and of TOML keys.
fn is_name(name: &str) -> bool {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    !name.is_empty()
        && name.len() <= 40
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(is_word)
}
