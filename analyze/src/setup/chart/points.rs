//! The points of a chart: the load that the machine carries in each posture.

use anyhow::{Result, bail};
use rayon::prelude::*;
use serde::Serialize;
use tipwatch_mechanics::machine::{LoadOnTool, Machine, SupportKind};
use tipwatch_mechanics::studies::load_capacity::{Carried, LadenMachine};

use super::request::{MOST_POSTURES, ReachFrom, Request, Sweep, standing};

/// Default limit of a wheel as a share of its static load, as in an analysis.
const DEFAULT_LIMIT_SHARE: f64 = 0.05;

/// A load chart.
#[derive(Debug)]
pub struct Chart {
    /// The machine on the supports of the chart.
    pub machine: Machine,
    /// Name of the link that carries the load.
    pub link: String,
    /// The joints that are swept.
    pub sweeps: Vec<Sweep>,
    /// Postures in the order of the sweeps, the last one fastest. A posture that cannot be computed is left out.
    pub points: Vec<ChartPoint>,
    /// Postures left out: a linkage cannot close.
    pub left_out: usize,
    /// Share of the tipping load that the chart states.
    pub share: f64,
    /// The limit of each wheel (N); `None` where static loads are unknown.
    pub limits_n: Option<Vec<f64>>,
    pub(super) placing: Placing,
}

/// Way of placing and loading a posture.
#[derive(Debug, Clone)]
pub(super) struct Placing {
    /// Joint positions of the other joints (rad or m).
    base: Vec<f64>,
    /// The swept joints.
    joints: Vec<usize>,
    load: LoadOnTool,
    origin: Origin,
    payloads_kg: Vec<f64>,
}

/// Origin of the reach.
#[derive(Debug, Clone, Copy)]
enum Origin {
    /// Forward of this place of the base frame (m).
    Front(f64),
    /// Away from the origin of a body.
    Body(usize),
}

/// A posture of a chart.
#[derive(Debug, Clone)]
pub struct ChartPoint {
    /// Positions of the swept joints (rad or m).
    pub positions: Vec<f64>,
    /// Reach of the load (m).
    pub reach_m: f64,
    /// Height of the load above the ground (m).
    pub height_m: f64,
    /// Load with which the machine begins to tip; `None` if no load tips it.
    pub tipping: Option<Carried>,
    /// Load with which a wheel falls to its limit; `None` if no load does that, or the limit is unknown.
    pub limit: Option<Carried>,
    /// Worst wheel with each of the requested loads.
    pub payloads: Vec<PayloadLoads>,
}

/// The worst wheel under a load.
#[derive(Debug, Clone, Serialize)]
pub struct PayloadLoads {
    /// The load (kg).
    pub mass_kg: f64,
    /// The wheel with the smallest share of its static load.
    pub wheel: String,
    /// Its overturning force (N).
    pub otf_n: f64,
    /// Whether the machine tips.
    pub tips: bool,
}

/// Computes a chart.
///
/// # Errors
/// The machine cannot stand on the supports, has no arm, or lacks a joint.
pub fn chart(machine: &Machine, request: &Request) -> Result<Chart> {
    let machine = standing(machine, &request.on)?;
    let sweeps = match request.sweeps.is_empty() {
        true => Sweep::of_arm(&machine),
        false => request.sweeps.clone(),
    };
    if sweeps.is_empty() {
        bail!(
            "expected joints of an arm with limits in the URDF, or --sweep JOINT=FROM:TO, found none"
        );
    }
    let joints: Vec<usize> = (sweeps.iter())
        .map(|sweep| joint(&machine, &sweep.joint))
        .collect::<Result<_>>()?;
    let count = (sweeps.iter()).try_fold(1_usize, |n, sweep| n.checked_mul(sweep.positions.len()));
    let Some(count) = count.filter(|&count| count <= MOST_POSTURES) else {
        bail!("expected at most {MOST_POSTURES} postures; sweep fewer positions");
    };
    let (load, link) = load_place(&machine, request.link.as_deref())?;
    let placing = Placing {
        base: machine.reference().posture.positions.clone(),
        joints,
        load,
        origin: origin(&machine, &request.reach_from)?,
        payloads_kg: request.payloads_kg.clone(),
    };
    let limits_n = limits(&machine, request.limit_share);
    let found: Vec<Option<ChartPoint>> = (0..count)
        .into_par_iter()
        .map(|index| {
            let positions = positions_at(&sweeps, index);
            placing.point(&machine, limits_n.as_deref(), positions)
        })
        .collect();
    let left_out = found.iter().filter(|point| point.is_none()).count();
    if left_out == count {
        bail!(
            "expected a posture in which the machine stands, found none: a linkage cannot close at these positions"
        );
    }
    Ok(Chart {
        link,
        sweeps,
        points: found.into_iter().flatten().collect(),
        left_out,
        share: request.share,
        limits_n,
        placing,
        machine,
    })
}

impl Placing {
    /// The posture with these positions of the swept joints.
    fn laden(&self, machine: &Machine, positions: &[f64]) -> Option<LadenMachine> {
        let mut all = self.base.clone();
        for (&joint, &position) in self.joints.iter().zip(positions) {
            all[joint] = position;
        }
        LadenMachine::new(machine, &all, self.load)
    }

    /// Reach and height of the load (m).
    pub(super) fn place(&self, machine: &Machine, positions: &[f64]) -> Option<[f64; 2]> {
        let laden = self.laden(machine, positions)?;
        Some(self.place_of(&laden))
    }

    fn place_of(&self, laden: &LadenMachine) -> [f64; 2] {
        let place = laden.place();
        let reach = match self.origin {
            Origin::Front(front) => place.x - front,
            Origin::Body(body) => {
                let from = laden.point(body, &nalgebra::Vector3::zeros());
                (place - from).xy().norm()
            }
        };
        [reach, laden.height(&place)]
    }

    pub(super) fn point(
        &self,
        machine: &Machine,
        limits_n: Option<&[f64]>,
        positions: Vec<f64>,
    ) -> Option<ChartPoint> {
        let mut laden = self.laden(machine, &positions)?;
        laden.with(0.0);
        let [reach_m, height_m] = self.place_of(&laden);
        let static_load = &machine.reference().static_load;
        let payloads = self.payloads_kg.iter().map(|&mass_kg| {
            let outcome = laden.with(mass_kg);
            let share = |wheel: usize| outcome.otf[wheel] / static_load[wheel];
            let wheels = 0..machine.wheels().len();
            let worst = wheels.min_by(|&a, &b| share(a).total_cmp(&share(b)));
            let worst = worst.unwrap_or(0);
            PayloadLoads {
                mass_kg,
                wheel: machine.wheels()[worst].name.clone(),
                otf_n: outcome.otf[worst],
                tips: outcome.itom_full.iter().any(|moment| *moment > 0.0),
            }
        });
        Some(ChartPoint {
            payloads: payloads.collect(),
            tipping: laden.tipping(),
            limit: limits_n.and_then(|limits| laden.wheel_limit(limits)),
            positions,
            reach_m,
            height_m,
        })
    }
}

fn positions_at(sweeps: &[Sweep], mut index: usize) -> Vec<f64> {
    let mut positions: Vec<f64> = Vec::with_capacity(sweeps.len());
    for sweep in sweeps.iter().rev() {
        positions.push(sweep.positions[index % sweep.positions.len()]);
        index /= sweep.positions.len();
    }
    positions.reverse();
    positions
}

fn joint(machine: &Machine, name: &str) -> Result<usize> {
    let joints = machine.joints();
    let Some(found) = joints.iter().position(|joint| joint.name == name) else {
        let known = joints.iter().filter(|joint| joint.spins_wheel.is_none());
        let known: Vec<&str> = known.map(|joint| joint.name.as_str()).collect();
        bail!(
            "expected a measured joint of the machine ({}), found \"{name}\"",
            known.join(", ")
        );
    };
    Ok(found)
}

/// Returns the position of the load, and the name of its link.
fn load_place(machine: &Machine, link: Option<&str>) -> Result<(LoadOnTool, String)> {
    let Some(name) = link else {
        let Some(load) = machine.load_on_tool() else {
            bail!(
                "expected [arm] in the machine file, or --link LINK, which carries the load; found neither"
            );
        };
        return Ok((load, machine.links()[load.tool].name.clone()));
    };
    let Some(index) = machine.links().iter().position(|link| link.name == name) else {
        bail!("--link: expected a link of the URDF, found \"{name}\"");
    };
    let link = &machine.links()[index];
    let load = LoadOnTool {
        tool: index,
        link: index,
        body: link.body,
        place: link.body_from_link.translation.vector,
    };
    Ok((load, name.into()))
}

fn origin(machine: &Machine, from: &ReachFrom) -> Result<Origin> {
    Ok(match from {
        ReachFrom::Base => Origin::Body(0),
        ReachFrom::Joint(name) => {
            let joint = joint(machine, name)?;
            match machine.bodies_of_joint(joint).next() {
                Some(body) => Origin::Body(body),
                None => bail!("--reach-from: joint {name} moves nothing"),
            }
        }
        ReachFrom::Tyres => {
            let supports = machine.supports();
            let wheels = supports.ids().map(|id| supports.support(id));
            let front = |kind: Option<SupportKind>| {
                let of_kind = wheels
                    .clone()
                    .filter(|wheel| kind.is_none_or(|it| wheel.kind == it));
                let fronts = of_kind.map(|wheel| wheel.centre_at_zero.x + wheel.radius);
                fronts.reduce(f64::max)
            };
            let front = front(Some(SupportKind::Wheel)).or_else(|| front(None));
            Origin::Front(front.unwrap_or(0.0))
        }
    })
}

fn limits(machine: &Machine, share: Option<f64>) -> Option<Vec<f64>> {
    let (limits, static_load) = (machine.limits(), &machine.reference().static_load);
    if let (None, Some(load)) = (share, limits.min_load) {
        return Some(vec![load; static_load.len()]);
    }
    let share = share
        .or(limits.min_load_share)
        .unwrap_or(DEFAULT_LIMIT_SHARE);
    let limits: Vec<f64> = static_load.iter().map(|load| load * share).collect();
    limits
        .iter()
        .all(|limit| limit.is_finite())
        .then_some(limits)
}
