//! Measured wheel loads of a log: of single wheels, axles and load pins, on the clock of the rows.

use anyhow::Result;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_language::say;
use tipwatch_mechanics::machine::LoadSensor;

use super::LoadedLog;
use super::held_forces::HeldForces;
use super::linkage_force::{Clocks, Series, interpolated, series_of};
use crate::base::error_text::error_text;

/// A sample this close to a row (ns) is its value, however rare samples are.
const NEAR_NS: i64 = 20_000_000;

/// The measured loads of a log.
#[derive(Debug, Default)]
pub struct MeasuredLoads {
    /// The sensors that the log contains, with their samples.
    pub sensors: Vec<MeasuredLoad>,
    /// Forces of supports that are measured too slowly for the estimator.
    pub(crate) held: HeldForces,
    /// Longest gap between samples that is interpolated (ns).
    longest_gap_ns: i64,
    /// Bound sensors that the log does not contain, as sentences.
    pub notes: Vec<String>,
}

/// The samples of a load sensor.
#[derive(Debug)]
pub struct MeasuredLoad {
    /// The sensor.
    pub sensor: LoadSensor,
    /// Stamps (ns) in order, and loads (N).
    samples: Series,
}

impl MeasuredLoads {
    /// Reads the loads that the machine file binds. What the log lacks is noted.
    pub(crate) fn read(log: &Log, file: &MachineFile, loaded: &LoadedLog) -> Self {
        let clocks = Clocks::of(file, loaded);
        let mut found = Self {
            // static rows hold their last samples, and so do the loads beside them
            longest_gap_ns: loaded.machine.longest_known_gap_ns(),
            held: loaded.held_forces.clone(),
            ..Self::default()
        };
        for sensor in loaded.machine.load_sensors() {
            match samples(log, sensor, &clocks) {
                Ok(samples) if samples.0.is_empty() => found.notes.push(say!(
                    "Measured load {}: topic {} has no readable number, so it is not compared.",
                    sensor.name,
                    sensor.field.topic
                )),
                Ok(samples) => found.sensors.push(MeasuredLoad {
                    sensor: sensor.clone(),
                    samples,
                }),
                Err(error) => found.notes.push(say!(
                    "Measured load {} is not compared: {}.",
                    sensor.name,
                    error_text(&error)
                )),
            }
        }
        found
    }

    /// The measured load (N) of the sensor with this index at a time (ns); NaN where there is none close enough.
    #[must_use]
    pub fn at(&self, sensor: usize, time_ns: i64) -> f64 {
        let (stamps, values) = &self.sensors[sensor].samples;
        interpolated(stamps, values, time_ns, self.longest_gap_ns).unwrap_or_else(|| {
            let next = stamps.partition_point(|&stamp| stamp < time_ns);
            let beside = next.saturating_sub(1)..stamps.len().min(next + 1);
            let near = |place: &usize| stamps[*place].abs_diff(time_ns);
            let nearest = beside.min_by_key(near);
            let nearest = nearest.filter(|place| near(place) <= NEAR_NS.unsigned_abs());
            nearest.map_or(f64::NAN, |place| values[place])
        })
    }

    /// Whether no load is measured.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sensors.is_empty()
    }
}

fn samples(log: &Log, sensor: &LoadSensor, clocks: &Clocks<'_>) -> Result<Series> {
    let (stamps, values) = series_of(log, &sensor.field, clocks)?;
    let pairs = stamps.into_iter().zip(values);
    Ok(pairs.filter(|(_, value)| value.is_finite()).unzip())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tipwatch_mechanics::machine::FieldSpec;

    fn loads(stamps_ms: &[i64], longest_gap_ns: i64) -> MeasuredLoads {
        let sensor = LoadSensor {
            name: "fl".into(),
            supports: Vec::new(),
            sigma: 1.0,
            field: FieldSpec {
                topic: "/loads".into(),
                field: None,
                joint: None,
                scale: 1.0,
                offset: 0.0,
                can: None,
            },
        };
        let stamps = stamps_ms.iter().map(|ms| ms * 1_000_000);
        let values = (0..stamps_ms.len()).map(|k| 100.0 * k as f64);
        MeasuredLoads {
            sensors: vec![MeasuredLoad {
                sensor,
                samples: (stamps.collect(), values.collect()),
            }],
            longest_gap_ns,
            held: HeldForces::default(),
            notes: Vec::new(),
        }
    }

    #[test]
    fn loads_are_interpolated_up_to_the_longest_gap() {
        let loads = loads(&[0, 200, 2000], 250_000_000);
        let at = |ms: i64| loads.at(0, ms * 1_000_000);
        assert_eq!([at(0), at(50), at(200)], [0.0, 25.0, 100.0]);
        assert!(at(1000).is_nan() && at(-50).is_nan() && at(2050).is_nan());
        // near a sample that stands alone
        assert_eq!(
            [at(215), at(1990), at(2010), at(-10)],
            [100.0, 200.0, 200.0, 0.0]
        );
    }
}
