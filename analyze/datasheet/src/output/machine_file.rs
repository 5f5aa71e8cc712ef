//! The machine file.

use std::fmt::Write;

use super::supports;
use super::text::{comment, float, quoted, triple};
use crate::body::{Joint, Machine, Role, Wheel};
use crate::prior::SHEET_MASS_SIGMA;

/// Values that a log of the machine and the user add to a machine file.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FromLog<'a> {
    /// The section `[signals]`.
    pub signals: &'a str,
    /// Keys of guesses in the section that nobody has confirmed.
    pub unconfirmed: &'a [String],
    /// Position of the IMU in the base link (m), where it was stated.
    pub imu_xyz: Option<[f64; 3]>,
    /// Roll, pitch and yaw of the IMU in the base link (rad), where they were stated.
    pub imu_rpy: Option<[f64; 3]>,
    /// Mass of the load on the tool during the log (kg), where it was stated.
    pub payload: Option<f64>,
}

impl Machine {
    /// Returns the machine file beside a URDF of this name, with the values that a log of the machine adds; without a log the
    /// signals are left open.
    #[must_use]
    pub fn machine_file(&self, urdf: &str, log: Option<FromLog<'_>>) -> String {
        let signals = log.map(|log| log.signals);
        let log = log.unwrap_or_default();
        let mut out = String::new();
        comment(
            &mut out,
            "Machine file from a data sheet, written by `tipwatch machine new`. Lines that begin with \"assumed\" are not \
             from the sheet: replace them by what you know. Check the result with `tipwatch check-machine`. Keys and units: \
             book/src/reference/machine-file.md.",
        );
        for source in &self.sources {
            comment(&mut out, &format!("source: {source}"));
        }
        let _ = writeln!(
            out,
            "name = {}\nurdf = {}",
            quoted(&self.name),
            quoted(urdf)
        );
        write_doubts(&mut out, &log);
        out.push('\n');
        for note in &self.notes {
            comment(&mut out, note);
        }
        for assumption in &self.assumptions {
            comment(&mut out, &assumption.to_string());
        }
        match self.has_tracks {
            true => supports::write_tracks(&mut out, self),
            false => self.write_wheels(&mut out),
        }
        supports::write(&mut out, self);
        self.write_imu(&mut out, &log);
        let _ = writeln!(out, "\n[arm]\nroot = {}", quoted(&self.arm_root));
        if let Some(tool) = &self.tool {
            let _ = writeln!(out, "tool = {}", quoted(tool));
        }
        self.write_linkages(&mut out);
        self.write_contact(&mut out);
        self.write_limits(&mut out);
        self.write_payload(&mut out, log.payload);
        self.write_uncertainty(&mut out);
        self.write_links(&mut out);
        self.write_weighed(&mut out);
        self.write_signals(&mut out, signals);
        out
    }

    fn write_wheels(&self, out: &mut String) {
        for wheel in &self.wheels {
            let _ = writeln!(
                out,
                "\n[wheels.{}]\nlink = {}\nradius = {}",
                wheel.name,
                quoted(&self.links[wheel.link].name),
                float(wheel.radius)
            );
            if let Some(raised_by) = supports::raised_by_pads(self, Some(wheel)) {
                let _ = writeln!(out, "{raised_by}");
            }
        }
    }

    fn write_imu(&self, out: &mut String, log: &FromLog<'_>) {
        out.push('\n');
        if log.imu_xyz.is_some() || log.imu_rpy.is_some() {
            comment(out, "The mounting of the IMU, stated at the terminal.");
        }
        if log.imu_xyz.is_none() || log.imu_rpy.is_none() {
            comment(
                out,
                "assumed: the IMU is level, in the middle of the base at the height of the centre of mass, because a data \
                 sheet does not say where it is. Needed: link, position (m) and orientation (rad).",
            );
        }
        let height = self.centre_of_mass[2];
        let _ = writeln!(
            out,
            "[imu]\nlink = \"base_link\"\nxyz = {}\nrpy = {}",
            triple(log.imu_xyz.unwrap_or([0.0, 0.0, height])),
            triple(log.imu_rpy.unwrap_or_default())
        );
    }

    fn write_linkages(&self, out: &mut String) {
        for linkage in &self.linkages {
            let _ = writeln!(
                out,
                "\n[[linkage]]\nname = {}\npivot = {}\ncylinder = {}\nrod = {}\nrod_end = {{ link = {}, xyz = {} }}\n\
                 anchor = {{ link = {}, xyz = {} }}",
                quoted(&linkage.name),
                quoted(&linkage.pivot),
                quoted(&linkage.cylinder),
                quoted(&linkage.rod),
                quoted(&linkage.rod_link),
                triple(linkage.rod_end),
                quoted(&linkage.pivot_link),
                triple(linkage.anchor)
            );
            let _ = writeln!(
                out,
                "# [linkage.pressure]  # if the log has the pressures of its chambers (Pa)\n# piston = {{ topic = \"/topic\", field = \
                 \"field\" }}\n# rod = {{ topic = \"/topic\", field = \"field\" }}\n# piston_area = {}\n# rod_area = {}",
                float(linkage.piston_area),
                float(linkage.rod_area)
            );
        }
    }

    fn write_contact(&self, out: &mut String) {
        let free: Vec<String> = self.free_joints.iter().map(|joint| quoted(joint)).collect();
        let stiffness = self
            .wheels
            .iter()
            .map(|w| format!("{} = {}", w.name, float(w.stiffness.round())));
        let stiffness = stiffness.collect::<Vec<_>>().join(", ");
        out.push_str("\n[contact]\n");
        if !free.is_empty() {
            comment(
                out,
                "Bogies, pendulum axles and frame joints that carry no torque. Remove those that are locked:",
            );
            let _ = writeln!(out, "free_joints = [{}]", free.join(", "));
        }
        let _ = writeln!(out, "tyre_stiffness = {{ {stiffness} }}");
    }

    fn posture_text(&self) -> String {
        let posture = self.posture();
        let joints: Vec<String> = posture
            .iter()
            .map(|(joint, at)| format!("{joint} = {}", exact(*at)))
            .collect();
        format!("{{ {} }}", joints.join(", "))
    }

    fn write_limits(&self, out: &mut String) {
        out.push_str("\n[limits]\n");
        comment(
            out,
            "The posture of the sheet, in which the static loads are its axle loads (rad, m):",
        );
        let posture = self.posture_text();
        let posture = match posture.as_str() {
            // stated, though every joint is at zero
            "{  }" => format!("{{ {} = 0.0 }}", self.first_joint()),
            posture => posture.to_owned(),
        };
        let _ = writeln!(out, "reference_posture = {posture}");
    }

    fn first_joint(&self) -> String {
        let joints = self.links.iter().filter_map(|link| link.joint.as_ref());
        let mut arm = joints.filter(|joint| joint.role == Role::Arm);
        arm.next().map_or(String::new(), |joint| joint.name.clone())
    }

    fn write_payload(&self, out: &mut String, stated: Option<f64>) {
        if let Some((mass, tool)) = stated.zip(self.tool.as_ref()) {
            out.push('\n');
            comment(out, "The load on the tool, stated at the terminal:");
            let _ = writeln!(
                out,
                "[[payload]]\nlink = {}\nmass = {}",
                quoted(tool),
                exact(mass)
            );
            if let Some((_, centre)) = self.rated_load {
                let _ = writeln!(out, "com = {}", triple([centre, 0.0, 0.0]));
            }
            return;
        }
        let Some(((mass, centre), tool)) = self.rated_load.zip(self.tool.as_ref()) else {
            return;
        };
        out.push('\n');
        comment(
            out,
            "The rated load. Needed, when it is carried: its mass and place, or mass = \"estimate\" with a cylinder force:",
        );
        let _ = writeln!(
            out,
            "# [[payload]]\n# link = {}\n# mass = {}\n# com = {}",
            quoted(tool),
            float(mass),
            triple([centre, 0.0, 0.0])
        );
    }

    fn write_uncertainty(&self, out: &mut String) {
        out.push_str("\n[uncertainty]\n");
        comment(
            out,
            "assumed: half of every inertia, because boxes stand for the parts",
        );
        let _ = writeln!(out, "inertia_share = 0.5");
        comment(out, "assumed: tyres within a factor of two");
        let _ = writeln!(out, "tyre_stiffness_share = 0.5");
        // the middle of a track is above its points as an axle is above the ground
        let over_ground = |w: &Wheel| w.radius - w.place[2];
        let radius = self.wheels.iter().map(over_ground).fold(0.0, f64::max);
        let bands = self.wheels.iter().filter_map(|wheel| wheel.guess_band);
        let band = bands.fold(0.015, f64::max);
        comment(
            out,
            "assumed: radii and places of wheels and arm within the rounding of a sheet and the wear of tyres",
        );
        let _ = writeln!(
            out,
            "wheel_radius = {}\nwheel_position = 0.02\narm_position = 0.03\njoint_offset = 0.02\njoint_offset_linear = 0.02",
            float(band * radius)
        );
    }

    /// Writes the standard deviations of mass and centre of mass of each link.
    fn write_links(&self, out: &mut String) {
        out.push('\n');
        comment(
            out,
            "assumed: standard deviations of masses (kg) and centres of mass (m, along the axes of the link): 2 % of the whole \
             machine for the frame, a third of what no sheet states, the sides alike within a hundredth of the width, and the \
             height as stated above, because a sheet describes a series and a posture, not this machine",
        );
        for link in self.links.iter().filter(|link| link.mass > 0.0) {
            let _ = writeln!(
                out,
                "[links.{}]\nmass_sigma = {}\ncom_sigma = {}",
                link.name,
                float(link.mass_sigma),
                triple(link.com_sigma)
            );
        }
    }

    fn write_weighed(&self, out: &mut String) {
        out.push_str("\n# The axle loads of the sheet, which `tipwatch check-machine` compares with the model. Better: those of scales.\n");
        let posture = self.posture_text();
        let _ = writeln!(
            out,
            "[weighed]\nunit = \"kg\"\nsigma = {}",
            float(SHEET_MASS_SIGMA * self.mass)
        );
        if posture != "{  }" {
            let _ = writeln!(out, "posture = {posture}");
        }
        let wheels: Vec<String> = self.wheels.iter().map(|w| quoted(&w.name)).collect();
        let wheels = wheels.join(", ");
        if !self.outriggers.is_empty() {
            // axles are weighed on the road, whatever the machine stands on at work
            let _ = writeln!(out, "supports = [{wheels}]");
        }
        out.push_str("sums = [\n");
        for (index, axle) in self.axles.iter().enumerate() {
            let Some(load) = axle.load.filter(|_| axle.is_stated) else {
                continue;
            };
            let wheels = self.wheels.iter().filter(|w| w.axle == index);
            let wheels: Vec<String> = wheels.map(|w| quoted(&w.name)).collect();
            let _ = writeln!(
                out,
                "  {{ name = \"axle {}\", wheels = [{}], load = {}, sigma = {} }},",
                index + 1,
                wheels.join(", "),
                exact(load),
                float(SHEET_MASS_SIGMA * load)
            );
        }
        let _ = writeln!(
            out,
            "  {{ name = \"whole machine\", wheels = [{wheels}], load = {} }},\n]",
            exact(self.mass)
        );
    }

    fn write_signals(&self, out: &mut String, signals: Option<&str>) {
        let of_role = |role: Role| {
            let joints = self.links.iter().filter_map(|link| link.joint.as_ref());
            joints.filter(move |joint| joint.role == role)
        };
        let passive: Vec<&Joint> = of_role(Role::Passive)
            .chain(of_role(Role::Steering))
            .collect();
        match signals {
            Some(signals) => {
                out.push('\n');
                out.push_str(signals.trim());
                out.push('\n');
            }
            None => {
                out.push_str("\n[signals]\n");
                comment(
                    out,
                    "Topics are found by their type where the log has joint states with the names of the URDF, an IMU and \
                     odometry. Needed otherwise: each joint by a field of a message; `tipwatch inspect LOG` lists them, and \
                     `tipwatch machine new --log LOG` writes this section.",
                );
                for joint in of_role(Role::Articulation).chain(of_role(Role::Arm)) {
                    let _ = writeln!(
                        out,
                        "# [signals.joints.{}]\n# position = {{ topic = \"/topic\", field = \"field\", scale = 1.0, offset = 0.0 }}",
                        joint.name
                    );
                }
            }
        }
        if !passive.is_empty() {
            out.push('\n');
            comment(
                out,
                "assumed: joints at zero that machines rarely log, because bogies, pendulum axles and steered wheels stand so on level ground when driving straight; a log's joint states come first",
            );
        }
        for joint in passive {
            let _ = writeln!(out, "[signals.joints.{}]\nposition = 0.0", joint.name);
        }
    }
}

fn write_doubts(out: &mut String, log: &FromLog<'_>) {
    let is_imu_stated = log.imu_xyz.is_some() && log.imu_rpy.is_some();
    let imu = (!is_imu_stated).then(|| quoted("imu"));
    let guesses = log.unconfirmed.iter().map(|key| quoted(key));
    let doubts: Vec<String> = imu.into_iter().chain(guesses).collect();
    if doubts.is_empty() {
        return;
    }
    comment(
        out,
        "Guesses with a wide standard deviation. Check each value, then remove its name from this list:",
    );
    let _ = writeln!(out, "unconfirmed = [{}]", doubts.join(", "));
}

/// A number that is read back as it is.
fn exact(value: f64) -> String {
    let text = format!("{value}");
    match text.contains(['.', 'e']) {
        true => text,
        false => format!("{text}.0"),
    }
}
