//! The cost function (30) and its weights.
//!
//! ```text
//!     S(7)   J = sum over pairs psi_ij (N_i - N_j)^2 + sum over edges psi_k / eta_k
//! ```
//! with each pair of wheels once (the paper's sum counts each twice, with a factor of one half), loads in kN and
//! angles in rad.

use crate::error::SuspensionError;
use tipwatch_mechanics::machine::{ControlWeights, MAX_WHEELS, Machine};
use tipwatch_mechanics::number::Gradient;

/// Unit of the loads in the cost (N).
const LOAD_UNIT: f64 = 1000.0;
/// Wheels within this fraction of the wheelbase (longitudinally) or track (laterally) count as aligned.
const LEVEL_SHARE: f64 = 0.1;

/// Weights by pair and by edge.
#[derive(Debug, Clone)]
pub(crate) struct Weights {
    /// Pairs of wheels and their weight (1/N^2).
    pairs: Vec<(usize, usize, f64)>,
    /// Weight of each edge's stability angle (rad).
    edges: Vec<f64>,
}

impl Weights {
    pub(crate) fn of(machine: &Machine, spec: &ControlWeights) -> Result<Self, SuspensionError> {
        let wheels = machine.wheels();
        let extent = |axis: usize| {
            let along = wheels.iter().map(|w| w.centre_at_zero[axis]);
            let (least, largest) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                (a.min(x), b.max(x))
            });
            largest - least
        };
        let level = |i: usize, j: usize, axis: usize| {
            let apart = wheels[i].centre_at_zero[axis] - wheels[j].centre_at_zero[axis];
            apart.abs() < LEVEL_SHARE * extent(axis)
        };
        let mut pairs = Vec::new();
        for i in 0..wheels.len() {
            for j in i + 1..wheels.len() {
                let stated = spec.pairs.iter().rev().find(|pair| {
                    let names = [&wheels[i].name, &wheels[j].name];
                    pair.wheels.iter().all(|name| names.contains(&name))
                });
                let weight = match stated {
                    Some(pair) => pair.weight,
                    None if level(i, j, 0) => spec.lateral,
                    None if level(i, j, 1) => spec.front_rear,
                    None => spec.diagonal,
                };
                if weight > 0.0 {
                    pairs.push((i, j, weight / (LOAD_UNIT * LOAD_UNIT)));
                }
            }
        }
        let edges = machine.polygon().edges();
        for name in spec.edges.keys() {
            if !edges.iter().any(|edge| &edge.name == name) {
                return Err(SuspensionError::UnknownEdge {
                    name: name.clone(),
                    edges: edges
                        .iter()
                        .map(|e| e.name.clone())
                        .collect::<Vec<_>>()
                        .join(", "),
                });
            }
        }
        let edges = edges.iter().map(|edge| {
            let along = wheels[edge.to].centre_at_zero - wheels[edge.from].centre_at_zero;
            let of_kind = if along.y.abs() > along.x.abs() {
                spec.front_and_rear_edges
            } else {
                spec.side_edges
            };
            spec.edges.get(&edge.name).copied().unwrap_or(of_kind)
        });
        Ok(Self {
            pairs,
            edges: edges.collect(),
        })
    }

    /// Whether the cost includes stability angles.
    pub(crate) fn use_angles(&self) -> bool {
        self.edges.iter().any(|&weight| weight > 0.0)
    }

    /// S(7)
    pub(crate) fn cost(
        &self,
        loads: impl ExactSizeIterator<Item = f64> + Clone,
        angles: impl Iterator<Item = f64>,
    ) -> f64 {
        let mut values = [0.0; MAX_WHEELS];
        for (value, load) in values.iter_mut().zip(loads) {
            *value = load;
        }
        let of_pair = |&(i, j, weight): &(usize, usize, f64)| {
            let difference: f64 = values[i] - values[j];
            weight * difference * difference
        };
        let of_edge =
            |(angle, &weight): (f64, &f64)| if weight > 0.0 { weight / angle } else { 0.0 };
        let pairs: f64 = self.pairs.iter().map(of_pair).sum();
        pairs + angles.zip(&self.edges).map(of_edge).sum::<f64>()
    }

    /// Derivatives of S(7) with respect to each load (1/N) and angle (1/rad); its second derivatives as a sum of
    /// squared directions, passed to `curve` with their factors.
    pub(crate) fn partials<const N: usize>(
        &self,
        loads: &[Gradient<N>],
        angles: &[Gradient<N>],
        by_load: &mut [f64],
        by_angle: &mut [f64],
        mut curve: impl FnMut(&[f64; N], f64),
    ) {
        by_load.fill(0.0);
        for &(i, j, weight) in &self.pairs {
            let difference = loads[i] - loads[j];
            by_load[i] += 2.0 * weight * difference.value;
            by_load[j] -= 2.0 * weight * difference.value;
            curve(&difference.slopes, 2.0 * weight);
        }
        for ((angle, &weight), by) in angles.iter().zip(&self.edges).zip(by_angle) {
            let inverse = 1.0 / angle.value;
            *by = if weight > 0.0 {
                curve(&angle.slopes, 2.0 * weight * inverse * inverse * inverse);
                -weight * inverse * inverse
            } else {
                0.0
            };
        }
    }

    /// The weighted product of the load differences with respect to one variable of `a` and one of `b`:
    /// d_a' W d_b.
    pub(crate) fn product<const N: usize>(
        &self,
        a: &[Gradient<N>],
        by_a: usize,
        b: &[Gradient<N>],
        by_b: usize,
    ) -> f64 {
        let of = |&(i, j, weight): &(usize, usize, f64)| {
            weight * (a[i] - a[j]).slopes[by_a] * (b[i] - b[j]).slopes[by_b]
        };
        self.pairs.iter().map(of).sum()
    }
}
