//! Control settings of an active suspension, as the machine file states them.

use std::collections::BTreeMap;

use serde::Deserialize;

table! {
    /// `[suspension.control]`: optimal control (30)-(31) of the second paper.
    pub struct SuspensionControl {
        /// The optimisation problem.
        mode: ControlMode = ControlMode::default();
        /// Command rate (Hz); the time step of (31e)-(31f) is its inverse.
        rate: f64 = 50.0, positive;
        /// Planning horizon of a move in `look-ahead` mode (s).
        look_ahead: f64 = 1.0, positive;
        /// Whether the actuators move independently; otherwise all move alike.
        independent: bool = false;
        /// Lower bound on the stability angles of the whole machine (rad).
        min_stability_angle: f64 = 0.1, acute;
        /// Fraction of the acceleration that remains for motion towards a stop, 0 to 1: rho of the limits.
        acceleration_at_stop: f64 = 0.2, share;
        /// Factor on the smallest approach zone of the stops that is proven sufficient, at least 1.
        approach_margin: f64 = 1.15, one_or_more;
        /// Weights of the cost function.
        weights: ControlWeights = ControlWeights::default();
    }
}

/// The optimisation problem of the controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControlMode {
    /// The loads at rest at the end of a planned move.
    #[default]
    LookAhead,
    /// The problem of the paper: the loads after the next time step, including its inertia forces.
    #[serde(rename = "literal")]
    OneStep,
}

table! {
    /// `[suspension.control.weights]`: the cost is the sum of weight (N_i - N_j)^2 over pairs of wheels, loads in
    /// kN, and of weight / stability angle over edges, angles in rad.
    pub struct ControlWeights {
        /// Pairs of wheels in line on one side (1/kN^2).
        front_rear: f64 = 1.0, not_negative;
        /// Pairs of wheels on opposite sides of an axle (1/kN^2).
        lateral: f64 = 1e-3, not_negative;
        /// All other pairs (1/kN^2).
        diagonal: f64 = 1.0, not_negative;
        /// Pairs with an individual weight.
        pairs: Vec<PairWeight> = Vec::new();
        /// Edges closer to transverse than to longitudinal (rad).
        front_and_rear_edges: f64 = 100.0, not_negative;
        /// The other edges (rad).
        side_edges: f64 = 10.0, not_negative;
        /// Edges with an individual weight, by name (rad).
        edges: BTreeMap<String, f64> = BTreeMap::new();
    }
}

/// The weight of one pair of wheels.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairWeight {
    /// Names of the wheels.
    pub wheels: [String; 2],
    /// (1/kN^2)
    pub weight: f64,
}
