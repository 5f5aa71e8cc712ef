//! Step that maximises the smallest margin, for the case that not all margins can be met.
//!
//! The smallest linearised margin over the box is a concave piecewise linear function: its maximum is at an
//! intersection of planes and sides of the box, one more in number than the variables. All of them are tried.

use super::quadratic_step::dot;
use crate::cost::{Evaluation, MAX_MARGINS};

/// The change of z that maximises the smallest linearised margin in the box from -1 to 1, and that maximum.
pub(crate) fn raising_step<const N: usize>(z: &[f64; N], here: &Evaluation<N>) -> ([f64; N], f64) {
    let mut roof = Roof {
        value: [0.0; MAX_MARGINS],
        slope: [[0.0; N]; MAX_MARGINS],
        count: here.margins().len(),
        low: z.map(|z| -1.0 - z),
        high: z.map(|z| 1.0 - z),
        best: [0.0; N],
        top: f64::NEG_INFINITY,
    };
    for (j, margin) in here.margins().iter().enumerate() {
        roof.value[j] = margin.value;
        roof.slope[j] = margin.slopes;
    }
    roof.consider([0.0; N]);
    if N == 1 {
        roof.along(0, [0.0; N]);
    } else {
        roof.over_two();
    }
    (roof.best, roof.top)
}

struct Roof<const N: usize> {
    value: [f64; MAX_MARGINS],
    slope: [[f64; N]; MAX_MARGINS],
    count: usize,
    low: [f64; N],
    high: [f64; N],
    best: [f64; N],
    top: f64,
}

impl<const N: usize> Roof<N> {
    /// Considers a candidate, clamped to the box, and keeps it if its smallest margin is larger.
    fn consider(&mut self, d: [f64; N]) {
        let d: [f64; N] = std::array::from_fn(|i| d[i].max(self.low[i]).min(self.high[i]));
        let heights = (0..self.count).map(|j| self.value[j] + dot(&self.slope[j], &d));
        let height = heights.fold(f64::INFINITY, f64::min);
        if height > self.top {
            (self.top, self.best) = (height, d);
        }
    }

    /// Candidates on the line from `d` along one axis: its ends, and intersections of two planes.
    fn along(&mut self, axis: usize, d: [f64; N]) {
        let mut place = d;
        for end in [self.low[axis], self.high[axis]] {
            place[axis] = end;
            self.consider(place);
        }
        place[axis] = 0.0;
        let base = place;
        for j in 0..self.count {
            for k in j + 1..self.count {
                let height = |i: usize| self.value[i] + dot(&self.slope[i], &base);
                let apart = self.slope[j][axis] - self.slope[k][axis];
                let crossing = (height(k) - height(j)) / apart;
                if crossing.is_finite() {
                    place[axis] = crossing;
                    self.consider(place);
                }
            }
        }
    }

    /// Candidates on the sides of the box, and intersections of three planes.
    fn over_two(&mut self) {
        for (side, axis) in [(0, 1), (1, 0)] {
            for end in [self.low[side], self.high[side]] {
                let mut d = [0.0; N];
                d[side] = end;
                self.along(axis, d);
            }
        }
        for i in 0..self.count {
            for j in i + 1..self.count {
                for k in j + 1..self.count {
                    let less = |a: usize| -> ([f64; 2], f64) {
                        let slope = |axis: usize| self.slope[a][axis] - self.slope[i][axis];
                        ([slope(0), slope(1)], self.value[i] - self.value[a])
                    };
                    let ((p, b), (q, c)) = (less(j), less(k));
                    let determinant = p[0] * q[1] - p[1] * q[0];
                    let mut d = [0.0; N];
                    d[0] = (b * q[1] - c * p[1]) / determinant;
                    d[1] = (p[0] * c - q[0] * b) / determinant;
                    if d[0].is_finite() && d[1].is_finite() {
                        self.consider(d);
                    }
                }
            }
        }
    }
}
