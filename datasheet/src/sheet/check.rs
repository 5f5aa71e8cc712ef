//! Refuses numbers that no machine of this kind has, with the likely correction.

use super::spec::{Axle, OutriggersSet, Segment, SegmentKind, Sheet};
use crate::error::SheetError;
use crate::prior::ROUNDING;

/// Names are parts of a URDF and of TOML keys.
fn is_name(name: &str) -> bool {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    !name.is_empty()
        && name.len() <= 40
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(is_word)
}

/// A length or a mass in other units that would be plausible.
fn in_other_unit(si: f64, range: [f64; 2], units: &[(&str, f64)]) -> String {
    let fits = |factor: f64| (range[0]..=range[1]).contains(&(si * factor));
    let found = units.iter().find(|(_, factor)| fits(*factor));
    found.map_or(String::new(), |(unit, _)| {
        format!("It looks like a number in {unit}: write \"{si} {unit}\"")
    })
}

const MASS_UNITS: &[(&str, f64)] = &[("t", 1000.0), ("lb", 0.453_592_37), ("g", 1e-3)];
const LENGTH_UNITS: &[(&str, f64)] = &[("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048)];

impl Sheet {
    /// Checks every number by itself, and those that belong together.
    pub(crate) fn check(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        if self.name.trim().is_empty() || self.name.len() > 200 {
            let found = format!("{} characters", self.name.len());
            return Err(self.wrong("name", "a name of 1 to 200 characters", found, ""));
        }
        self.mass_in("mass", self.mass.si, prior.mass)?;
        for (place, length, most) in [
            ("length", self.length, 60.0),
            ("width", self.width, 30.0),
            ("height", self.height, 30.0),
            ("ground_clearance", self.ground_clearance, 5.0),
            ("centre_of_mass_height", self.centre_of_mass_height, 15.0),
        ] {
            if let Some(length) = length {
                self.length_in(place, length.si, [0.01, most])?;
            }
        }
        if let Some(angle) = self.tilt_angle {
            self.angle_in("tilt_angle", angle.si, [5.0, 70.0])?;
        }
        if self.tilt_angle.is_some() && self.centre_of_mass_height.is_some() {
            return Err(self.wrong(
                "tilt_angle",
                "either tilt_angle or centre_of_mass_height",
                "both",
                "Leave out the one that is less certain",
            ));
        }
        if let Some(k) = self.tyre_stiffness.map(|k| k.si)
            && !(1e3..=1e8).contains(&k)
        {
            let likely = "Tyres of such machines have 1e5 to 3e6 N/m";
            return Err(self.wrong(
                "tyre_stiffness",
                "1e3 to 1e8 N/m",
                format!("{k} N/m"),
                likely,
            ));
        }
        self.check_ground()?;
        self.check_joints()?;
        self.check_arm()?;
        self.check_outriggers()
    }

    fn check_ground(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        match (&self.tracks, prior.has_tracks) {
            (Some(tracks), true) => {
                self.length_in("tracks.gauge", tracks.gauge.si, [0.5, 15.0])?;
                self.length_in("tracks.length", tracks.length.si, [0.5, 20.0])?;
                self.length_in("tracks.shoe", tracks.shoe.si, [0.1, 3.0])?;
                self.length_in("tracks.height", tracks.height.si, [0.1, 4.0])?;
                match self.axles.is_empty() {
                    true => Ok(()),
                    false => Err(self.wrong("axles", "none beside [tracks]", "axles", "")),
                }
            }
            (None, true) => Err(self.wrong("tracks", "[tracks] of a crawler", "none", "")),
            (Some(_), false) => {
                let likely = "For a crawler take template = \"crawler-excavator\"";
                Err(self.wrong("tracks", "axles", "[tracks]", likely))
            }
            (None, false) => self.check_axles(),
        }
    }

    fn check_axles(&self) -> Result<(), SheetError> {
        if !(2..=6).contains(&self.axles.len()) {
            let found = self.axles.len().to_string();
            return Err(self.wrong("axles", "2 to 6 tables [[axles]]", found, ""));
        }
        for (index, axle) in self.axles.iter().enumerate() {
            self.check_axle(index, axle)?;
        }
        self.check_spacing()?;
        let wheels: usize = self.axles.iter().map(Axle::wheels).sum();
        if !(3..=12).contains(&wheels) {
            let likely = "Take twin tyres as one wheel, with tyre_width of both";
            return Err(self.wrong("axles", "3 to 12 wheels", wheels.to_string(), likely));
        }
        self.check_loads()
    }

    /// Wheels of neighbouring axles do not overlap.
    fn check_spacing(&self) -> Result<(), SheetError> {
        /// Share of the radii that must fit between two wheels in line.
        const FITS: f64 = 0.9;
        for (index, pair) in self.axles.windows(2).enumerate() {
            let [front, rear] = [&pair[0], &pair[1]];
            let of_bogie = |axle: &Axle| axle.bogie.map_or(0.0, |b| b.si / 2.0);
            let between = rear.behind.map_or(0.0, |b| b.si) - of_bogie(front) - of_bogie(rear);
            let radii = self.tyre_radius(front) + self.tyre_radius(rear);
            if between < FITS * radii {
                return Err(self.wrong(
                    format!("axles[{}].behind", index + 1),
                    format!(
                        "at least {:.3} m between neighbouring wheels, whose radii add up to that",
                        radii
                    ),
                    format!("{between:.3} m"),
                    "Check the distance from axle to axle, and that the radius is not the diameter",
                ));
            }
        }
        Ok(())
    }

    fn check_axle(&self, index: usize, axle: &Axle) -> Result<(), SheetError> {
        let place = |key: &str| format!("axles[{index}].{key}");
        match (index, axle.behind) {
            (0, Some(_)) => {
                let expected = "none for the first axle";
                return Err(self.wrong(place("behind"), expected, "a length", ""));
            }
            (0, None) => {}
            (_, None) => {
                let expected = "the distance behind the axle before it";
                return Err(self.wrong(place("behind"), expected, "none", ""));
            }
            (_, Some(behind)) => self.length_in(&place("behind"), behind.si, [0.1, 25.0])?,
        }
        if let Some(track) = axle.track {
            self.length_in(&place("track"), track.si, [0.1, 15.0])?;
        }
        let radius = self.template.prior().radius;
        let tyre = axle.tyre().map(|t| t.radius);
        let stated = axle.tyre_radius.map(|r| r.si);
        let Some(r) = stated.or(tyre) else {
            let (expected, found) = match &axle.tyre {
                Some(name) => (
                    "a designation such as \"20.5R25\", \"710/45-26.5\" or \"7.00-12\", or tyre_radius",
                    format!("\"{name}\""),
                ),
                None => ("tyre or tyre_radius", "neither".into()),
            };
            return Err(self.wrong(place("tyre"), expected, found, ""));
        };
        self.length_in(&place("tyre_radius"), r, radius)?;
        if let (Some(stated), Some(tyre)) = (stated, tyre)
            && !(0.75..=1.33).contains(&(stated / tyre))
        {
            let likely = match (1.6..2.4).contains(&(stated / tyre)) {
                true => "It looks like the diameter",
                false => "",
            };
            let expected = format!("about {tyre:.3} m, as the designation says");
            return Err(self.wrong(
                place("tyre_radius"),
                expected,
                format!("{stated} m"),
                likely,
            ));
        }
        if let Some(width) = axle.tyre_width {
            self.length_in(&place("tyre_width"), width.si, [0.01, 3.0])?;
        }
        if let Some(bogie) = axle.bogie {
            self.length_in(&place("bogie"), bogie.si, [1.4 * r, 6.0 * r])?;
        }
        if (axle.track.is_none() || axle.pendulum.is_some()) && axle.bogie.is_some() {
            let expected = "an axle with bogies to have a track and no pendulum";
            return Err(self.wrong(place("bogie"), expected, "another one", ""));
        }
        if axle.track.is_none() && axle.pendulum.is_some() {
            let expected = "none for a single wheel in the middle";
            return Err(self.wrong(place("pendulum"), expected, "an angle", ""));
        }
        for (key, angle) in [("steering", axle.steering), ("pendulum", axle.pendulum)] {
            if let Some(angle) = angle {
                self.angle_in(&place(key), angle.si, [0.5, 95.0])?;
            }
        }
        for (key, mass) in [
            ("load", axle.load),
            ("laden", axle.laden),
            ("wheel_mass", axle.wheel_mass),
        ] {
            if let Some(mass) = mass {
                let least = if key == "wheel_mass" {
                    0.0
                } else {
                    f64::MIN_POSITIVE
                };
                self.mass_in(&place(key), mass.si, [least, 3.0 * self.mass.si])?;
            }
        }
        Ok(())
    }

    /// Axle loads add up to the operating mass.
    fn check_loads(&self) -> Result<(), SheetError> {
        let loads: Vec<f64> = self
            .axles
            .iter()
            .filter_map(|a| a.load)
            .map(|m| m.si)
            .collect();
        if loads.is_empty() {
            return Ok(());
        }
        if loads.len() < self.axles.len() {
            let found = format!("{} of {}", loads.len(), self.axles.len());
            let likely = "The one that is missing is the operating mass less the others";
            return Err(self.wrong(
                "axles.load",
                "loads of all axles, or of none",
                found,
                likely,
            ));
        }
        let (sum, mass) = (loads.iter().sum::<f64>(), self.mass.si);
        if (sum - mass).abs() <= ROUNDING * mass {
            return Ok(());
        }
        let laden = self.rated_load.as_ref().map(|load| load.mass.si);
        let is_laden = laden.is_some_and(|load| (sum - mass - load).abs() <= ROUNDING * sum);
        // single loads in another unit than the others
        let in_kg = loads.iter().map(|load| match *load < 0.01 * mass {
            true => 1000.0 * load,
            false => *load,
        });
        let is_mixed = (in_kg.sum::<f64>() - mass).abs() <= ROUNDING * mass;
        let likely = match sum / mass {
            _ if is_mixed => {
                "Some loads are in t and the mass in kg: state the unit, such as \"18.6 t\""
            }
            _ if is_laden => {
                "The axle loads look like those with the rated load: write them as laden"
            }
            r if (r - 1000.0).abs() < 20.0 || (r - 0.001).abs() < 2e-5 => {
                "One of the two is in t and the other in kg: state the unit, such as \"18.6 t\""
            }
            r if (r - 0.5).abs() < 0.01 => "These look like loads of one wheel: give both together",
            r if (r - 9.81).abs() < 0.15 => "These look like newtons: divide by 9.81",
            _ => "Check that mass and loads are of the same equipment and posture",
        };
        Err(self.wrong(
            "axles.load",
            format!("loads that add up to the operating mass of {mass} kg"),
            format!("{sum} kg"),
            likely,
        ))
    }

    fn check_joints(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        match (&self.articulation, prior.is_articulated) {
            (Some(joint), true) => {
                let wheelbase = self.axle_positions().last().map_or(0.0, |x| -x);
                self.length_in(
                    "articulation.behind",
                    joint.behind.si,
                    [0.05 * wheelbase, 0.95 * wheelbase],
                )?;
                self.angle_in("articulation.angle", joint.angle.si, [1.0, 90.0])?;
                if let Some(roll) = joint.roll {
                    self.angle_in("articulation.roll", roll.si, [0.5, 60.0])?;
                }
                if let Some(mass) = joint.front_mass {
                    self.mass_in("articulation.front_mass", mass.si, [0.0, self.mass.si])?;
                }
            }
            (None, true) => {
                let expected = "[articulation] with the place of the frame joint";
                return Err(self.wrong("articulation", expected, "none", ""));
            }
            (Some(_), false) => {
                let expected = format!("none for a {}", self.template);
                return Err(self.wrong("articulation", expected, "[articulation]", ""));
            }
            (None, false) => {}
        }
        if let Some(slew) = &self.slew {
            if !(slew.behind.si.abs() <= 30.0) {
                let found = format!("{} m", slew.behind.si);
                return Err(self.wrong(
                    "slew.behind",
                    "-30 to 30 m",
                    found,
                    "Write \"NUMBER mm\" for millimetres",
                ));
            }
            self.length_in("slew.height", slew.height.si, [0.01, 10.0])?;
            self.range(
                "slew",
                slew.range.map(|r| r.map(|a| a.si)),
                slew.at.map(|a| a.si),
            )?;
        }
        match (&self.superstructure, prior.has_superstructure) {
            (Some(upper), true) => {
                self.length_in("superstructure.tail", upper.tail.si, [0.3, 15.0])?;
                if self.slew.is_none() {
                    return Err(self.wrong("slew", "[slew] below a superstructure", "none", ""));
                }
                if let Some(mass) = upper.mass {
                    self.mass_in("superstructure.mass", mass.si, [0.0, self.mass.si])?;
                }
                if let Some(com) = upper.centre_of_mass_behind
                    && !(com.si.abs() <= upper.tail.si)
                {
                    let expected = format!(
                        "a place within the tail swing radius of {} m",
                        upper.tail.si
                    );
                    let place = "superstructure.centre_of_mass_behind";
                    return Err(self.wrong(place, expected, format!("{} m", com.si), ""));
                }
                if let Some(width) = upper.width {
                    self.length_in("superstructure.width", width.si, [0.3, 15.0])?;
                }
                Ok(())
            }
            (None, true) => {
                let expected = "[superstructure] with its tail swing radius";
                Err(self.wrong("superstructure", expected, "none", ""))
            }
            (Some(_), false) => {
                let expected = format!("none for a {}", self.template);
                Err(self.wrong("superstructure", expected, "[superstructure]", ""))
            }
            (None, false) => Ok(()),
        }
    }

    fn check_arm(&self) -> Result<(), SheetError> {
        let arm = &self.arm;
        if !(arm.ahead.si.abs() <= 30.0) {
            let likely = in_other_unit(arm.ahead.si.abs(), [0.0, 30.0], LENGTH_UNITS);
            return Err(self.wrong(
                "arm.ahead",
                "-30 to 30 m",
                format!("{} m", arm.ahead.si),
                likely,
            ));
        }
        self.length_in("arm.height", arm.height.si, [0.01, 15.0])?;
        if let Some(mass) = arm.mass {
            self.mass_in("arm.mass", mass.si, [0.0, self.mass.si])?;
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
            if let Some(mass) = tool.mass {
                self.mass_in("arm.tool.mass", mass.si, [0.0, self.mass.si])?;
            }
            if let Some(length) = tool.length {
                self.length_in("arm.tool.length", length.si, [0.0, 20.0])?;
            }
            self.range(
                "arm.tool",
                tool.range.map(|r| r.map(|a| a.si)),
                tool.at.map(|a| a.si),
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
            self.mass_in("rated_load.mass", load.mass.si, [0.0, 2_000_000.0])?;
            self.length_in("rated_load.centre", load.centre.si, [0.0, 10.0])?;
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
            self.mass_in(&place("mass"), mass.si, [0.0, self.mass.si])?;
        }
        let limits = segment.range.map(|r| r.map(|a| a.si));
        self.range(
            &format!("arm.segments[{index}]"),
            limits,
            segment.at.map(|a| a.si),
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
            for (key, length, least) in [
                ("closed", cylinder.closed, 0.01),
                ("stroke", cylinder.stroke, 0.01),
                ("bore", cylinder.bore, 0.005),
                ("rod", cylinder.rod, 0.003),
            ] {
                self.length_in(&place(&format!("cylinder.{key}")), length.si, [least, 10.0])?;
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

    fn check_outriggers(&self) -> Result<(), SheetError> {
        if self.outriggers.len() > 4 {
            let found = self.outriggers.len().to_string();
            return Err(self.wrong("outriggers", "at most 4 pairs", found, ""));
        }
        for (index, pair) in self.outriggers.iter().enumerate() {
            let place = |key: &str| format!("outriggers[{index}].{key}");
            self.length_in(&place("base"), pair.base.si, [0.3, 20.0])?;
            if !(pair.behind.si.abs() <= 30.0) {
                let likely = in_other_unit(pair.behind.si.abs(), [0.0, 30.0], LENGTH_UNITS);
                let found = format!("{} m", pair.behind.si);
                return Err(self.wrong(place("behind"), "-30 to 30 m", found, likely));
            }
            if let Some(pad) = pair.pad {
                self.length_in(&place("pad"), pad.si, [0.02, 3.0])?;
            }
            let Some(OutriggersSet::Signals { left, right }) = &pair.set else {
                continue;
            };
            for (side, switch) in [("left", left), ("right", right)] {
                let empty = [("topic", &switch.topic), ("field", &switch.field)];
                if let Some((key, _)) = empty.into_iter().find(|(_, text)| text.is_empty()) {
                    let place = place(&format!("set.{side}.{key}"));
                    return Err(self.wrong(place, "a name", "an empty text", ""));
                }
                if let Some(above) = switch.above.filter(|above| !above.is_finite()) {
                    let place = place(&format!("set.{side}.above"));
                    return Err(self.wrong(place, "a finite number", above.to_string(), ""));
                }
            }
        }
        Ok(())
    }

    fn mass_in(&self, place: &str, kg: f64, range: [f64; 2]) -> Result<(), SheetError> {
        if (range[0]..=range[1]).contains(&kg) {
            return Ok(());
        }
        let expected = format!(
            "{:.4} to {:.4} kg for a {}",
            range[0], range[1], self.template
        );
        let likely = in_other_unit(kg, range, MASS_UNITS);
        Err(self.wrong(place, trim(&expected), format!("{kg} kg"), likely))
    }

    fn length_in(&self, place: &str, m: f64, range: [f64; 2]) -> Result<(), SheetError> {
        if (range[0]..=range[1]).contains(&m) {
            return Ok(());
        }
        let expected = format!("{:.4} to {:.4} m", range[0], range[1]);
        let likely = in_other_unit(m, range, LENGTH_UNITS);
        Err(self.wrong(place, trim(&expected), format!("{m} m"), likely))
    }

    fn angle_in(&self, place: &str, angle: f64, degrees: [f64; 2]) -> Result<(), SheetError> {
        let found = angle.to_degrees();
        if (degrees[0] - 1e-9..=degrees[1] + 1e-9).contains(&found) {
            return Ok(());
        }
        let expected = format!("{} to {} degrees", degrees[0], degrees[1]);
        let likely = match (degrees[0]..=degrees[1]).contains(&found.to_degrees()) {
            true => format!("It looks like radians: write \"{found} rad\""),
            false => String::new(),
        };
        Err(self.wrong(place, expected, format!("{found} degrees"), likely))
    }

    /// A range is in order, no larger than two turns, and holds the posture of the sheet.
    fn range(
        &self,
        place: &str,
        range: Option<[f64; 2]>,
        at: Option<f64>,
    ) -> Result<(), SheetError> {
        let degrees = |a: f64| (a.to_degrees() * 1e6).round() * 1e-6;
        let [least, most] =
            range.unwrap_or([-4.0 * std::f64::consts::PI, 4.0 * std::f64::consts::PI]);
        if !(least < most && most - least < 26.0) {
            let found = format!("{} to {} degrees", degrees(least), degrees(most));
            let expected = "a smallest and a larger angle";
            return Err(self.wrong(format!("{place}.range"), expected, found, ""));
        }
        match at {
            Some(at) if !(least - 1e-9..=most + 1e-9).contains(&at) => {
                let expected = format!(
                    "an angle within the range of {} to {} degrees",
                    degrees(least),
                    degrees(most)
                );
                Err(self.wrong(
                    format!("{place}.at"),
                    expected,
                    format!("{} degrees", degrees(at)),
                    "",
                ))
            }
            _ => Ok(()),
        }
    }

    /// Places of the axles: 0 for the first one, negative behind it (m).
    pub(crate) fn axle_positions(&self) -> Vec<f64> {
        let behind = self.axles.iter().map(|a| a.behind.map_or(0.0, |b| b.si));
        behind
            .scan(0.0, |x, behind| {
                *x -= behind;
                Some(*x)
            })
            .collect()
    }
}

/// Without trailing zeros of decimals.
fn trim(text: &str) -> String {
    let words = text.split(' ').map(|word| match word.contains('.') {
        true => word.trim_end_matches('0').trim_end_matches('.'),
        false => word,
    });
    words.collect::<Vec<_>>().join(" ")
}

impl Sheet {
    /// Radius of the tyre of a checked axle (m).
    pub(crate) fn tyre_radius(&self, axle: &Axle) -> f64 {
        let stated = axle.tyre_radius.map(|r| r.si);
        stated
            .or(axle.tyre().map(|tyre| tyre.radius))
            .unwrap_or(0.5)
    }
}

impl Axle {
    /// Number of its wheels.
    pub(crate) fn wheels(&self) -> usize {
        match (self.track, self.bogie) {
            (None, _) => 1,
            (Some(_), None) => 2,
            (Some(_), Some(_)) => 4,
        }
    }

    /// The tyre that its designation describes.
    pub(crate) fn tyre(&self) -> Option<super::Tyre> {
        self.tyre.as_deref().and_then(super::Tyre::parse)
    }
}
