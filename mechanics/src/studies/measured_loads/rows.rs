//! Rows at which measured and computed loads are compared, and from when on they differ by more than chance.

use crate::machine::LoadSensor;

/// Excess over the root of the number of sensors.
pub(super) const EXCESS: f64 = 3.5;

/// Whether a difference of a sum of loads contradicts the computed one by itself.
#[must_use]
pub fn shows(difference: f64, sigma: f64) -> bool {
    difference.abs() > (1.0 + EXCESS) * sigma
}

/// Measured loads of a row.
#[derive(Clone, Copy)]
pub struct MeasuredRow<'a> {
    /// The load sensors.
    pub sensors: &'a [&'a LoadSensor],
    /// Measured load by sensor (N); NaN where there is none.
    pub loads: &'a [f64],
    /// The force of an actuated joint whose samples are too far apart for the state (N); NaN without one.
    pub held: &'a dyn Fn(usize) -> f64,
    /// Standard deviation of a weighted sum of the computed loads that motion which was not observed adds (N), by the factors.
    pub unobserved: &'a dyn Fn(&[f64]) -> f64,
}

impl std::fmt::Debug for MeasuredRow<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MeasuredRow")
            .field("loads", &self.loads)
            .finish_non_exhaustive()
    }
}

/// Index, time and supports of a row that is compared.
#[derive(Debug, Clone, Copy)]
pub struct RowPlace {
    /// Its index.
    pub row: usize,
    /// Its time (ns).
    pub time_ns: i64,
    /// Index of the set of supports on the ground; `None` on supports that never change.
    pub set: Option<usize>,
}

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
