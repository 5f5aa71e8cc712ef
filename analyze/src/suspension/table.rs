//! The columns of `whatif.parquet`.

use tipwatch_suspension::Status;
use tipwatch_suspension::replay::Track;

use super::what_if::WhatIf;
use crate::base::options::Precision;
use crate::tables::table::Table;

/// One table row per row of the log: `fixed_` with the rods locked, `moved_` with the requested motion.
#[must_use]
pub fn table(what_if: &WhatIf) -> Table {
    let mut columns = Columns::default();
    let rows = &what_if.analysis.rows;
    columns
        .0
        .add("time_ns", Some("ns"), rows.times_ns.iter().copied());
    columns.track(what_if, "fixed", &what_if.comparison.fixed);
    columns.track(what_if, "moved", &what_if.comparison.moved);
    columns.actuators(what_if);
    let status = (what_if.comparison.moved.status.iter()).map(|status| status.map(Status::name));
    columns.0.add("status", Some(""), status);
    columns.0
}

#[derive(Default)]
struct Columns(Table);

impl Columns {
    fn add(&mut self, name: String, unit: &'static str, values: &[f64]) {
        self.0.add_known(name, unit, Precision::Double, values);
    }

    fn track(&mut self, what_if: &WhatIf, of: &str, track: &Track) {
        let wheels = what_if.analysis.machine.wheels();
        for (wheel, load) in wheels.iter().zip(&track.load) {
            let name = wheel.name.to_lowercase();
            self.add(format!("{of}_load_{name}"), "N", load);
        }
        for (wheel, otf) in wheels.iter().zip(&track.otf) {
            let name = wheel.name.to_lowercase();
            self.add(format!("{of}_otf_{name}"), "N", otf);
        }
        self.add(format!("{of}_spread"), "N", &track.spread);
        let [forward, left] = &track.com;
        self.add(format!("{of}_com_forward"), "m", forward);
        self.add(format!("{of}_com_left"), "m", left);
        let angle = &track.stability_angle;
        self.add(format!("{of}_stability_angle_least"), "rad", angle);
        for (name, rod) in rod_names(what_if).iter().zip(&track.rods) {
            self.add(format!("{of}_position_{name}"), "m", &rod.position);
            self.add(format!("{of}_velocity_{name}"), "m/s", &rod.velocity);
            let acceleration = &rod.acceleration;
            self.add(format!("{of}_acceleration_{name}"), "m/s^2", acceleration);
            let needed = &rod.force_needed;
            self.add(format!("{of}_force_needed_{name}"), "N", needed);
        }
    }

    /// Command, valve and cylinder, if the suspension is controlled.
    fn actuators(&mut self, what_if: &WhatIf) {
        if !what_if.comparison.moved.is_controlled() {
            return;
        }
        for (name, rod) in rod_names(what_if)
            .iter()
            .zip(&what_if.comparison.moved.rods)
        {
            self.add(format!("reference_{name}"), "m", &rod.reference);
            let rate = &rod.reference_velocity;
            self.add(format!("reference_velocity_{name}"), "m/s", rate);
            let acceleration = &rod.commanded_acceleration;
            self.add(
                format!("commanded_acceleration_{name}"),
                "m/s^2",
                acceleration,
            );
            for (end, index) in [("least", 0), ("greatest", 1)] {
                let (velocity, acceleration) =
                    (&rod.velocity_limits[index], &rod.acceleration_limits[index]);
                self.add(format!("{end}_velocity_{name}"), "m/s", velocity);
                self.add(format!("{end}_acceleration_{name}"), "m/s^2", acceleration);
            }
            let error = rod.tracking_error();
            self.add(format!("tracking_error_{name}"), "m", &error);
            self.add(format!("valve_{name}"), "-", &rod.opening);
            let piston = &rod.piston_pressure;
            self.add(format!("piston_pressure_{name}"), "Pa", piston);
            let pressure = &rod.rod_pressure;
            self.add(format!("rod_pressure_{name}"), "Pa", pressure);
            self.add(format!("force_{name}"), "N", &rod.force);
        }
    }
}

/// Names of the suspension's linkages, by actuator.
pub(crate) fn rod_names(what_if: &WhatIf) -> Vec<String> {
    let linkages = what_if.analysis.machine.linkages();
    (what_if.comparison.suspension.linkages.iter())
        .map(|&linkage| linkages[linkage].name.to_lowercase())
        .collect()
}
