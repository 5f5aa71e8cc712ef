//! Control settings of an active suspension, as the machine file states them.

use std::collections::BTreeMap;

use serde::Deserialize;

/// `[suspension.control]`: optimal control (30)-(31) of the second paper.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SuspensionControl {
    /// The optimisation problem.
    pub mode: ControlMode,
    /// Command rate (Hz); the time step of (31e)-(31f) is its inverse.
    pub rate: f64,
    /// Planning horizon of a move in `look-ahead` mode (s).
    pub look_ahead: f64,
    /// Whether the actuators move independently; otherwise all move alike.
    pub independent: bool,
    /// Lower bound on the stability angles of the whole machine (rad).
    pub min_stability_angle: f64,
    /// Fraction of the acceleration that remains for motion towards a stop, 0 to 1: rho of the limits.
    pub acceleration_at_stop: f64,
    /// Factor on the smallest approach zone of the stops that is proven sufficient, at least 1.
    pub approach_margin: f64,
    /// Weights of the cost function.
    pub weights: ControlWeights,
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

/// `[suspension.control.weights]`: the cost is the sum of weight (N_i - N_j)^2 over pairs of wheels, loads in
/// kN, and of weight / stability angle over edges, angles in rad.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ControlWeights {
    /// Pairs of wheels in line on one side (1/kN^2).
    pub front_rear: f64,
    /// Pairs of wheels on opposite sides of an axle (1/kN^2).
    pub lateral: f64,
    /// All other pairs (1/kN^2).
    pub diagonal: f64,
    /// Pairs with an individual weight.
    pub pairs: Vec<PairWeight>,
    /// Edges closer to transverse than to longitudinal (rad).
    pub front_and_rear_edges: f64,
    /// The other edges (rad).
    pub side_edges: f64,
    /// Edges with an individual weight, by name (rad).
    pub edges: BTreeMap<String, f64>,
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

impl Default for SuspensionControl {
    fn default() -> Self {
        Self {
            mode: ControlMode::default(),
            rate: 50.0,
            look_ahead: 1.0,
            independent: false,
            min_stability_angle: 0.1,
            acceleration_at_stop: 0.2,
            approach_margin: 1.15,
            weights: ControlWeights::default(),
        }
    }
}

impl Default for ControlWeights {
    fn default() -> Self {
        Self {
            front_rear: 1.0,
            lateral: 1e-3,
            diagonal: 1.0,
            pairs: Vec::new(),
            front_and_rear_edges: 100.0,
            side_edges: 10.0,
            edges: BTreeMap::new(),
        }
    }
}
