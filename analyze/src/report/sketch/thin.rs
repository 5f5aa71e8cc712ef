//! Fewer points for a curve whose values come row by row, with its peaks and breaks kept.

/// Values that stand beside each other in a row.
pub(in crate::report) const VALUES: usize = 4;

/// A row that is drawn, with its values as precise as a picture needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::report) struct Point {
    row: u32,
    values: [f32; VALUES],
}

impl Point {
    pub(super) fn new(row: usize, values: [f64; VALUES]) -> Self {
        Self {
            row: row as u32,
            values: values.map(|value| value as f32),
        }
    }

    pub(in crate::report) fn row(&self) -> usize {
        self.row as usize
    }

    pub(in crate::report) fn values(&self) -> [f64; VALUES] {
        self.values.map(f64::from)
    }
}

/// The rows of a curve to draw, as [`rows_to_draw`](crate::page::rows_to_draw) chooses them.
#[derive(Debug, Clone)]
pub(super) struct Thinned {
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
    pub(super) fn new(rows: usize, most: usize) -> Self {
        let buckets = (most.saturating_sub(2) / 3).max(1);
        Self {
            rows,
            row: 0,
            most,
            buckets,
            bucket: 0,
            end: rows / buckets,
            least: None,
            largest: None,
            broken: None,
            last: None,
            kept: Vec::new(),
        }
    }

    /// Takes the next row, chosen by `value`.
    pub(super) fn push(&mut self, value: f64, values: [f64; VALUES]) {
        let row = self.row;
        let point = || Point::new(row, values);
        self.row += 1;
        if self.rows <= self.most {
            self.kept.push(point());
            return;
        }
        if row == 0 {
            self.kept.push(point());
        }
        if row == self.end {
            self.end_bucket();
        }
        if self.row == self.rows {
            self.last = Some(point());
        }
        if !value.is_finite() {
            self.broken.get_or_insert_with(point);
            return;
        }
        if let (Some((least, _)), Some((largest, _))) = (&self.least, &self.largest)
            && *least < value
            && value < *largest
        {
            return;
        }
        if self
            .least
            .is_none_or(|(least, _)| value.total_cmp(&least).is_lt())
        {
            self.least = Some((value, point()));
        }
        if self
            .largest
            .is_none_or(|(largest, _)| value.total_cmp(&largest).is_ge())
        {
            self.largest = Some((value, point()));
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
    pub(super) fn finish(mut self) -> Vec<Point> {
        if self.rows > self.most {
            self.end_bucket();
            self.kept.extend(self.last);
            self.kept.dedup_by_key(|point| point.row);
        }
        self.kept
    }
}

/// The rows of several curves over the same rows.
pub(super) fn together(curves: impl IntoIterator<Item = Vec<Point>>) -> Vec<Point> {
    let mut all: Vec<Point> = curves.into_iter().flatten().collect();
    all.sort_by_key(|point| point.row);
    all.dedup_by_key(|point| point.row);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::rows_to_draw;

    #[test]
    fn the_rows_are_those_of_the_whole_curve() {
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
            curve
                .iter()
                .for_each(|&value| thinned.push(value, [value; VALUES]));
            let rows: Vec<usize> = thinned.finish().iter().map(Point::row).collect();
            assert_eq!(rows, rows_to_draw(curve, most));
        }
    }
}
