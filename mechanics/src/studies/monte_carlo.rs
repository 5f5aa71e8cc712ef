//! The first paper's study of parametric uncertainty (section VIII.C, Figs. 13 and 14): random variation of
//! all lengths, fixed angles, masses and inertias of the machine, and its effect on the loads.
//!
//! Every sampled machine is evaluated on every row, without linearisation. Where a sampled triangle cannot
//! close, or the machine tips, the sample is excluded from that row's band and counted.

use std::ops::Range;

use crate::dynamics::newton_euler;
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::quantities::Quantity;
use crate::evaluate::workspace::Workspace;
use crate::explain::indicators::arm_wrench_of;
use crate::machine::{Axis, LinkGroup, Machine, ParameterSampler};
use crate::number::Lanes;
use crate::state::{State, StateColumns};

/// Rows whose samples are held at once: they fit into the cache of a core.
const BLOCK_ROWS: usize = 16;

/// Settings of a study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Study {
    /// Number of machines sampled.
    pub draws: usize,
    /// Largest relative deviation of a parameter, 0.1 in the paper; deviations are uniformly distributed.
    pub spread: f64,
    /// Seed of the random numbers: the same seed gives the same machines.
    pub seed: u64,
}

/// Distribution of one quantity over the samples, row by row.
#[derive(Debug, Clone)]
pub struct Band {
    /// The quantity: a load, or a component of the wrench at the arm's base.
    pub quantity: Quantity,
    /// 2.5 % quantile of the samples; NaN where no sample can be evaluated.
    pub low: Vec<f64>,
    /// 97.5 % quantile of the samples.
    pub high: Vec<f64>,
    /// Standard deviation of the samples.
    pub sigma: Vec<f64>,
    /// Samples excluded.
    pub left_out: Vec<u32>,
}

impl Study {
    /// The sampled machines.
    #[must_use]
    pub fn machines(&self, machine: &Machine) -> Vec<Machine> {
        let mut draws = ParameterSampler::new(self.seed, self.spread);
        (0..self.draws)
            .map(|_| machine.sampled(&mut draws))
            .collect()
    }
}

/// The bands of `rows` over machines sampled around `machine`: of every wheel's load, and of the six
/// components of the wrench at the arm's root if there is an arm.
#[must_use]
pub fn bands(
    machine: &Machine,
    sampled: &[Machine],
    states: &StateColumns,
    rows: Range<usize>,
) -> Vec<Band> {
    let mut sampler = Sampler::new(machine, sampled.len());
    let mut bands: Vec<Band> = sampler.quantities.iter().map(|&q| Band::empty(q)).collect();
    for first in rows.clone().step_by(BLOCK_ROWS) {
        let block = first..(first + BLOCK_ROWS).min(rows.end);
        sampler.fill(sampled, states, &block);
        for row in 0..block.len() {
            for (quantity, band) in bands.iter_mut().enumerate() {
                band.push(sampler.values(quantity, row));
            }
        }
    }
    bands
}

/// Values of the samples on a block of rows.
struct Sampler {
    quantities: Vec<Quantity>,
    draws: usize,
    /// Whether each body belongs to the arm.
    in_arm: Vec<bool>,
    /// The block's rows, in lanes.
    states: Vec<State<Lanes>>,
    /// Shared by all samples: they change neither its size nor the structure of the machine.
    workspace: Workspace<Lanes>,
    /// Values by quantity, row of the block and sample.
    values: Vec<f64>,
}

impl Sampler {
    fn new(machine: &Machine, draws: usize) -> Self {
        let mut quantities: Vec<_> = (0..machine.wheels.len()).map(Quantity::Load).collect();
        if machine.arm_root.is_some() {
            quantities.extend(Axis::ALL.map(Quantity::ArmForce));
            quantities.extend(Axis::ALL.map(Quantity::ArmMoment));
        }
        let is_arm = |body: usize| {
            let mut links = machine.links.iter().filter(|link| link.body == body);
            links.all(|link| link.group == LinkGroup::Arm)
        };
        Self {
            values: vec![0.0; quantities.len() * BLOCK_ROWS * draws],
            quantities,
            draws,
            in_arm: (0..machine.bodies.len()).map(is_arm).collect(),
            states: vec![State::zero(machine); BLOCK_ROWS / Lanes::COUNT],
            workspace: Workspace::new(machine),
        }
    }

    fn fill(&mut self, sampled: &[Machine], states: &StateColumns, block: &Range<usize>) {
        let firsts = block.clone().step_by(Lanes::COUNT);
        let groups = firsts.len();
        for (first, state) in firsts.zip(&mut self.states) {
            states.get_lanes(first, block.end, state);
        }
        // A machine is larger than the rows, so each machine is loaded only once for all of them.
        for (draw, machine) in sampled.iter().enumerate() {
            for group in 0..groups {
                self.evaluate(machine, draw, group);
            }
        }
    }

    fn evaluate(&mut self, machine: &Machine, draw: usize, group: usize) {
        let (state, row) = (&self.states[group], group * Lanes::COUNT);
        evaluate(machine, state, &mut self.workspace);
        let w = &self.workspace;
        let moved = newton_euler::sum(&w.wrenches, |body| self.in_arm[body]);
        let tool = newton_euler::tool_wrench(machine, state, &w.motions);
        let arm = arm_wrench_of(machine, &w.motions, &tool.minus(&moved));
        for (k, quantity) in self.quantities.iter().enumerate() {
            let value = match *quantity {
                Quantity::ArmForce(axis) => arm.force[axis as usize],
                Quantity::ArmMoment(axis) => arm.moment[axis as usize],
                other => w.outcome.get(other),
            };
            for (lane, value) in value.to_array().into_iter().enumerate() {
                let place = (k * BLOCK_ROWS + row + lane) * self.draws + draw;
                self.values[place] = value;
            }
        }
    }

    fn values(&mut self, quantity: usize, row: usize) -> &mut [f64] {
        let first = (quantity * BLOCK_ROWS + row) * self.draws;
        &mut self.values[first..first + self.draws]
    }
}

impl Band {
    fn empty(quantity: Quantity) -> Self {
        Self {
            quantity,
            low: Vec::new(),
            high: Vec::new(),
            sigma: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// Appends the rows of `other`, which come after these.
    pub fn append(&mut self, other: &Self) {
        self.low.extend_from_slice(&other.low);
        self.high.extend_from_slice(&other.high);
        self.sigma.extend_from_slice(&other.sigma);
        self.left_out.extend_from_slice(&other.left_out);
    }

    /// Takes the samples of one row and sorts them in place.
    fn push(&mut self, draws: &mut [f64]) {
        let mut known = 0;
        for i in 0..draws.len() {
            if draws[i].is_finite() {
                draws.swap(known, i);
                known += 1;
            }
        }
        self.left_out.push((draws.len() - known) as u32);
        let draws = &mut draws[..known];
        if draws.is_empty() {
            for column in [&mut self.low, &mut self.high, &mut self.sigma] {
                column.push(f64::NAN);
            }
            return;
        }
        let count = known as f64;
        let mean = draws.iter().sum::<f64>() / count;
        let squares: f64 = draws.iter().map(|value| (value - mean).powi(2)).sum();
        self.sigma.push((squares / count).sqrt());
        let tail = ((0.025 * count) as usize).min(known - 1);
        let (_, &mut low, above) = draws.select_nth_unstable_by(tail, f64::total_cmp);
        let last = above.len().saturating_sub(1 + tail);
        let high = match above {
            [] => low,
            _ => *above.select_nth_unstable_by(last, f64::total_cmp).1,
        };
        self.low.push(low);
        self.high.push(high);
    }
}
