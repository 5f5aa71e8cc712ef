//! Margins of plans: what every wheel keeps beyond what it must.
//!
//! ```text
//!     S(17)  X (x - home) >= -max(e, spare/4, k (N_lock - swing - limit))
//!            D            >= -max(m, spare/4, k (N_lock - swing - limit))
//!            spare = N_lock - limit - max(swing, doubt of the base) - doubt of the arm
//!            at every node of a plan, and for the commanded acceleration now
//! ```
//! A wheel that has nothing to spare loses nothing to where the rods are (e is there for rounding), and no more than m for
//! the moment of a start, without which rods under such a wheel could never help it. Nearly all wheels have nothing to spare if
//! everything moves at once against them as hard as it ever did. A share k of what is expected of a wheel keeps that remote case
//! from freezing the rods: a heavy wheel gives what a light one needs. So a load is never below the smaller
//! of the limit and what locking gives, m aside, as long as nothing moves more than S(14) reserves for. Stability angles
//! keep likewise to the smallest that locking gives now, or an ample one if that is smaller, and the spread of the loads to
//! what locking gives at that time and a little more. What locking gave earlier is no measure: rods that used up a
//! peak of the past would make one of their own.

use super::by_wheel::{ByWheel, spread};
use super::forecast::{Added, ByRod, Forecast, Outlook, TIMES_S};
use super::plan::{NODE_S, NODES, Plan, Plans, Rods};
use crate::condensed::MAX_ACTUATORS;
use tipwatch_mechanics::machine::MAX_WHEELS;

/// e, as a share of the mean load.
const AT_REST_SHARE: f64 = 0.0004;
/// m, as a share of the mean load.
const START_SHARE: f64 = 0.002;
/// Share of a wheel's spare load that may be used: the rest is for errors of the model.
const SPARE_SHARE: f64 = 0.25;
/// k: share of its expected spare load that a wheel may lose, however large the doubt.
const EXPECTED_SHARE: f64 = 0.006;
/// A load below its bound counts for more than any spread or angle (in units of the mean load).
const PRIORITY: f64 = 1e3;
/// Weight of a radian in units of the mean load.
const ANGLE_UNIT: f64 = 2.0;
/// Share of a stability angle's spare that may be used.
const ANGLE_SHARE: f64 = 0.5;
/// Weight of the end of a plan in its harm: it lasts.
const TAIL: f64 = 10.0;
/// Largest growth of the spread of the loads, as a share of the weight ...
const SPREAD_GROWTH: f64 = 0.01;
/// ... and up to this spread, since every useful motion starts with the inertia of its start.
const SMALL_SPREAD_GROWTH: f64 = 0.08;
const SMALL_SPREAD: f64 = 0.5;
/// r of S(14) rises to 1 in this time (s).
const RISE_S: f64 = 0.3;

/// Limits and scales of the margins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// (N)
    pub(super) mean_load: f64,
    /// Limit of a wheel's load (N).
    pub(super) limit: f64,
    /// Stability angle to keep (rad).
    pub(super) angle: f64,
    /// Weight of the machine (N).
    pub(super) weight: f64,
    /// The largest acceleration of a rod (m/s^2).
    pub(super) acceleration: f64,
}

impl Bounds {
    /// Returns the largest allowed spread of the loads where locked rods give this one (N): the growth may be larger while the
    /// spread is small.
    fn spread(&self, locked: f64) -> f64 {
        let small = (locked + SMALL_SPREAD_GROWTH * self.weight).min(SMALL_SPREAD * self.weight);
        small.max(locked + SPREAD_GROWTH * self.weight)
    }
}

/// The forecast at a node.
#[derive(Debug, Clone, Copy)]
struct Node {
    outlook: Outlook,
    /// Largest allowed loss of each wheel's load: to the position of the rods alone, and in all (N).
    may_lose: [ByWheel; 2],
    /// Largest allowed loss of each stability angle (rad).
    angle_may_lose: ByWheel,
    /// The largest spread (N).
    spread: f64,
    /// Minus D at home by S(12), for loads and angles: the rest that makes D zero there.
    curve: [ByWheel; 2],
}

/// Margins at one instant.
#[derive(Debug)]
pub(super) struct Margins {
    plans: Plans,
    bounds: Bounds,
    wheels: usize,
    edges: usize,
    here: Rods,
    home: ByRod,
    nodes: Vec<Node>,
}

impl Margins {
    pub(super) fn new(bounds: Bounds) -> Self {
        let none = [0.0; MAX_ACTUATORS];
        Self {
            plans: Plans::new(),
            bounds,
            wheels: 0,
            edges: 0,
            here: Rods { x: none, v: none },
            home: none,
            nodes: Vec::with_capacity(NODES),
        }
    }

    /// Takes a forecast for rods here.
    pub(super) fn take(&mut self, forecast: &Forecast, here: Rods, home: ByRod, bounds: Bounds) {
        (self.wheels, self.edges) = (forecast.wheels, forecast.edges);
        (self.here, self.home, self.bounds) = (here, home, bounds);
        self.nodes.clear();
        for node in 0..NODES {
            let node = self.node(forecast, node);
            self.nodes.push(node);
        }
    }

    fn node(&self, forecast: &Forecast, node: usize) -> Node {
        let t = NODE_S * node as f64;
        let outlook = forecast.between(t);
        let bounds = &self.bounds;
        let least = [AT_REST_SHARE, START_SHARE].map(|share| share * bounds.mean_load);
        let (mut may_lose, mut angle_may_lose) = ([[0.0; MAX_WHEELS]; 2], [0.0; MAX_WHEELS]);
        let rise = (t / RISE_S).min(1.0);
        for wheel in 0..self.wheels {
            let doubt = &forecast.doubt;
            // the swing is what such accelerations of the base have just done
            let by_base = (rise * doubt.by_base[wheel]).max(forecast.swing[wheel]);
            let by_arm = rise * doubt.by_arm[wheel] + 0.5 * t * t * doubt.by_square[wheel];
            let above = outlook.locked[wheel] - bounds.limit;
            let spare = SPARE_SHARE * (above - by_base - by_arm);
            let expected = EXPECTED_SHARE * (above - forecast.swing[wheel]);
            for (may_lose, least) in may_lose.iter_mut().zip(least) {
                may_lose[wheel] = least.max(spare).max(expected);
            }
        }
        for edge in 0..self.edges {
            let spare = outlook.locked_angle[edge] - bounds.angle;
            angle_may_lose[edge] = ANGLE_SHARE * spare.max(0.0);
        }
        let locked_spread = spread(&outlook.locked[..self.wheels]);
        Node {
            may_lose,
            angle_may_lose,
            spread: bounds.spread(locked_spread),
            curve: [&outlook.load, &outlook.angle].map(|added| self.curve(added)),
            outlook,
        }
    }

    /// Minus D at home by S(12).
    fn curve(&self, added: &Added) -> ByWheel {
        let way = self.offset(&self.home);
        added.at_rest(&way).map(|missing| -missing)
    }

    fn offset(&self, x: &ByRod) -> ByRod {
        std::array::from_fn(|k| x[k] - self.here.x[k])
    }

    /// The rods after a step with this acceleration (m/s^2).
    pub(super) fn after(&self, a: &ByRod, seconds: f64) -> Rods {
        let v: ByRod = std::array::from_fn(|k| self.here.v[k] + seconds * a[k]);
        let x = std::array::from_fn(|k| self.here.x[k] + 0.5 * seconds * (self.here.v[k] + v[k]));
        Rods { x, v }
    }

    /// The rods when a plan begins, whose start takes time to reach from an acceleration: da/dt is limited (m/s^3).
    ///
    /// The acceleration of the plan is that at its beginning, found from the rods here.
    pub(super) fn begin(&self, plan: Plan, rods: &Rods, a: &ByRod, jerk: f64) -> Rods {
        let start = self.start(plan, rods);
        let longest = a
            .iter()
            .zip(&start)
            .fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        let t = longest / jerk;
        Rods {
            x: std::array::from_fn(|k| {
                rods.x[k] + t * (rods.v[k] + t * (2.0 * a[k] + start[k]) / 6.0)
            }),
            v: std::array::from_fn(|k| rods.v[k] + 0.5 * t * (a[k] + start[k])),
        }
    }

    /// Returns the accelerations of the rods at the start of a plan (m/s^2).
    pub(super) fn start(&self, plan: Plan, rods: &Rods) -> ByRod {
        self.plans.at(plan, 0, rods, &self.home).1
    }

    /// The margin of an acceleration now.
    pub(super) fn now(&self, a: &ByRod) -> f64 {
        self.at(0, &self.here, a)
    }

    /// S(20): largest rate of change of the acceleration of rods that move alike (m/s^3) on a platform that swings with this
    /// period (s).
    pub(super) fn affordable_jerk(&self, period: f64) -> f64 {
        let Some(node) = self.nodes.get((period / NODE_S).ceil() as usize) else {
            return 0.0;
        };
        let mut by_acceleration = [0.0; MAX_WHEELS];
        for by_rod in &node.outlook.load.by_acceleration {
            for (sum, by_rod) in by_acceleration.iter_mut().zip(by_rod) {
                *sum += by_rod;
            }
        }
        let wheels = self.wheels;
        let locked_spread = spread(&node.outlook.locked[..wheels]);
        let mut most = (node.spread - locked_spread) / spread(&by_acceleration[..wheels]);
        for (may_lose, load) in node.may_lose[1][..wheels].iter().zip(&by_acceleration) {
            most = most.min(may_lose / load.abs());
        }
        std::f64::consts::TAU / period * most
    }

    /// Returns the deficit of a margin below zero, as a multiple of m.
    pub(super) fn missing(&self, margin: f64) -> f64 {
        let priority = PRIORITY * self.bounds.mean_load;
        let of_wheel = margin < -0.5 * priority;
        let margin = if of_wheel { margin + priority } else { margin };
        -margin / (START_SHARE * self.bounds.mean_load)
    }

    /// The least margin of a plan.
    pub(super) fn of(&self, plan: Plan, rods: &Rods) -> f64 {
        let mut least = f64::INFINITY;
        for node in 0..NODES {
            let (moved, a) = self.plans.at(plan, node, rods, &self.home);
            let hardest = a.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
            if hardest > self.bounds.acceleration {
                return f64::NEG_INFINITY;
            }
            least = least.min(self.at(node, &moved, &a));
        }
        least
    }

    /// Returns the harm of a plan: the sum of squares of the load that the wheels lose beyond what they may, over its nodes, with
    /// more weight on its end (N^2).
    pub(super) fn harm(&self, plan: Plan, rods: &Rods) -> f64 {
        let mut sum = 0.0;
        for node in 0..NODES {
            let (moved, a) = self.plans.at(plan, node, rods, &self.home);
            let weight = if node + 1 == NODES { TAIL } else { 1.0 };
            let (added, _) = self.added(node, &moved, &a);
            for wheel in 0..self.wheels {
                let missing = self.margin(node, &added, wheel).min(0.0);
                sum += weight * missing * missing;
            }
        }
        sum
    }

    /// D at a node: to the position of the rods alone, and in all; and the square of the share of the way home that is
    /// gone.
    fn added(&self, node: usize, rods: &Rods, a: &ByRod) -> ([ByWheel; 2], f64) {
        let node = &self.nodes[node];
        let dx = self.offset(&rods.x);
        let way = self.offset(&self.home);
        let length = way.iter().map(|d| d * d).sum::<f64>();
        let gone = way.iter().zip(&dx).map(|(way, dx)| way * dx).sum::<f64>();
        let gone = if length > 1e-12 { gone / length } else { 0.0 };
        let square = gone * gone;
        let mut at_rest = node.outlook.load.at_rest(&dx);
        for wheel in 0..self.wheels {
            at_rest[wheel] += square * node.curve[0][wheel];
        }
        let mut in_motion = at_rest;
        node.outlook.load.add_motion(&mut in_motion, &rods.v, a);
        ([at_rest, in_motion], square)
    }

    /// S(17) for one wheel (N).
    fn margin(&self, node: usize, added: &[ByWheel; 2], wheel: usize) -> f64 {
        let [at_rest, in_motion] = &self.nodes[node].may_lose;
        (added[0][wheel] + at_rest[wheel]).min(added[1][wheel] + in_motion[wheel])
    }

    /// S(17) for rods with this motion at a node: the least of all margins (N).
    fn at(&self, node: usize, rods: &Rods, a: &ByRod) -> f64 {
        let (added, square) = self.added(node, rods, a);
        let mut least = f64::INFINITY;
        for wheel in 0..self.wheels {
            least = least.min(self.margin(node, &added, wheel));
        }
        if least < 0.0 {
            return least - PRIORITY * self.bounds.mean_load;
        }
        let node = &self.nodes[node];
        let mut load = added[1];
        for wheel in 0..self.wheels {
            load[wheel] += node.outlook.locked[wheel];
        }
        let spare = node.spread - spread(&load[..self.wheels]);
        // a load moved from one wheel to another changes its difference to all others
        least = least.min(spare / (2 * self.wheels.max(2) - 2) as f64);
        let unit = ANGLE_UNIT * self.bounds.mean_load;
        let angle = node.outlook.angle.at_rest(&self.offset(&rods.x));
        for edge in 0..self.edges {
            let added = angle[edge] + square * node.curve[1][edge];
            // unknown angles restrain nothing
            least = least.min(unit * (added + node.angle_may_lose[edge]));
        }
        least
    }
}

impl Added {
    /// S(12) without V and A.
    fn at_rest(&self, dx: &ByRod) -> ByWheel {
        let mut sum = self.here;
        for (by_position, dx) in self.by_position.iter().zip(dx) {
            for (sum, by_position) in sum.iter_mut().zip(by_position) {
                *sum += by_position * dx;
            }
        }
        sum
    }

    /// Adds V v + c A a of S(12).
    fn add_motion(&self, sum: &mut ByWheel, v: &ByRod, a: &ByRod) {
        for k in 0..MAX_ACTUATORS {
            for (i, sum) in sum.iter_mut().enumerate() {
                *sum += self.by_velocity[k][i] * v[k] + self.by_acceleration[k][i] * a[k];
            }
        }
    }

    fn mix(&mut self, other: &Self, share: f64) {
        mix(&mut self.here, &other.here, share);
        for k in 0..MAX_ACTUATORS {
            mix(&mut self.by_position[k], &other.by_position[k], share);
            mix(&mut self.by_velocity[k], &other.by_velocity[k], share);
            mix(
                &mut self.by_acceleration[k],
                &other.by_acceleration[k],
                share,
            );
        }
    }
}

impl Forecast {
    /// The outlook after `t` seconds.
    fn between(&self, t: f64) -> Outlook {
        let last = TIMES_S.len() - 1;
        let after = (1..last).find(|&i| t < TIMES_S[i]).unwrap_or(last);
        let [start, end] = [TIMES_S[after - 1], TIMES_S[after]];
        let share = ((t - start) / (end - start)).min(1.0);
        let (mut outlook, other) = (self.at[after - 1], &self.at[after]);
        mix(&mut outlook.locked, &other.locked, share);
        mix(&mut outlook.locked_angle, &other.locked_angle, share);
        outlook.load.mix(&other.load, share);
        outlook.angle.mix(&other.angle, share);
        outlook
    }
}

fn mix(values: &mut ByWheel, others: &ByWheel, share: f64) {
    for (value, other) in values.iter_mut().zip(others) {
        *value += share * (other - *value);
    }
}
