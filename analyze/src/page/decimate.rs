//! Fewer points for a curve, with its peaks and breaks kept.

/// Values that stand beside each other in a row.
pub(crate) const VALUES: usize = 4;

/// A row that is drawn, with its values as precise as a picture needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    row: u32,
    values: [f32; VALUES],
}

impl Point {
    #[inline]
    pub(crate) fn new(row: usize, [a, b, c, d]: [f64; VALUES]) -> Self {
        Self {
            row: row as u32,
            values: [a as f32, b as f32, c as f32, d as f32],
        }
    }

    pub(crate) fn row(&self) -> usize {
        self.row as usize
    }

    pub(crate) fn values(&self) -> [f64; VALUES] {
        self.values.map(f64::from)
    }
}

/// The rows of a curve to draw, whose values come row by row: at most so many of them, in order.
///
/// A short curve keeps all rows. A longer one is cut into equal buckets; each keeps its smallest value, its
/// largest value and, as a break, its first value that is not finite. The first and the last row stay too.
#[derive(Debug, Clone, Default)]
pub(crate) struct Thinned {
    /// Rows of the whole curve, and of those before the next one.
    rows: usize,
    row: usize,
    most: usize,
    buckets: usize,
    bucket: usize,
    /// First row after the bucket.
    end: usize,
    least: Option<(f64, Point)>,
    largest: Option<(f64, Point)>,
    broken: Option<Point>,
    last: Option<Point>,
    kept: Vec<Point>,
}

impl Thinned {
    /// A curve of `rows` rows, of which at most `most` are drawn.
    pub(crate) fn new(rows: usize, most: usize) -> Self {
        let buckets = (most.saturating_sub(2) / 3).max(1);
        // a bucket has two extremes, and rarely a break
        let kept = if rows <= most { rows } else { 2 * buckets + 2 };
        Self {
            rows,
            most,
            buckets,
            end: rows / buckets,
            kept: Vec::with_capacity(kept),
            ..Self::default()
        }
    }

    /// Takes the next rows, chosen by `chosen`; `values` gives what stands in the one with this index.
    pub(crate) fn extend(&mut self, chosen: &[f64], values: impl Fn(usize) -> [f64; VALUES]) {
        let first = self.row;
        let point = |at: usize| Point::new(first + at, values(at));
        self.row += chosen.len();
        if self.rows <= self.most {
            self.kept.extend((0..chosen.len()).map(point));
            return;
        }
        if chosen.is_empty() {
            return;
        }
        if first == 0 {
            self.kept.push(point(0));
        }
        let mut from = 0;
        while from < chosen.len() {
            if first + from == self.end {
                self.end_bucket();
            }
            // a bucket has three rows or more
            let to = (self.end - first).min(chosen.len());
            self.extend_bucket(&chosen[from..to], |at| point(from + at));
            from = to;
        }
        if self.row == self.rows {
            self.last = Some(point(chosen.len() - 1));
        }
    }

    /// Takes rows of the bucket.
    fn extend_bucket(&mut self, chosen: &[f64], point: impl Fn(usize) -> Point) {
        // NaN, before the first finite value, is in no order
        let value = |known: &Option<(f64, Point)>| known.map_or(f64::NAN, |(value, _)| value);
        let (mut least, mut largest) = (value(&self.least), value(&self.largest));
        let (mut least_at, mut largest_at) = (None, None);
        for (at, &value) in chosen.iter().enumerate() {
            if least < value && value < largest {
                continue;
            }
            if !value.is_finite() {
                self.broken.get_or_insert_with(|| point(at));
                continue;
            }
            if least.is_nan() || value.total_cmp(&least).is_lt() {
                (least, least_at) = (value, Some(at));
            }
            if largest.is_nan() || value.total_cmp(&largest).is_ge() {
                (largest, largest_at) = (value, Some(at));
            }
        }
        if let Some(at) = least_at {
            self.least = Some((least, point(at)));
        }
        if let Some(at) = largest_at {
            self.largest = Some((largest, point(at)));
        }
    }

    fn end_bucket(&mut self) {
        let extremes = [self.least.take(), self.largest.take()];
        let extremes = extremes.into_iter().flatten().map(|(_, point)| point);
        let before = self.kept.len();
        self.kept.extend(extremes.chain(self.broken.take()));
        self.kept[before..].sort_unstable_by_key(|point| point.row);
        self.bucket += 1;
        self.end = (self.bucket + 1) * self.rows / self.buckets;
    }

    /// The rows to draw, in order.
    pub(crate) fn finish(mut self) -> Vec<Point> {
        if self.rows > self.most {
            self.end_bucket();
            self.kept.extend(self.last);
            self.kept.dedup_by_key(|point| point.row);
        }
        self.kept
    }
}

/// The rows of several curves over the same rows.
pub(crate) fn together(curves: impl IntoIterator<Item = Vec<Point>>) -> Vec<Point> {
    let mut curves = curves.into_iter();
    // most are alone, and stay where they are
    let mut all = curves.next().unwrap_or_default();
    for curve in curves {
        all.reserve_exact(curve.len());
        all.extend(curve);
    }
    all.sort_by_key(|point| point.row);
    all.dedup_by_key(|point| point.row);
    all
}

/// The rows to draw of a curve whose values are all known, as [`Thinned`] chooses them: at most `most`, in order.
pub(crate) fn rows_to_draw(values: &[f64], most: usize) -> Vec<usize> {
    let mut thinned = Thinned::new(values.len(), most);
    thinned.extend(values, |_| [0.0; VALUES]);
    thinned.finish().iter().map(Point::row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize) -> Vec<f64> {
        (0..count).map(|row| (row as f64 * 0.01).sin()).collect()
    }

    #[test]
    fn short_curves_keep_every_row() {
        assert_eq!(rows_to_draw(&wave(100), 100), (0..100).collect::<Vec<_>>());
        assert!(rows_to_draw(&[], 10).is_empty());
    }

    #[test]
    fn single_peaks_and_dips_stay() {
        let mut values = wave(100_000);
        values[31_415] = 99.0;
        values[92_653] = -99.0;
        let rows = rows_to_draw(&values, 4000);
        assert!(rows.len() <= 4000);
        assert!(rows.contains(&31_415) && rows.contains(&92_653));
        assert!(rows.contains(&0) && rows.contains(&99_999));
        assert!(rows.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn a_single_missing_value_breaks_the_line() {
        let mut values = wave(50_000);
        values[20_000] = f64::NAN;
        assert!(rows_to_draw(&values, 1000).contains(&20_000));
    }

    #[test]
    fn a_curve_without_values_stays_empty() {
        let rows = rows_to_draw(&vec![f64::NAN; 10_000], 1000);
        assert!(!rows.is_empty() && rows.len() <= 1000);
    }

    #[test]
    fn a_bucket_keeps_its_first_least_its_last_largest_and_its_first_break() {
        let curve = [0.0, 5.0, 5.0, 2.0, -3.0, f64::NAN, -3.0, f64::NAN, 0.5];
        assert_eq!(rows_to_draw(&curve, 5), [0, 2, 4, 5, 8]);
        assert_eq!(rows_to_draw(&[1.0; 9], 5), [0, 8]);
    }

    #[test]
    fn the_division_into_blocks_leaves_no_trace() {
        let mut curve: Vec<f64> = (0..12_345)
            .map(|row| (f64::from(row) * 0.01).sin())
            .collect();
        curve[4000..4010].fill(f64::NAN);
        curve[77] = 5.0;
        curve[12_344] = -5.0;
        let constant = vec![1.0; 5000];
        let unknown = vec![f64::NAN; 5000];
        for (curve, most) in [
            (&curve, 100),
            (&curve, 4000),
            (&curve, 20_000),
            (&constant, 1000),
            (&unknown, 1000),
        ] {
            let mut thinned = Thinned::new(curve.len(), most);
            let mut parts = curve.as_slice();
            for length in [1, 0, 7, 2048, usize::MAX] {
                let (part, rest) = parts.split_at(length.min(parts.len()));
                thinned.extend(part, |at| [part[at]; VALUES]);
                parts = rest;
            }
            let points = thinned.finish();
            let rows: Vec<usize> = points.iter().map(Point::row).collect();
            assert_eq!(rows, rows_to_draw(curve, most));
            let is_of_row = |point: &Point| {
                let value = curve[point.row()] as f32;
                point.values().map(f64::to_bits) == [f64::from(value).to_bits(); VALUES]
            };
            assert!(points.iter().all(is_of_row));
        }
    }
}
