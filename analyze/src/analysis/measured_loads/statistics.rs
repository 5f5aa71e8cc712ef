//! Error and band coverage of the computed loads, by load sensor.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::machine::LoadSensor;
use tipwatch_mechanics::studies::measured_loads::ComparedRow;

use crate::base::number::known;

/// Share of a normal distribution within one and two standard deviations.
pub(crate) const EXPECTED: [f64; 2] = [0.682_689_492, 0.954_499_736];

/// Measured against computed load of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SensorStatistics {
    /// Name of the sensor, as in the columns of samples.parquet.
    pub sensor: String,
    /// Rows compared: an even selection of the valid rows with all wheels on the ground.
    pub rows: usize,
    /// Mean measured load.
    pub mean_measured_n: Option<f64>,
    /// Mean of measured minus computed load.
    pub bias_n: Option<f64>,
    /// Root mean square of measured minus computed load.
    pub rms_n: Option<f64>,
    /// The same as a share of the mean measured load.
    pub rms_share: Option<f64>,
    /// Standard deviation of the sensor, from the machine file or by default.
    pub sensor_sigma_n: f64,
    /// Median standard deviation of the computed load.
    pub computed_sigma_n: Option<f64>,
    /// Share of the rows that are inside one standard deviation of computed and measured load together; 0.683 is
    /// expected over many machines. The errors of one machine are much the same in all rows.
    pub inside_1_sigma: Option<f64>,
    /// The same for two standard deviations; 0.954 is expected.
    pub inside_2_sigma: Option<f64>,
}

pub(super) fn statistics(sensors: &[&LoadSensor], rows: &[ComparedRow]) -> Vec<SensorStatistics> {
    let of = |(k, sensor): (usize, &&LoadSensor)| {
        let known_rows = rows.iter().filter(|row| row.measured[k].is_finite());
        let errors: Vec<[f64; 3]> = known_rows
            .map(|row| {
                [
                    row.measured[k],
                    row.measured[k] - row.computed[k],
                    row.sigma[k],
                ]
            })
            .filter(|values| values.iter().all(|value| value.is_finite()))
            .collect();
        let count = errors.len() as f64;
        let mean = |value: fn(&[f64; 3]) -> f64| errors.iter().map(value).sum::<f64>() / count;
        let inside = |sigmas: f64| {
            let within =
                |[_, error, sigma]: &&[f64; 3]| error.abs() <= sigmas * sigma.hypot(sensor.sigma);
            known(errors.iter().filter(within).count() as f64 / count)
        };
        let rms = mean(|[_, error, _]| error * error).sqrt();
        let mut sigmas: Vec<f64> = errors.iter().map(|[_, _, sigma]| *sigma).collect();
        sigmas.sort_by(f64::total_cmp);
        SensorStatistics {
            sensor: sensor.name.clone(),
            rows: errors.len(),
            mean_measured_n: known(mean(|[measured, ..]| *measured)),
            bias_n: known(mean(|[_, error, _]| *error)),
            rms_n: known(rms),
            rms_share: known(rms / mean(|[measured, ..]| *measured)),
            sensor_sigma_n: sensor.sigma,
            computed_sigma_n: sigmas.get(sigmas.len() / 2).copied(),
            inside_1_sigma: inside(1.0),
            inside_2_sigma: inside(2.0),
        }
    };
    sensors.iter().enumerate().map(of).collect()
}
