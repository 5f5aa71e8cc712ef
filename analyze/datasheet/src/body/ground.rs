//! Supports of a machine: wheels, bogies, pendulum axles, tracks.

use super::build::{Build, DARK, GREY};
use super::machine::{AxleGroup, JointKind, Role, Solid, Wheel};
use crate::error::SheetError;
use crate::prior::{BEAM_SHARE, WHEEL_DENSITY};
use crate::sheet::Axle;

const LEFT: [f64; 3] = [0.0, 1.0, 0.0];

impl Build<'_> {
    pub(super) fn ground(&mut self) -> Result<(), SheetError> {
        if self.sheet.tracks.is_some() {
            self.tracks();
            return Ok(());
        }
        self.axle_groups();
        for index in 0..self.sheet.axles.len() {
            self.axle(index);
        }
        Ok(())
    }

    /// Places and loads; without stated loads a prior.
    fn axle_groups(&mut self) {
        let count = self.sheet.axles.len();
        let is_stated = self.sheet.axles.iter().all(|axle| axle.load.is_some());
        let mass = self.sheet.mass.si;
        let first = self.prior.first_axle;
        let prior = |index: usize| match (count, index) {
            (2, 0) => first * mass,
            (2, _) => (1.0 - first) * mass,
            _ => mass / count as f64,
        };
        let follows_superstructure = self.prior.balance == crate::prior::Balance::Superstructure;
        if !is_stated && !follows_superstructure {
            let shares = (0..count).map(|i| format!("{:.0} kg", prior(i)));
            let shares = shares.collect::<Vec<_>>().join(", ");
            self.assumed.add(
                format!("axle loads of {shares}"),
                "the sheet states none; the place of the centre of mass follows from them: weigh the axles",
            );
        }
        let places = self.sheet.axle_positions();
        for (index, axle) in self.sheet.axles.iter().enumerate() {
            let load = match axle.load {
                Some(load) => Some(load.si),
                None => (!follows_superstructure).then(|| prior(index)),
            };
            self.machine.axles.push(AxleGroup {
                x: self.size.front + places[index],
                load,
                is_stated,
            });
        }
    }

    fn axle(&mut self, index: usize) {
        let axle = self.sheet.axles[index].clone();
        let radius = self.sheet.tyre_radius(&axle);
        let x = self.machine.axles[index].x;
        let mut carrier = self.frame_at(x);
        let load = self.machine.axles[index].load;
        let load = load.unwrap_or(self.sheet.mass.si / self.sheet.axles.len() as f64);
        let at = [x, 0.0, radius];
        let width = axle
            .tyre_width
            .map(|w| w.si)
            .or(axle.tyre().map(|t| t.width));
        let width = width.unwrap_or(0.45 * radius);
        if let Some(pendulum) = axle.pendulum {
            let name = format!("axle_{}", index + 1);
            let mut joint = self.joint(
                &name,
                JointKind::Revolute,
                carrier,
                at,
                [1.0, 0.0, 0.0],
                Role::Passive,
            );
            joint.limits = Some([-pendulum.si, pendulum.si]);
            carrier = self.add(&name, Some(joint), at);
            let track = axle.track.map_or(1.0, |t| t.si);
            let beam = [0.35 * radius, 0.8 * track, 0.35 * radius];
            self.draw(carrier, Solid::Box(beam), at, DARK);
            self.beam(
                carrier,
                BEAM_SHARE * load,
                beam,
                &format!("pendulum axle {}", index + 1),
            );
            self.machine.free_joints.push(name);
        }
        let Some(track) = axle.track.map(|t| t.si) else {
            self.wheel(index, &axle, carrier, "C", [x, 0.0, radius], radius, width);
            return;
        };
        for (side, sign) in [("L", 1.0), ("R", -1.0)] {
            let y = sign * track / 2.0;
            let Some(spacing) = axle.bogie.map(|b| b.si) else {
                self.wheel(index, &axle, carrier, side, [x, y, radius], radius, width);
                continue;
            };
            let name = format!("bogie_{}{}", side.to_lowercase(), index + 1);
            let at = [x, y, radius];
            let mut joint =
                self.joint(&name, JointKind::Revolute, carrier, at, LEFT, Role::Passive);
            joint.limits = Some([-0.5, 0.5]);
            let bogie = self.add(&name, Some(joint), at);
            let beam = [0.8 * spacing, 0.5 * width, 0.4 * radius];
            self.draw(bogie, Solid::Box(beam), at, DARK);
            self.beam(
                bogie,
                BEAM_SHARE * load / 2.0,
                beam,
                &format!("each bogie of axle {}", index + 1),
            );
            self.machine.free_joints.push(name);
            for along in [spacing / 2.0, -spacing / 2.0] {
                self.wheel(
                    index,
                    &axle,
                    bogie,
                    side,
                    [x + along, y, radius],
                    radius,
                    width,
                );
            }
        }
    }

    fn beam(&mut self, link: usize, mass: f64, extent: [f64; 3], what: &str) {
        self.assumed.add(
            format!("mass of {what} {mass:.0} kg"),
            "beams of this kind have some 6 % of the load that they carry",
        );
        let described = &mut self.machine.links[link];
        (described.mass, described.extent) = (mass, extent);
        self.known_within(link, 0.5, 0.05);
    }

    #[allow(clippy::too_many_arguments, reason = "one wheel, told once")]
    fn wheel(
        &mut self,
        index: usize,
        axle: &Axle,
        carrier: usize,
        side: &str,
        at: [f64; 3],
        radius: f64,
        width: f64,
    ) {
        let name = self.wheel_name(index, side);
        let lower = name.to_lowercase();
        let mut carrier = carrier;
        if let Some(steering) = axle.steering {
            let name = format!("steer_{lower}");
            let upright = [0.0, 0.0, 1.0];
            let mut joint = self.joint(
                &name,
                JointKind::Revolute,
                carrier,
                at,
                upright,
                Role::Steering,
            );
            joint.limits = Some([-steering.si, steering.si]);
            carrier = self.add(&format!("{name}_link"), Some(joint), at);
        }
        let link_name = format!("wheel_{lower}");
        let joint = self.joint(
            &link_name,
            JointKind::Continuous,
            carrier,
            at,
            LEFT,
            Role::Wheel,
        );
        let link = self.add(&link_name, Some(joint), at);
        let solid = Solid::CylinderY {
            radius,
            length: width,
        };
        self.draw(link, solid, at, DARK);
        let hub = Solid::CylinderY {
            radius: 0.5 * radius,
            length: 1.04 * width,
        };
        self.draw(link, hub, at, GREY);
        // m = rho r^2 w
        let mass = self.assumed.or(
            axle.wheel_mass.map(|m| m.si),
            WHEEL_DENSITY * radius * radius * width,
            |v| format!("mass of a wheel of axle {} {v:.0} kg", index + 1),
            "wheels with tyre and rim have about this mass for their size, within a third",
        );
        let described = &mut self.machine.links[link];
        described.mass = mass;
        described.extent = [2.0 * radius, width, 2.0 * radius];
        let is_stated = axle.wheel_mass.is_some();
        self.known_within(link, if is_stated { 0.05 } else { 1.0 / 3.0 }, 0.01);
        let is_guess = axle.tyre_radius.is_none();
        let band = axle.tyre().map_or(0.0, |tyre| tyre.band);
        if is_guess {
            let tyre = axle.tyre.as_deref().unwrap_or_default();
            self.assumed.add(
                format!("radius of the tyres {tyre} {radius:.3} m"),
                format!(
                    "it follows from the designation, within {:.0} %",
                    100.0 * band
                ),
            );
        }
        self.machine.wheels.push(Wheel {
            name,
            link,
            place: [0.0; 3],
            radius,
            stiffness: 0.0,
            axle: index,
            guess_band: is_guess.then_some(band),
        });
    }

    /// FL, FR, RL, RR for two axles; else side and number, front first.
    fn wheel_name(&self, axle: usize, side: &str) -> String {
        let axles = &self.sheet.axles;
        if axles.len() == 2 && axles.iter().all(|a| a.bogie.is_none()) {
            let end = if axle == 0 { "F" } else { "R" };
            return match side {
                "C" => format!("{end}C"),
                side => format!("{end}{side}"),
            };
        }
        let same = |wheel: &&Wheel| wheel.name.starts_with(side);
        let before = self.machine.wheels.iter().filter(same).count();
        format!("{side}{}", before + 1)
    }

    /// Tracks: supports along their length on the ground, both ends included.
    fn tracks(&mut self) {
        let Some(tracks) = self.sheet.tracks.clone() else {
            return;
        };
        let radius = tracks.height.si / 2.0;
        let points = self.track_points();
        for (side, sign) in [("left", 1.0), ("right", -1.0)] {
            let y = sign * tracks.gauge.si / 2.0;
            let name = format!("track_{side}");
            let track = self.fixed(&name, 0, [0.0, y, radius]);
            let belt = Solid::Box([tracks.length.si, tracks.shoe.si, tracks.height.si]);
            self.draw(track, belt, [0.0, y, radius], DARK);
            for (end, sign) in [("front", 1.0), ("rear", -1.0)] {
                let at = [sign * tracks.length.si / 2.0, y, radius];
                let drum = self.fixed(&format!("{name}_{end}"), track, at);
                let solid = Solid::CylinderY {
                    radius,
                    length: tracks.shoe.si,
                };
                self.draw(drum, solid, at, DARK);
            }
            for point in 0..points {
                let share = f64::from(point) / f64::from(points - 1) - 0.5;
                self.machine.wheels.push(Wheel {
                    name: format!("{}_{}", side.to_uppercase(), point + 1),
                    link: track,
                    place: [share * tracks.length.si, 0.0, -radius],
                    radius: 0.0,
                    stiffness: 0.0,
                    axle: 0,
                    guess_band: None,
                });
            }
        }
        self.assumed.add(
            format!("each track bears on {points} points along its length on the ground, from end to end, which are springs alike"),
            "the ground below a track bears anywhere: the sum of its points and the polygon of support are certain, the load of a \
             point is that of even ground",
        );
        self.assumed.add(
            "the tracks' mass belongs to the carrier",
            "the sheet states only the mass of the whole machine",
        );
    }

    /// Points of each track: a machine has at most twelve supports, its outriggers included.
    fn track_points(&self) -> u8 {
        match self.sheet.outriggers.len() {
            0..=2 => 4,
            3 => 3,
            _ => 2,
        }
    }
}
