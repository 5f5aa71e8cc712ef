//! The total of the measured loads against the weight and the vertical acceleration of all masses, and where every support is
//! measured by itself, their moments as well.
//!
//! They hold whatever the split, and also while a wheel is off the ground, where single loads are not compared:
//! ```text
//!     r = sum of F_measured - N,   s^2 = sum of s_sensor^2 + s_N^2
//! ```
//! F are sensors of one or more supports, or the forces of jacks. A row is off where the distance of these one or three quantities
//! exceeds the root of their number by 3.5, as in the comparison of single loads. A load at the end of a boom shows in the moments
//! long before it shows in the total.

use super::singles::Acts;
use super::total_row::TotalRow;
use super::unstated::SAME_PLACE;
use crate::machine::{LoadSensor, Machine};

/// Sensors that together carry every support on the ground once, if there are any.
#[must_use]
pub fn sensors_of_all(sensors: &[&LoadSensor], machine: &Machine) -> Option<Vec<usize>> {
    let places = sensors
        .iter()
        .map(|sensor| sensor.places(machine).collect());
    let places: Vec<Vec<usize>> = places.collect();
    let mut found = Vec::new();
    let mut covered = vec![false; machine.wheels().len()];
    complete(&places, &mut covered, &mut found).then_some(found)
}

/// Adds sensors for the places that are not covered, from the first one on; `sensors` are the places that each covers.
fn complete(sensors: &[Vec<usize>], covered: &mut [bool], found: &mut Vec<usize>) -> bool {
    let Some(first) = covered.iter().position(|covered| !covered) else {
        return true;
    };
    for (k, sensor) in sensors.iter().enumerate() {
        let fits = sensor.contains(&first) && !sensor.iter().any(|&place| covered[place]);
        if !fits {
            continue;
        }
        let set = |to: bool, covered: &mut [bool]| {
            for &place in sensor {
                covered[place] = to;
            }
        };
        set(true, covered);
        found.push(k);
        if complete(sensors, covered, found) {
            return true;
        }
        found.pop();
        set(false, covered);
    }
    false
}

/// The places of the supports whose sensors, exchanged, leave nothing to explain: in the mean over the rows, for no single one decides.
#[must_use]
pub fn exchanged(rows: &[&TotalRow]) -> Option<[usize; 2]> {
    let acts: Option<Vec<&Acts>> = rows.iter().map(|row| row.acts.as_ref()).collect();
    let acts = acts?;
    let pairs = acts.first()?.exchanged.iter().enumerate();
    let misfits = pairs.map(|(index, (pair, _))| {
        let all = acts.iter().filter_map(|acts| acts.exchanged.get(index));
        let sum: f64 = all.map(|(_, misfit)| misfit).sum();
        (*pair, sum / acts.len() as f64)
    });
    let best = misfits.min_by(|(_, a), (_, b)| a.total_cmp(b));
    best.filter(|(_, misfit)| *misfit < SAME_PLACE)
        .map(|(pair, _)| pair)
}
