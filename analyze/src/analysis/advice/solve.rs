//! The smallest amount of a change that holds: bracketing and interpolation on the simulated margins.

use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Machine;

use super::candidates::Candidate;
use super::simulate::{Margins, simulate};
use super::window::Window;
use crate::base::number::number;
use crate::events::support_words::SupportWord;

/// Amounts at which a bracket is looked for, besides the first-order estimate.
const SCANNED: usize = 8;
/// Steps of a bracket: how precisely an amount is found.
const STEPS: usize = 1024;
/// Rows on which a solution is looked for, before it is checked on all.
const SOLVED_ROWS: usize = 96;
/// Searches for a solution, each with the rows that the last one violated.
const MOST_SEARCHES: usize = 6;
/// Significant digits of a change, rounded away from zero.
const DIGITS: i32 = 3;
/// Rounding errors of loads and moments, relative to the machine's weight.
const ROUNDING: f64 = 1e-9;

/// Bounds that a change must keep.
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
    /// Returns the bounds with a margin (N) above the limit of each wheel that fell below it.
    pub(super) fn with_margin(&self, margin_n: impl Fn(usize) -> f64) -> Self {
        let limits = self.otf.iter().enumerate();
        let limits = limits.map(|(wheel, limit)| match self.targets.contains(&wheel) {
            true => limit + margin_n(wheel),
            false => *limit,
        });
        Self {
            targets: self.targets.clone(),
            otf: limits.collect(),
            any_split: self.any_split.clone(),
            ..*self
        }
    }

    /// The first violated bound, those of the targets first.
    pub(super) fn violated(&self, found: &Margins) -> Option<Violation> {
        if let Some(place) = found.not_computable {
            return Some(Violation::NotComputable { place });
        }
        let mut slacks = self.slacks(found);
        let violated = slacks.find(|(slack, _)| !(*slack >= 0.0));
        violated.map(|(_, violation)| violation)
    }

    /// The slack of each bound, those of the targets first: by how much it is kept, in its own unit; negative or NaN where
    /// it is violated. With it the violation that it is then.
    fn slacks(&self, found: &Margins) -> impl Iterator<Item = (f64, Violation)> {
        let rounding = ROUNDING * self.weight;
        let others = (0..self.otf.len()).filter(|wheel| !self.targets.contains(wheel));
        let targets = self.targets.iter().map(|&target| (target, 0.0));
        let wheels = targets.chain(others.map(move |wheel| (wheel, rounding)));
        let wheels = wheels.map(|(wheel, rounding)| {
            let (otf_n, place) = found.otf[wheel];
            let violation = Violation::Wheel {
                wheel,
                otf_n,
                place,
            };
            (otf_n - (self.otf[wheel] - rounding), violation)
        });
        let (margin_m, place) = found.zmp;
        let zmp = (
            margin_m - (self.zmp - ROUNDING),
            Violation::Zmp { margin_m, place },
        );
        let (moment_nm, place) = found.moment;
        let moment = (
            self.moment + rounding - moment_nm,
            Violation::Moment { moment_nm, place },
        );
        wheels.chain([zmp, moment])
    }

    /// The least slack of the wheels that fell below their limit as logged; minus infinity where it cannot be computed.
    fn slack_of_targets(&self, found: &Margins) -> f64 {
        least_slack(found, self.slacks(found).take(self.targets.len()))
    }

    /// The least slack of all bounds; minus infinity where it cannot be computed.
    fn slack(&self, found: &Margins) -> f64 {
        least_slack(found, self.slacks(found))
    }

    /// Whether the bounds also hold under any split that equilibrium allows.
    pub(super) fn hold_under_any_split(&self, found: &Margins) -> bool {
        let rounding = ROUNDING * self.weight;
        let mut wheels = found.any_split.iter().zip(&self.any_split);
        wheels.all(|(load, bound)| *load >= bound - rounding)
    }
}

fn least_slack(found: &Margins, slacks: impl Iterator<Item = (f64, Violation)>) -> f64 {
    let computable = if found.not_computable.is_none() {
        f64::INFINITY
    } else {
        f64::NEG_INFINITY
    };
    slacks.fold(computable, |least, (slack, _)| {
        if slack.is_nan() {
            f64::NEG_INFINITY
        } else {
            least.min(slack)
        }
    })
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

    /// Describes why the change is not advised.
    fn reason(&self, machine: &Machine, bounds: &Bounds) -> String {
        match *self {
            Self::NotComputable { .. } => word!("the machine cannot take that posture").into(),
            Self::Wheel { wheel, otf_n, .. } => say!(
                "{} would fall to {} N, below {} N",
                SupportWord::named(&machine.wheels()[wheel]),
                number(otf_n),
                number(bounds.otf[wheel])
            ),
            Self::Zmp { margin_m, .. } => say!(
                "the machine would come nearer to an edge: ZMP margin {} m instead of {} m",
                number(margin_m),
                number(bounds.zmp)
            ),
            Self::Moment { moment_nm, .. } => say!(
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
    let reason = last.map(|violation| violation.reason(window.machine(), bounds));
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
        let mut scan = Scan::of(self);
        let of_targets = |found: &Margins| self.bounds.slack_of_targets(found);
        let Some(bracket) = scan.first(0.0, &of_targets) else {
            return Err(self.out_of_reach(&scan.simulated));
        };
        let share = self.least_of(bracket, &of_targets);
        let Some(violation) = self.bounds.violated(&self.simulate(share)) else {
            return Ok(share);
        };
        // more of the change may mend what the least amount violates
        let of_all = |found: &Margins| self.bounds.slack(found);
        match scan.first(share, &of_all) {
            Some(bracket) => Ok(self.least_of(bracket, &of_all)),
            None => Err(violation.reason(self.window.machine(), self.bounds)),
        }
    }

    /// The least step of the bracket that holds, if all above it do.
    fn least_of(&self, bracket: Bracket, slack: &dyn Fn(&Margins) -> f64) -> f64 {
        let Bracket { below, holding } = bracket;
        let share = |step: usize| match step {
            STEPS => holding.share,
            _ => below.share + (holding.share - below.share) * (step as f64 / STEPS as f64),
        };
        let (mut low, mut high) = ((0, below.slack), (STEPS, holding.slack));
        // the slack is nearly linear between two kinks; where it is not, halving is the faster half of the time
        let mut halves = false;
        while high.0 - low.0 > 1 {
            let width = high.0 - low.0;
            let crossing = low.1 / (low.1 - high.1) * width as f64;
            let step = match halves || !crossing.is_finite() {
                true => width / 2,
                false => (crossing.ceil() as usize).clamp(1, width - 1),
            };
            let found = slack(&self.simulate(share(low.0 + step)));
            if found >= 0.0 {
                high = (low.0 + step, found);
            } else {
                low = (low.0 + step, found);
            }
            halves = !halves && high.0 - low.0 > width / 2;
        }
        share(high.0)
    }

    /// Describes why no amount brings the wheels to their limits.
    fn out_of_reach(&self, scanned: &[(f64, Margins)]) -> String {
        let lowest = |(_, found): &(f64, Margins)| {
            let computable = found.not_computable.is_none();
            let targets = self.bounds.targets.iter().filter(|_| computable);
            let otf = targets.map(|&wheel| (wheel, found.otf[wheel].0));
            otf.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let best = scanned.iter().filter_map(lowest);
        match best.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((wheel, otf_n)) => say!(
                "within its limits the minimum of {} would be {} N at best",
                SupportWord::named(&self.window.machine().wheels()[wheel]),
                number(otf_n)
            ),
            None => word!("the machine cannot take that posture").into(),
        }
    }
}

/// A share of the largest amount, with the least slack of the bounds looked at. A slack that is not known is NaN.
#[derive(Debug, Clone, Copy)]
struct Simulated {
    share: f64,
    slack: f64,
}

/// Two shares: the bounds looked at are kept at the second one.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    below: Simulated,
    holding: Simulated,
}

/// Shares to look for a bracket at, ascending: evenly spaced, and the first-order estimate. They are simulated when
/// they are asked for.
struct Scan<'a> {
    search: &'a Search<'a>,
    shares: Vec<f64>,
    /// The first ones, with their margins.
    simulated: Vec<(f64, Margins)>,
}

impl<'a> Scan<'a> {
    fn of(search: &'a Search<'a>) -> Self {
        let even = (1..=SCANNED).map(|k| k as f64 / SCANNED as f64);
        let seed = search.candidate.first_order;
        let seed = seed.map(|seed| seed / search.candidate.bound);
        let seed = seed.filter(|share| 0.0 < *share && *share < 1.0);
        let mut shares: Vec<f64> = even.chain(seed).collect();
        shares.sort_by(f64::total_cmp);
        Self {
            search,
            shares,
            simulated: Vec::new(),
        }
    }

    /// Finds the first share above `above` that holds, with the one before it.
    fn first(&mut self, above: f64, slack: &dyn Fn(&Margins) -> f64) -> Option<Bracket> {
        let mut below = Simulated {
            share: above,
            slack: f64::NAN,
        };
        for place in 0..self.shares.len() {
            if self.simulated.len() == place {
                let share = self.shares[place];
                self.simulated.push((share, self.search.simulate(share)));
            }
            let (share, found) = &self.simulated[place];
            if *share <= above {
                continue;
            }
            let holding = Simulated {
                share: *share,
                slack: slack(found),
            };
            if holding.slack >= 0.0 {
                return Some(Bracket { below, holding });
            }
            below = holding;
        }
        None
    }
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
