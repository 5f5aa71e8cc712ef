//! Builds the bodies of a sheet: frames, running gear, slew and superstructure, arm, outriggers.

use super::machine::{Joint, JointKind, Link, Machine, Outrigger, PadSet, Role, Shape, Solid};
use super::reach::reach;
use crate::error::SheetError;
use crate::prior::{Assumptions, Prior, Template};
use crate::sheet::{OutriggersSet, Sheet};

pub(super) const YELLOW: [f64; 3] = [0.93, 0.70, 0.13];
pub(super) const DARK: [f64; 3] = [0.20, 0.21, 0.23];
pub(super) const GREY: [f64; 3] = [0.55, 0.57, 0.60];
pub(super) const GLASS: [f64; 3] = [0.62, 0.76, 0.86];

/// A machine under construction.
pub(super) struct Build<'a> {
    pub(super) sheet: &'a Sheet,
    pub(super) prior: Prior,
    pub(super) assumed: Assumptions,
    pub(super) machine: Machine,
    /// Origin of each link in the base frame with all joints at zero (m); rotations are then none, but for
    /// cylinders.
    pub(super) origins: Vec<[f64; 3]>,
    pub(super) size: Size,
}

/// Overall size of the platform (m).
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    pub(super) length: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) clearance: f64,
    /// The place of the first axle, or of the middle of the tracks.
    pub(super) front: f64,
    /// Height of the axles.
    pub(super) axle_height: f64,
}

/// Builds the bodies, without the masses that the weights determine.
pub(crate) fn build(sheet: &Sheet) -> Result<Machine, SheetError> {
    let mut assumed = Assumptions::default();
    let size = Size::of(sheet, &mut assumed);
    let mut build = Build {
        sheet,
        prior: sheet.template.prior(),
        assumed,
        machine: empty(sheet),
        origins: Vec::new(),
        size,
    };
    build.frames();
    build.ground()?;
    let (parent, axis_x) = build.slew();
    let tip = build.arm(parent)?;
    build.outriggers();
    let Build {
        assumed,
        mut machine,
        size,
        ..
    } = build;
    machine.height = size.height;
    machine.reach = reach(&machine.links, tip.link, tip.point, axis_x);
    check_reach(sheet, &machine)?;
    machine.assumptions = assumed.into_vec();
    Ok(machine)
}

fn check_reach(sheet: &Sheet, machine: &Machine) -> Result<(), SheetError> {
    /// The sheet's reach may end before the arm is straight, and lengths are rounded.
    const SHORTER: f64 = 0.98;
    const LONGER: f64 = 1.12;
    let Some(stated) = sheet.arm.reach.map(|reach| reach.si) else {
        return Ok(());
    };
    if (SHORTER * stated..=LONGER * stated).contains(&machine.reach) {
        return Ok(());
    }
    let likely = match machine.reach < stated {
        true => {
            "A length or an extension is missing or too short, or a range keeps the arm from stretching"
        }
        false => "A length is too long, or the reach is that of another boom",
    };
    Err(sheet.wrong(
        "arm.reach",
        format!(
            "{:.3} m, which the segments give when the arm is stretched",
            machine.reach
        ),
        format!("{stated} m"),
        likely,
    ))
}

fn empty(sheet: &Sheet) -> Machine {
    Machine {
        name: sheet.name.clone(),
        template: sheet.template,
        sources: sheet.sources.clone(),
        links: Vec::new(),
        wheels: Vec::new(),
        assumptions: Vec::new(),
        notes: Vec::new(),
        mass: sheet.mass.si,
        reach: 0.0,
        centre_of_mass: [0.0; 3],
        axles: Vec::new(),
        free_joints: Vec::new(),
        linkages: Vec::new(),
        arm_root: String::new(),
        tool: None,
        outriggers: Vec::new(),
        has_tracks: sheet.tracks.is_some(),
        rated_load: sheet
            .rated_load
            .as_ref()
            .map(|load| (load.mass.si, load.centre.si)),
        height: 0.0,
        unknown: Vec::new(),
        slew_x: None,
        height_sigma: 0.0,
    }
}

impl Size {
    fn of(sheet: &Sheet, assumed: &mut Assumptions) -> Self {
        let positions = sheet.axle_positions();
        let span = -positions.last().copied().unwrap_or(0.0);
        let (span, radius, track) = match &sheet.tracks {
            Some(tracks) => (
                0.0,
                tracks.height.si / 2.0,
                tracks.gauge.si + tracks.shoe.si,
            ),
            None => {
                let radii = sheet.axles.iter().map(|axle| sheet.tyre_radius(axle));
                let tracks = sheet.axles.iter().filter_map(|axle| axle.track);
                let widest = tracks.map(|t| t.si).fold(0.0, f64::max);
                (span, radii.fold(0.0, f64::max), widest)
            }
        };
        let ground = sheet
            .tracks
            .as_ref()
            .map_or(span, |tracks| tracks.length.si);
        const FOR_INERTIA: &str =
            "the sheet does not say it; it sets the inertia and the picture, not the loads at rest";
        let mut or = |stated: Option<crate::quantity::Length>, prior: f64, name: &str| {
            let what = |v: f64| format!("overall {name} {v:.2} m");
            assumed.or(stated.map(|l| l.si), prior, what, FOR_INERTIA)
        };
        let length = or(sheet.length, ground + 2.4 * radius, "length");
        let width = or(sheet.width, track + 0.7 * radius, "width");
        let height = sheet.height.map(|h| h.si);
        let height = assumed.or(
            height,
            (2.0 * radius + 0.7 * track).max(1.15 * sheet.arm.height.si.min(4.0)),
            |v| format!("overall height {v:.2} m"),
            "the sheet does not say it; the height of the centre of mass follows from it",
        );
        let clearance = sheet.ground_clearance.map(|c| c.si);
        let clearance = assumed.or(
            clearance,
            0.5 * radius,
            |v| format!("ground clearance {v:.2} m"),
            "the sheet does not say it; it sets the picture only",
        );
        Self {
            length,
            width,
            height,
            clearance: clearance.min(0.8 * height),
            front: span / 2.0,
            axle_height: radius,
        }
    }
}

impl Build<'_> {
    /// Adds a link at a place in the base frame, with all joints at zero.
    pub(super) fn add(&mut self, name: &str, joint: Option<Joint>, origin: [f64; 3]) -> usize {
        self.machine.links.push(Link {
            name: name.into(),
            joint,
            mass: 0.0,
            com: [0.0; 3],
            inertia: [0.0; 3],
            mass_sigma: 0.0,
            com_sigma: [0.0; 3],
            extent: [0.0; 3],
            shapes: Vec::new(),
        });
        self.origins.push(origin);
        self.machine.links.len() - 1
    }

    /// A joint at a place in the base frame.
    pub(super) fn joint(
        &self,
        name: &str,
        kind: JointKind,
        parent: usize,
        at: [f64; 3],
        axis: [f64; 3],
        role: Role,
    ) -> Joint {
        let origin = self.origins[parent];
        Joint {
            name: name.into(),
            kind,
            parent,
            xyz: [at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]],
            pitch: 0.0,
            axis,
            limits: None,
            mimic: None,
            at: 0.0,
            role,
        }
    }

    /// Sets the standard deviations of the links from an index on: of their masses as a share of the mass, of their centres of
    /// mass as a share of the extent.
    pub(super) fn known_within(&mut self, from: usize, mass: f64, place: f64) {
        for link in &mut self.machine.links[from..] {
            link.mass_sigma = mass * link.mass;
            // a centimetre is as well as any drawing of a weldment is kept
            link.com_sigma = link.extent.map(|side| place * side + 0.01);
        }
    }

    /// A fixed frame.
    pub(super) fn fixed(&mut self, name: &str, parent: usize, at: [f64; 3]) -> usize {
        let x = [1.0, 0.0, 0.0];
        let joint = self.joint(
            &format!("{name}_fixed"),
            JointKind::Fixed,
            parent,
            at,
            x,
            Role::Fixed,
        );
        self.add(name, Some(joint), at)
    }

    pub(super) fn draw(&mut self, link: usize, solid: Solid, at: [f64; 3], colour: [f64; 3]) {
        let origin = self.origins[link];
        self.machine.links[link].shapes.push(Shape {
            solid,
            xyz: [at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]],
            colour,
        });
    }

    /// The place of the frame joint, of an articulated machine.
    fn frame_joint(&self) -> Option<f64> {
        let joint = self.sheet.articulation.as_ref()?;
        Some(self.size.front - joint.behind.si)
    }

    /// Returns the frame that carries parts at x.
    pub(super) fn frame_at(&self, x: f64) -> usize {
        let Some(joint) = self.frame_joint() else {
            return 0;
        };
        let is_base = (x < joint) == self.prior.cab_is_rear;
        match is_base {
            true => 0,
            false => self.machine.unknown[1].0,
        }
    }

    /// The platform, or the two frames of an articulated machine.
    fn frames(&mut self) {
        let size = self.size;
        let base = self.add("base_link", None, [0.0; 3]);
        let [front_end, rear_end] = [size.length / 2.0, -size.length / 2.0];
        let Some((x, spec)) = self.frame_joint().zip(self.sheet.articulation.clone()) else {
            self.frame(base, front_end, rear_end, true);
            return;
        };
        let at = [x, 0.0, size.axle_height];
        let limit = spec.angle.si;
        let other = if self.prior.cab_is_rear {
            "front_frame"
        } else {
            "rear_frame"
        };
        let upright = [0.0, 0.0, 1.0];
        let mut joint = self.joint(
            "articulation",
            JointKind::Revolute,
            base,
            at,
            upright,
            Role::Articulation,
        );
        joint.limits = Some([-limit, limit]);
        let frame = match spec.roll {
            None => self.add(other, Some(joint), at),
            Some(roll) => {
                let middle = self.add("articulation_link", Some(joint), at);
                let ahead = [1.0, 0.0, 0.0];
                let mut joint = self.joint(
                    "frame_roll",
                    JointKind::Revolute,
                    middle,
                    at,
                    ahead,
                    Role::Passive,
                );
                joint.limits = Some([-roll.si, roll.si]);
                self.machine.free_joints.push("frame_roll".into());
                self.add(other, Some(joint), at)
            }
        };
        let (front, rear) = match self.prior.cab_is_rear {
            true => (frame, base),
            false => (base, frame),
        };
        // the base comes first
        let has_cab = |frame: usize| frame == base;
        if front == base {
            self.frame(front, front_end, x, has_cab(front));
            self.frame(rear, x, rear_end, has_cab(rear));
        } else {
            self.frame(rear, x, rear_end, has_cab(rear));
            self.frame(front, front_end, x, has_cab(front));
        }
    }

    fn frame(&mut self, link: usize, front: f64, rear: f64, has_cab: bool) {
        let size = self.size;
        let (length, middle) = (front - rear, 0.5 * (front + rear));
        let has_upper = self.prior.has_superstructure;
        let rise = size.height - size.clearance;
        let deck = size.clearance + if has_upper { 0.25 } else { 0.4 } * rise;
        let slew_height = self.sheet.slew.as_ref().map(|slew| slew.height.si);
        let is_small = self.prior.mass[0] <= 100.0;
        let deck = if is_small { size.height } else { deck };
        let deck = match slew_height.filter(|_| has_upper) {
            Some(height) => height.max(size.clearance + 0.05),
            None => deck,
        };
        let narrow = 0.6 * size.width;
        let thickness = deck - size.clearance;
        let at = [middle, 0.0, size.clearance + thickness / 2.0];
        self.draw(link, Solid::Box([length, narrow, thickness]), at, YELLOW);
        if has_cab && !has_upper && !is_small {
            // the boom of a telehandler is beside the cab
            let (wide, side) = match self.sheet.template {
                Template::Telehandler => (0.34, 0.3),
                _ => (0.55, 0.0),
            };
            let cab = [
                0.34 * length,
                wide * size.width,
                (size.height - deck).max(0.1),
            ];
            let x = match self.prior.cab_is_rear {
                true => front - cab[0] / 2.0,
                false => middle,
            };
            let at = [x, side * size.width, deck + cab[2] / 2.0];
            self.draw(link, Solid::Box(cab), at, GLASS);
        }
        let extent = [0.8 * length, 0.6 * size.width, 0.5 * rise];
        self.machine.links[link].extent = extent;
        let height = match has_upper {
            true => 0.55 * deck,
            false => self.prior.com_height * size.height,
        };
        self.machine.unknown.push((link, [middle, 0.0, height]));
    }

    /// The slew and the superstructure. Returns the link that carries the arm, and the axis from which the reach
    /// counts.
    fn slew(&mut self) -> (usize, f64) {
        let Some(slew) = self.sheet.slew.clone() else {
            let x = self.size.front + self.sheet.arm.ahead.si;
            let frame = match self.prior.is_articulated && self.prior.arm_is_front {
                true => self.frame_at(self.size.front),
                false => self.frame_at(x),
            };
            return (frame, self.size.front);
        };
        let x = self.size.front - slew.behind.si;
        let frame = self.frame_at(x);
        let at = [x, 0.0, slew.height.si];
        let kind = if slew.range.is_some() {
            JointKind::Revolute
        } else {
            JointKind::Continuous
        };
        let mut joint = self.joint("slew", kind, frame, at, [0.0, 0.0, 1.0], Role::Arm);
        joint.limits = slew.range.map(|range| range.map(|angle| angle.si));
        joint.at = self.assumed.or(
            slew.at.map(|a| a.si),
            0.0,
            |_| "the arm points forward in the posture of the sheet".into(),
            "the sheet does not say where it points",
        );
        self.machine.slew_x = Some(x);
        self.machine.arm_root = "superstructure".into();
        let Some(upper) = self.sheet.superstructure.clone() else {
            self.machine.arm_root = "slew_column".into();
            let link = self.add("slew_column", Some(joint), at);
            let top = (self.sheet.arm.height.si - slew.height.si).max(0.05);
            let side = (0.06 * self.size.length).max(0.05);
            let middle = [x, 0.0, slew.height.si + top / 2.0];
            self.draw(link, Solid::Box([side, side, top]), middle, GREY);
            return (link, x);
        };
        let link = self.add("superstructure", Some(joint), at);
        let width = upper.width.map_or(0.95 * self.size.width, |w| w.si);
        let (tail, rise) = (upper.tail.si, (self.size.height - slew.height.si).max(0.3));
        let front = 0.35 * tail;
        let house = Solid::Box([tail + front, width, 0.55 * rise]);
        let middle = [x + (front - tail) / 2.0, 0.0, slew.height.si + 0.275 * rise];
        self.draw(link, house, middle, YELLOW);
        let cab = Solid::Box([0.5 * tail, 0.35 * width, rise]);
        let at = [
            x + front + 0.1 * tail,
            0.3 * width,
            slew.height.si + rise / 2.0,
        ];
        self.draw(link, cab, at, GLASS);
        let weight = Solid::Box([0.25 * tail, width, 0.5 * rise]);
        let at = [x - 0.875 * tail, 0.0, slew.height.si + 0.25 * rise];
        self.draw(link, weight, at, DARK);
        self.machine.links[link].extent = [1.2 * tail, 0.8 * width, 0.6 * rise];
        let behind = upper.centre_of_mass_behind.map(|b| b.si);
        let behind = self.assumed.or(
            behind,
            0.45 * tail,
            |v| format!("the superstructure's centre of mass lies {v:.2} m behind the slew's axis"),
            "counterweight and engine fill the rear; the axle loads correct it where the carrier is symmetrical",
        );
        let height = slew.height.si + 0.3 * rise;
        self.machine.unknown.push((link, [x - behind, 0.0, height]));
        (link, x)
    }

    /// Pads of outriggers, set and fully extended, as frames of their own without mass.
    fn outriggers(&mut self) {
        let pairs = self.sheet.outriggers.clone();
        let count = pairs.len();
        for (index, pair) in pairs.into_iter().enumerate() {
            let x = self.size.front - pair.behind.si;
            let frame = self.frame_at(x);
            let end = match (index, count) {
                (0, _) => "f".to_owned(),
                (i, n) if i + 1 == n => "r".to_owned(),
                (i, _) => format!("m{i}"),
            };
            let sets = match pair.set {
                None => [None, None],
                Some(OutriggersSet::Always(on)) => {
                    [Some(PadSet::Always(on)), Some(PadSet::Always(on))]
                }
                Some(OutriggersSet::Signals { left, right }) => {
                    [left, right].map(|switch| Some(PadSet::While(switch)))
                }
            };
            for ((side, sign), set) in [("l", 1.0), ("r", -1.0)].into_iter().zip(sets) {
                let name = format!("outrigger_{end}{side}");
                let y = sign * pair.base.si / 2.0;
                let link = self.fixed(&name, frame, [x, y, 0.0]);
                let pad = pair.pad.map_or(0.4, |p| p.si);
                self.draw(link, Solid::Box([pad, pad, 0.04]), [x, y, 0.02], GREY);
                let height = self.size.clearance.max(0.3);
                let leg = Solid::Box([0.12, 0.12, height]);
                self.draw(link, leg, [x, y, height / 2.0], GREY);
                let inner = sign * 0.3 * self.size.width;
                let beam = Solid::Box([0.16, (y - inner).abs().max(0.05), 0.16]);
                self.draw(link, beam, [x, 0.5 * (y + inner), height], GREY);
                self.machine
                    .outriggers
                    .push(Outrigger { link: name, x, set });
            }
        }
        if count > 0 {
            self.assumed.add(
                "the outriggers' mass belongs to the carrier",
                "their extension moves the centre of mass of the whole machine little, and sideways by nothing when both sides are out",
            );
        }
    }
}
