//! How an active suspension is steered, as the machine file states it.

use std::collections::BTreeMap;

use serde::Deserialize;

/// `[suspension.control]`: the second paper's optimal control (30)-(31).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SuspensionControl {
    /// Which problem is solved.
    pub mode: ControlMode,
    /// How often a command is asked for (Hz); the step of (31e)-(31f) is its inverse.
    pub rate: f64,
    /// How far ahead `look-ahead` mode plans a move of the rods (s).
    pub look_ahead: f64,
    /// Whether the actuators move each by itself; else all rods move alike.
    pub independent: bool,
    /// Stability angles of the whole machine are kept above this (rad).
    pub min_stability_angle: f64,
    /// Share of the acceleration that is left for pushing on at a stop, 0 to 1: rho of the limits.
    pub acceleration_at_stop: f64,
    /// Factor on the least width of the stops' approach zone that is proven enough, 1 or more.
    pub approach_margin: f64,
    /// Weights of the cost.
    pub weights: ControlWeights,
}

/// The problem that the control solves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControlMode {
    /// The loads at rest at the end of a planned move.
    #[default]
    LookAhead,
    /// The paper's problem: the loads of the next step, with the inertia of the step itself.
    Literal,
}

/// `[suspension.control.weights]`: the cost is the sum over pairs of wheels of weight (N_i - N_j)^2 with
/// loads in kN, and over edges of weight / stability angle in rad.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ControlWeights {
    /// Pairs of wheels one behind the other on a side (1/kN^2).
    pub front_rear: f64,
    /// Pairs of wheels side by side (1/kN^2).
    pub lateral: f64,
    /// All other pairs (1/kN^2).
    pub diagonal: f64,
    /// Pairs with a weight of their own.
    pub pairs: Vec<PairWeight>,
    /// Edges more across than along the machine (rad).
    pub front_and_rear_edges: f64,
    /// The other edges (rad).
    pub side_edges: f64,
    /// Edges with a weight of their own, by name (rad).
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
