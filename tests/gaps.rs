//! Gaps, disorder and duplicates are reported, never filled in.

use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_analyze::load::load;
use tipwatch_analyze::report::story;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::estimation::{RowClock, SmoothedRows, smooth};
use tipwatch_mechanics::state::{Reason, Sensor};
use tipwatch_mechanics::{Quantity, StateColumns};
use tipwatch_tests::{OwnedSamples, analysed, analysed_with, data, write_kept};

/// Smooths the short log after `edit` has changed its recordings.
fn smoothed(edit: impl Fn(&mut OwnedSamples)) -> SmoothedRows {
    let path = data("tiny.mcap");
    let log = Log::open(&path).unwrap();
    let loaded = load(
        &log,
        &MachineFile::read(&path.with_extension("toml")).unwrap(),
        Estimator::Smoother,
        &mut |_| {},
    )
    .unwrap();
    let recordings: Vec<OwnedSamples> = loaded
        .signals
        .iter()
        .map(|signal| {
            let recording = &signal.recording;
            let mut values = vec![0.0; recording.len() * recording.width()];
            recording.read(0..recording.len(), &mut values).unwrap();
            let mut recording = OwnedSamples {
                sensor: signal.sensor,
                stamps_ns: recording.stamps_ns.clone(),
                values,
            };
            edit(&mut recording);
            recording
        })
        .collect();
    let samples: Vec<_> = recordings.iter().map(OwnedSamples::samples).collect();
    smooth(
        &loaded.machine,
        &loaded.matched.sensors,
        &samples,
        RowClock::JointStates,
    )
}

/// Removes the samples for which `gone` is true, given their time since the first sample (s).
fn leave_out(recording: &mut OwnedSamples, gone: impl Fn(f64) -> bool) {
    let width = recording.values.len() / recording.stamps_ns.len();
    let first = recording.stamps_ns[0];
    let keep: Vec<bool> = recording
        .stamps_ns
        .iter()
        .map(|&t| !gone((t - first) as f64 * 1e-9))
        .collect();
    let mut index = 0;
    recording.values.retain(|_| {
        index += 1;
        keep[(index - 1) / width]
    });
    let mut flags = keep.iter();
    recording.stamps_ns.retain(|_| *flags.next().unwrap());
}

#[test]
fn only_rows_inside_an_imu_gap_are_invalid() {
    let rows = smoothed(|recording| {
        if recording.sensor == Sensor::Imu {
            leave_out(recording, |t| (1.0..1.6).contains(&t));
        }
    });
    let first = rows.times_ns[0];
    for (&time, reasons) in rows.times_ns.iter().zip(&rows.estimated.reasons) {
        let t = (time - first) as f64 * 1e-9;
        if (1.05..1.55).contains(&t) {
            assert!(reasons.has(Reason::ImuGap), "{t}");
        } else if !(0.95..1.65).contains(&t) {
            assert!(reasons.is_empty(), "{t}: {reasons:?}");
        }
    }
}

#[test]
fn a_gap_in_the_joint_states_is_invalid_and_not_bridged() {
    let rows = smoothed(|recording| {
        if matches!(recording.sensor, Sensor::Joints(_)) {
            leave_out(recording, |t| (1.0..1.6).contains(&t));
        }
    });
    let gaps = rows
        .estimated
        .reasons
        .iter()
        .filter(|reasons| reasons.has(Reason::JointsGap))
        .count();
    assert_eq!(gaps, 1, "one row says that there is a gap");
}

#[test]
fn a_short_dropout_is_bridged() {
    let rows = smoothed(|recording| leave_out(recording, |t| (1.0..1.1).contains(&t)));
    let mut reasons = rows.estimated.reasons.iter();
    assert!(reasons.all(|reasons| reasons.is_empty()));
}

#[test]
fn disorder_and_duplicates_change_nothing() {
    let straight = smoothed(|_| {});
    let shuffled = smoothed(|recording| {
        let width = recording.values.len() / recording.stamps_ns.len();
        let n = recording.stamps_ns.len();
        // repeat every seventh sample at the end, then reorder all of them
        for i in (0..n).step_by(7) {
            recording.stamps_ns.push(recording.stamps_ns[i]);
            recording
                .values
                .extend_from_within(i * width..(i + 1) * width);
        }
        let total = recording.stamps_ns.len();
        let order: Vec<usize> = (0..total).map(|i| (i * 7919) % total).collect();
        let (stamps, values) = (recording.stamps_ns.clone(), recording.values.clone());
        recording.stamps_ns = order.iter().map(|&i| stamps[i]).collect();
        recording.values = order
            .iter()
            .flat_map(|&i| values[i * width..(i + 1) * width].to_vec())
            .collect();
    });
    assert_eq!(straight.times_ns, shuffled.times_ns);
    assert!(
        shuffled
            .counts
            .iter()
            .all(|(_, counts)| counts.not_later > 0)
    );
    let first = |rows: &StateColumns| -> Vec<f64> { rows.column(0).collect() };
    let states = [straight, shuffled].map(|rows| first(&rows.estimated.states));
    assert_eq!(states[0], states[1]);
}

/// The joints end while a wheel is off the ground, the log goes on: nothing says that the wheel stayed off until the log ended.
#[test]
fn what_follows_the_last_row_is_not_known() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("swing_lift.mcap");
    let whole = analysed(&data("swing_lift.mcap"), Options::default());
    assert_eq!(whole.coverage.after_rows_s, 0.0);
    let is_lift = |event: &&Event| event.kind == EventKind::WheelLift;
    let lift = whole.events.iter().find(is_lift).unwrap();
    let end_ns = lift.end_ns.unwrap();
    // the wheel was light for longer than it was off the ground
    let ends = format!(
        "At t = {:.2} ± {:.2} s every wheel carried load again",
        (end_ns - whole.rows.times_ns[0]) as f64 * 1e-9,
        2.0 * lift.end_sigma_s.unwrap()
    );
    let told = story(&whole);
    assert!(told.last().unwrap().starts_with(&ends), "{told:?}, {ends}");

    let until_ns = end_ns - (end_ns - lift.start_ns) / 2;
    write_kept(&data("swing_lift.mcap"), &log, &|topic, time_ns| {
        topic != "/joint_states" || time_ns < until_ns
    });
    let cut = analysed_with(&log, &data("swing_lift.toml"), Options::default());
    let lift = cut.events.iter().find(is_lift).unwrap();
    assert_eq!(lift.end_ns, None);
    let last_ns = *cut.rows.times_ns.last().unwrap();
    let whole_ns = *whole.rows.times_ns.last().unwrap();
    let after_s = (whole_ns - last_ns) as f64 * 1e-9;
    assert!(
        (cut.coverage.after_rows_s - after_s).abs() < 0.1,
        "{:?}",
        cut.coverage
    );
}

/// Causes count from a moment at which no wheel was light yet.
#[test]
fn a_steady_moment_before_an_event_is_before_all_of_it() {
    for name in ["swing_lift", "side_reach", "tip_over", "unstated_load"] {
        let found = analysed(&data(&format!("{name}.mcap")), Options::default());
        let limits = found.min_loads_n.as_ref().unwrap();
        let causes = found
            .events
            .iter()
            .filter_map(|event| event.causes.as_ref());
        for causes in causes.filter(|causes| causes.since_is_steady) {
            let row = found.rows.at(causes.since_ns);
            let window = found.rows.window(row..row + 1);
            for (wheel, limit_n) in limits.iter().enumerate() {
                let load_n = window.value(Quantity::Load(wheel), 0);
                assert!(load_n > *limit_n, "{name}: {load_n} N of wheel {wheel}");
            }
        }
    }
}
