//! The delay between two measurements of one motion.
//!
//! For each delay tau the late signal y is fitted by the known ones x:
//! ```text
//!     S(tau) = min over a, b, c of sum ( y(t + tau) - a x(t) - b - c t )^2
//! ```
//! Each stretch of time has its own b and c. A coarse search over more than a second finds the part of the range in which a
//! fine one follows. The delay minimises the sum over the channels of ln S, so a
//! channel counts by how well it fits, whatever its unit and gain. A parabola through the three lowest
//! points interpolates between steps. The standard deviation comes from a jackknife over blocks of time,
//! valid for correlated errors, and is at least the disagreement between the channels.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix};
use rayon::prelude::*;
use tipwatch_language::{say, word};

use super::channel::{COARSE_STEP, Channel};
use super::grid::STEP_S;

/// Delays compared, early and late ones and zero: up to half a second either way of the middle.
const DELAYS: usize = 2 * 50 + 1;
/// First the middle is searched among so many delays of coarse steps: up to 1.12 s either way. From a second on the
/// log times show that two clocks differ. A search that ends before the true delay finds the next period of a periodic
/// motion in its place.
const COARSE_DELAYS: usize = 2 * 56 + 1;
/// Fewest steps that all delays of the first search must have in common: two seconds.
const FEWEST_STEPS: usize = 200;
/// Distance from zero within which a middle counts as zero (steps): half of the range that is compared around it.
const NEAR_ZERO: usize = 25;
/// Length of a block of the jackknife (steps).
const BLOCK: usize = 250;
/// Fewest and most blocks.
const FEWEST_BLOCKS: usize = 6;
const MOST_BLOCKS: usize = 40;
/// Smallest correlation that determines a delay.
const LEAST_CORRELATION: f64 = 0.6;
/// Largest standard deviation of a delay (s).
const LARGEST_SIGMA_S: f64 = 0.03;
/// Smallest standard deviation (s): sensors low-pass what they measure.
const FLOOR_S: f64 = 0.0005;
/// Residuals below this share of the signal are rounding errors.
const ROUNDING: f64 = 1e-10;

/// A delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Delay {
    /// Delay of the late signal (s).
    pub(super) seconds: f64,
    /// Standard deviation (s).
    pub(super) sigma: f64,
    /// Correlation of the best channel at that delay.
    pub(super) correlation: f64,
}

/// Sums of one channel over a block, for each of `D` delays.
#[derive(Debug, Clone)]
struct Sums<const D: usize> {
    /// The stretch of time that contains the block.
    stretch: usize,
    /// Known by known; the first two are a constant and the time.
    known: Vec<Vec<f64>>,
    /// Sums of each known signal times the late one, for each delay.
    both: Vec<[f64; D]>,
    /// Late by late, for each delay.
    late: [f64; D],
}

/// The largest of `D` delays, either way (steps).
const fn farthest<const D: usize>() -> usize {
    D / 2
}

/// Estimates the delay of the late signals; `stretches` holds the channels of each stretch, in the same order.
///
/// # Errors
/// The signals do not determine a delay; the error says why.
pub(super) fn find(stretches: &[Vec<Option<Channel>>]) -> Result<Delay, String> {
    let coarse: Vec<Vec<Option<Channel>>> = stretches
        .iter()
        .map(|channels| {
            channels
                .iter()
                .map(|c| Some(c.as_ref()?.coarse()))
                .collect()
        })
        .collect();
    let common = coarse.iter().flatten().flatten();
    let common = common.map(compared_steps::<COARSE_DELAYS>).max();
    let middle = match common >= Some(FEWEST_STEPS / COARSE_STEP) {
        true => middle(&coarse)?,
        false => 0,
    };
    if middle.unsigned_abs() <= NEAR_ZERO {
        return around_zero(stretches);
    }
    let shifted: Vec<Vec<Option<Channel>>> = stretches
        .iter()
        .map(|channels| {
            channels
                .iter()
                .map(|c| Some(c.as_ref()?.earlier(middle)))
                .collect()
        })
        .collect();
    let found = around_zero(&shifted)?;
    Ok(Delay {
        seconds: found.seconds + middle as f64 * STEP_S,
        ..found
    })
}

/// The delay near which the signals agree best (steps), whichever part of the log is left out.
fn middle(coarse: &[Vec<Option<Channel>>]) -> Result<isize, String> {
    let channels = sums::<COARSE_DELAYS>(coarse)?;
    let costs = costs(&channels);
    correlation(&costs)?;
    let steps = |place: usize| {
        (place as isize - farthest::<COARSE_DELAYS>() as isize) * COARSE_STEP as isize
    };
    let farthest_s = farthest::<COARSE_DELAYS>() as f64 * COARSE_STEP as f64 * STEP_S;
    let beyond = || say!("best agreement beyond {farthest_s:.1} s, or no agreement");
    let found = steps(deepest(&costs).ok_or_else(beyond)?);
    let parts = without_each_block(&channels, |costs| Some(steps(deepest(costs)?)));
    for part in parts {
        let part = part.ok_or(word!("parts of the log disagree"))?;
        if part.abs_diff(found) > NEAR_ZERO {
            return Err(say!(
                "parts of the log disagree, as with a periodic motion: {:.1} s or {:.1} s",
                found as f64 * STEP_S,
                part as f64 * STEP_S
            ));
        }
    }
    Ok(found)
}

/// Estimates a delay of less than half a second.
fn around_zero(stretches: &[Vec<Option<Channel>>]) -> Result<Delay, String> {
    let channels = sums::<DELAYS>(stretches)?;
    let costs = costs(&channels);
    let correlation = correlation(&costs)?;
    let seconds = valley(&costs).ok_or(word!(
        "best agreement beyond half a second, or no agreement"
    ))?;
    let jackknife = jackknife(&channels).ok_or(word!("parts of the log disagree"))?;
    let sigma = jackknife.hypot(FLOOR_S).max(disagreement(&costs, seconds));
    if sigma > LARGEST_SIGMA_S {
        return Err(say!(
            "not enough motion: estimated delay {:.0} ms with standard deviation {:.0} ms",
            seconds * 1e3,
            sigma * 1e3
        ));
    }
    Ok(Delay {
        seconds,
        sigma,
        correlation,
    })
}

/// The sums of each channel that has enough blocks.
fn sums<const D: usize>(stretches: &[Vec<Option<Channel>>]) -> Result<Vec<Vec<Sums<D>>>, String> {
    let count = stretches.iter().map(Vec::len).max().unwrap_or(0);
    let channels: Vec<Vec<Sums<D>>> = (0..count)
        .map(|channel| {
            let parts = stretches.iter().enumerate();
            let parts = parts.filter_map(|(at, s)| Some((at, s.get(channel)?.as_ref()?)));
            blocks(parts)
        })
        .filter(|blocks: &Vec<Sums<D>>| blocks.len() >= FEWEST_BLOCKS)
        .collect();
    match channels.is_empty() {
        true => Err(word!("too little time with both signals and motion").into()),
        false => Ok(channels),
    }
}

/// The costs of each channel over all blocks.
fn costs<const D: usize>(channels: &[Vec<Sums<D>>]) -> Vec<Vec<f64>> {
    channels.iter().map(|c| cost(c, |_| true)).collect()
}

/// The correlation of the best channel at its best delay, if it is enough.
fn correlation(costs: &[Vec<f64>]) -> Result<f64, String> {
    let least = |cost: &Vec<f64>| cost.iter().copied().fold(f64::INFINITY, f64::min);
    let best = costs.iter().map(least).fold(f64::INFINITY, f64::min);
    let correlation = (1.0 - best.exp()).max(0.0).sqrt();
    if correlation < LEAST_CORRELATION {
        return Err(say!(
            "not enough motion: the signals are too weakly correlated ({correlation:.2})"
        ));
    }
    Ok(correlation)
}

/// Returns the number of steps of the known signals that have a late sample at each of `D` delays.
fn compared_steps<const D: usize>(channel: &Channel) -> usize {
    channel.late.len().saturating_sub(2 * farthest::<D>())
}

/// Sums over blocks of time.
fn blocks<'a, const D: usize>(parts: impl Iterator<Item = (usize, &'a Channel)>) -> Vec<Sums<D>> {
    let parts: Vec<(usize, &Channel)> = parts.collect();
    let width = parts.iter().map(|(_, c)| c.known.len()).min().unwrap_or(0);
    let total = parts
        .iter()
        .map(|(_, c)| compared_steps::<D>(c))
        .sum::<usize>();
    let length = BLOCK
        .min(total / (2 * FEWEST_BLOCKS))
        .max(total / MOST_BLOCKS);
    if width == 0 || length == 0 {
        return Vec::new();
    }
    let blocks = parts.into_iter().flat_map(|(stretch, channel)| {
        let end = channel.late.len().saturating_sub(farthest::<D>());
        let ends = (farthest::<D>() + length..=end).step_by(length);
        ends.map(move |end| (stretch, channel, end - length..end))
    });
    let blocks: Vec<(usize, &Channel, Range<usize>)> = blocks.collect();
    let blocks = blocks.into_par_iter();
    let sums = blocks.map(|(stretch, channel, steps)| Sums::of(stretch, channel, width, steps));
    sums.collect()
}

impl<const D: usize> Sums<D> {
    fn of(stretch: usize, channel: &Channel, width: usize, steps: Range<usize>) -> Self {
        let (from, to) = (steps.start, steps.end);
        let one = vec![1.0; to - from];
        let middle = 0.5 * channel.late.len() as f64;
        let time: Vec<f64> = steps.map(|i| i as f64 / middle - 1.0).collect();
        let known: Vec<&[f64]> = [&one[..], &time]
            .into_iter()
            .chain((0..width).map(|k| &channel.known[k][from..to]))
            .collect();
        // the first window, and how far the others reach beyond it
        let late = &channel.late[from - farthest::<D>()..to + farthest::<D>()];
        let moving = MovingSums::of(late, to - from);
        let by_one = |delay: usize| moving.values[delay];
        // step number from + j goes with the late signal's step delay + j
        let by_time = |delay: usize| {
            let ahead = from as f64 - delay as f64;
            (moving.by_place[delay] + ahead * moving.values[delay]) / middle - moving.values[delay]
        };
        let by_signal = |known: &[f64]| {
            std::array::from_fn(|delay| dot(known, &late[delay..delay + known.len()]))
        };
        let own = [std::array::from_fn(by_one), std::array::from_fn(by_time)];
        Self {
            stretch,
            known: (known.iter())
                .map(|a| known.iter().map(|b| dot(a, b)).collect())
                .collect(),
            both: (own.into_iter())
                .chain(known[OWN..].iter().map(|known| by_signal(known)))
                .collect(),
            late: moving.squares,
        }
    }
}

/// Sums over a window that moves over a signal, one step for each delay.
struct MovingSums<const D: usize> {
    values: [f64; D],
    /// Sums of each value times its place in the signal.
    by_place: [f64; D],
    squares: [f64; D],
}

impl<const D: usize> MovingSums<D> {
    /// Differences of sums from the signal's first step on: a window's own sum would be added anew for each delay.
    fn of(signal: &[f64], window: usize) -> Self {
        let over_windows = |term: &dyn Fn(usize, f64) -> f64| {
            let mut sums = Vec::with_capacity(signal.len() + 1);
            let mut sum = 0.0;
            sums.push(sum);
            for (place, &value) in signal.iter().enumerate() {
                sum += term(place, value);
                sums.push(sum);
            }
            std::array::from_fn(|delay| sums[delay + window] - sums[delay])
        };
        Self {
            values: over_windows(&|_, value| value),
            by_place: over_windows(&|place, value| place as f64 * value),
            squares: over_windows(&|_, value| value * value),
        }
    }
}

/// Dot product in eight independent partial sums.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Constant and linear terms of a stretch.
const OWN: usize = 2;

/// Returns for each delay the logarithm of the residual of the fit relative to the residual of constant and linear terms alone,
/// over the blocks for which `counts`.
fn cost<const D: usize>(blocks: &[Sums<D>], counts: impl Fn(usize) -> bool) -> Vec<f64> {
    let used: Vec<&Sums<D>> = (blocks.iter().enumerate())
        .filter(|(block, _)| counts(*block))
        .map(|(_, sums)| sums)
        .collect();
    let known = used.first().map_or(0, |sums| sums.known.len());
    let own = OWN * (1 + used.iter().map(|sums| sums.stretch).max().unwrap_or(0));
    // constant and linear terms of each stretch first, then the shared coefficients
    let place = |sums: &Sums<D>, k: usize| match k < OWN {
        true => OWN * sums.stretch + k,
        false => own + k - OWN,
    };
    let width = own + known.saturating_sub(OWN);
    let mut matrix = DMatrix::zeros(width, width);
    for sums in &used {
        for (i, row) in sums.known.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                matrix[(place(sums, i), place(sums, j))] += product;
            }
        }
    }
    let Some(factor) = cholesky(matrix) else {
        return vec![0.0; D];
    };
    let mut late = [0.0; D];
    let mut both = vec![[0.0; D]; width];
    for sums in &used {
        add(&mut late, &sums.late);
        for (k, products) in sums.both.iter().enumerate() {
            add(&mut both[place(sums, k)], products);
        }
    }
    solve_lower(&factor, &mut both);
    // b' inv(A) b = |inv(L) b|^2, term by term: what each signal explains beyond those before it
    let explained = |terms: &[[f64; D]], delay: usize| -> f64 {
        terms.iter().map(|term| term[delay] * term[delay]).sum()
    };
    let (of_stretches, of_signals) = both.split_at(own);
    let cost = |(delay, late): (usize, f64)| {
        let moving = late - explained(of_stretches, delay);
        let left = moving - explained(of_signals, delay);
        (left / moving.max(f64::MIN_POSITIVE)).max(ROUNDING).ln()
    };
    late.into_iter().enumerate().map(cost).collect()
}

/// Replaces right sides b, of all delays at once, by inv(L) b.
fn solve_lower<const D: usize>(factor: &DMatrix<f64>, right: &mut [[f64; D]]) {
    for i in 0..right.len() {
        let (before, rest) = right.split_at_mut(i);
        let row = &mut rest[0];
        for (j, solved) in before.iter().enumerate() {
            let by = factor[(i, j)];
            for (at, solved) in row.iter_mut().zip(solved) {
                *at -= by * solved;
            }
        }
        let diagonal = factor[(i, i)];
        row.iter_mut().for_each(|at| *at /= diagonal);
    }
}

fn add<const D: usize>(sums: &mut [f64; D], more: &[f64; D]) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += more;
    }
}

/// Cholesky factor L of A = L L', slightly regularised for collinear signals.
fn cholesky(mut a: DMatrix<f64>) -> Option<DMatrix<f64>> {
    for i in 0..a.nrows() {
        // a stretch without a block does not contribute
        a[(i, i)] = if a[(i, i)] > 0.0 {
            a[(i, i)] * (1.0 + 1e-9)
        } else {
            1.0
        };
    }
    a.cholesky().map(Cholesky::unpack)
}

/// The delay of least cost, by its place; `None` at the ends of the range.
fn lowest(costs: &[Vec<f64>]) -> Option<usize> {
    let sum = |delay: usize| costs.iter().map(|cost| cost[delay]).sum::<f64>();
    let delays = costs.first().map_or(0, Vec::len);
    let lowest = (0..delays).min_by(|&a, &b| sum(a).total_cmp(&sum(b)))?;
    (lowest > 0 && lowest + 1 < delays).then_some(lowest)
}

/// The delay whose valley is deepest, by its place; `None` at the ends of the range. The bottom of a valley lies between
/// steps: another period whose bottom is on a step would look deeper.
fn deepest(costs: &[Vec<f64>]) -> Option<usize> {
    let delays = costs.first().map_or(0, Vec::len);
    let depth = |place: usize| -> f64 {
        let bottoms = costs.iter().map(|cost| {
            let Some(&[a, b, c]) = (place.checked_sub(1))
                .and_then(|before| cost.get(before..=place + 1)?.first_chunk::<3>())
            else {
                return cost[place];
            };
            let [a, b, c] = [a.exp(), b.exp(), c.exp()];
            if a < b || c < b || a - 2.0 * b + c <= 0.0 {
                return b.ln();
            }
            let bottom = b - (a - c) * (a - c) / (8.0 * (a - 2.0 * b + c));
            bottom.max(ROUNDING).ln()
        });
        bottoms.sum()
    };
    let deepest = (0..delays).min_by(|&a, &b| depth(a).total_cmp(&depth(b)))?;
    (deepest > 0 && deepest + 1 < delays).then_some(deepest)
}

/// The delay of least cost (s); `None` at the ends of the range. Interpolates by a parabola through the
/// residuals, each channel relative to its minimum: sums of squares are parabolic, their logarithms are
/// not.
fn valley(costs: &[Vec<f64>]) -> Option<f64> {
    let lowest = lowest(costs)?;
    let left = |delay: usize| -> f64 {
        let shares = costs.iter().map(|cost| (cost[delay] - cost[lowest]).exp());
        shares.sum()
    };
    let (a, b, c) = (left(lowest - 1), left(lowest), left(lowest + 1));
    let bend = a - 2.0 * b + c;
    let between = if bend > 0.0 {
        0.5 * (a - c) / bend
    } else {
        0.0
    };
    Some((lowest as f64 - farthest::<DELAYS>() as f64 + between.clamp(-1.0, 1.0)) * STEP_S)
}

/// Computes `found` from the costs with each block left out in turn.
fn without_each_block<const D: usize, T: Send>(
    channels: &[Vec<Sums<D>>],
    found: impl Fn(&[Vec<f64>]) -> T + Sync,
) -> Vec<T> {
    let blocks = channels.iter().map(Vec::len).max().unwrap_or(0);
    let without = |left_out: usize| {
        let costs: Vec<Vec<f64>> = (channels.iter())
            .map(|channel| {
                // channels with fewer blocks leave out the one at the same time
                let skipped = left_out * channel.len() / blocks;
                cost(channel, |block| block != skipped)
            })
            .collect();
        found(&costs)
    };
    (0..blocks).into_par_iter().map(without).collect()
}

/// Standard deviation from leaving out each block in turn.
fn jackknife(channels: &[Vec<Sums<DELAYS>>]) -> Option<f64> {
    let delays = without_each_block(channels, valley).into_iter();
    let delays: Vec<f64> = delays.collect::<Option<_>>()?;
    let n = delays.len() as f64;
    let mean = delays.iter().sum::<f64>() / n;
    let squares: f64 = delays.iter().map(|d| (d - mean) * (d - mean)).sum();
    Some(((n - 1.0) / n * squares).sqrt())
}

/// Standard deviation of the mean over the single channels, weighted by the curvature of their minima.
fn disagreement(costs: &[Vec<f64>], mean: f64) -> f64 {
    let (mut weights, mut squares, mut count) = (0.0, 0.0, 0.0);
    for cost in costs {
        let lowest = (1..cost.len() - 1).min_by(|&a, &b| cost[a].total_cmp(&cost[b]));
        let (Some(lowest), Some(delay)) = (lowest, valley(std::slice::from_ref(cost))) else {
            continue;
        };
        let bend = cost[lowest - 1] - 2.0 * cost[lowest] + cost[lowest + 1];
        if (1.0 - cost[lowest].exp()).max(0.0).sqrt() < LEAST_CORRELATION || bend <= 0.0 {
            continue;
        }
        weights += bend;
        squares += bend * (delay - mean) * (delay - mean);
        count += 1.0;
    }
    if count < 2.0 {
        return 0.0;
    }
    (squares / weights / (count - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_over_a_moving_window_are_those_over_each_window() {
        let signal: Vec<f64> = (0..300).map(|i| 5.0 + (0.1 * f64::from(i)).sin()).collect();
        let window = signal.len() - (DELAYS - 1);
        let found = MovingSums::<DELAYS>::of(&signal, window);
        for delay in 0..DELAYS {
            let part = signal.iter().enumerate().skip(delay).take(window);
            let sum = |term: fn(usize, f64) -> f64| part.clone().map(|(i, &v)| term(i, v)).sum();
            for (found, direct) in [
                (found.values[delay], sum(|_, value| value)),
                (
                    found.by_place[delay],
                    sum(|place, value| place as f64 * value),
                ),
                (found.squares[delay], sum(|_, value| value * value)),
            ] {
                let direct: f64 = direct;
                assert!(
                    (found - direct).abs() < 1e-12 * direct.abs(),
                    "{delay}: {found} {direct}"
                );
            }
        }
    }

    #[test]
    fn right_sides_are_solved_by_the_factor() {
        let factor = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 3.0, 4.0]);
        let mut right = [[2.0; DELAYS], [11.0; DELAYS]];
        right[0][7] = 4.0;
        solve_lower(&factor, &mut right);
        assert_eq!([right[0][0], right[1][0]], [1.0, 2.0]);
        assert_eq!([right[0][7], right[1][7]], [2.0, 1.25]);
    }

    /// A late signal with another gain and a drift, and the known one, over some seconds.
    fn channel(motion: impl Fn(f64) -> f64, late_s: f64, seconds: usize) -> Channel {
        let steps = 0..seconds * 100;
        let time = |step: usize| step as f64 * STEP_S;
        let known: Vec<f64> = steps.clone().map(|step| motion(time(step))).collect();
        let late = steps.map(|step| 7.0 - 3.0 * motion(time(step) - late_s) + 0.2 * time(step));
        Channel {
            late: late.collect(),
            known: vec![known],
        }
    }

    fn found(channel: Channel) -> Result<Delay, String> {
        find(&[vec![Some(channel)]])
    }

    #[test]
    fn a_late_signal_has_its_delay_whatever_its_gain_and_drift() {
        let motion = |t: f64| (0.9 * t).sin() + 0.5 * (2.3 * t).cos();
        for late_s in [0.043, 0.2, 0.45, 0.6, 0.8, 0.95, 1.05] {
            for late_s in [late_s, -late_s] {
                let found = found(channel(motion, late_s, 30)).unwrap();
                assert!((found.seconds - late_s).abs() < 1e-4, "{late_s}: {found:?}");
                assert!(found.correlation > 0.999);
            }
        }
    }

    /// A search of half a second took the wrong period where the true delay is longer.
    #[test]
    fn a_period_of_a_swinging_motion_is_not_taken_for_the_delay() {
        for period_s in [0.6, 0.9, 1.3, 2.0] {
            let rate = std::f64::consts::TAU / period_s;
            let motion = |t: f64| (rate * t).sin() + 0.3 * (0.4 * t).sin();
            for late_s in [0.0, 0.3, 0.37, 0.705, -0.705, 1.0, -1.0] {
                let found = found(channel(motion, late_s, 30)).unwrap();
                assert!(
                    (found.seconds - late_s).abs() < 2e-3,
                    "{period_s}, {late_s}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn a_short_log_is_searched_within_half_a_second() {
        let motion = |t: f64| (2.9 * t).sin() + 0.5 * (7.3 * t).cos();
        let found_s = found(channel(motion, 0.2, 4)).unwrap().seconds;
        assert!((found_s - 0.2).abs() < 1e-3, "{found_s}");
        let slow = |t: f64| (1.1 * t).sin();
        let error = found(channel(slow, 0.7, 4)).unwrap_err();
        assert!(error.contains("beyond half a second"), "{error}");
    }
}
