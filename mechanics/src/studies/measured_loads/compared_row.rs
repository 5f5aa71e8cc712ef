//! A row at which measured and computed loads are compared.

use super::excess::EXCESS;
use crate::machine::LoadSensor;

/// A compared row.
#[derive(Debug, Clone)]
pub struct ComparedRow {
    /// Its index.
    pub row: usize,
    /// Its time (ns).
    pub time_ns: i64,
    /// Index of the set of supports on the ground.
    pub set: Option<usize>,
    /// Measured load by sensor (N); NaN where there is none.
    pub measured: Vec<f64>,
    /// Computed load by sensor (N).
    pub computed: Vec<f64>,
    /// Standard deviation of the computed load by sensor (N).
    pub sigma: Vec<f64>,
    /// Squared distance r' S^-1 r between measured and computed loads, with the residuals r of all sensors and their covariance
    /// S, whatever the split between diagonals.
    pub(super) distance: f64,
    /// Number of sensors in `distance`.
    pub(super) sensors: usize,
}

impl ComparedRow {
    /// Whether measured and computed loads are further apart than by chance: the root of the distance exceeds that of the number
    /// of sensors by 3.5, which chance makes once in some thousand rows. `None` for a row without a number.
    #[must_use]
    pub fn is_off(&self) -> Option<bool> {
        let is_off = self.distance.sqrt() > (self.sensors as f64).sqrt() + EXCESS;
        self.distance.is_finite().then_some(is_off)
    }

    /// The sensor that is furthest off in the mean over some rows: its index, its mean of measured minus computed load (N), and the mean
    /// standard deviation of that difference (N). NaN, of the first sensor, where nothing is known.
    #[must_use]
    pub fn furthest_off(rows: &[&Self], sensors: &[&LoadSensor]) -> (usize, f64, f64) {
        let mean = |k: usize| {
            let known = rows
                .iter()
                .filter(|row| (row.measured[k] - row.computed[k] + row.sigma[k]).is_finite());
            let sum = known.fold([0.0; 3], |[count, error, sigma], row| {
                let own = row.sigma[k].hypot(sensors[k].sigma);
                [
                    count + 1.0,
                    error + row.measured[k] - row.computed[k],
                    sigma + own,
                ]
            });
            (sum[1] / sum[0], sum[2] / sum[0])
        };
        let all = (0..sensors.len()).map(|k| (k, mean(k)));
        let known = all.filter(|(_, (error, _))| error.is_finite());
        let worst = known.max_by(|(_, a), (_, b)| (a.0 / a.1).abs().total_cmp(&(b.0 / b.1).abs()));
        let (sensor, (difference, sigma)) = worst.unwrap_or((0, (f64::NAN, f64::NAN)));
        (sensor, difference, sigma)
    }
}
