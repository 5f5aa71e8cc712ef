//! Shared by the tests: fixtures, their ground truth, and analyses of them.

pub mod digest;
#[cfg(doctest)]
mod documents;
mod edited_log;
pub mod fingerprint;
mod load_log;
pub mod prediction;
mod python_package;

use std::path::{Path, PathBuf};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_analyze::tables::parquet;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::estimation::SensorSamples;
use tipwatch_mechanics::state::Sensor;

pub use edited_log::{Values, write_edited, write_edited_without, write_kept};
pub use load_log::{LOADS, write_with_loads};
pub use python_package::python_package;

/// A file in `data/`.
#[must_use]
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data")
        .join(name)
}

/// A log beside the repository, not part of it. Tests that need one are in modules named `needs_shared`.
///
/// # Panics
/// If it is absent.
#[must_use]
pub fn beside(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/logs")
        .join(name);
    assert!(path.exists(), "{}: not found", path.display());
    path
}

/// Analyses a log with the machine file of the same name beside it.
///
/// # Panics
/// If the analysis fails.
#[must_use]
pub fn analysed(log: &Path, options: Options) -> Analysis {
    analysed_with(log, &log.with_extension("toml"), options)
}

/// Options of an analysis by this estimator.
#[must_use]
pub fn by(estimator: Estimator) -> Options {
    Options {
        estimator,
        ..Options::default()
    }
}

/// Analyses a log with a machine file.
///
/// # Panics
/// If the analysis fails.
#[must_use]
pub fn analysed_with(log: &Path, machine: &Path, options: Options) -> Analysis {
    let file = MachineFile::read(machine).expect("a machine file");
    analyse(log, &file, options, &mut |_| {}).expect("an analysis")
}

/// Ground truth of a simulated log: times (ns) and the loads of each wheel (N), smoothed over 51 samples by a third-order
/// Savitzky-Golay filter.
#[derive(Debug)]
pub struct Truth {
    times_ns: Vec<i64>,
    loads: Vec<Vec<f64>>,
}

impl Truth {
    /// Reads and smooths the ground truth beside a log, for the wheels with these names.
    ///
    /// # Panics
    /// If the file is missing.
    #[must_use]
    pub fn of(log: &Path, wheels: &[&str]) -> Self {
        let truth = Self::smoothed_already(log, wheels);
        Self {
            loads: truth.loads.iter().map(|load| smoothed(load)).collect(),
            ..truth
        }
    }

    /// Reads ground truth that was smoothed when it was written.
    ///
    /// # Panics
    /// If the file is missing.
    #[must_use]
    pub fn smoothed_already(log: &Path, wheels: &[&str]) -> Self {
        let path = log.with_extension("truth.parquet");
        let table = parquet::read(&path).expect("truth beside the log");
        let loads = wheels.iter().map(|wheel| {
            let column = table.column(&format!("load_{}", wheel.to_lowercase()));
            column.expect("a column").numbers().expect("numbers")
        });
        let times = table.column("t_ns").expect("t_ns").integers();
        Self {
            loads: loads.collect(),
            times_ns: times.expect("integers"),
        }
    }

    /// Times of the samples (ns).
    #[must_use]
    pub fn times_ns(&self) -> &[i64] {
        &self.times_ns
    }

    /// Load of a wheel at a time (N).
    #[must_use]
    pub fn load(&self, wheel: usize, time_ns: i64) -> f64 {
        self.at(wheel, time_ns)
    }

    /// Every `step`th row: its time (ns) and the loads of four wheels (N).
    #[must_use]
    pub fn rows(&self, step: usize) -> Vec<(i64, [f64; 4])> {
        let row = |row: usize| {
            let loads = std::array::from_fn(|wheel| self.loads[wheel][row]);
            (self.times_ns[row], loads)
        };
        (0..self.times_ns.len()).step_by(step).map(row).collect()
    }

    /// Linearly interpolated load of a wheel.
    fn at(&self, wheel: usize, time_ns: i64) -> f64 {
        let next = self
            .times_ns
            .partition_point(|&t| t < time_ns)
            .clamp(1, self.times_ns.len() - 1);
        let (a, b) = (self.times_ns[next - 1], self.times_ns[next]);
        let share = (time_ns - a) as f64 / (b - a) as f64;
        let loads = &self.loads[wheel];
        loads[next - 1] + share * (loads[next] - loads[next - 1])
    }

    /// Mean over a time span (s after the start) of a weighted sum of the OTF errors of the wheels (N).
    #[must_use]
    pub fn mean_error(&self, analysis: &Analysis, span_s: [f64; 2], factors: [f64; 4]) -> f64 {
        let from_start = |time: i64| (time - self.times_ns[0]) as f64 * 1e-9;
        let rows: Vec<usize> = (0..analysis.rows.len())
            .filter(|&row| {
                let t = from_start(analysis.rows.times_ns[row]);
                span_s[0] < t && t < span_s[1]
            })
            .collect();
        let error = |row: usize| -> f64 {
            let of = |wheel: usize| {
                let otf = analysis.rows.whole().outcomes.column(Quantity::Otf(wheel))[row];
                otf - self.at(wheel, analysis.rows.times_ns[row])
            };
            (0..4).map(|wheel| factors[wheel] * of(wheel)).sum()
        };
        rows.iter().map(|&row| error(row)).sum::<f64>() / rows.len() as f64
    }

    /// Share of the true loads inside the envelope widened by `slack_n` (N), without half a second at each end.
    #[must_use]
    pub fn share_within_envelope(&self, analysis: &Analysis, slack_n: f64) -> f64 {
        let (first, last) = (
            self.times_ns[0] + 500_000_000,
            self.times_ns[self.times_ns.len() - 1] - 500_000_000,
        );
        let (mut inside, mut all) = (0.0, 0.0);
        for wheel in 0..self.loads.len() {
            let least = analysis
                .rows
                .whole()
                .outcomes
                .column(Quantity::LoadLeast(wheel));
            let largest = analysis
                .rows
                .whole()
                .outcomes
                .column(Quantity::LoadLargest(wheel));
            for (row, &time) in analysis.rows.times_ns.iter().enumerate() {
                if time > first && time < last {
                    let truth = self.at(wheel, time);
                    let holds = least[row] - slack_n <= truth && truth <= largest[row] + slack_n;
                    inside += f64::from(u8::from(holds));
                    all += 1.0;
                }
            }
        }
        inside / all
    }

    /// Root mean square error of all wheel loads relative to the mean load, without half a second at each end.
    #[must_use]
    pub fn error_share(&self, analysis: &Analysis) -> f64 {
        self.error_share_shifted(analysis, 0)
    }

    /// Returns the [`error_share`](Self::error_share) without a longer start (s): the causal estimator has to settle where a log
    /// begins in motion.
    #[must_use]
    pub fn error_share_after(&self, analysis: &Analysis, start_s: f64) -> f64 {
        self.error_share_of(analysis, start_s, 0)
    }

    /// Returns the [`error_share`](Self::error_share) for rows whose times are early by `early_ns` (ns).
    #[must_use]
    pub fn error_share_shifted(&self, analysis: &Analysis, early_ns: i64) -> f64 {
        self.error_share_of(analysis, 0.5, early_ns)
    }

    fn error_share_of(&self, analysis: &Analysis, start_s: f64, early_ns: i64) -> f64 {
        let (first, last) = (
            self.times_ns[0] + (start_s * 1e9) as i64,
            self.times_ns[self.times_ns.len() - 1] - 500_000_000,
        );
        let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
        for wheel in 0..self.loads.len() {
            let found = analysis.rows.whole().outcomes.column(Quantity::Load(wheel));
            for (&time, &load) in analysis.rows.times_ns.iter().zip(found) {
                let time = time + early_ns;
                if time > first && time < last {
                    let truth = self.at(wheel, time);
                    squares += (load - truth) * (load - truth);
                    sum += truth;
                    count += 1.0;
                }
            }
        }
        (squares / count).sqrt() / (sum / count)
    }
}

/// Third-order Savitzky-Golay smoothing over 51 samples. The ends, which no test uses, are not smoothed.
fn smoothed(values: &[f64]) -> Vec<f64> {
    const HALF: i64 = 25;
    let m = HALF as f64;
    // weights of the least-squares cubic in the middle of the window
    let scale = (2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0) / 3.0;
    let weight = |k: i64| (3.0 * m * m + 3.0 * m - 1.0 - 5.0 * (k * k) as f64) / scale;
    let inside = |i: usize| i as i64 >= HALF && (i as i64) < values.len() as i64 - HALF;
    let middle = |i: usize| {
        (-HALF..=HALF)
            .map(|k| weight(k) * values[(i as i64 + k) as usize])
            .sum()
    };
    (0..values.len())
        .map(|i| if inside(i) { middle(i) } else { values[i] })
        .collect()
}

/// Samples of one sensor that a test may edit before they are smoothed.
#[derive(Debug, Clone)]
pub struct OwnedSamples {
    /// The sensor.
    pub sensor: Sensor,
    /// Stamps (ns).
    pub stamps_ns: Vec<i64>,
    /// Values of all samples, one sample after the other.
    pub values: Vec<f64>,
}

impl OwnedSamples {
    /// The samples as the smoother takes them.
    #[must_use]
    pub fn samples(&self) -> SensorSamples<'_> {
        SensorSamples {
            sensor: self.sensor,
            stamps_ns: &self.stamps_ns,
            values: &self.values,
        }
    }
}
