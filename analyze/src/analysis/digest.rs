//! Key figures of all rows, which summary, policy and report state.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::SURE_SIGMAS;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{Quantity, State};

use super::study::{Block, StudiedLog, Study};
use crate::base::number::known;
use crate::base::rows::Rows;
use crate::events::split_rule::is_open;

/// Rows in which an attitude is looked for, evenly spread.
const LOOKED_AT: usize = 50;

/// Key figures of all rows.
#[derive(Debug, Clone, Default)]
pub struct Digest {
    /// Number of valid rows.
    pub valid_rows: usize,
    /// Rows among these whose signals contradict each other.
    pub doubted_rows: usize,
    /// Figures of each wheel over the valid rows.
    pub wheels: Vec<WheelDigest>,
    /// Row and wheel of the smallest load compared with the load at rest; `None` if no valid row has loads.
    pub lightest: Option<(usize, usize)>,
    /// Median width of the envelopes as a share of the loads at rest; 0 where it is unknown.
    pub open_split: f64,
    /// Whether the log has an attitude.
    pub has_attitude: bool,
}

/// Figures of a wheel over the valid rows.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
#[schemars(rename = "WheelSummary")]
pub struct WheelDigest {
    /// Static load: level, at rest, in the reference posture (N).
    pub static_load_n: Option<f64>,
    /// Load below which the wheel is light (N).
    pub min_load_limit_n: Option<f64>,
    /// Mean load (N).
    pub mean_load_n: Option<f64>,
    /// Smallest load (N).
    pub least_load_n: Option<f64>,
    /// Smallest OTF (N).
    pub least_otf_n: Option<f64>,
    /// When that was, after the first row (s).
    pub least_otf_s: Option<f64>,
    /// Largest load (N).
    pub largest_load_n: Option<f64>,
    /// Median of the standard deviation of the load (N); null for models without it.
    pub median_load_sigma_n: Option<f64>,
    /// The OTF whose band reaches lowest, the first of equal ones; `None` for models without bands.
    #[serde(skip)]
    pub least_in_band: Option<OtfBand>,
    /// The same of each time that the machine tips about an edge, which the wheel may be on: one of them may be a fall.
    #[serde(skip)]
    pub least_while_tipping: Vec<OtfBand>,
    /// Whether each row with its load has a band: none has one while the machine tips, nor under a model without bands.
    #[serde(skip)]
    pub is_band_known: bool,
    /// The smallest finite load, the first of equal ones.
    #[serde(skip)]
    pub lowest: Option<LowestLoad>,
    /// Whether another split could have left the wheel without load.
    #[serde(skip)]
    pub could_unload: bool,
    /// Whether the range of the load over all splits is known in every row.
    #[serde(skip)]
    pub is_range_known: bool,
    /// Lowest load of the wheel while another split could have brought it below its limit.
    #[serde(skip)]
    pub open: Option<OpenLoad>,
}

/// An OTF with its band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtfBand {
    /// The row.
    pub row: usize,
    /// The OTF (N).
    pub otf_n: f64,
    /// Its standard deviation (N).
    pub sigma_n: f64,
}

impl OtfBand {
    /// The lower end of the band: two standard deviations less (N).
    #[must_use]
    pub fn least_n(&self) -> f64 {
        self.otf_n - SURE_SIGMAS * self.sigma_n
    }
}

/// A lowest load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowestLoad {
    /// The row.
    pub row: usize,
    /// The load (N).
    pub load_n: f64,
    /// Whether equilibrium leaves the load open.
    pub is_split_open: bool,
}

/// A load with its range over all splits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenLoad {
    /// The row.
    pub row: usize,
    /// The load under the stated split (N).
    pub load_n: f64,
    /// The smallest load that equilibrium allows (N).
    pub least_n: f64,
    /// The largest load that equilibrium allows (N).
    pub largest_n: f64,
}

/// The digest while the rows are computed block by block.
pub(super) struct DigestPass<'a> {
    machine: &'a Machine,
    min_loads_n: Option<&'a [f64]>,
    /// Rows from one in which an attitude is looked for to the next.
    attitude_step: usize,
    digest: Digest,
    lightest_share: f64,
    sigmas: Vec<SpreadValues>,
    widths: SpreadValues,
    /// By wheel, the number of valid rows with a load, and the sum of these loads (N).
    loads: Vec<(usize, f64)>,
    /// By wheel, the last row in which the machine tips.
    tipping: Vec<Option<usize>>,
}

impl<'a> Study<'a> for DigestPass<'a> {
    type Found = Digest;

    fn begin(log: &StudiedLog<'a>) -> Self {
        let at_rest_n = &log.machine.reference().static_load;
        let wheel = |wheel: usize| WheelDigest {
            static_load_n: known(at_rest_n[wheel]),
            min_load_limit_n: log.min_loads_n.map(|loads| loads[wheel]),
            is_band_known: true,
            is_range_known: true,
            ..WheelDigest::default()
        };
        let wheels = log.machine.wheels().len();
        Self {
            machine: log.machine,
            min_loads_n: log.min_loads_n,
            attitude_step: (log.table.len() / LOOKED_AT).max(1),
            digest: Digest {
                wheels: (0..wheels).map(wheel).collect(),
                ..Digest::default()
            },
            lightest_share: f64::INFINITY,
            sigmas: vec![SpreadValues::default(); wheels],
            widths: SpreadValues::default(),
            loads: vec![(0, 0.0); wheels],
            tipping: vec![None; wheels],
        }
    }

    fn take(&mut self, block: &Block<'a>) {
        let rows = &*block.rows;
        self.look_for_attitude(rows);
        let valid: Vec<usize> = (0..rows.len()).filter(|&row| rows.is_valid(row)).collect();
        self.digest.valid_rows += valid.len();
        let doubted = valid.iter().filter(|&&row| rows.reasons[row].have_doubt());
        self.digest.doubted_rows += doubted.count();
        for wheel in 0..self.digest.wheels.len() {
            self.take_wheel(rows, wheel, &valid);
        }
        self.look_for_lightest(rows, &valid);
    }
}

impl From<DigestPass<'_>> for Digest {
    fn from(pass: DigestPass<'_>) -> Self {
        let mut digest = pass.digest;
        digest.open_split = pass.widths.middle().unwrap_or(0.0);
        let wheels = digest.wheels.iter_mut().zip(pass.sigmas);
        for ((wheel, sigmas), (rows, sum_n)) in wheels.zip(pass.loads) {
            wheel.mean_load_n = known(sum_n / rows as f64);
            wheel.median_load_sigma_n = sigmas.middle();
        }
        digest
    }
}

impl DigestPass<'_> {
    fn take_wheel(&mut self, rows: &Rows, wheel: usize, valid: &[usize]) {
        let column = |quantity| rows.outcomes.column(quantity);
        let (load, otf) = (column(Quantity::Load(wheel)), column(Quantity::Otf(wheel)));
        let least = column(Quantity::LoadLeast(wheel));
        let largest = column(Quantity::LoadLargest(wheel));
        let otf_sigma = rows.outcomes.known_column(Quantity::OtfSigma(wheel));
        let at_rest_n = self.machine.reference().static_load[wheel];
        let limit_n = self.min_loads_n.map_or(0.0, |limits| limits[wheel]);
        let found = &mut self.digest.wheels[wheel];
        let has_load = |row: &usize| rows.reasons[*row].leave_loads() && !load[*row].is_nan();
        let has_band = |row: usize| {
            rows.is_valid(row) && otf_sigma.is_some_and(|sigma| sigma[row].is_finite())
        };
        found.is_band_known &= (0..rows.len()).filter(has_load).all(has_band);
        let band_at = |row: usize| {
            let band = OtfBand {
                row: rows.first + row,
                otf_n: otf[row],
                sigma_n: otf_sigma?[row],
            };
            band.least_n().is_finite().then_some(band)
        };
        let tips = |row: &usize| rows.reasons[*row].has(Reason::Tipping) && has_load(row);
        for band in (0..rows.len()).filter(tips).filter_map(band_at) {
            take_tipping(
                &mut found.least_while_tipping,
                &mut self.tipping[wheel],
                band,
            );
        }
        for &row in valid {
            let load_n = load[row];
            if load_n.is_nan() {
                // off the ground, while the machine is on other supports
                continue;
            }
            let (count, sum_n) = &mut self.loads[wheel];
            (*count, *sum_n) = (*count + 1, *sum_n + load_n);
            let with = |known: Option<f64>, of: fn(f64, f64) -> f64| {
                Some(known.map_or(load_n, |known| of(known, load_n)))
            };
            found.least_load_n = with(found.least_load_n, f64::min);
            found.largest_load_n = with(found.largest_load_n, f64::max);
            let is_less = |least: f64| otf[row].total_cmp(&least).is_lt();
            if found.least_otf_n.is_none_or(is_less) {
                (found.least_otf_n, found.least_otf_s) = (Some(otf[row]), Some(rows.seconds(row)));
            }
            let bands = found.least_in_band.into_iter().chain(band_at(row));
            found.least_in_band = lowest(bands);
            if load_n.is_finite() && found.lowest.is_none_or(|lowest| load_n < lowest.load_n) {
                found.lowest = Some(LowestLoad {
                    row: rows.first + row,
                    load_n,
                    is_split_open: is_open(rows, wheel, row),
                });
            }
            let least_n = least[row];
            found.could_unload |= least_n <= 0.0;
            found.is_range_known &= least_n.is_finite();
            let is_less = |open: OpenLoad| load_n.total_cmp(&open.load_n).is_lt();
            if (least_n < limit_n || least_n <= 0.0)
                && found.open.is_none_or(is_less)
                && is_open(rows, wheel, row)
            {
                found.open = Some(OpenLoad {
                    row: rows.first + row,
                    load_n,
                    least_n,
                    largest_n: largest[row],
                });
            }
            self.widths.push((largest[row] - least_n) / at_rest_n);
        }
        if let Some(sigma) = rows.outcomes.known_column(Quantity::LoadSigma(wheel)) {
            valid
                .iter()
                .filter(|&&row| !load[row].is_nan())
                .for_each(|&row| self.sigmas[wheel].push(sigma[row]));
        }
    }

    fn look_for_lightest(&mut self, rows: &Rows, valid: &[usize]) {
        let wheels = 0..self.digest.wheels.len();
        let loads: Vec<&[f64]> = wheels
            .map(|wheel| rows.outcomes.column(Quantity::Load(wheel)))
            .collect();
        let at_rest_n = &self.machine.reference().static_load;
        for &row in valid {
            for (wheel, load) in loads.iter().enumerate() {
                let share = load[row] / at_rest_n[wheel];
                let is_first = self.digest.lightest.is_none();
                if share.is_finite() && (is_first || share.total_cmp(&self.lightest_share).is_lt())
                {
                    self.lightest_share = share;
                    self.digest.lightest = Some((rows.first + row, wheel));
                }
            }
        }
    }

    fn look_for_attitude(&mut self, rows: &Rows) {
        let mut state = State::zero(self.machine);
        let first = rows.first.next_multiple_of(self.attitude_step);
        let looked_at = (first..rows.first + rows.len()).step_by(self.attitude_step);
        for row in looked_at {
            rows.states.get(row - rows.first, &mut state);
            self.digest.has_attitude |= state.base.known_up().is_some();
        }
    }
}

/// The band that reaches lowest, the first of equal ones.
fn lowest(bands: impl Iterator<Item = OtfBand>) -> Option<OtfBand> {
    bands.min_by(|a, b| a.least_n().total_cmp(&b.least_n()))
}

/// Keeps the band that reaches lowest of each run of rows, with the last row of the one before.
fn take_tipping(least: &mut Vec<OtfBand>, last: &mut Option<usize>, band: OtfBand) {
    let goes_on = last.replace(band.row) == band.row.checked_sub(1);
    match least.last_mut() {
        Some(known) if goes_on => {
            if band.least_n() < known.least_n() {
                *known = band;
            }
        }
        _ => least.push(band),
    }
}

/// Most values that are kept.
const MOST: usize = 1 << 19;

/// Values evenly spread over a series: all of a short one, every second, fourth and so on of a longer one.
#[derive(Debug, Clone, Default)]
struct SpreadValues {
    values: Vec<f64>,
    /// Values seen that are finite.
    seen: usize,
    /// Values from one that is kept to the next, as a power of two.
    step: u32,
}

impl SpreadValues {
    /// Adds the next value; one that is not finite is left out.
    fn push(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        if self.seen.is_multiple_of(1 << self.step) {
            if self.values.len() == MOST {
                let mut place = 0;
                self.values.retain(|_| {
                    place += 1;
                    place % 2 == 1
                });
                self.step += 1;
            }
            if self.seen.is_multiple_of(1 << self.step) {
                self.values.push(value);
            }
        }
        self.seen += 1;
    }

    /// The median, the upper one of an even number; `None` without values.
    fn middle(mut self) -> Option<f64> {
        let middle = self.values.len() / 2;
        let is_empty = self.values.is_empty();
        (!is_empty).then(|| *self.values.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One least band of the whole log lay in the fall and was left out there, and a rocking before it was never told.
    #[test]
    fn each_tipping_has_a_least_band_of_its_own() {
        let (mut least, mut last) = (Vec::new(), None);
        for (row, otf_n) in [(3, 5.0), (4, -2.0), (5, 1.0), (9, -7.0), (10, -9.0)] {
            let sigma_n = 0.0;
            let band = OtfBand {
                row,
                otf_n,
                sigma_n,
            };
            take_tipping(&mut least, &mut last, band);
        }
        let rows: Vec<usize> = least.iter().map(|band| band.row).collect();
        assert_eq!(rows, [4, 10]);
    }

    fn median_of(values: impl Iterator<Item = f64>) -> Option<f64> {
        let mut kept = SpreadValues::default();
        values.for_each(|value| kept.push(value));
        assert!(kept.values.len() <= MOST);
        kept.middle()
    }

    #[test]
    fn the_median_of_a_short_series_is_exact() {
        assert_eq!(median_of([3.0, f64::NAN, 1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median_of([1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median_of(std::iter::empty()), None);
        assert_eq!(
            median_of((0..MOST).map(|k| k as f64)),
            Some(MOST as f64 / 2.0)
        );
    }

    #[test]
    fn the_median_of_a_long_series_is_that_of_evenly_spread_values() {
        let count = 5 * MOST + 7;
        let median = median_of((0..count).map(|k| k as f64)).unwrap();
        assert!((median - count as f64 / 2.0).abs() <= 8.0, "{median}");
    }
}
