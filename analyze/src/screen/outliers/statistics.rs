//! Robust statistics of few numbers.

/// The median; `None` of nothing.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    Sorted::of(values.to_vec()).without(None).median()
}

/// The mean; `None` of nothing.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Values in order, of which each in turn is compared with all others.
#[derive(Debug, Default)]
pub(super) struct Sorted(Vec<f64>);

impl Sorted {
    pub(super) fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    /// All of them but one of this value.
    pub(super) fn without(&self, value: Option<f64>) -> Others<'_> {
        let place = value.and_then(|value| self.0.binary_search_by(|x| x.total_cmp(&value)).ok());
        let (before, after) = self.0.split_at(place.unwrap_or(self.0.len()));
        Others {
            before,
            after: after.get(1..).unwrap_or_default(),
        }
    }
}

/// [`Sorted`] values without one of them. Nothing is computed of each of them: in a fleet every machine has its own others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Others<'a> {
    before: &'a [f64],
    after: &'a [f64],
}

impl Others<'_> {
    pub(super) fn len(&self) -> usize {
        self.before.len() + self.after.len()
    }

    /// The value at a place of the order.
    fn at(&self, place: usize) -> Option<f64> {
        let behind = || self.after.get(place - self.before.len());
        self.before.get(place).or_else(behind).copied()
    }

    pub(super) fn median(&self) -> Option<f64> {
        self.middle(|place| self.at(place))
    }

    /// The middle one of as many numbers as there are values, or the mean of the two in the middle, by their place in order.
    fn middle(&self, at: impl Fn(usize) -> Option<f64>) -> Option<f64> {
        let middle = self.len() / 2;
        match self.len() % 2 {
            1 => at(middle),
            _ => Some(0.5 * (at(middle.checked_sub(1)?)? + at(middle)?)),
        }
    }

    /// Standard deviation from the median of the distances to the median (MAD): 1.4826 MAD, which is the
    /// standard deviation of normal values, and which few wild ones do not move.
    fn robust_sigma(&self) -> Option<f64> {
        let center = self.median()?;
        // the nearest values are neighbours: of all runs of so many, the one whose farther end is nearest
        let distance = |place: usize| {
            let farther_end = |first: usize| {
                Some((center - self.at(first)?).max(self.at(first + place)? - center))
            };
            let (mut low, mut high) = (0, self.len() - place);
            while low < high {
                let first = usize::midpoint(low, high);
                match self.at(first + place)? - center < center - self.at(first)? {
                    true => low = first + 1,
                    false => high = first,
                }
            }
            let ends = [low.checked_sub(1), Some(low)].into_iter().flatten();
            ends.filter_map(farther_end).reduce(f64::min)
        };
        Some(1.4826 * self.middle(distance)?)
    }
}

/// Probability that one more value differs so much from the median of `others` by chance, if all come from
/// one normal distribution; `sigma` is the standard deviation with which the value itself is known.
///
/// ```text
///     t = (value - median) / sqrt(s^2 (1 + 1.57 / n) + sigma^2),  s = 1.4826 MAD
/// ```
/// 1.57 / n is the variance of a median of n, relative to that of one value (pi / 2). t is read from
/// Student's distribution with 0.3 (n - 1) degrees of freedom, rounded down: the MAD knows as much of the
/// spread as 0.37 times as many values would, and rounded down the probability is never too small. So it is with
/// [`MOST_FREEDOM`].
pub(super) fn of_one_more(value: f64, sigma: f64, others: &Others<'_>) -> Option<f64> {
    let n = others.len() as f64;
    let spread = others.robust_sigma()?;
    let variance = spread * spread * (1.0 + 1.57 / n) + sigma * sigma;
    let difference = value - others.median()?;
    if variance <= 0.0 {
        // equal values say nothing about how far others scatter
        return None;
    }
    let freedom = (0.3 * (n - 1.0)).floor().clamp(1.0, MOST_FREEDOM) as u32;
    Some(student_two_sided(difference / variance.sqrt(), freedom))
}

/// Most degrees of freedom: a sum of half as many terms is made for each machine. The probability of 1e-7, which one among
/// thousands of machines must fall below, is by a quarter too large.
const MOST_FREEDOM: f64 = 1000.0;

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

/// Fewest values before and after a change.
pub(super) const LEAST_SEGMENT: usize = 3;
/// Orders that are tried until this many show a change as large as the real one: from then on the share of those is known
/// to a tenth.
const ENOUGH: u32 = 100;
/// Most orders that are tried: the smallest probability that can be told from none.
const MOST_ORDERS: u32 = 1_000_000;

/// A change of the mean within a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Change {
    /// Number of values before it.
    pub(super) before: usize,
    /// Mean after it minus mean before it.
    pub(super) difference: f64,
    /// Correlation of neighbouring values within the two parts: days resemble each other, by weather, site and work.
    pub(super) correlation: f64,
    /// Number of values.
    values: usize,
    /// T / s, and the probability by order.
    score: f64,
    by_order: f64,
}

impl Change {
    /// Probability that a series in which nothing changed shows so large a change in this direction. Of few values the
    /// correlation is hardly known: it is taken to be at least `usual`, that of comparable series.
    pub(super) fn chance(&self, usual: f64) -> f64 {
        let correlation = self.correlation.max(usual).clamp(0.0, MOST_CORRELATION);
        let t = self.score * ((1.0 - correlation) / (1.0 + correlation)).sqrt();
        let places = self.values + 1 - 2 * LEAST_SEGMENT;
        let normal = 0.5 * student_two_sided(t, (self.values - 2) as u32) * places as f64;
        self.by_order.max(STRICTER * normal).min(1.0)
    }
}

/// Largest correlation that is believed: what resembles itself more is a level that wanders.
const MOST_CORRELATION: f64 = 0.95;

/// The most pronounced fall of the mean within a series, such that values after it are smaller; `None` of a series that is
/// too short or constant.
///
/// ```text
///     T = max over k of (mean of the first k - mean of the others) sqrt(k (n - k) / n)
/// ```
/// If nothing changed and the values are independent, every order of them is equally likely, whatever their distribution. The
/// probability by order is therefore the share of random orders with a T at least as large (permutation test of the largest CUSUM, with the
/// stopping rule of Besag and Clifford). A second one assumes normal values:
///
/// ```text
///     t = T / s sqrt((1 - r) / (1 + r)),  times the number of k (Bonferroni)
///     r = r1 + 2 (1 + 3 r1) / n
/// ```
/// with s and the correlation r1 of neighbours from the values within the two parts: n values that resemble their neighbours
/// tell as much of a mean as n (1 - r) / (1 + r) independent ones, and r1 is too small by (1 + 3 r1) / n for each mean that is
/// taken away (Marriott and Pope, 1954). Both must be small, as the larger of them is returned: the first alone calls a change of a thousandth of the scatter
/// sure if it separates a few days well, the second alone trusts the shape of the distribution.
pub(super) fn fall(values: &[f64]) -> Option<Change> {
    fall_by(values, MOST_ORDERS)
}

/// Finds the most pronounced fall of the mean by at most so many random orders; see [`fall`].
fn fall_by(values: &[f64], most_orders: u32) -> Option<Change> {
    let n = values.len();
    let (first, last) = (
        values.iter().copied().reduce(f64::min)?,
        values.iter().copied().reduce(f64::max)?,
    );
    if n < 2 * LEAST_SEGMENT || !(last > first) {
        return None;
    }
    let (before, most) = largest_fall(values);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (early, late) = values.split_at(before);
    let difference = mean(late) - mean(early);
    let mut order = values.to_vec();
    // the same series has the same probability
    let mut state = values.iter().fold(n as u64, |state, value| {
        state.rotate_left(7) ^ value.to_bits().wrapping_mul(0x9E37_79B9_7F4A_7C15)
    });
    let (mut tried, mut as_large) = (0_u32, 0_u32);
    // equal values in another order must count as equal
    let limit = most - 1e-9 * (last - first);
    while tried < most_orders && as_large < ENOUGH {
        shuffle(&mut order, &mut state);
        tried += 1;
        as_large += u32::from(largest_fall(&order).1 >= limit);
    }
    let by_order = f64::from(as_large + 1) / f64::from(tried + 1);
    let (spread, correlation) = scatter(early, late);
    Some(Change {
        before,
        difference,
        correlation: correlation + 2.0 * (1.0 + 3.0 * correlation) / n as f64,
        values: n,
        score: most / spread,
        by_order,
    })
}

/// Ratio by which the probability under a normal distribution must be smaller than that by order: a real change has a probability
/// many times smaller anyway, and few alarms are left to chance.
const STRICTER: f64 = 50.0;

/// Standard deviation within two parts, and the correlation of neighbours there; no correlation of equal values.
fn scatter(early: &[f64], late: &[f64]) -> (f64, f64) {
    let (mut squares, mut products) = (0.0, 0.0);
    for part in [early, late] {
        let mean = part.iter().sum::<f64>() / part.len() as f64;
        squares += part.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let neighbours = part.windows(2);
        products += neighbours
            .map(|two| (two[0] - mean) * (two[1] - mean))
            .sum::<f64>();
    }
    let freedom = early.len() + late.len() - 2;
    let correlation = if squares > 0.0 {
        products / squares
    } else {
        0.0
    };
    ((squares / freedom as f64).sqrt(), correlation)
}

/// Finds the place at which the mean falls most, as the number of values before it, and the size of the fall (T).
fn largest_fall(values: &[f64]) -> (usize, f64) {
    let n = values.len() as f64;
    let all: f64 = values.iter().sum();
    let mut sum: f64 = values[..LEAST_SEGMENT - 1].iter().sum();
    let mut largest = (LEAST_SEGMENT, f64::NEG_INFINITY);
    for k in LEAST_SEGMENT..=values.len() - LEAST_SEGMENT {
        sum += values[k - 1];
        let k_values = k as f64;
        let fall = (sum - all * k_values / n) * (n / (k_values * (n - k_values))).sqrt();
        if fall > largest.1 {
            largest = (k, fall);
        }
    }
    largest
}

/// Smallest probability that [`fall`] can find in so many values: that of an order in which all smaller values come last.
pub(super) fn least_chance(values: usize) -> f64 {
    let half = values / 2;
    // ways to choose half of them
    (1..=half).fold(1.0, |chance, k| {
        chance * k as f64 / (values - half + k) as f64
    })
}

/// A random order (Fisher and Yates).
fn shuffle(values: &mut [f64], state: &mut u64) {
    for last in (1..values.len()).rev() {
        let place = (u128::from(random(state)) * (last as u128 + 1)) >> 64;
        values.swap(last, place as usize);
    }
}

/// The next number of SplitMix64.
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Which of some probabilities are discoveries: of all of them together at most a share of `rate` is expected to be false
/// (Benjamini and Hochberg). Returned is each one's smallest rate at which it is one (q-value).
pub(super) fn discovery_rates(probabilities: &[f64]) -> Vec<f64> {
    let count = probabilities.len();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
    let mut rates = vec![1.0; count];
    let mut least: f64 = 1.0;
    for (place, &index) in order.iter().enumerate().rev() {
        least = least.min(probabilities[index] * count as f64 / (place + 1) as f64);
        rates[index] = least;
    }
    rates
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
        // the example of Benjamini and Hochberg (1995), 15 probabilities: four discoveries at 5 %
        let found = discovery_rates(&[
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
            0.5719, 0.6528, 0.7590, 1.0,
        ]);
        assert_eq!(
            found.iter().filter(|rate| **rate <= 0.05).count(),
            4,
            "{found:?}"
        );
        // C(18, 9) and C(7, 3) ways to choose
        assert!((least_chance(18) - 1.0 / 48_620.0).abs() < 1e-12);
        assert!((least_chance(7) - 1.0 / 35.0).abs() < 1e-12);
    }

    /// Beside the definition: distances of all others, sorted.
    #[test]
    fn scatter_of_the_others_is_that_of_their_distances() {
        let mut state = 11;
        for count in 1..40_usize {
            // some values are equal
            let values: Vec<f64> = (0..count)
                .map(|_| (4.0 * normal(&mut state)).round() / 8.0)
                .collect();
            let sorted = Sorted::of(values.clone());
            for left_out in 0..count {
                let mut others = values.clone();
                let value = others.remove(left_out);
                let expected = median(&others).map(|center| {
                    let distances: Vec<f64> = others.iter().map(|x| (x - center).abs()).collect();
                    1.4826 * median(&distances).unwrap()
                });
                let found = sorted.without(Some(value));
                assert_eq!(found.len(), others.len());
                assert_eq!(found.median(), median(&others));
                assert_eq!(found.robust_sigma(), expected, "{others:?}");
            }
        }
    }

    #[test]
    fn a_change_is_found_where_it_is() {
        let mut state = 3;
        let mut values: Vec<f64> = (0..18).map(|_| 0.5 + 0.02 * normal(&mut state)).collect();
        values[13..].iter_mut().for_each(|value| *value -= 0.45);
        let found = fall(&values).unwrap();
        assert_eq!(found.before, 13);
        assert!((found.difference + 0.45).abs() < 0.03);
        // the five smallest values are last in one of C(18, 5) orders
        assert!(
            (found.chance(0.0) - 1.0 / 8568.0).abs() < 0.3 / 8568.0,
            "{found:?}"
        );
        let rising: Vec<f64> = values.iter().rev().copied().collect();
        assert!(fall(&rising).unwrap().chance(0.0) > 0.5);
    }

    #[test]
    fn equal_values_and_nothing_say_nothing() {
        let of_equal = |count| Sorted::of(vec![1.0; count]);
        assert_eq!(of_one_more(3.0, 0.0, &of_equal(9).without(None)), None);
        assert_eq!(of_one_more(3.0, 0.0, &of_equal(0).without(None)), None);
        assert_eq!(fall(&[]), None);
        assert_eq!(fall(&[1.0; 40]), None);
        assert_eq!(fall(&[1.0, 2.0, 3.0, 4.0, 5.0]), None);
        // two values that take turns
        let turns: Vec<f64> = (0..20).map(|i| f64::from(i % 2)).collect();
        assert!(fall(&turns).unwrap().chance(0.0) > 0.5);
    }

    /// Normal numbers: the sum of twelve uniform ones.
    fn normal(state: &mut u64) -> f64 {
        let mut uniform = || (random(state) >> 11) as f64 / (1_u64 << 53) as f64;
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    #[test]
    fn chance_is_called_sure_no_more_often_than_stated() {
        let mut state = 7;
        for n in [8, 12, 25] {
            let trials = 1000;
            let mut alarms = [0; 3];
            for _ in 0..trials {
                let all: Vec<f64> = (0..n + 1).map(|_| normal(&mut state)).collect();
                let (one, others) = all.split_first().unwrap();
                let sorted = Sorted::of(all.clone());
                let chance = of_one_more(*one, 0.0, &sorted.without(Some(*one)));
                alarms[0] += u32::from(chance.unwrap() < 0.05);
                alarms[1] += u32::from(fall(others).unwrap().chance(0.0) < 0.05);
                // mostly nothing, sometimes much: far from normal
                let rare = |value: &f64| if *value > 1.3 { value.exp() } else { 0.0 };
                let rare: Vec<f64> = others.iter().map(rare).collect();
                alarms[2] += u32::from(fall(&rare).is_some_and(|change| change.chance(0.0) < 0.05));
            }
            let share = alarms.map(|count| f64::from(count) / f64::from(trials));
            // three standard deviations of the count above 5 %
            assert!(
                share.iter().all(|share| *share < 0.05 + 0.0207),
                "{n}: {share:?}"
            );
        }
    }

    /// Values that resemble their neighbours (first order, 0.8): most orders of them are less conspicuous than their own.
    #[test]
    fn values_that_resemble_their_neighbours_are_called_sure_no_more_often() {
        let mut state = 13;
        for n in [18, 40] {
            let (trials, mut alarms) = (500, 0);
            for _ in 0..trials {
                let mut last = normal(&mut state);
                let series = (0..n).map(|_| {
                    last = 0.8 * last + 0.6 * normal(&mut state);
                    last
                });
                let series: Vec<f64> = series.collect();
                alarms += u32::from(fall_by(&series, 1000).unwrap().chance(0.0) < 0.05);
            }
            let share = f64::from(alarms) / f64::from(trials);
            // three standard deviations of the count above 5 %
            assert!(share < 0.05 + 0.0292, "{n}: {share}");
        }
    }
}
