//! Combines pairwise delays to one offset for each topic.
//!
//! With the offset of the reference fixed at zero, the others minimise
//! ```text
//!     sum over pairs ( late_topic - late_against - measured )^2 / sigma^2
//! ```
//! Their variances are the diagonal of the inverse normal matrix.
//!
//! Around a loop the estimates must add up to zero. Where they do not, at least one of them is wrong, and a mean of
//! right and wrong ones is an offset that no clock has. The fewest estimates that have to be wrong are left out. Where
//! different ones could be, each of them is: then the loop does not determine an offset.

use nalgebra::{DMatrix, DVector};
use tipwatch_language::{say, word};
use tipwatch_mechanics::state::Sensor;

use super::offsets::{ClockOffsets, PairOffset, REAL_SIGMAS, TopicOffset};
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

/// Most estimates that are tried as the wrong ones at a time.
const MOST_WRONG: usize = 3;

/// Combines the offsets of the pairs to one offset for each topic.
fn offsets(
    loaded: &LoadedLog,
    forces: &[LinkageForce],
    mut pairs: Vec<PairOffset>,
) -> ClockOffsets {
    let signals = &loaded.signals;
    let Some(reference) = reference(signals) else {
        return ClockOffsets::default();
    };
    leave_out_contradictions(&mut pairs);
    let known: Vec<Known<'_>> = pairs.iter().filter_map(Known::of).collect();
    let reached = reached(reference, &known);
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

/// A pair whose delay is known.
#[derive(Debug, Clone, Copy)]
struct Known<'a> {
    topic: &'a str,
    against: &'a str,
    late_s: f64,
    sigma_s: f64,
}

impl<'a> Known<'a> {
    /// `None` for a pair without a delay, and for one that is left out.
    fn of(pair: &'a PairOffset) -> Option<Self> {
        let is_used = pair.why_not.is_none();
        is_used.then_some(Self {
            topic: &pair.topic,
            against: &pair.against,
            late_s: pair.late_s?,
            sigma_s: pair.sigma_s?,
        })
    }
}

/// The topics that chains of pairs connect with one, which comes first.
fn reached<'a>(from: &'a str, pairs: &[Known<'a>]) -> Vec<&'a str> {
    let mut reached = vec![from];
    let mut grows = true;
    while grows {
        grows = false;
        for pair in pairs {
            for (from, to) in [(pair.topic, pair.against), (pair.against, pair.topic)] {
                if reached.contains(&from) && !reached.contains(&to) {
                    reached.push(to);
                    grows = true;
                }
            }
        }
    }
    reached
}

/// Says of the pairs that contradict others why they are not used.
fn leave_out_contradictions(pairs: &mut [PairOffset]) {
    loop {
        let places: Vec<usize> = (0..pairs.len())
            .filter(|&place| Known::of(&pairs[place]).is_some())
            .collect();
        let known: Vec<Known<'_>> = pairs.iter().filter_map(Known::of).collect();
        let wrong: Vec<usize> = contradicting(&known)
            .into_iter()
            .map(|number| places[number])
            .collect();
        if wrong.is_empty() {
            return;
        }
        let estimate = |pair: &PairOffset| {
            say!(
                "{} late relative to {} by {:.1} ms (standard deviation {:.1} ms) from {}",
                pair.topic,
                pair.against,
                pair.late_s.unwrap_or(0.0) * 1e3,
                pair.sigma_s.unwrap_or(0.0) * 1e3,
                pair.by
            )
        };
        let estimates: Vec<String> = wrong.iter().map(|&place| estimate(&pairs[place])).collect();
        let why_not = match estimates.as_slice() {
            [one] => say!("it contradicts the other estimates, which agree: {one}"),
            several => say!(
                "these estimates contradict each other: {}",
                several.join("; ")
            ),
        };
        for place in wrong {
            pairs[place].why_not = Some(why_not.clone());
        }
    }
}

/// The pairs that may be the wrong ones where estimates contradict each other: those of every smallest set without which
/// the others agree.
fn contradicting(pairs: &[Known<'_>]) -> Vec<usize> {
    let residuals = residuals(pairs);
    if agree(&residuals) {
        return Vec::new();
    }
    let looped: Vec<usize> = (0..pairs.len())
        .filter(|&pair| residuals[pair].is_some())
        .collect();
    for count in 1..=MOST_WRONG {
        let mut wrong: Vec<usize> = (sets(&looped, count).into_iter())
            .filter(|set| {
                let others = (0..pairs.len()).filter(|pair| !set.contains(pair));
                let others: Vec<Known<'_>> = others.map(|pair| pairs[pair]).collect();
                agree(&self::residuals(&others))
            })
            .flatten()
            .collect();
        wrong.sort_unstable();
        wrong.dedup();
        if !wrong.is_empty() {
            return wrong;
        }
    }
    looped
}

/// Whether no pair differs significantly from the offsets of the others.
fn agree(residuals: &[Option<f64>]) -> bool {
    !residuals.iter().flatten().any(|r| *r > REAL_SIGMAS)
}

/// All sets of so many of some numbers.
fn sets(of: &[usize], count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let mut sets = Vec::new();
    for (place, &first) in of.iter().enumerate() {
        for mut rest in self::sets(&of[place + 1..], count - 1) {
            rest.push(first);
            sets.push(rest);
        }
    }
    sets
}

/// Returns for each pair the number of standard deviations by which it differs from the other pairs; `None` if it is in no loop,
/// so that they say nothing of it.
fn residuals(pairs: &[Known<'_>]) -> Vec<Option<f64>> {
    let of_pair = |number: usize| {
        let pair = &pairs[number];
        // what the others say of it
        let others = (pairs.iter().enumerate()).filter(|(other, _)| *other != number);
        let others: Vec<Known<'_>> = others.map(|(_, pair)| *pair).collect();
        let topics = reached(pair.against, &others);
        let place = topics.iter().position(|topic| *topic == pair.topic)?;
        let (late_s, sigma_s) = *solve(&topics, &others)?.get(place.checked_sub(1)?)?;
        Some((pair.late_s - late_s).abs() / sigma_s.hypot(pair.sigma_s))
    };
    (0..pairs.len()).map(of_pair).collect()
}

/// Delay of each topic but the first, and its standard deviation.
fn solve(topics: &[&str], pairs: &[Known<'_>]) -> Option<Vec<(f64, f64)>> {
    let unknown = topics.len().checked_sub(1).filter(|&n| n > 0)?;
    let mut matrix = DMatrix::<f64>::zeros(unknown, unknown);
    let mut right = DVector::<f64>::zeros(unknown);
    let place = |name: &str| topics.iter().position(|topic| *topic == name);
    for pair in pairs {
        let (Some(a), Some(b)) = (place(pair.topic), place(pair.against)) else {
            continue;
        };
        let weight = 1.0 / (pair.sigma_s * pair.sigma_s);
        for (topic, sign) in [(a, 1.0), (b, -1.0)] {
            if topic > 0 {
                matrix[(topic - 1, topic - 1)] += weight;
                right[topic - 1] += sign * weight * pair.late_s;
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

/// Describes why the offset of a topic is unknown.
fn why_not(topic: &str, pairs: &[PairOffset]) -> String {
    let of_topic = pairs
        .iter()
        .filter(|pair| pair.topic == topic || pair.against == topic);
    let mut reasons: Vec<String> = of_topic
        .filter_map(|pair| {
            let why_not = pair.why_not.as_ref()?;
            Some(match pair.late_s {
                // it names the pairs
                Some(_) => why_not.clone(),
                None => format!("{}: {why_not}", pair.by),
            })
        })
        .collect();
    reasons.dedup();
    match reasons.is_empty() {
        true => word!("no other signal measures the same motion").into(),
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
        let known: Vec<_> = pairs.iter().filter_map(Known::of).collect();
        let solved = solve(&["imu", "odom", "joints"], &known).unwrap();
        // by the chain 40 ms with variance 5, directly 38 ms with variance 16
        let (chain, direct) = (1.0 / 5.0, 1.0 / 16.0);
        let late = (chain * 0.040 + direct * 0.038) / (chain + direct);
        let sigma = (1.0_f64 / (chain + direct)).sqrt() * 1e-3;
        assert!((solved[1].0 - late).abs() < 1e-9, "{solved:?}");
        assert!((solved[1].1 - sigma).abs() < 1e-9, "{solved:?}");
    }

    /// Returns the indices of the pairs that are left out.
    fn left_out(mut pairs: Vec<PairOffset>) -> Vec<usize> {
        leave_out_contradictions(&mut pairs);
        let numbers = 0..pairs.len();
        numbers.filter(|&n| pairs[n].why_not.is_some()).collect()
    }

    #[test]
    fn estimates_of_a_loop_that_contradict_each_other_are_left_out() {
        let odometry = || pair("odom", "imu", 0.001, 0.002);
        let wheels = || pair("joints", "odom", 0.0, 0.002);
        let tilt = |late_s| pair("joints", "imu", late_s, 0.012);
        // within three of the 12.3 ms by which the loop may fail to close
        let no = Vec::<usize>::new();
        assert_eq!(left_out(vec![odometry(), wheels(), tilt(0.035)]), no);
        assert_eq!(left_out(vec![odometry(), wheels(), tilt(-0.033)]), no);
        // any of the three may be the wrong one
        assert_eq!(left_out(vec![odometry(), wheels(), tilt(0.17)]), [0, 1, 2]);
        // what is in no loop has no contradiction
        let force = || pair("force", "joints", 0.3, 0.001);
        let pairs = vec![odometry(), force(), wheels(), tilt(0.17)];
        assert_eq!(left_out(pairs), [0, 2, 3]);
    }

    #[test]
    fn two_estimates_of_one_pair_that_contradict_each_other_name_both() {
        let mut pairs = vec![
            pair("joints", "imu", 0.0, 0.010),
            pair("joints", "imu", 0.166, 0.010),
        ];
        leave_out_contradictions(&mut pairs);
        for pair in &pairs {
            let why_not = pair.why_not.as_ref().unwrap();
            assert!(
                why_not.contains(" 0.0 ms") && why_not.contains("166.0 ms"),
                "{why_not}"
            );
        }
        let known: Vec<_> = pairs.iter().filter_map(Known::of).collect();
        assert_eq!(reached("imu", &known), ["imu"]);
        let why_not = why_not("joints", &pairs);
        assert_eq!(why_not.matches("166.0 ms").count(), 1, "{why_not}");
    }

    #[test]
    fn one_estimate_against_several_that_agree_is_the_wrong_one() {
        let late = |late_s| pair("joints", "imu", late_s, 0.002);
        assert_eq!(left_out(vec![late(0.0), late(0.083), late(0.001)]), [1]);
        // no two of these agree
        assert_eq!(left_out(vec![late(0.0), late(0.04), late(0.08)]), [0, 1, 2]);
        // the loop of the other stream confirms the odometry
        let pairs = vec![
            pair("odom", "imu", 0.0, 0.002),
            pair("arm", "odom", 0.0, 0.002),
            pair("arm", "imu", 0.0, 0.012),
            pair("legs", "odom", 0.0, 0.002),
            pair("legs", "imu", 0.2, 0.012),
        ];
        assert_eq!(left_out(pairs), [3, 4]);
    }
}
