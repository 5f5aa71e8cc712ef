//! Groups wheels to axles and sides.

use tipwatch_mechanics::RestingMachine;
use tipwatch_mechanics::machine::Machine;

use super::document::{Axle, SumCheck, names};
use crate::base::number::known;

/// Largest distance along the machine between wheels of one axle, as a share of the wheelbase.
const AXLE_SHARE: f64 = 0.1;

/// Wheels by axle, front first.
fn by_axle(standing: &RestingMachine) -> Vec<Vec<usize>> {
    let x = |wheel: usize| standing.wheel_centres[wheel].x;
    let mut order: Vec<usize> = (0..standing.wheel_centres.len()).collect();
    order.sort_by(|&a, &b| x(b).total_cmp(&x(a)));
    let length = x(order[0]) - x(order[order.len() - 1]);
    let mut axles: Vec<Vec<usize>> = Vec::new();
    for wheel in order {
        match axles.last_mut() {
            Some(axle) if x(axle[0]) - x(wheel) <= AXLE_SHARE * length => axle.push(wheel),
            _ => axles.push(vec![wheel]),
        }
    }
    for axle in &mut axles {
        axle.sort_unstable();
    }
    axles
}

fn axle_x(standing: &RestingMachine, axle: &[usize]) -> f64 {
    let sum: f64 = axle.iter().map(|&w| standing.wheel_centres[w].x).sum();
    sum / axle.len() as f64
}

pub(super) fn wheelbase(standing: &RestingMachine) -> Option<f64> {
    let axles = by_axle(standing);
    let at = |axle: &Vec<usize>| axle_x(standing, axle);
    let length = at(axles.first()?) - at(axles.last()?);
    known(length).filter(|_| axles.len() > 1)
}

pub(super) fn axles(machine: &Machine, standing: &RestingMachine) -> Vec<Axle> {
    let y = |&wheel: &usize| standing.wheel_centres[wheel].y;
    let axle = |axle: &Vec<usize>| {
        let left = axle.iter().map(y).fold(f64::NEG_INFINITY, f64::max);
        let right = axle.iter().map(y).fold(f64::INFINITY, f64::min);
        Axle {
            wheels: names(machine, axle),
            x_m: axle_x(standing, axle),
            track_m: known(left - right).filter(|_| axle.len() > 1),
        }
    };
    by_axle(standing).iter().map(axle).collect()
}

/// Centre line between the outermost wheels (m).
fn middle_line(standing: &RestingMachine) -> f64 {
    let y = standing.wheel_centres.iter().map(|centre| centre.y);
    let (least, largest) = y.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| {
        (a.min(y), b.max(y))
    });
    0.5 * (least + largest)
}

pub(super) fn sums(machine: &Machine, standing: &RestingMachine) -> Vec<SumCheck> {
    let centre = middle_line(standing);
    let left = |&wheel: &usize| standing.wheel_centres[wheel].y > centre;
    let all = 0..machine.wheels().len();
    let mut groups: Vec<(String, Vec<usize>)> = by_axle(standing)
        .into_iter()
        .enumerate()
        .map(|(i, axle)| (format!("axle {}", i + 1), axle))
        .collect();
    groups.push(("left".into(), all.clone().filter(left).collect()));
    groups.push(("right".into(), all.clone().filter(|w| !left(w)).collect()));
    groups.push(("all".into(), all.collect()));
    let sum = |(name, wheels): (String, Vec<usize>)| {
        let (load, sigma) = standing.load_of(&wheels);
        SumCheck {
            name,
            wheels: names(machine, &wheels),
            static_load_n: known(load),
            sigma_n: known(sigma),
            share: known(load / standing.outcome().normal_force),
        }
    };
    groups.into_iter().map(sum).collect()
}
