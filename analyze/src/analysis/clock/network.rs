//! Combines pairwise delays to one offset for each topic.
//!
//! With the offset of the reference fixed at zero, the others minimise
//! ```text
//!     sum over pairs ( late_topic - late_against - measured )^2 / sigma^2
//! ```
//! Their variances are the diagonal of the inverse normal matrix.

use nalgebra::{DMatrix, DVector};
use tipwatch_mechanics::state::Sensor;

use super::offsets::{ClockOffsets, PairOffset, TopicOffset};
use super::pairs;
use crate::base::estimated::EstimatedRows;
use crate::load::linkage_force::LinkageForce;
use crate::load::{LoadedLog, Signal};

/// Estimates the offsets between the clocks of a log's topics; `rows` were estimated from its signals.
pub(crate) fn estimate(
    loaded: &LoadedLog,
    forces: &[LinkageForce],
    rows: &EstimatedRows,
) -> ClockOffsets {
    offsets(loaded, forces, pairs::compare(loaded, forces, rows))
}

/// One offset for each topic, from those of the pairs.
fn offsets(loaded: &LoadedLog, forces: &[LinkageForce], pairs: Vec<PairOffset>) -> ClockOffsets {
    let signals = &loaded.signals;
    let Some(reference) = reference(signals) else {
        return ClockOffsets::default();
    };
    let known: Vec<(&PairOffset, f64, f64)> = (pairs.iter())
        .filter_map(|pair| Some((pair, pair.late_s?, pair.sigma_s?)))
        .collect();
    let mut reached = vec![reference];
    let mut grows = true;
    while grows {
        grows = false;
        for (pair, ..) in &known {
            for (from, to) in [(&pair.topic, &pair.against), (&pair.against, &pair.topic)] {
                if reached.contains(&from.as_str()) && !reached.contains(&to.as_str()) {
                    reached.push(to);
                    grows = true;
                }
            }
        }
    }
    let solved = solve(&reached, &known);
    let mut topics: Vec<TopicOffset> = Vec::new();
    let of_signals = signals.iter().map(|signal| &signal.topic);
    for name in of_signals.chain(forces.iter().map(|force| &force.topic)) {
        if topics.iter().any(|topic| topic.topic == *name) {
            continue;
        }
        let place = reached.iter().position(|reached| reached == name);
        let found = match (place, &solved) {
            (Some(0), _) => Some((0.0, 0.0)),
            (Some(place), Some(solved)) => Some(solved[place - 1]),
            _ => None,
        };
        topics.push(TopicOffset {
            topic: name.clone(),
            offset_s: found.map(|(late, _)| -late + 0.0),
            sigma_s: found.map(|(_, sigma)| sigma),
            applied: false,
            stated_s: loaded.clock_offsets_s.get(name).copied(),
            why_not: found.is_none().then(|| why_not(name, &pairs)),
        });
    }
    ClockOffsets {
        reference: Some(reference.to_owned()),
        topics,
        pairs,
    }
}

/// The reference: the IMU, on which loads depend most; else odometry, else the first joint states.
fn reference(signals: &[Signal]) -> Option<&str> {
    let of = |sensor: Sensor| signals.iter().find(|signal| signal.sensor == sensor);
    let found = of(Sensor::Imu).or_else(|| of(Sensor::Odometry));
    found
        .or_else(|| signals.first())
        .map(|signal| signal.topic.as_str())
}

/// Delay of each topic but the first, and its standard deviation.
fn solve(topics: &[&str], pairs: &[(&PairOffset, f64, f64)]) -> Option<Vec<(f64, f64)>> {
    let unknown = topics.len().checked_sub(1).filter(|&n| n > 0)?;
    let mut matrix = DMatrix::<f64>::zeros(unknown, unknown);
    let mut right = DVector::<f64>::zeros(unknown);
    let place = |name: &str| topics.iter().position(|topic| *topic == name);
    for (pair, late, sigma) in pairs {
        let (Some(a), Some(b)) = (place(&pair.topic), place(&pair.against)) else {
            continue;
        };
        let weight = 1.0 / (sigma * sigma);
        for (topic, sign) in [(a, 1.0), (b, -1.0)] {
            if topic > 0 {
                matrix[(topic - 1, topic - 1)] += weight;
                right[topic - 1] += sign * weight * late;
            }
        }
        if a > 0 && b > 0 {
            matrix[(a - 1, b - 1)] -= weight;
            matrix[(b - 1, a - 1)] -= weight;
        }
    }
    let inverse = matrix.try_inverse()?;
    let late = &inverse * right;
    Some(
        (0..unknown)
            .map(|i| (late[i], inverse[(i, i)].sqrt()))
            .collect(),
    )
}

/// Why the offset of a topic is unknown.
fn why_not(topic: &str, pairs: &[PairOffset]) -> String {
    let of_topic = pairs
        .iter()
        .filter(|pair| pair.topic == topic || pair.against == topic);
    let reasons: Vec<String> = of_topic
        .filter_map(|pair| Some(format!("{}: {}", pair.by, pair.why_not.as_ref()?)))
        .collect();
    match reasons.is_empty() {
        true => "no other signal measures the same motion".into(),
        false => reasons.join("; "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(topic: &str, against: &str, late_s: f64, sigma_s: f64) -> PairOffset {
        PairOffset {
            topic: topic.into(),
            against: against.into(),
            by: "",
            late_s: Some(late_s),
            sigma_s: Some(sigma_s),
            correlation: None,
            why_not: None,
        }
    }

    #[test]
    fn chained_and_direct_delays_are_weighted_by_variance() {
        // joints 41 ms late against odometry (2 ms), which is 1 ms early (1 ms); directly 38 ms (4 ms)
        let pairs = [
            pair("odom", "imu", -0.001, 0.001),
            pair("joints", "odom", 0.041, 0.002),
            pair("joints", "imu", 0.038, 0.004),
        ];
        let known: Vec<_> = pairs
            .iter()
            .map(|p| (p, p.late_s.unwrap(), p.sigma_s.unwrap()))
            .collect();
        let solved = solve(&["imu", "odom", "joints"], &known).unwrap();
        // by the chain 40 ms with variance 5, directly 38 ms with variance 16
        let (chain, direct) = (1.0 / 5.0, 1.0 / 16.0);
        let late = (chain * 0.040 + direct * 0.038) / (chain + direct);
        let sigma = (1.0_f64 / (chain + direct)).sqrt() * 1e-3;
        assert!((solved[1].0 - late).abs() < 1e-9, "{solved:?}");
        assert!((solved[1].1 - sigma).abs() < 1e-9, "{solved:?}");
    }
}
