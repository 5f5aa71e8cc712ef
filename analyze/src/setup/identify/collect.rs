//! The rows of a log as data: measured loads, cylinder forces, and the accelerometer at rest on level ground.

use tipwatch_calibration::identification::{
    Channel, Data, Instant, Measured, Reading, Situation, Source,
};
use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::{Machine, MachineSpec, SupportId};

use super::weighings::channel;
use crate::analysis::MeasuredLog;
use crate::analysis::measured_loads::sampled_rows;
use crate::load::linkage_force::at;

/// Error of one sample, as a share of the sensor's stated standard deviation, which is that of its constant error.
const SAMPLE_SHARE: f64 = 0.3;
/// Most rows of a log whose cylinder forces are used.
const MOST_FORCES: usize = 200;
/// A measured wheel below this share of the mean load counts as lifted.
const LEAST_SHARE: f64 = 0.02;
/// Standard deviation of a mean specific force at rest, without its bias (m/s^2), and the fewest rows of one.
const SPECIFIC_FORCE: f64 = 0.01;
const FEWEST_AT_REST: usize = 20;

/// Adds the rows of a log; `level` is the standard deviation of its ground's slope, where that is level (rad).
pub(super) fn add(
    log: &MeasuredLog,
    name: &str,
    spec: &MachineSpec,
    level: Option<f64>,
    data: &mut Data,
) {
    let channels = Channels::of(log, spec, data);
    let standing = log.loaded.standing();
    let rows = &log.rows;
    let usable: Vec<usize> = sampled_rows(rows.len())
        .filter(|&row| rows.is_valid(row))
        .collect();
    let every = usable.len().div_ceil(MOST_FORCES).max(1);
    let mut instants = Vec::new();
    for (place, &row) in usable.iter().enumerate() {
        // the loads of supports that are not known to be on the ground say nothing
        let Some(machine) = standing.at(rows.times_ns[row]) else {
            continue;
        };
        let mut state = State::zero(machine);
        rows.state(row, &mut state);
        let mut readings = channels.loads(log, machine, &state, row);
        if place % every == 0 {
            readings.extend(channels.forces(log, spec, row));
        }
        if readings.is_empty() {
            continue;
        }
        instants.push(Instant {
            time_s: rows.seconds(row),
            supports: machine.stands_on().into(),
            situation: Situation::Logged(Box::new(state)),
            readings,
        });
    }
    if !instants.is_empty() {
        data.sources.push(Source {
            name: name.into(),
            is_log: true,
            instants,
        });
    }
    if let Some(sigma) = level {
        let resting = at_rest(log, name, sigma, data);
        data.sources.extend(resting);
    }
}

/// The channels of a log. A sensor of several logs is one channel.
struct Channels {
    loads: Vec<usize>,
    forces: Vec<usize>,
}

impl Channels {
    fn of(log: &MeasuredLog, spec: &MachineSpec, data: &mut Data) -> Self {
        let mut add = |name: String, bias_sigma: f64, is_load: bool| {
            data.index_of(Channel {
                name,
                unit: "N",
                bias_sigma,
                is_load,
            })
        };
        let loads = log.loads.sensors.iter().map(|load| {
            let sensor = &load.sensor;
            add(format!("load {}", sensor.name), sensor.sigma, true)
        });
        let loads = loads.collect();
        let forces = log.forces.iter().map(|force| {
            let linkage = &spec.linkage[force.linkage];
            let name = format!("cylinder {}", linkage.name);
            add(name, linkage.force_sigma, false)
        });
        Self {
            loads,
            forces: forces.collect(),
        }
    }

    /// Measured loads of a row; none while a wheel is off the ground.
    fn loads(
        &self,
        log: &MeasuredLog,
        machine: &Machine,
        state: &State<f64>,
        row: usize,
    ) -> Vec<Reading> {
        let mean = machine.mass() * machine.gravity() / machine.wheels().len() as f64;
        let time_ns = log.rows.times_ns[row];
        let unobserved = log.unobserved(machine, state, time_ns);
        let mut found = Vec::new();
        for (index, (load, &channel)) in log.loads.sensors.iter().zip(&self.loads).enumerate() {
            let value = log.loads.at(index, time_ns);
            if !value.is_finite() || load.sensor.places(machine).next().is_none() {
                continue;
            }
            if value < LEAST_SHARE * mean {
                return Vec::new();
            }
            let by_motion = (unobserved.as_ref())
                .map_or(0.0, |motion| motion.sigma(&load.sensor.factors(machine)));
            found.push(Reading {
                what: Measured::Load {
                    supports: load.sensor.supports.clone(),
                },
                value,
                sigma: (SAMPLE_SHARE * load.sensor.sigma).hypot(by_motion),
                channel,
            });
        }
        found
    }

    fn forces(&self, log: &MeasuredLog, spec: &MachineSpec, row: usize) -> Vec<Reading> {
        let time_ns = log.rows.times_ns[row];
        let forces = log.forces.iter().zip(&self.forces);
        let known = forces.filter_map(|(force, &channel)| {
            let value = at(force.series.as_ref().ok()?, time_ns)?;
            let linkage = &spec.linkage[force.linkage];
            // friction is in neither direction while nothing moves
            let friction = linkage.friction_share * value;
            value.is_finite().then_some(Reading {
                what: Measured::ActuatorForce {
                    linkage: force.linkage,
                },
                value,
                sigma: friction.hypot(SAMPLE_SHARE * linkage.force_sigma).max(1.0),
                channel,
            })
        });
        known.collect()
    }
}

/// The mean specific force while the machine stands, in its first posture: one reading, because the slope is the same.
fn at_rest(log: &MeasuredLog, name: &str, slope_sigma: f64, data: &mut Data) -> Option<Source> {
    let (standing, rows) = (log.loaded.standing(), &log.rows);
    let machine = &log.loaded.machine;
    let mut supports: Option<Vec<SupportId>> = None;
    let mut state = State::zero(machine);
    let mut positions: Option<Vec<f64>> = None;
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for row in sampled_rows(rows.len()).filter(|&row| rows.is_valid(row)) {
        let activity = &rows.activities[row];
        if !(activity.at_standstill && activity.is_quiet) {
            continue;
        }
        let Some(on) = standing.at(rows.times_ns[row]).map(Machine::stands_on) else {
            continue;
        };
        // those of the first row
        if supports.get_or_insert_with(|| on.to_vec()) != on {
            continue;
        }
        rows.state(row, &mut state);
        let now: Vec<f64> = state.joints.iter().map(|joint| joint.position).collect();
        let first = positions.get_or_insert_with(|| now.clone());
        let pairs = first.iter().zip(&now);
        if pairs.clone().all(|(a, b)| (a - b).abs() < 0.02) {
            (0..3).for_each(|axis| sum[axis] += state.imu.specific_force[axis]);
            count += 1.0;
        }
    }
    if count < FEWEST_AT_REST as f64 {
        return None;
    }
    let readings = (0..3).map(|axis| Reading {
        what: Measured::SpecificForce { axis },
        value: sum[axis] / count,
        sigma: SPECIFIC_FORCE,
        channel: data.index_of(channel(
            format!("accelerometer {}", ["x", "y", "z"][axis]),
            "m/s^2",
        )),
    });
    let readings = readings.collect();
    Some(Source {
        name: format!("{name}, at rest on level ground"),
        is_log: false,
        instants: vec![Instant {
            time_s: 0.0,
            supports: supports?.into(),
            situation: Situation::AtRest {
                positions: positions?,
                slope: [0.0; 2],
                slope_sigma,
            },
            readings,
        }],
    })
}
