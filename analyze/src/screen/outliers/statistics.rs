//! Robust statistics of few numbers.

/// The median; `None` of nothing.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() % 2 {
        1 => sorted.get(middle).copied(),
        _ => Some(0.5 * (sorted.get(middle.checked_sub(1)?)? + sorted.get(middle)?)),
    }
}

/// Standard deviation from the median of the distances to the median (MAD): 1.4826 MAD, which is the
/// standard deviation of normal values, and which few wild ones do not move.
pub(super) fn robust_sigma(values: &[f64]) -> Option<f64> {
    let middle = median(values)?;
    let distances: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    Some(1.4826 * median(&distances)?)
}

/// Probability that one more value differs so much from the median of `others` by chance, if all come from
/// one normal distribution; `sigma` is the standard deviation with which the value itself is known.
///
/// ```text
///     t = (value - median) / sqrt(s^2 (1 + 1.57 / n) + sigma^2),  s = 1.4826 MAD
/// ```
/// 1.57 / n is the variance of a median of n, relative to that of one value (pi / 2). t is read from
/// Student's distribution with 0.3 (n - 1) degrees of freedom, rounded down: the MAD knows as much of the
/// spread as 0.37 times as many values would, and rounded down the probability is never too small.
pub(super) fn of_one_more(value: f64, sigma: f64, others: &[f64]) -> Option<f64> {
    let n = others.len() as f64;
    let spread = robust_sigma(others)?;
    let variance = spread * spread * (1.0 + 1.57 / n) + sigma * sigma;
    let difference = value - median(others)?;
    if variance <= 0.0 {
        // equal values say nothing about how far others scatter
        return None;
    }
    let freedom = (0.3 * (n - 1.0)).floor().max(1.0) as u32;
    Some(student_two_sided(difference / variance.sqrt(), freedom))
}

/// Probability of a value at least as far from zero under Student's distribution (Abramowitz and Stegun,
/// 26.7.3 and 26.7.4).
fn student_two_sided(t: f64, freedom: u32) -> f64 {
    let angle = (t.abs() / f64::from(freedom).sqrt()).atan();
    let (sine, cosine) = angle.sin_cos();
    // 1 + 1/2 cos^2 + (1 3)/(2 4) cos^4 ..., or cos + 2/3 cos^3 + (2 4)/(3 5) cos^5 ...
    let is_odd = freedom % 2 == 1;
    let (mut term, mut power) = match is_odd {
        true => (cosine, 1),
        false => (1.0, 0),
    };
    let mut sum = if freedom == 1 { 0.0 } else { term };
    while power + 4 <= freedom {
        term *= cosine * cosine * f64::from(power + 1) / f64::from(power + 2);
        power += 2;
        sum += term;
    }
    let within = match is_odd {
        true => 2.0 / std::f64::consts::PI * (angle + sine * sum),
        false => sine * sum,
    };
    (1.0 - within).clamp(0.0, 1.0)
}

/// Most values of which all ways to choose are counted; of more the normal approximation is used.
const MOST_COUNTED: usize = 60;

/// Probability that `a` and `b` differ so much in rank by chance, if all come from one distribution,
/// whichever it is (Wilcoxon's rank-sum test, two-sided; ties share their ranks).
pub(super) fn of_two_groups(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.is_empty() || b.is_empty() {
        return None;
    }
    let mut all: Vec<(f64, bool)> = a.iter().map(|&value| (value, true)).collect();
    all.extend(b.iter().map(|&value| (value, false)));
    all.sort_by(|x, y| x.0.total_cmp(&y.0));
    // twice the rank, so that shared ranks are whole numbers
    let mut ranks = vec![0_usize; all.len()];
    let mut ties = 0.0;
    let mut from = 0;
    while from < all.len() {
        let same = all[from..].iter().take_while(|x| x.0 == all[from].0);
        let count = same.count();
        ranks[from..from + count].fill(2 * from + count + 1);
        ties += (count as f64).powi(3) - count as f64;
        from += count;
    }
    let sum: usize = ranks
        .iter()
        .zip(&all)
        .filter(|(_, (_, is_a))| *is_a)
        .map(|(rank, _)| rank)
        .sum();
    Some(match all.len() <= MOST_COUNTED {
        true => counted(&ranks, a.len(), sum),
        false => approximated(all.len() as f64, a.len() as f64, sum as f64, ties),
    })
}

/// Share of all ways to choose `size` of the ranks whose sum is at least as far from the middle.
fn counted(ranks: &[usize], size: usize, sum: usize) -> f64 {
    let total: usize = ranks.iter().sum();
    // ways[k][s]: ways to choose k ranks with the sum s
    let mut ways = vec![vec![0.0_f64; total + 1]; size + 1];
    ways[0][0] = 1.0;
    for (seen, &rank) in ranks.iter().enumerate() {
        for k in (1..=size.min(seen + 1)).rev() {
            for s in (rank..=total).rev() {
                let more = ways[k - 1][s - rank];
                ways[k][s] += more;
            }
        }
    }
    // the middle is size * total / count
    let count = ranks.len();
    let distance = |s: usize| (s * count).abs_diff(size * total);
    let all: f64 = ways[size].iter().sum();
    let far: f64 = (ways[size].iter().enumerate())
        .filter(|(s, _)| distance(*s) >= distance(sum))
        .map(|(_, ways)| ways)
        .sum();
    far / all
}

/// The same from the normal distribution, with ties and a correction for continuity.
fn approximated(count: f64, size: f64, doubled_sum: f64, ties: f64) -> f64 {
    let others = count - size;
    let middle = 0.5 * size * (count + 1.0);
    let variance = size * others / 12.0 * (count + 1.0 - ties / (count * (count - 1.0)));
    if variance <= 0.0 {
        return 1.0;
    }
    let distance = ((0.5 * doubled_sum - middle).abs() - 0.5).max(0.0);
    libm::erfc(distance / variance.sqrt() / std::f64::consts::SQRT_2)
}

/// Probabilities corrected for the number of comparisons (Holm): the chance that any of them is called
/// sure by chance stays below the limit that one alone would have.
pub(super) fn corrected(probabilities: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..probabilities.len()).collect();
    order.sort_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
    let mut corrected = vec![0.0; probabilities.len()];
    let mut largest: f64 = 0.0;
    for (place, &index) in order.iter().enumerate() {
        let left = (probabilities.len() - place) as f64;
        largest = largest.max((left * probabilities[index]).min(1.0));
        corrected[index] = largest;
    }
    corrected
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    #[test]
    fn val_probabilities_are_those_of_printed_tables() {
        // Student's distribution: t of 5 % two-sided
        for (freedom, t) in [
            (1, 12.706),
            (2, 4.303),
            (3, 3.182),
            (5, 2.571),
            (10, 2.228),
            (30, 2.042),
        ] {
            assert!(
                (student_two_sided(t, freedom) - 0.05).abs() < 5e-5,
                "{freedom}"
            );
        }
        assert_eq!(student_two_sided(0.0, 4), 1.0);
        // Wilcoxon: 3 of 11, the three smallest: 2 of 165 ways
        let (low, high): (Vec<f64>, Vec<f64>) = (
            (0..3).map(f64::from).collect(),
            (3..11).map(f64::from).collect(),
        );
        assert!((of_two_groups(&low, &high).unwrap() - 2.0 / 165.0).abs() < 1e-12);
        // Holm's own example
        let found = corrected(&[0.01, 0.04, 0.03, 0.005]);
        let expected = [0.03, 0.06, 0.06, 0.02];
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-12),
            "{found:?}"
        );
    }

    #[test]
    fn counted_and_approximated_probabilities_agree() {
        let a: Vec<f64> = (0..25).map(|i| f64::from(i % 7) + 0.8).collect();
        let b: Vec<f64> = (0..30).map(|i| f64::from(i % 9)).collect();
        let counted = of_two_groups(&a, &b).unwrap();
        let twice = |x: &[f64]| [x, x].concat();
        assert!(of_two_groups(&twice(&a), &twice(&b)).unwrap() < counted);
        let ranks: Vec<usize> = (1..=50).map(|rank| 2 * rank).collect();
        let sum: usize = ranks[..20].iter().sum::<usize>() + 500;
        let exact = super::counted(&ranks, 20, sum);
        assert!(
            (exact - approximated(50.0, 20.0, sum as f64, 0.0)).abs() < 0.01,
            "{exact}"
        );
    }

    #[test]
    fn equal_values_and_nothing_say_nothing() {
        assert_eq!(of_one_more(3.0, 0.0, &[1.0; 9]), None);
        assert_eq!(of_one_more(3.0, 0.0, &[]), None);
        assert_eq!(of_two_groups(&[], &[1.0]), None);
        assert_eq!(of_two_groups(&[1.0; 5], &[1.0; 5]), Some(1.0));
        assert_eq!(of_two_groups(&[1.0; 50], &[1.0; 50]), Some(1.0));
    }

    /// Uniform numbers (SplitMix64).
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn chance_is_called_sure_no_more_often_than_stated() {
        let mut state = 7;
        let normal = |state: &mut u64| (0..12).map(|_| random(state)).sum::<f64>() - 6.0;
        for n in [8, 12, 25] {
            let trials = 4000;
            let mut alarms = [0; 2];
            for _ in 0..trials {
                let all: Vec<f64> = (0..n + 1).map(|_| normal(&mut state)).collect();
                let (one, others) = all.split_first().unwrap();
                alarms[0] += u32::from(of_one_more(*one, 0.0, others).unwrap() < 0.05);
                let (recent, earlier) = others.split_at(n / 4);
                alarms[1] += u32::from(of_two_groups(recent, earlier).unwrap() < 0.05);
            }
            let share = alarms.map(|count| f64::from(count) / f64::from(trials));
            // three standard deviations of the count above 5 %
            assert!(
                share.iter().all(|share| *share < 0.05 + 0.0104),
                "{n}: {share:?}"
            );
        }
    }
}
