//! Parameters of cylinder, oil and valve: as stated in the machine file, and derived.

use std::f64::consts::PI;

table! {
    /// `[suspension.hydraulics]`: common to all actuators of the suspension. By default, cylinder and dead volumes
    /// are those published for the lift cylinder of the first paper's arm, the valve is that of the second paper.
    #[derive(Copy)]
    pub struct HydraulicsSpec {
        /// Diameter of the piston (m).
        bore: f64 = 0.080, positive;
        /// Diameter of the rod (m).
        rod: f64 = 0.045, positive;
        /// Oil volume in hoses and cylinder on the piston side with the rod fully retracted (m^3).
        dead_volume_piston: f64 = 3e-3, positive;
        /// Oil volume on the rod side with the rod fully extended (m^3).
        dead_volume_rod: f64 = 3e-3, positive;
        /// Bulk modulus of the oil (Pa).
        bulk_modulus: f64 = 1e9, positive;
        /// Supply pressure (Pa).
        supply_pressure: f64 = 21e6, positive;
        /// Tank pressure (Pa).
        tank_pressure: f64 = 0.0;
        /// Pressure at which a chamber's relief valve opens (Pa); default 1.2 times the supply pressure.
        relief_pressure: Option<f64> = None;
        /// Flow of the fully open valve at the nominal pressure drop of an edge (m^3/s).
        valve_flow: f64 = 40e-3 / 60.0, positive;
        /// Nominal pressure drop (Pa).
        valve_pressure_drop: f64 = 3.5e6, positive;
        /// Relative flow coefficients of the edges, in the order supply to piston, piston to tank, supply to rod, rod
        /// to tank: c_p1, c_n1, c_p2, c_n2.
        edges: [f64; 4] = [1.0; 4], positive;
        /// Gain k_p of the valve law (1/m).
        gain: f64 = 10.0, positive;
        /// Slew rate of the valve: full openings per second (1/s).
        valve_rate: f64 = 20.0, positive;
        /// Viscous friction of the seals (N s/m).
        friction: f64 = 2e4, not_negative;
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
    /// Returns the first parameter that another one makes invalid: its key, the expected value, the found value.
    pub(crate) fn fault(&self) -> Option<(&'static str, &'static str, String)> {
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
