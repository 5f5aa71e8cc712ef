//! Notes: information about how the results were obtained, for every reader.

use std::collections::BTreeMap;

use tipwatch_language::{decimals, say, word};
use tipwatch_mechanics::estimation::ShownNoise;
use tipwatch_mechanics::estimation::plausibility::{Excitation, Unshown};
use tipwatch_mechanics::machine::{
    Axis, Machine, MountSource, Note, NoteKind, Parameter, Proof, SessionProofs,
};
use tipwatch_mechanics::state::{Reason, Sensor};
use tipwatch_mechanics::{Quantity, State};

use super::clock::{self, ClockOffsets, text::TopicsFinding};
use super::imu_check::MountingCheck;
use super::measured_loads::LoadComparison;
use super::payload::EstimatedPayload;
use super::prediction::PredictionSeen;
use crate::base::number::short;
use crate::base::rows::Rows;
use crate::load::{LoadedLog, MeasuredLoads};

/// Data of all rows for notes and advice.
#[derive(Debug)]
pub(crate) struct Seen {
    /// Number of rows.
    rows: usize,
    /// Rows in which measured torques determined the load split.
    with_torques: usize,
    /// Valid rows in which a bias of the accelerometer was subtracted, as a number.
    with_bias: f64,
    /// Sums over these rows: the subtracted bias (m/s^2), and the variance of the specific force, by axis.
    removed_bias: [f64; 3],
    bias_variance: [f64; 3],
    /// Smallest and largest position of each joint in the valid rows (rad or m).
    pub(crate) positions: Vec<[f64; 2]>,
    /// The specific force of the steady rows.
    pub(crate) mounting: MountingCheck,
    /// Evidence of the motion on signs and order of the sensors.
    excitation: Excitation,
    ahead: PredictionSeen,
}

impl Seen {
    /// Returns the data before the first row.
    pub(crate) fn new(machine: &Machine) -> Self {
        Self {
            rows: 0,
            with_torques: 0,
            with_bias: 0.0,
            removed_bias: [0.0; 3],
            bias_variance: [0.0; 3],
            positions: vec![[f64::INFINITY, f64::NEG_INFINITY]; machine.joints().len()],
            mounting: MountingCheck::new(machine),
            excitation: Excitation::new(machine),
            ahead: PredictionSeen::default(),
        }
    }

    /// Takes the next rows.
    pub(crate) fn take(&mut self, machine: &Machine, rows: &Rows) {
        self.rows += rows.len();
        self.ahead.take(rows);
        if let Some(used) = rows.outcomes.known_column(Quantity::MeasuredTorques) {
            self.with_torques += used.iter().filter(|&&torques| torques > 0.0).count();
        }
        let mut state = State::zero(machine);
        for row in 0..rows.len() {
            if rows.reasons[row].leave_state_unknown() {
                continue;
            }
            rows.states.get(row, &mut state);
            // a machine that falls or lies on its side stands on no plane through its contacts
            let falls = [Reason::Tipping, Reason::SupportsUnknown];
            if !falls.iter().any(|&reason| rows.reasons[row].has(reason)) {
                self.mounting.take(machine, &state);
            }
            self.excitation.take(rows.times_ns[row], &state);
            if !rows.is_valid(row) {
                continue;
            }
            for (range, joint) in self.positions.iter_mut().zip(&state.joints) {
                *range = [range[0].min(joint.position), range[1].max(joint.position)];
            }
            let bias = &state.noise.accelerometer_bias;
            if bias.covariance_change == [0.0; 6] {
                continue;
            }
            self.with_bias += 1.0;
            for (i, axis) in Axis::ALL.into_iter().enumerate() {
                self.removed_bias[i] += bias.removed[i];
                let sigma = state.sigma(machine, Parameter::SpecificForce(axis));
                self.bias_variance[i] += sigma.powi(2);
            }
        }
        self.mounting.evaluate_waiting(machine);
    }
}

/// Noise that differs from the stated one by less than this factor is not worth a note.
const NOTED_NOISE: f64 = 2.0;

/// Describes the noises shown by the samples that are far from the stated ones.
pub(crate) fn of_noise(noise: &[ShownNoise]) -> Option<String> {
    let differs = |noise: &&ShownNoise| {
        let ratio = noise.ratio();
        ratio.is_finite() && !(1.0 / NOTED_NOISE..=NOTED_NOISE).contains(&ratio)
    };
    let told = noise.iter().filter(differs).map(|noise| {
        say!(
            "{} {} {} (stated: {})",
            noise.key,
            short(noise.shown),
            noise.unit,
            short(noise.stated)
        )
    });
    let mut told: Vec<String> = told.collect();
    told.dedup();
    (!told.is_empty()).then(|| {
        say!(
            "The samples show another noise than [estimator] states. Estimates and bands rest on what they show: {}.",
            told.join(", ")
        )
    })
}

/// The joints of the arm whose encoder reads exactly zero in every sample of the log.
pub(crate) fn of_zeros(machine: &Machine, seen: &Seen, shown: SessionProofs) -> Option<Note> {
    let unshown = seen.excitation.unshown();
    let only_zeros = shown.unchanged.shared_with(shown.at_zero);
    let joints = unshown.iter().filter_map(|it| match it {
        Unshown::Joint(joint) if only_zeros.has(Proof::Joint(*joint)) => {
            Some(machine.joints()[*joint].name.as_str())
        }
        _ => None,
    });
    let joints: Vec<&str> = joints.collect();
    (!joints.is_empty()).then(|| {
        let text = say!(
            "The position of {} is exactly 0 in every sample. So reads an encoder that nobody reads, too: if the arm stood \
             elsewhere, the loads are those of another posture.",
            joints.join(", ")
        );
        Note::new(NoteKind::Untested, text)
    })
}

/// Assumptions, substitutes and anomalies, one note each.
#[must_use]
pub(crate) fn of(
    loaded: &LoadedLog,
    payloads: &[EstimatedPayload],
    clock_findings: &[TopicsFinding],
    clock: &ClockOffsets,
    seen: &Seen,
) -> Vec<Note> {
    let mut notes: Vec<Note> = Vec::new();
    let sensors = &loaded.matched.sensors;
    if !sensors.imu && sensors.odometry {
        notes.push(
            word!("The log has no IMU. Specific force and angular velocity are computed from the odometry.")
                .into(),
        );
    } else if !sensors.imu {
        notes.push(
            word!("The log has neither IMU nor odometry: wheel loads cannot be computed.").into(),
        );
    }
    if let source @ MountSource::Assumed { .. } = &loaded.machine.imu().source {
        let text = say!("Position and orientation of the IMU: {source}.");
        notes.push(Note::from(text));
    }
    notes.extend(reference_posture(&loaded.machine).map(Note::from));
    notes.extend(loaded.machine.notes().iter().cloned());
    let found = missing_wheel_joints(loaded)
        .into_iter()
        .chain(loaded.notes.iter().cloned())
        .chain(measured_torques(loaded, seen))
        .chain(accelerometer_bias(loaded, seen));
    notes.extend(found.map(Note::from));
    let untested = (seen.excitation).statement(&loaded.machine, word!("this log"));
    notes.extend(untested.map(|text| Note::new(NoteKind::Untested, text)));
    let found = (seen.ahead.note(&loaded.machine).into_iter()).chain(without_value(loaded));
    notes.extend(found.map(Note::from));
    for signal in loaded.signals.iter() {
        if signal.recording.stamps_ns.is_empty() && !matches!(signal.sensor, Sensor::Joints(_)) {
            notes.push(Note::from(say!("{}: no readable message.", signal.topic)));
        }
    }
    let clocks = clock_findings.iter().map(|finding| format!("{finding}."));
    let clocks = clocks.chain(clock::text::notes(clock));
    let payloads = payloads.iter().map(|found| {
        say!(
            "Payload {}: its mass was estimated as {:.0} kg (standard deviation {:.0} kg), from the force of linkage {}.",
            found.payload,
            found.mass_kg,
            found.sigma_kg,
            found.linkage
        )
    });
    let integrity = &loaded.losses.integrity;
    let losses = (loaded.losses.notes.iter().cloned())
        .chain(skipped_chunks(integrity.chunks_passed_over))
        .chain(
            (integrity.note()).map(|note| say!("{note}; implausible values are flagged instead.")),
        );
    notes.extend(clocks.chain(payloads).chain(losses).map(Note::from));
    notes
}

/// Messages that have none of the numbers of a signal: one note for all joints that share a topic.
fn without_value(loaded: &LoadedLog) -> Vec<String> {
    let mut skipped: BTreeMap<(&str, &str), [u64; 2]> = BTreeMap::new();
    for signal in loaded.signals.iter() {
        let count = signal.recording.reading.without_value;
        if count > 0 {
            let key = (signal.topic.as_str(), signal.name);
            let [least, most] = skipped.entry(key).or_insert([count; 2]);
            (*least, *most) = (count.min(*least), count.max(*most));
        }
    }
    let note = |((topic, name), [least, most]): ((&str, &str), [u64; 2])| {
        let count = match least == most {
            true => least.to_string(),
            false => say!("{least} to {most}"),
        };
        say!("{topic}: skipped {count} messages without any of the fields bound to {name}.")
    };
    skipped.into_iter().map(note).collect()
}

/// Returns the notes on measured against computed loads.
pub(crate) fn of_measured_loads(
    measured: &MeasuredLoads,
    comparison: &LoadComparison,
    start_ns: i64,
) -> Vec<String> {
    let mut notes = measured.notes.clone();
    for sensor in &comparison.sensors {
        let (Some(bias), Some(rms), Some(inside)) =
            (sensor.bias_n, sensor.rms_n, sensor.inside_2_sigma)
        else {
            notes.push(say!(
                "Measured load {}: no row to compare it with the computed load.",
                sensor.sensor
            ));
            continue;
        };
        notes.push(say!(
            "Measured load {}: measured minus computed {bias:+.0} N in the mean, {rms:.0} N root mean square over {} \
             rows; {:.0} % of them inside two standard deviations of both.",
            sensor.sensor,
            sensor.rows,
            100.0 * inside
        ));
    }
    for span in &comparison.contradictions {
        let seconds = |time_ns: i64| (time_ns - start_ns) as f64 * 1e-9;
        notes.push(say!(
            "From t = {:.2} s to {:.2} s measured and computed loads contradict each other, most at {}: measured minus \
             computed {:+.0} N, standard deviation of both together {:.0} N{}. {}.",
            seconds(span.start_ns),
            seconds(span.end_ns),
            span.sensor,
            span.difference_n,
            span.sigma_n,
            span.explanation(),
            span.consequence()
        ));
    }
    notes
}

/// The assumed posture of the reference loads, where an arm makes a difference.
fn reference_posture(machine: &Machine) -> Option<String> {
    let posture = &machine.reference().posture;
    let has_arm = machine.joints().iter().any(|j| j.spins_wheel.is_none());
    (has_arm && !posture.is_stated).then(|| {
        say!(
            "Static loads, the reference of utilisation and load limits, are those of {}.",
            posture.source()
        )
    })
}

/// The share of rows in which measured torques determined the load split.
fn measured_torques(loaded: &LoadedLog, seen: &Seen) -> Option<String> {
    let sensors = &loaded.matched.sensors;
    let machine = &loaded.machine;
    let mut linkages: Vec<&str> = (sensors.actuators.iter())
        .map(|signal| &machine.contact().actuated_joints[signal.joint])
        .map(|joint| joint.name(machine.linkages()))
        .collect();
    linkages.dedup();
    if linkages.is_empty() {
        return None;
    }
    let with = seen.with_torques;
    if with == 0 {
        return Some(say!(
            "The forces of {} were not used: they are missing in every row, or the model cannot use them.",
            linkages.join(", ")
        ));
    }
    Some(say!(
        "In {:.1} % of the rows the measured forces of {} determined the load split. There \
         the split rule has no effect, and envelope and standard deviations follow from the forces.",
        100.0 * with as f64 / seen.rows as f64,
        linkages.join(", ")
    ))
}

/// The bias of the accelerometer that was subtracted, or that none could be estimated.
fn accelerometer_bias(loaded: &LoadedLog, seen: &Seen) -> Option<String> {
    let machine = &loaded.machine;
    let stated = machine.uncertainty().accelerometer_bias;
    if !loaded.matched.sensors.imu || stated <= 0.0 {
        return None;
    }
    let (removed, variance, known) = (seen.removed_bias, seen.bias_variance, seen.with_bias);
    if known == 0.0 {
        return Some(say!(
            "The bias of the accelerometer could not be estimated: there is neither an attitude with odometry nor a standstill, or \
             the IMU is not on the base. Its stated standard deviation of {stated} m/s² remains in every band."
        ));
    }
    let mean = |i: usize| {
        let (removed, sigma) = (removed[i] / known, f64::sqrt(variance[i] / known));
        decimals(format!(
            "{} {removed:+.3} ± {sigma:.3}",
            Axis::ALL[i].name()
        ))
    };
    Some(say!(
        "Bias of the accelerometer, estimated from attitude, odometry and standstill and subtracted (mean, IMU axes, ± one \
         standard deviation): {}, {}, {} m/s².",
        mean(0),
        mean(1),
        mean(2)
    ))
}

fn skipped_chunks(chunks: u64) -> Option<String> {
    (chunks > 0).then(|| {
        say!(
            "Skipped {chunks} chunks of the log that contain no used topic according to its index. They were not checked \
             for damage; tipwatch recover checks every byte."
        )
    })
}

fn missing_wheel_joints(loaded: &LoadedLog) -> Option<String> {
    let missing: Vec<_> = loaded
        .machine
        .joints()
        .iter()
        .filter(|j| !j.logged && j.constant.is_none())
        .map(|j| j.name.as_str())
        .collect();
    if missing.is_empty() {
        return None;
    }
    let source = if loaded.matched.sensors.odometry {
        word!("their velocities follow from odometry, assuming rolling without slip")
    } else {
        word!("they are assumed at rest, because there is no odometry either")
    };
    Some(say!(
        "Wheel joints missing from the joint states: {}; {source}.",
        missing.join(", ")
    ))
}
