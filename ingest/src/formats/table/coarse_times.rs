//! Times that are coarser than the rows, such as whole seconds of ten rows a second: the rows of one time are spread evenly.

use std::{collections::BTreeMap, ops::ControlFlow, path::Path};

use tipwatch_language::say;

use crate::message::Losses;

/// Most rows of one time that are spread: they are held until the next time.
const MOST_ROWS_OF_A_TIME: u64 = 1 << 14;
/// Fewer than one in so many rows of a time that is taken were written twice; the times are not coarser than the rows.
const RARE: u64 = 10;

/// How rows of one time are spread.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// The usual time between two different times (ns).
    step_ns: i64,
    /// The usual number of rows of one time.
    rows: u64,
}

/// Counts of the first pass over the rows.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Counted {
    pub(super) rows: u64,
    pub(super) span_ns: Option<(i64, i64)>,
    /// How rows of one time are spread, where the times are coarser than the rows.
    pub(super) spread: Option<Spread>,
}

impl Spread {
    /// The time behind that of the rows (ns) for row `row` of `count`. Of the first time and of the last one, rows may lie outside
    /// the table.
    fn offset_ns(self, row: u64, count: u64, step_ns: i64, is_first: bool, is_last: bool) -> i64 {
        let places = match is_first || is_last {
            true => count.max(self.rows),
            false => count,
        };
        let before = if is_first { places - count } else { 0 };
        let share = i128::from(step_ns) * i128::from(before + row) / i128::from(places.max(1));
        // a share of the step, which is an i64
        share as i64
    }
}

/// What the times of the rows of a table are, by a first pass over them.
#[derive(Debug, Default)]
pub(super) struct CoarseTimes {
    rows: u64,
    span_ns: Option<(i64, i64)>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    /// Rows with the time of the row before.
    repeated: u64,
    /// Rows with another number in a column than an earlier row of their time.
    differing: u64,
    /// The numbers of the rows of the last time, by column.
    numbers: Vec<f64>,
    rows_of_first: u64,
    rows_of_last: u64,
    /// How often a time has so many rows.
    counts: BTreeMap<u64, u64>,
    /// Steps of the times, about alike ones together: how many, and their sum (ns).
    steps: BTreeMap<i64, (u64, i128)>,
}

impl CoarseTimes {
    /// Counts a row with these numbers; NaN for none.
    pub(super) fn count(&mut self, time_ns: i64, numbers: impl Iterator<Item = f64>) {
        self.rows += 1;
        let (first, last) = self.span_ns.unwrap_or((time_ns, time_ns));
        self.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        self.first_ns.get_or_insert(time_ns);
        if self.last_ns == Some(time_ns) {
            self.repeated += 1;
            self.rows_of_last += 1;
            let mut differs = false;
            for (before, number) in self.numbers.iter_mut().zip(numbers) {
                differs |= number.is_finite() && before.is_finite() && number != *before;
                if number.is_finite() {
                    *before = number;
                }
            }
            self.differing += u64::from(differs);
            return;
        }
        if let Some(before) = self.last_ns {
            self.end_time();
            let step = time_ns.saturating_sub(before);
            if step > 0 {
                let (count, sum) = self.steps.entry(about(step)).or_default();
                *count += 1;
                *sum += i128::from(step);
            }
        }
        self.last_ns = Some(time_ns);
        self.rows_of_last = 1;
        self.numbers.clear();
        self.numbers.extend(numbers);
    }

    fn end_time(&mut self) {
        if self.counts.is_empty() {
            self.rows_of_first = self.rows_of_last;
        }
        *self.counts.entry(self.rows_of_last).or_default() += 1;
    }

    /// Ends the pass, and reports times that are too coarse for the rows.
    pub(super) fn finish(mut self, path: &Path, losses: &mut Losses) -> Counted {
        let (rows, repeated) = (self.rows, self.repeated);
        if rows > 0 {
            self.end_time();
        }
        let spread = self.spread();
        let name = path.display();
        if let Some(spread) = spread {
            let step_s = spread.step_ns as f64 / 1e9;
            losses.note(say!(
                "{name}: {repeated} of {rows} rows have the time of the row before, and the time goes on in steps of {step_s} s: the rows \
                 of one time are spread evenly over a step in the order of the file, so that times are uncertain by {step_s} s; \
                 --time-column NAME states a finer time"
            ));
        } else if self.differing > 0 {
            losses.note(say!(
                "{name}: {repeated} of {rows} rows have the time of the row before: of rows of one time, each column has one value; \
                 --time-column NAME states a finer time"
            ));
        }
        Counted {
            rows,
            span_ns: self.span_of(spread),
            spread,
        }
    }

    fn spread(&self) -> Option<Spread> {
        let most = self.counts.last_key_value().map_or(0, |(rows, _)| *rows);
        let is_coarse = self.differing > 0 && RARE * self.differing >= self.rows;
        if !is_coarse || most > MOST_ROWS_OF_A_TIME {
            return None;
        }
        let steps = self.steps.iter().map(|(step, (count, _))| (*step, *count));
        let (count, sum) = self.steps.get(&median(steps)?)?;
        Some(Spread {
            step_ns: i64::try_from(sum / i128::from((*count).max(1))).ok()?,
            // that of most rows: the first time and the last one may have few
            rows: median(
                self.counts
                    .iter()
                    .map(|(rows, count)| (*rows, rows * count)),
            )?,
        })
    }

    /// The times of the first row and the last one, if rows of one time are spread.
    fn span_of(&self, spread: Option<Spread>) -> Option<(i64, i64)> {
        let (Some(spread), Some((first, last))) = (spread, self.span_ns) else {
            return self.span_ns;
        };
        let start = spread.offset_ns(0, self.rows_of_first, spread.step_ns, true, false);
        let rows = self.rows_of_last;
        let end = spread.offset_ns(rows.saturating_sub(1), rows, spread.step_ns, false, true);
        let start = if self.first_ns == Some(first) {
            start
        } else {
            0
        };
        let end = match self.last_ns == Some(last) {
            true => end,
            false => spread.step_ns,
        };
        Some((first.saturating_add(start), last.saturating_add(end)))
    }
}

/// A step without its lower binary digits: about alike steps have one place.
fn about(step: i64) -> i64 {
    const DIGITS: u32 = 10;
    let lower = (i64::BITS - step.leading_zeros()).saturating_sub(DIGITS);
    step >> lower << lower
}

/// The median of values in rising order, each of which there is so often.
fn median<T>(values: impl Iterator<Item = (T, u64)> + Clone) -> Option<T> {
    let all: u64 = values.clone().map(|(_, count)| count).sum();
    let mut passed = 0;
    for (value, count) in values {
        passed += count;
        if 2 * passed >= all {
            return Some(value);
        }
    }
    None
}

/// The rows of one time, held until the next one.
pub(super) struct HeldRows {
    spread: Option<Spread>,
    time_ns: Option<i64>,
    count: u64,
    width: usize,
    values: Vec<f64>,
    is_first: bool,
}

/// Takes the time of a row (ns) and its numbers.
type Take<'t> = dyn FnMut(i64, &[f64]) -> ControlFlow<()> + 't;

impl HeldRows {
    pub(super) fn new(spread: Option<Spread>) -> Self {
        Self {
            spread,
            time_ns: None,
            count: 0,
            width: 0,
            values: Vec::new(),
            is_first: true,
        }
    }

    /// Takes the next row; passes on the rows before it whose times are known now.
    pub(super) fn push(
        &mut self,
        time_ns: i64,
        values: &[f64],
        take: &mut Take<'_>,
    ) -> ControlFlow<()> {
        if self.spread.is_none() {
            return take(time_ns, values);
        }
        if self.time_ns != Some(time_ns) {
            self.pass_on(Some(time_ns), take)?;
            self.time_ns = Some(time_ns);
        }
        self.count += 1;
        self.width = values.len();
        self.values.extend_from_slice(values);
        ControlFlow::Continue(())
    }

    /// Passes on the rows of the last time.
    pub(super) fn end(&mut self, take: &mut Take<'_>) -> ControlFlow<()> {
        self.pass_on(None, take)
    }

    fn pass_on(&mut self, next_ns: Option<i64>, take: &mut Take<'_>) -> ControlFlow<()> {
        let (Some(spread), Some(time_ns)) = (self.spread, self.time_ns.take()) else {
            return ControlFlow::Continue(());
        };
        let until_next = next_ns.map(|next| next.saturating_sub(time_ns));
        let step_ns = match until_next.filter(|step| *step > 0) {
            Some(step) => step.min(spread.step_ns),
            None => spread.step_ns,
        };
        let (count, values) = (self.count, std::mem::take(&mut self.values));
        let is_first = std::mem::replace(&mut self.is_first, false);
        self.count = 0;
        let mut rest = &values[..];
        for row in 0..count {
            let (values, behind) = rest.split_at(self.width.min(rest.len()));
            rest = behind;
            let offset = spread.offset_ns(row, count, step_ns, is_first, next_ns.is_none());
            take(time_ns.saturating_add(offset), values)?;
        }
        self.values = values;
        self.values.clear();
        ControlFlow::Continue(())
    }
}
