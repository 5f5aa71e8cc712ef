//! Parameters of cylinder, oil and valve: as stated in the machine file, and derived.

use std::f64::consts::PI;

use serde::Deserialize;

/// `[suspension.hydraulics]`: common to all actuators of the suspension. By default, cylinder and dead volumes
/// are those published for the lift cylinder of the first paper's arm, the valve is that of the second paper.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HydraulicsSpec {
    /// Diameter of the piston (m).
    pub bore: f64,
    /// Diameter of the rod (m).
    pub rod: f64,
    /// Oil volume in hoses and cylinder on the piston side with the rod fully retracted (m^3).
    pub dead_volume_piston: f64,
    /// Oil volume on the rod side with the rod fully extended (m^3).
    pub dead_volume_rod: f64,
    /// Bulk modulus of the oil (Pa).
    pub bulk_modulus: f64,
    /// Supply pressure (Pa).
    pub supply_pressure: f64,
    /// Tank pressure (Pa).
    pub tank_pressure: f64,
    /// Pressure at which a chamber's relief valve opens (Pa); default 1.2 times the supply pressure.
    pub relief_pressure: Option<f64>,
    /// Flow of the fully open valve at the nominal pressure drop of an edge (m^3/s).
    pub valve_flow: f64,
    /// Nominal pressure drop (Pa).
    pub valve_pressure_drop: f64,
    /// Relative flow coefficients of the edges, in the order supply to piston, piston to tank, supply to rod, rod
    /// to tank: c_p1, c_n1, c_p2, c_n2.
    pub edges: [f64; 4],
    /// Gain k_p of the valve law (1/m).
    pub gain: f64,
    /// Slew rate of the valve: full openings per second (1/s).
    pub valve_rate: f64,
    /// Viscous friction of the seals (N s/m).
    pub friction: f64,
}

impl Default for HydraulicsSpec {
    fn default() -> Self {
        Self {
            bore: 0.080,
            rod: 0.045,
            dead_volume_piston: 3e-3,
            dead_volume_rod: 3e-3,
            bulk_modulus: 1e9,
            supply_pressure: 21e6,
            tank_pressure: 0.0,
            relief_pressure: None,
            valve_flow: 40e-3 / 60.0,
            valve_pressure_drop: 3.5e6,
            edges: [1.0; 4],
            gain: 10.0,
            valve_rate: 20.0,
            friction: 2e4,
        }
    }
}

/// Cylinder, oil and valve of one actuator, as used in the equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HydraulicParameters {
    /// A_a, area of the piston (m^2).
    pub piston_area: f64,
    /// A_b, area of the annulus around the rod (m^2).
    pub ring_area: f64,
    /// V_a, V_b: dead volumes (m^3).
    pub dead_volumes: [f64; 2],
    /// s, stroke (m).
    pub stroke: f64,
    /// beta (Pa).
    pub bulk_modulus: f64,
    /// p_s (Pa).
    pub supply: f64,
    /// p_r (Pa).
    pub tank: f64,
    /// Pressure at which relief valves open (Pa).
    pub relief: f64,
    /// c_p1, c_n1, c_p2, c_n2: Q_N / sqrt(dp_N) of each edge (m^3/s per root Pa).
    pub coefficients: [f64; 4],
    /// k_p (1/m).
    pub gain: f64,
    /// Slew rate of the valve: full openings per second (1/s).
    pub valve_rate: f64,
    /// d (N s/m).
    pub friction: f64,
}

impl HydraulicsSpec {
    /// The first invalid parameter: its key, what was expected, what was found.
    pub(crate) fn fault(&self) -> Option<(&'static str, &'static str, String)> {
        let positive = [
            ("bore", self.bore),
            ("rod", self.rod),
            ("dead_volume_piston", self.dead_volume_piston),
            ("dead_volume_rod", self.dead_volume_rod),
            ("bulk_modulus", self.bulk_modulus),
            ("supply_pressure", self.supply_pressure),
            ("valve_flow", self.valve_flow),
            ("valve_pressure_drop", self.valve_pressure_drop),
            ("gain", self.gain),
            ("valve_rate", self.valve_rate),
        ];
        let edges = self.edges.map(|edge| ("edges", edge));
        for (key, value) in positive.into_iter().chain(edges) {
            if !(value.is_finite() && value > 0.0) {
                return Some((key, "a positive number", value.to_string()));
            }
        }
        if !(self.friction.is_finite() && self.friction >= 0.0) {
            let found = self.friction.to_string();
            return Some(("friction", "a number that is not negative", found));
        }
        if self.rod >= self.bore {
            return Some(("rod", "a diameter below the bore", self.rod.to_string()));
        }
        if !(self.tank_pressure >= 0.0 && self.tank_pressure < self.supply_pressure) {
            let found = self.tank_pressure.to_string();
            return Some((
                "tank_pressure",
                "0 or more and below the supply pressure",
                found,
            ));
        }
        let relief = self.relief_pressure.unwrap_or(f64::INFINITY);
        if relief.is_nan() || relief < self.supply_pressure {
            return Some((
                "relief_pressure",
                "the supply pressure or more",
                relief.to_string(),
            ));
        }
        None
    }

    /// Parameters for a cylinder with this stroke (m).
    #[must_use]
    pub fn parameters(&self, stroke: f64) -> HydraulicParameters {
        let area = |diameter: f64| PI / 4.0 * diameter * diameter;
        let nominal = self.valve_flow / self.valve_pressure_drop.sqrt();
        HydraulicParameters {
            piston_area: area(self.bore),
            ring_area: area(self.bore) - area(self.rod),
            dead_volumes: [self.dead_volume_piston, self.dead_volume_rod],
            stroke,
            bulk_modulus: self.bulk_modulus,
            supply: self.supply_pressure,
            tank: self.tank_pressure,
            relief: self.relief_pressure.unwrap_or(1.2 * self.supply_pressure),
            coefficients: self.edges.map(|edge| edge * nominal),
            gain: self.gain,
            valve_rate: self.valve_rate,
            friction: self.friction,
        }
    }
}
