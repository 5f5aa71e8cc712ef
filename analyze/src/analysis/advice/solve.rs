//! The smallest amount of a change that holds: bracketing and bisection on the simulated margins.

use tipwatch_mechanics::machine::Machine;

use super::candidates::Candidate;
use super::simulate::{Margins, simulate};
use super::window::Window;
use crate::base::number::number;

/// Amounts at which a bracket is looked for, besides the first-order estimate.
const SCANNED: usize = 8;
/// Bisections of a bracket.
const BISECTIONS: usize = 10;
/// Rows on which a solution is looked for, before it is checked on all.
const SOLVED_ROWS: usize = 96;
/// Searches for a solution, each with the rows that the last one violated.
const MOST_SEARCHES: usize = 6;
/// Significant digits of a change, rounded away from zero.
const DIGITS: i32 = 3;
/// Rounding errors of loads and moments, relative to the machine's weight.
const ROUNDING: f64 = 1e-9;

/// What a change must keep.
#[derive(Debug)]
pub(super) struct Bounds {
    /// Wheels that fell below their limit in the window as logged.
    pub(super) targets: Vec<usize>,
    /// Smallest OTF of each wheel (N): its limit.
    pub(super) otf: Vec<f64>,
    /// Smallest load of each wheel under any split (N).
    pub(super) any_split: Vec<f64>,
    /// Smallest distance of the centre of pressure from an edge as logged (m).
    pub(super) zmp: f64,
    /// Largest overturning moment as logged (N m).
    pub(super) moment: f64,
    /// Weight of the machine (N).
    pub(super) weight: f64,
}

/// A bound that a change violates.
#[derive(Debug, Clone)]
pub(super) enum Violation {
    /// A state that cannot be computed, such as an open linkage.
    NotComputable { place: usize },
    /// A wheel below its bound.
    Wheel {
        wheel: usize,
        otf_n: f64,
        place: usize,
    },
    /// Nearer to an edge than as logged.
    Zmp { margin_m: f64, place: usize },
    /// A larger overturning moment than as logged.
    Moment { moment_nm: f64, place: usize },
}

/// The smallest amount that holds on all rows.
#[derive(Debug)]
pub(super) struct Solution {
    pub(super) amount: f64,
    pub(super) margins: Margins,
}

impl Bounds {
    /// The first violated bound, those of the targets first.
    pub(super) fn violated(&self, found: &Margins) -> Option<Violation> {
        if let Some(place) = found.not_computable {
            return Some(Violation::NotComputable { place });
        }
        let rounding = ROUNDING * self.weight;
        let others = (0..self.otf.len()).filter(|wheel| !self.targets.contains(wheel));
        for (wheel, slack) in (self.targets.iter().map(|&target| (target, 0.0)))
            .chain(others.map(|wheel| (wheel, rounding)))
        {
            let (otf_n, place) = found.otf[wheel];
            if !(otf_n >= self.otf[wheel] - slack) {
                return Some(Violation::Wheel {
                    wheel,
                    otf_n,
                    place,
                });
            }
        }
        if !(found.zmp.0 >= self.zmp - ROUNDING) {
            let (margin_m, place) = found.zmp;
            return Some(Violation::Zmp { margin_m, place });
        }
        if !(found.moment.0 <= self.moment + rounding) {
            let (moment_nm, place) = found.moment;
            return Some(Violation::Moment { moment_nm, place });
        }
        None
    }

    /// Whether every wheel that fell below its limit is at it.
    fn targets_hold(&self, found: &Margins) -> bool {
        found.not_computable.is_none()
            && (self.targets.iter()).all(|&wheel| found.otf[wheel].0 >= self.otf[wheel])
    }

    /// Whether the bounds also hold under any split that equilibrium allows.
    pub(super) fn hold_under_any_split(&self, found: &Margins) -> bool {
        let rounding = ROUNDING * self.weight;
        let mut wheels = found.any_split.iter().zip(&self.any_split);
        wheels.all(|(load, bound)| *load >= bound - rounding)
    }
}

impl Violation {
    fn place(&self) -> usize {
        match *self {
            Self::NotComputable { place }
            | Self::Wheel { place, .. }
            | Self::Zmp { place, .. }
            | Self::Moment { place, .. } => place,
        }
    }

    /// Why a change is not advised.
    fn reason(&self, machine: &Machine, bounds: &Bounds) -> String {
        match *self {
            Self::NotComputable { .. } => "the machine cannot take that posture".into(),
            Self::Wheel { wheel, otf_n, .. } => format!(
                "wheel {} would fall to {} N, below {} N",
                machine.wheels()[wheel].name,
                number(otf_n),
                number(bounds.otf[wheel])
            ),
            Self::Zmp { margin_m, .. } => format!(
                "the machine would come nearer to an edge: ZMP margin {} m instead of {} m",
                number(margin_m),
                number(bounds.zmp)
            ),
            Self::Moment { moment_nm, .. } => format!(
                "the machine would come nearer to an edge: overturning moment {} N m instead of {} N m",
                number(moment_nm),
                number(bounds.moment)
            ),
        }
    }
}

/// The smallest amount of a change that holds on every row, or why there is none.
pub(super) fn solve(
    window: &Window,
    bounds: &Bounds,
    logged: &Margins,
    candidate: &Candidate,
) -> Result<Solution, String> {
    let mut rows = rows_to_solve(window, logged);
    let mut last = None;
    for _ in 0..MOST_SEARCHES {
        let search = Search {
            window: &window.pick(&rows),
            bounds,
            candidate,
        };
        let share = search.smallest_share()?;
        let exact = candidate.bound * share;
        let mut violation = None;
        for amount in [rounded_up(exact, candidate.bound), exact] {
            let margins = simulate(window, candidate.change, amount);
            match bounds.violated(&margins) {
                None => return Ok(Solution { amount, margins }),
                Some(found) => violation = Some(found),
            }
        }
        if let Some(violation) = violation {
            rows.push(violation.place());
            rows.sort_unstable();
            rows.dedup();
            last = Some(violation);
        }
    }
    let reason = last.map(|violation| violation.reason(&window.machine, bounds));
    Err(reason.unwrap_or_default())
}

/// Rows spread over the window, and those with the smallest margins as logged.
fn rows_to_solve(window: &Window, logged: &Margins) -> Vec<usize> {
    let step = window.rows.len().div_ceil(SOLVED_ROWS).max(1);
    let critical = logged.otf.iter().map(|otf| otf.1);
    let critical = critical.chain([logged.zmp.1, logged.moment.1]);
    let mut rows: Vec<usize> = (0..window.rows.len())
        .step_by(step)
        .chain(critical)
        .collect();
    rows.sort_unstable();
    rows.dedup();
    rows
}

/// The amount with few digits, away from zero, but not beyond the bound.
fn rounded_up(amount: f64, bound: f64) -> f64 {
    let exponent = amount.abs().log10().floor() as i32 - (DIGITS - 1);
    let unit = 10_f64.powi(exponent.abs());
    let scale = |value: f64, by: f64| if exponent < 0 { value * by } else { value / by };
    let size = scale((scale(amount.abs(), unit)).ceil(), 1.0 / unit);
    let rounded = size.min(bound.abs()).copysign(amount);
    if rounded.is_finite() { rounded } else { amount }
}

struct Search<'a> {
    window: &'a Window,
    bounds: &'a Bounds,
    candidate: &'a Candidate,
}

impl Search<'_> {
    fn simulate(&self, share: f64) -> Margins {
        let amount = self.candidate.bound * share;
        simulate(self.window, self.candidate.change, amount)
    }

    /// The smallest share of the largest amount that holds.
    fn smallest_share(&self) -> Result<f64, String> {
        let scanned = self.scanned();
        let holds = |found: &Margins| self.bounds.targets_hold(found);
        let Some((below, reached)) = first(&scanned, 0.0, &holds) else {
            return Err(self.out_of_reach(&scanned));
        };
        let share = self.bisected(below, reached, &holds);
        let Some(violation) = self.bounds.violated(&self.simulate(share)) else {
            return Ok(share);
        };
        // more of the change may mend what the least amount violates
        let keeps_all = |found: &Margins| self.bounds.violated(found).is_none();
        match first(&scanned, share, &keeps_all) {
            Some((below, reached)) => Ok(self.bisected(below, reached, &keeps_all)),
            None => Err(violation.reason(&self.window.machine, self.bounds)),
        }
    }

    /// Shares to look for a bracket at, ascending, with their margins: evenly spaced, and the first-order estimate.
    fn scanned(&self) -> Vec<(f64, Margins)> {
        let even = (1..=SCANNED).map(|k| k as f64 / SCANNED as f64);
        let seed = self.candidate.first_order;
        let seed = seed.map(|seed| seed / self.candidate.bound);
        let seed = seed.filter(|share| 0.0 < *share && *share < 1.0);
        let mut shares: Vec<f64> = even.chain(seed).collect();
        shares.sort_by(f64::total_cmp);
        let simulated = shares
            .into_iter()
            .map(|share| (share, self.simulate(share)));
        simulated.collect()
    }

    /// The upper end of the bracket after bisection: it holds.
    fn bisected(&self, mut below: f64, mut holding: f64, holds: &dyn Fn(&Margins) -> bool) -> f64 {
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (below + holding);
            match holds(&self.simulate(middle)) {
                true => holding = middle,
                false => below = middle,
            }
        }
        holding
    }

    /// Why no amount brings the wheels to their limits.
    fn out_of_reach(&self, scanned: &[(f64, Margins)]) -> String {
        let lowest = |(_, found): &(f64, Margins)| {
            let computable = found.not_computable.is_none();
            let targets = self.bounds.targets.iter().filter(|_| computable);
            let otf = targets.map(|&wheel| (wheel, found.otf[wheel].0));
            otf.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let best = scanned.iter().filter_map(lowest);
        match best.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((wheel, otf_n)) => format!(
                "within its limits the minimum of wheel {} would be {} N at best",
                self.window.machine.wheels()[wheel].name,
                number(otf_n)
            ),
            None => "the machine cannot take that posture".into(),
        }
    }
}

/// The first scanned share above `above` that holds, and the one before it.
fn first(
    scanned: &[(f64, Margins)],
    above: f64,
    holds: &dyn Fn(&Margins) -> bool,
) -> Option<(f64, f64)> {
    let mut before = above;
    for (share, found) in scanned.iter().filter(|(share, _)| *share > above) {
        if holds(found) {
            return Some((before, *share));
        }
        before = *share;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::rounded_up;

    #[test]
    fn a_change_is_rounded_away_from_zero_and_within_its_bound() {
        for (amount, bound, rounded) in [
            (0.12341, 1.0, 0.124),
            (-0.12341, -1.0, -0.124),
            (0.5, 1.0, 0.5),
            (0.99999, 0.999_995, 0.999_995),
            (1234.5, 5000.0, 1240.0),
        ] {
            let found: f64 = rounded_up(amount, bound);
            assert!((found - rounded).abs() < 1e-12 * rounded.abs(), "{found}");
            assert!(found.abs() >= amount.abs() * (1.0 - 1e-12));
        }
    }
}
