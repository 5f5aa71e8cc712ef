//! Measures of how the weight is distributed over the wheels.

use super::balance::Balance;
use super::values::Indicators;
use crate::machine::Machine;
use crate::number::Real;
use crate::wheel_loads::sigma;

/// A wheel closer to the centre line than this fraction of the half track belongs to neither side.
const MIDDLE_SHARE: f64 = 0.05;

pub(super) fn fill<T: Real>(balance: &Balance<'_, T>, out: &mut Indicators<T>) {
    let (machine, load) = (balance.machine, balance.load);
    let mut sum = T::zero();
    let mut right_less_left = T::zero();
    for (&load, side) in load.iter().zip(sides(machine)) {
        sum += load;
        right_less_left -= load * T::constant(side);
    }
    out.load_transfer_ratio = right_less_left / sum;
    // (35): each pair of wheels once
    let mut spread = T::zero();
    for (i, &a) in load.iter().enumerate() {
        for &b in &load[i + 1..] {
            spread += (a - b).abs();
        }
    }
    out.spread = spread;
    let optimal = machine
        .reference
        .optimal_load
        .iter()
        .map(|&load| T::constant(load));
    out.sigma = sigma(balance.otf.iter().copied(), optimal);
}

/// 1 for a left wheel, -1 for a right wheel, 0 near the centre line.
fn sides(machine: &Machine) -> impl Iterator<Item = f64> + '_ {
    let lateral = |w: &crate::machine::Wheel| w.centre_at_zero.y;
    let (least, largest) = machine
        .wheels
        .iter()
        .map(lateral)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, largest), y| {
            (least.min(y), largest.max(y))
        });
    let (middle, half) = (0.5 * (least + largest), 0.5 * (largest - least));
    machine.wheels.iter().map(move |wheel| {
        let off = (lateral(wheel) - middle) / half;
        if off.abs() < MIDDLE_SHARE {
            0.0
        } else {
            off.signum()
        }
    })
}
