//! Axles, tracks, and the loads on them.

use crate::error::SheetError;
use crate::prior::{ROUNDING, Template};
use crate::sheet::spec::{Axle, Sheet};

/// Mass of a wheel as a share of the operating mass, at least.
const LEAST_WHEEL_SHARE: f64 = 2e-4;

impl Sheet {
    pub(super) fn check_ground(&self) -> Result<(), SheetError> {
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
                    "a designation such as \"20.5R25\", \"710/45-26.5\", \"7.00-12\", \"16.9-24\", \"18x7-8\" or \"200x50\", or \
                     tyre_radius and tyre_width",
                    format!("\"{name}\""),
                ),
                None => ("tyre or tyre_radius", "neither".into()),
            };
            return Err(self.wrong(place("tyre"), expected, found, ""));
        };
        self.check_radius(index, axle, r, radius)?;
        self.check_radius_in_machine(index, axle, r)?;
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
            // of twin tyres at most
            self.length_in(&place("tyre_width"), width.si, [0.01, 3.0_f64.min(4.0 * r)])?;
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
                if key == "wheel_mass" {
                    self.part_in(&place(key), mass.si, LEAST_WHEEL_SHARE)?;
                    continue;
                }
                let least = f64::MIN_POSITIVE;
                self.mass_in(&place(key), mass.si, [least, 3.0 * self.mass.si])?;
            }
        }
        Ok(())
    }

    /// The radius is one that this kind of machine has.
    fn check_radius(
        &self,
        index: usize,
        axle: &Axle,
        r: f64,
        range: [f64; 2],
    ) -> Result<(), SheetError> {
        let [least, most] = range;
        match (axle.tyre_radius, &axle.tyre) {
            (None, Some(name)) if !(least..=most).contains(&r) => Err(self.wrong(
                format!("axles[{index}].tyre"),
                format!("a radius of {least} to {most} m for a {}", self.template),
                format!("\"{name}\", whose radius is {r:.3} m"),
                "Check the designation, and the kind of the machine (template)",
            )),
            _ => self.length_in(&format!("axles[{index}].tyre_radius"), r, range),
        }
    }

    /// The wheels of the unladen machine share its mass, but for castors of robots: an axle with bogies does not carry less
    /// than one with two wheels.
    fn check_wheel_loads(&self) -> Result<(), SheetError> {
        /// The most loaded wheel by the least loaded one, at most.
        const SHARED: f64 = 3.0;
        if self.template == Template::MobileManipulator {
            return Ok(());
        }
        // a single wheel in the middle is often a pair of twins
        let of_wheel = |axle: &Axle| axle.load.map(|load| load.si / axle.wheels().max(2) as f64);
        let loads: Vec<(usize, f64)> = (self.axles.iter().enumerate())
            .filter_map(|(index, axle)| Some((index + 1, of_wheel(axle)?)))
            .collect();
        let least = loads.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let most = loads.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let (Some(least), Some(most)) = (least, most) else {
            return Ok(());
        };
        if most.1 <= SHARED * least.1 {
            return Ok(());
        }
        Err(self.wrong(
            "axles.load",
            format!("loads of wheels that differ by a factor of {SHARED} at most"),
            format!(
                "{:.0} kg on a wheel of axle {} and {:.0} kg on one of axle {}",
                least.1, least.0, most.1, most.0
            ),
            "Check that the loads of the axles are not exchanged, and that each is that of the whole axle",
        ))
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
            return self.check_wheel_loads();
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
}
