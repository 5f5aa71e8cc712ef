//! Logs with every kind of wrong clock seen on machines, written here.

use std::collections::BTreeMap;

use mcap::WriteOptions;
use tipwatch_ingest::{
    ClockFinding, ClockFindingKind as Kind, FieldRequest, Log, NumberField, SensorKind,
    SensorRecording, SensorRequest, StampSource, Treatment, record_fields, record_sensors,
};

use crate::sensor_blocks::blocks_and_columns;
use crate::support::{FIRST_NS, Mcap, TempLog, joint_state};

const MS: i64 = 1_000_000;
const S: i64 = 1_000_000_000;
const PERIOD: i64 = 10 * MS;
const MESSAGES: i64 = 2000;

/// The times of a message: header stamp (zero if absent), publish time, log time.
#[derive(Clone, Copy)]
struct StampedMessage {
    stamp: i64,
    publish: i64,
    log: i64,
}

impl StampedMessage {
    /// Returns the message with another stamp.
    fn stamped(self, stamp: i64) -> Self {
        Self { stamp, ..self }
    }
}

/// A message that is received when it is sent.
fn sent(stamp: i64, log: i64) -> StampedMessage {
    let publish = log;
    StampedMessage {
        stamp,
        publish,
        log,
    }
}

/// Transport delay of 2 to 3 ms.
fn delay(i: i64) -> i64 {
    2 * MS + ((i * 0x9E37_79B9) >> 7) % MS
}

/// A message at this time, by a correct clock.
fn sound(time: i64, i: i64) -> StampedMessage {
    sent(time, time + delay(i))
}

fn at(i: i64) -> i64 {
    FIRST_NS + i * PERIOD
}

fn all(message: impl Fn(i64) -> StampedMessage) -> Vec<StampedMessage> {
    (0..MESSAGES).map(message).collect()
}

fn log_of(topics: &[(&str, Vec<StampedMessage>)], with_clock_topic: bool) -> TempLog {
    log_ordered(topics, with_clock_topic, |_, _, message| message.log)
}

/// A log whose messages are in the order of `key`, given the topic and the index of a message among its messages.
fn log_ordered(
    topics: &[(&str, Vec<StampedMessage>)],
    with_clock_topic: bool,
    key: impl Fn(usize, i64, &StampedMessage) -> i64,
) -> TempLog {
    let mut writer = Mcap::new(WriteOptions::new().compression(None));
    if with_clock_topic {
        writer.topic("/clock", "rosgraph_msgs/msg/Clock", "uint32 sec\n");
    }
    let mut messages = Vec::new();
    for (topic, (name, times)) in topics.iter().enumerate() {
        let channel = writer.joints(name);
        messages.extend(
            times
                .iter()
                .enumerate()
                .map(|(i, &m)| (m, channel, topic, i)),
        );
    }
    messages.sort_by_key(|(message, _, topic, i)| key(*topic, *i as i64, message));
    for (message, channel_id, _, i) in messages {
        let joint = joint_state(message.stamp, &["a"], &[i as f64], &[]);
        let times = [message.log, message.publish].map(|time| time as u64);
        writer.message(channel_id, i as u32, times, &joint);
    }
    TempLog::new("log.mcap", &writer.finish())
}

fn recorded(file: &TempLog) -> BTreeMap<String, SensorRecording> {
    let log = Log::open(&file.path).unwrap();
    let topics = log.topics().iter().filter(|topic| topic.name != "/clock");
    let requests: Vec<SensorRequest> = topics
        .map(|topic| SensorRequest::typed(topic.id, SensorKind::JointStates, vec!["a".into()]))
        .collect();
    let (_, losses) = record_sensors(&log, &requests, &mut |_| {}).unwrap();
    assert!(losses.is_empty(), "{losses:?}");
    let (_, recordings) = blocks_and_columns(&log, &requests);
    recordings
        .into_iter()
        .map(|r| (log.topic(r.reading.topic).unwrap().name.clone(), r))
        .collect()
}

fn found(recording: &SensorRecording, kind: Kind) -> &ClockFinding {
    let finding = recording.reading.findings.iter().find(|f| f.kind == kind);
    finding.unwrap_or_else(|| panic!("no {kind:?} in {:?}", recording.reading.findings))
}

fn kinds(recording: &SensorRecording) -> Vec<Kind> {
    recording.reading.findings.iter().map(|f| f.kind).collect()
}

/// The largest error of the stamps (ms).
fn largest_error_ms(recording: &SensorRecording, truth: impl Fn(i64) -> i64) -> f64 {
    let error = |(place, &stamp): (usize, &i64)| {
        // the joint position is the index of the message
        let i = recording.values[place * recording.width] as i64;
        (stamp - truth(i)).abs() as f64 / MS as f64
    };
    let errors = recording.stamps_ns.iter().enumerate().map(error);
    errors.fold(0.0, f64::max)
}

#[test]
fn valid_stamps_stay_unchanged() {
    let shifted = |i| sound(at(i) + 3 * MS, i);
    let recordings = recorded(&log_of(
        &[("/arm", all(|i| sound(at(i), i))), ("/imu", all(shifted))],
        false,
    ));
    for (name, offset) in [("/arm", 0), ("/imu", 3 * MS)] {
        let recording = &recordings[name];
        assert_eq!(largest_error_ms(recording, |i| at(i) + offset), 0.0);
        assert_eq!(kinds(recording), []);
        assert_eq!(recording.reading.correction.added_s, 0.0);
        let timing = recording.reading.statistics.timing();
        let offset = timing.header_minus_log.unwrap();
        assert!((offset.median_s + 0.0025).abs() < 2e-4, "{offset:?}");
        assert!((offset.mad_s - 0.00025).abs() < 5e-5, "{offset:?}");
        assert!(offset.drift_ppm.abs() < 5.0 * offset.drift_sigma_ppm.max(1.0));
    }
}

#[test]
fn simulation_time_becomes_the_time_of_all_signals() {
    // the simulation runs at half speed
    let simulated = |i: i64| sent(7 * S + i * PERIOD, FIRST_NS + 2 * i * PERIOD + delay(i));
    let file = log_of(&[("/arm", all(simulated)), ("/imu", all(simulated))], true);
    let recordings = recorded(&file);
    for recording in recordings.values() {
        let finding = found(recording, Kind::SimulationTime);
        assert_eq!(finding.treatment, Treatment::Handled);
        assert!(finding.seen.contains("/clock") && finding.seen.contains("0.500"));
        assert_eq!(largest_error_ms(recording, |i| 7 * S + i * PERIOD), 0.0);
        let timing = recording.reading.statistics.timing();
        let drift = timing.header_minus_log.unwrap();
        assert!((drift.drift_ppm + 500_000.0).abs() < 100.0, "{drift:?}");
    }
}

#[test]
fn unstamped_signals_follow_uneven_simulation_time() {
    // the rate changes every second
    let log_time = |i: i64| {
        let t = i as f64 * 0.01;
        FIRST_NS + ((1.3 * t + 0.3 * (0.7 * t).sin()) * 1e9) as i64
    };
    let simulated = |i| sent(S + i * PERIOD, log_time(i));
    let unstamped = |i| simulated(i).stamped(0);
    let recordings = recorded(&log_of(
        &[("/arm", all(simulated)), ("/force", all(unstamped))],
        false,
    ));
    let force = &recordings["/force"];
    assert_eq!(
        found(force, Kind::NoHeaderStamp).treatment,
        Treatment::Handled
    );
    let error = largest_error_ms(force, |i| S + i * PERIOD);
    assert!(error < 20.0, "{error} ms");
}

#[test]
fn replayed_log_keeps_machine_time() {
    let days = 40 * 86_400 * S;
    let replayed = |i: i64| {
        let log = at(i) / 2 + FIRST_NS / 2 + days + delay(i);
        sent(at(i), log)
    };
    let recordings = recorded(&log_of(
        &[("/arm", all(replayed)), ("/imu", all(replayed))],
        false,
    ));
    for recording in recordings.values() {
        let finding = found(recording, Kind::ReplayedLog);
        assert_eq!(finding.treatment, Treatment::Handled);
        assert!(
            finding.seen.contains("40.00 days later") && finding.seen.contains("2.00"),
            "{finding}"
        );
        assert_eq!(largest_error_ms(recording, at), 0.0);
    }
}

#[test]
fn unstamped_messages_are_omitted_or_placed() {
    let never = |i| sound(at(i), i).stamped(0);
    let sometimes = |i| sound(at(i), i).stamped(if i % 10 == 3 { 0 } else { at(i) });
    let topics = [
        ("/arm", all(|i| sound(at(i), i))),
        ("/force", all(never)),
        ("/imu", all(sometimes)),
    ];
    let recordings = recorded(&log_of(&topics, false));
    let force = &recordings["/force"];
    let finding = found(force, Kind::NoHeaderStamp);
    assert_eq!(finding.treatment, Treatment::Handled);
    assert!(
        finding.seen.contains("absent or zero") && finding.done.contains("/arm"),
        "{finding}"
    );
    assert_eq!(force.reading.clock.source, StampSource::Log);
    assert!((force.reading.correction.added_s + 0.0025).abs() < 2e-4);
    // the deviation of single delays from the median remains
    let error = largest_error_ms(force, at);
    assert!(error < 0.7, "{error} ms");
    let imu = &recordings["/imu"];
    assert_eq!(found(imu, Kind::ZeroStamps).treatment, Treatment::Handled);
    assert_eq!((imu.reading.unstamped, imu.stamps_ns.len()), (200, 1800));
    assert_eq!(largest_error_ms(imu, at), 0.0);
}

#[test]
fn log_time_is_used_and_reported_without_stamps() {
    let never = |i| sound(at(i), i).stamped(0);
    let recordings = recorded(&log_of(
        &[("/arm", all(never)), ("/imu", all(never))],
        false,
    ));
    for recording in recordings.values() {
        let finding = found(recording, Kind::NoHeaderStamp);
        assert_eq!(finding.treatment, Treatment::Reported);
        assert_eq!(largest_error_ms(recording, |i| at(i) + delay(i)), 0.0);
    }
}

#[test]
fn publish_time_is_preferred_to_log_time() {
    // published 1 ms after measurement, recorded with delays
    let published = |stamp: i64, i: i64| StampedMessage {
        stamp,
        publish: at(i) + MS,
        log: at(i) + delay(i) * 10,
    };
    let topics = [
        ("/arm", all(|i| published(at(i), i))),
        ("/force", all(|i| published(0, i))),
    ];
    let force = &recorded(&log_of(&topics, false))["/force"];
    assert_eq!(force.reading.clock.source, StampSource::Publish);
    assert_eq!(largest_error_ms(force, at), 0.0);
    let both = [
        ("/arm", all(|i| published(0, i))),
        ("/force", all(|i| published(0, i))),
    ];
    let recordings = recorded(&log_of(&both, false));
    assert_eq!(largest_error_ms(&recordings["/arm"], |i| at(i) + MS), 0.0);
    assert_eq!(
        recordings["/arm"].reading.time_base.source(),
        StampSource::Publish
    );
}

#[test]
fn topic_of_another_epoch_is_mapped_to_the_common_clock() {
    let since_boot = |i| sound(at(i), i).stamped(500 * S + i * PERIOD);
    let slow_clock = |i| sound(at(i), i).stamped(at(i) - 90 * S);
    let topics = [
        ("/arm", all(|i| sound(at(i), i))),
        ("/boom", all(|i| sound(at(i), i))),
        ("/imu", all(since_boot)),
        ("/odom", all(slow_clock)),
    ];
    let recordings = recorded(&log_of(&topics, false));
    for (name, kind) in [("/imu", Kind::OtherEpoch), ("/odom", Kind::ClockApart)] {
        let finding = found(&recordings[name], kind);
        assert_eq!(finding.treatment, Treatment::Handled, "{finding}");
        let error = largest_error_ms(&recordings[name], at);
        assert!(error < 0.1, "{name}: {error} ms");
    }
    assert_eq!(kinds(&recordings["/arm"]), []);
}

#[test]
fn other_epoch_is_refused_without_usable_log_times() {
    let at_once = |stamp: i64| sent(stamp, FIRST_NS);
    let topics = [
        ("/arm", all(|i| at_once(at(i)))),
        ("/boom", all(|i| at_once(at(i)))),
        ("/imu", all(|i| at_once(500 * S + i * PERIOD))),
    ];
    let recordings = recorded(&log_of(&topics, false));
    assert_eq!(largest_error_ms(&recordings["/arm"], at), 0.0);
    let imu = &recordings["/imu"];
    let refusal = imu.reading.refusal().unwrap();
    assert_eq!(refusal.kind, Kind::OtherEpoch);
    assert!(
        refusal
            .done
            .contains("log times of all its messages are equal")
    );
    assert!(imu.stamps_ns.is_empty());
}

#[test]
fn runs_of_a_looped_replay_follow_each_other() {
    let length = 5 * S;
    let looped = |period: i64| {
        move |i: i64| {
            let time = i * period;
            sound(FIRST_NS + time, i).stamped(FIRST_NS - 86_400 * S + time % length)
        }
    };
    let slow: Vec<StampedMessage> = (0..500).map(looped(40 * MS)).collect();
    let topics = [("/arm", all(looped(PERIOD))), ("/imu", slow)];
    let recordings = recorded(&log_of(&topics, false));
    for (name, period) in [("/arm", PERIOD), ("/imu", 40 * MS)] {
        let recording = &recordings[name];
        let finding = found(recording, Kind::ClockRestart);
        assert_eq!(finding.treatment, Treatment::Handled);
        assert!(finding.done.contains("all topics restart"), "{finding}");
        assert_eq!(recording.reading.correction.restarts, 3);
        let run = |i: i64| i * period / length;
        let truth = |i: i64| FIRST_NS - 86_400 * S + i * period + run(i) * S;
        let error = largest_error_ms(recording, truth);
        assert!(error < 1.0, "{name}: {error} ms");
    }
    // both topics are shifted equally, to the nanosecond
    let (arm, imu) = (&recordings["/arm"], &recordings["/imu"]);
    let of_run = |recording: &SensorRecording, i: usize| recording.stamps_ns[i];
    assert_eq!(of_run(arm, 1000), of_run(imu, 250));
    assert_eq!(of_run(arm, 1500), of_run(imu, 375));
}

/// As several writers, a merge or a late flush leave it.
#[test]
fn blocks_in_another_order_are_no_restarts() {
    let sound_ones = || all(|i| sound(at(i), i));
    let topics = [("/arm", sound_ones()), ("/imu", sound_ones())];
    let late_block = |_: usize, i: i64, message: &StampedMessage| match i {
        800..900 => at(1000) + i,
        _ => message.log,
    };
    let halves_exchanged = |_: usize, i: i64, message: &StampedMessage| match i {
        ..1000 => message.log + 10 * S,
        _ => message.log - 10 * S,
    };
    let reversed =
        |_: usize, i: i64, message: &StampedMessage| message.log - 2 * (i / 300) * 300 * PERIOD;
    let files = [
        log_ordered(&topics, false, late_block),
        log_ordered(&topics, false, halves_exchanged),
        log_ordered(&topics, false, reversed),
    ];
    for (place, file) in files.iter().enumerate() {
        for recording in recorded(file).into_values() {
            assert!(
                !kinds(&recording).contains(&Kind::ClockRestart),
                "{place}: {:?}",
                recording.reading.findings
            );
            assert_eq!(recording.stamps_ns.len(), MESSAGES as usize);
            assert_eq!(largest_error_ms(&recording, at), 0.0);
        }
    }
}

#[test]
fn restarted_sensor_is_joined_by_log_time() {
    let restarted = |i| sound(at(i), i).stamped(at(i) - if i < 800 { 0 } else { 60 * S });
    let set_ahead =
        |i| sound(at(i), i).stamped(at(i) - if i < 1300 { 400 * 86_400 * S } else { 0 });
    let topics = [
        ("/arm", all(|i| sound(at(i), i))),
        ("/imu", all(restarted)),
        ("/odom", all(set_ahead)),
    ];
    let recordings = recorded(&log_of(&topics, false));
    for name in ["/imu", "/odom"] {
        let recording = &recordings[name];
        let finding = found(recording, Kind::ClockRestart);
        assert!(finding.done.contains("other topics continue"), "{finding}");
        let error = largest_error_ms(recording, at);
        assert!(error < 0.5, "{name}: {error} ms");
    }
    assert_eq!(kinds(&recordings["/arm"]), []);
}

#[test]
fn late_repeated_and_impossible_stamps_are_reported() {
    let odd = |i: i64| {
        let stamp = match i % 500 {
            100 => at(i - 300),         // three seconds late
            200 => at(i - 1),           // again
            300 => i32::MAX as i64 * S, // impossible
            _ => at(i),
        };
        sound(at(i), i).stamped(stamp)
    };
    let often_twice = |i: i64| sound(at(i), i).stamped(at(i / 4 * 4));
    let topics = [
        ("/arm", all(|i| sound(at(i), i))),
        ("/imu", all(odd)),
        ("/odom", all(often_twice)),
    ];
    let recordings = recorded(&log_of(&topics, false));
    let imu = &recordings["/imu"];
    let late = found(imu, Kind::DisorderedStamps);
    assert!(late.seen.starts_with("8 stamps"), "{late}");
    let timing = imu.reading.statistics.timing();
    assert_eq!(timing.stamps_not_dates, 0);
    assert_eq!(timing.largest_backward.unwrap().to_ns, at(301));
    let impossible = found(imu, Kind::ImpossibleStamps);
    assert!(impossible.seen.starts_with("4 stamps"), "{impossible}");
    assert_eq!(imu.stamps_ns.len(), 1996);
    assert!(!kinds(imu).contains(&Kind::ClockRestart));
    found(&recordings["/odom"], Kind::RepeatedStamps);
}

#[test]
fn clock_drift_is_removed() {
    let fast = |i: i64| sound(at(i), i).stamped(at(i) + i * PERIOD / 200);
    let topics = [
        ("/arm", all(fast)),
        ("/boom", all(|i| sound(at(i), i))),
        ("/imu", all(|i| sound(at(i), i))),
    ];
    let arm = &recorded(&log_of(&topics, false))["/arm"];
    let finding = found(arm, Kind::ClockDrift);
    assert_eq!(finding.treatment, Treatment::Handled);
    assert!((arm.reading.correction.drift_removed_ppm - 5000.0).abs() < 5.0);
    let error = largest_error_ms(arm, at);
    assert!(error < 0.2, "{error} ms");
}

/// As a busy computer writes a replay that runs as fast as it can: the log times are those of late reads.
#[test]
fn stamps_that_begin_and_end_together_are_of_one_clock_where_log_times_scatter() {
    let late = |i: i64| {
        let log = at(0) + i * PERIOD * 5 / 4 + ((i * 0x9E37_79B9) >> 7) % S;
        StampedMessage {
            log,
            ..sound(at(i), i)
        }
    };
    let of_arm = |message: &dyn Fn(i64) -> StampedMessage| {
        let topics = [
            ("/arm", (0..MESSAGES).map(message).collect()),
            ("/boom", all(|i| sound(at(i), i))),
            ("/imu", all(|i| sound(at(i), i))),
        ];
        recorded(&log_of(&topics, false)).remove("/arm").unwrap()
    };
    let arm = of_arm(&late);
    assert_eq!(largest_error_ms(&arm, at), 0.0);
    assert_eq!(arm.stamps_ns.len(), MESSAGES as usize);
    let clock = (arm.reading.findings.iter())
        .find(|f| matches!(f.kind, Kind::ClockDrift | Kind::ClockApart))
        .unwrap();
    assert_eq!(clock.treatment, Treatment::Reported, "{clock}");

    // a clock that is 2 s ahead does not show itself as the same
    let ahead = |i: i64| late(i).stamped(at(i) + 2 * S);
    let arm = of_arm(&ahead);
    let is_refusal = |f: &ClockFinding| f.treatment == Treatment::Refused;
    assert!(
        arm.reading.findings.iter().any(is_refusal),
        "{:?}",
        arm.reading.findings
    );
}

#[test]
fn single_numbers_are_put_on_the_clock_of_the_sensors() {
    let simulated = |i: i64| sound(at(i), i).stamped(7 * S + i * PERIOD);
    let never = |i| sound(at(i), i).stamped(0);
    let file = log_of(&[("/arm", all(simulated)), ("/force", all(never))], false);
    let log = Log::open(&file.path).unwrap();
    let request = SensorRequest::typed(
        log.topics()[0].id,
        SensorKind::JointStates,
        vec!["a".into()],
    );
    let (arm, _) = record_sensors(&log, &[request], &mut |_| {}).unwrap();
    let field = FieldRequest {
        topic: "/force".into(),
        number: NumberField {
            field: "position".into(),
            joint: Some("a".into()),
            scale: 1.0,
            offset: 0.0,
        },
    };
    let (force, _) = record_fields(&log, &[field], Some(&arm[0].reading.time_base)).unwrap();
    assert_eq!(force[0].values[1000], 1000.0);
    let error = force[0].stamps_ns[1000] - (7 * S + 1000 * PERIOD);
    assert!(error.abs() < MS, "{error} ns");
}

/// The errors of the stamps about their median (ms): what is left of a common offset does not count.
fn largest_scatter_ms(recording: &SensorRecording, truth: impl Fn(i64) -> i64) -> f64 {
    let error = |(place, &stamp): (usize, &i64)| {
        let i = recording.values[place * recording.width] as i64;
        stamp - truth(i)
    };
    let errors: Vec<i64> = recording.stamps_ns.iter().enumerate().map(error).collect();
    let mut sorted = errors.clone();
    sorted.sort_unstable();
    let middle = sorted[sorted.len() / 2];
    let far = errors.iter().map(|error| (error - middle).abs()).max();
    far.unwrap_or(0) as f64 / MS as f64
}

/// Topics without stamps of 10 and 50 ms, in the order in which they were received, with this log time.
fn without_stamps(log: impl Fn(i64) -> i64) -> BTreeMap<String, SensorRecording> {
    let message = |time: i64| {
        let log = log(time);
        sent(0, log)
    };
    let fast = all(|i| message(i * PERIOD));
    let slow = (0..MESSAGES / 5)
        .map(|i| message(5 * i * PERIOD + 3 * MS))
        .collect();
    let topics = [("/fast", fast), ("/slow", slow)];
    // the true times order the file
    let file = log_ordered(&topics, false, |topic, i, _| match topic {
        0 => i * PERIOD,
        _ => 5 * i * PERIOD + 3 * MS,
    });
    recorded(&file)
}

#[test]
fn a_stepped_restarted_or_set_log_time_gives_stretches_one_after_the_other() {
    // soon after the start, in the middle, shortly before the end
    for messages in [20, 1000, 1960] {
        let middle = messages * PERIOD + 7 * MS;
        let jumps: [(&str, i64); 5] = [
            ("step", -100 * MS),
            ("step", -1500 * MS),
            ("step", -10 * S),
            ("restart", -middle),
            ("set", 8 * 365 * 86_400 * S),
        ];
        for (name, by) in jumps {
            let start = 1000 * S;
            let log = |time: i64| start + time + if time < middle { 0 } else { by };
            let recordings = without_stamps(log);
            for (topic, period) in [("/fast", PERIOD), ("/slow", 5 * PERIOD)] {
                let recording = &recordings[topic];
                let finding = found(recording, Kind::LogTimeJump);
                assert_eq!(finding.treatment, Treatment::Handled, "{finding}");
                let before = format!("from {}.", (start + middle) / S);
                assert!(finding.seen.contains(&before), "{name} by {by}: {finding}");
                // as recorded, and the time between is a second longer
                let phase = if topic == "/fast" { 0 } else { 3 * MS };
                let truth = |i: i64| {
                    let time = i * period + phase;
                    start + time + if time < middle { 0 } else { S }
                };
                let error = largest_error_ms(recording, truth);
                assert!(error < 1e-3, "{name} by {by} ns, {topic}: {error} ms");
                let in_order = recording.log_times_ns.is_sorted();
                assert!(in_order, "log times are in the order of the file");
            }
        }
    }
}

#[test]
fn stamps_that_step_back_with_the_log_time_keep_the_order_of_the_file() {
    // all on one computer, whose clock is set back
    for by in [80 * MS, 300 * MS, 990 * MS, 5 * S] {
        for middle in [20, 1000, 1960] {
            let stamped = |i: i64| sound(at(i) - if i < middle { 0 } else { by }, i);
            let topics = [("/arm", all(stamped)), ("/leg", all(stamped))];
            let file = log_ordered(&topics, false, |topic, i, _| 2 * i + topic as i64);
            for (topic, recording) in recorded(&file) {
                let of_stamps = found(&recording, Kind::ClockRestart);
                assert_eq!(of_stamps.treatment, Treatment::Handled);
                assert!(
                    !kinds(&recording).contains(&Kind::DisorderedStamps),
                    "{topic}"
                );
                let truth = |i: i64| at(i) + if i < middle { 0 } else { S };
                // the length of the step is known by the delays of the transport
                let error = largest_error_ms(&recording, truth);
                assert!(error < 1.0, "{by} ns at {middle}, {topic}: {error} ms");
            }
        }
    }
}

#[test]
fn a_log_time_that_is_set_forward_is_told_by_stamps_that_go_on() {
    for by in [200 * MS, 5 * S, 7 * 86_400 * S] {
        let log = |i: i64| at(i) + delay(i) + if i < 900 { 0 } else { by };
        let message = |stamp: i64, i: i64| sent(stamp, log(i));
        let stamped = || all(|i| message(at(i), i));
        let unstamped = all(|i| message(0, i));
        let topics = [
            ("/arm", stamped()),
            ("/leg", stamped()),
            ("/bare", unstamped),
        ];
        let recordings = recorded(&log_of(&topics, false));
        let finding = found(&recordings["/arm"], Kind::LogTimeJump);
        assert!(finding.seen.contains("forward by"), "{finding}");
        let others = kinds(&recordings["/arm"]);
        assert!(!others.contains(&Kind::ReplayedLog), "{others:?}");
        assert_eq!(largest_error_ms(&recordings["/arm"], at), 0.0);
        let error = largest_scatter_ms(&recordings["/bare"], at);
        assert!(error < 1.5, "{by} ns: {error} ms");
    }
    // one topic whose messages take longer from then on is no jump
    let late = |i: i64| at(i) + delay(i) + if i < 900 { 0 } else { 200 * MS };
    let queued = all(|i| sent(at(i), late(i)));
    let topics = [("/arm", queued), ("/leg", all(|i| sound(at(i), i)))];
    let recordings = recorded(&log_of(&topics, false));
    assert!(!kinds(&recordings["/arm"]).contains(&Kind::LogTimeJump));
}

#[test]
fn a_slow_topic_follows_the_jump_that_a_fast_one_shows() {
    // the step is shorter than the period of the slow topic
    let middle = 1000 * PERIOD + 7 * MS;
    let log = |time: i64| 50 * S + time - if time < middle { 0 } else { 30 * MS + 30 * MS };
    let recordings = without_stamps(log);
    let truth = |i: i64| {
        let time = 5 * i * PERIOD + 3 * MS;
        50 * S + time + if time < middle { 0 } else { S }
    };
    let error = largest_error_ms(&recordings["/slow"], truth);
    assert!(error < 1e-3, "{error} ms");
}

#[test]
fn a_counter_that_wraps_around_is_continued() {
    for wrap in [(1_i64 << 32) * MS, (1 << 32) * 1000, (1 << 16) * MS] {
        let start = wrap - 7 * S - 3 * MS;
        let recordings = without_stamps(|time| (start + time) % wrap);
        for (topic, period, phase) in [("/fast", PERIOD, 0), ("/slow", 5 * PERIOD, 3 * MS)] {
            let recording = &recordings[topic];
            let finding = found(recording, Kind::LogTimeJump);
            assert!(finding.seen.contains("wraps around 1 time(s)"), "{finding}");
            let error = largest_error_ms(recording, |i| start + i * period + phase);
            assert_eq!(error, 0.0, "{wrap}: {topic}");
        }
    }
}

#[test]
fn disordered_log_times_are_no_jump() {
    // blocks of 20 messages change places
    let log = |i: i64| match i % 100 {
        40..60 => i + 20,
        60..80 => i - 20,
        _ => i,
    };
    let message = |i: i64| sent(0, at(log(i)));
    let file = log_ordered(&[("/arm", all(message))], false, |_, i, _| i);
    let recording = &recorded(&file)["/arm"];
    assert_eq!(kinds(recording), [Kind::NoHeaderStamp]);
    assert_eq!(largest_error_ms(recording, |i| at(log(i))), 0.0);
}

#[test]
fn rows_in_no_order_of_time_are_no_jump() {
    let message = |i: i64| sent(0, at(i));
    // the later half first, the quarters in no order, and no order at all
    let quarter = MESSAGES / 4;
    let orders: [&dyn Fn(i64) -> i64; 3] = [
        &|i| (i + MESSAGES / 2) % MESSAGES,
        &|i| [2, 0, 3, 1][(i / quarter) as usize] * quarter + i % quarter,
        &|i| i * 7919 % MESSAGES,
    ];
    for log in orders {
        let shown = all(|i| message(log(i)));
        let file = log_ordered(&[("/arm", shown)], false, |_, i, _| i);
        let recording = &recorded(&file)["/arm"];
        assert_eq!(kinds(recording), [Kind::NoHeaderStamp]);
        assert_eq!(largest_error_ms(recording, |i| at(log(i))), 0.0);
    }
}

#[test]
fn a_log_time_that_steps_back_does_not_move_stamps() {
    let log = |i: i64| at(i) + delay(i) - if i < 900 { 0 } else { 5 * S };
    let stamped = |i: i64| sent(at(i), log(i));
    let unstamped = |i: i64| stamped(i).stamped(0);
    let topics = [("/arm", all(stamped)), ("/force", all(unstamped))];
    let recordings = recorded(&log_ordered(&topics, false, |_, i, _| i));
    assert_eq!(largest_error_ms(&recordings["/arm"], at), 0.0);
    found(&recordings["/arm"], Kind::LogTimeJump);
    let error = largest_error_ms(&recordings["/force"], at);
    assert!(error < 2.0, "{error} ms");
}

#[test]
fn clocks_that_are_all_set_by_years_keep_one_time_axis() {
    // stamps and log times, with the first position of the satellites
    let set = |i: i64| if i < 700 { 0 } else { 8 * 365 * 86_400 * S };
    let message = |i: i64| sent(at(i) + set(i), at(i) + set(i) + delay(i));
    let topics = [("/arm", all(message)), ("/imu", all(message))];
    let recordings = recorded(&log_of(&topics, false));
    for recording in recordings.values() {
        found(recording, Kind::LogTimeJump);
        found(recording, Kind::ClockRestart);
        let truth = |i: i64| at(i) + if i < 700 { 0 } else { S };
        let error = largest_error_ms(recording, truth);
        assert!(error < 2.0, "{error} ms");
    }
    let (arm, imu) = (&recordings["/arm"], &recordings["/imu"]);
    assert_eq!(arm.stamps_ns, imu.stamps_ns);
}

#[test]
fn a_corrected_sensor_clock_is_put_back() {
    for (name, step) in [
        ("ahead", 100 * MS),
        ("ahead", 600 * MS),
        ("behind", -400 * MS),
    ] {
        // wrong before the correction
        let corrected = |i: i64| sound(at(i), i).stamped(at(i) + if i < 1200 { step } else { 0 });
        let topics = [
            ("/arm", all(corrected)),
            ("/imu", all(|i| sound(at(i), i))),
            ("/odom", all(|i| sound(at(i), i))),
        ];
        let recordings = recorded(&log_of(&topics, false));
        let arm = &recordings["/arm"];
        let finding = found(arm, Kind::StampStep);
        assert_eq!(finding.treatment, Treatment::Handled);
        let error = largest_error_ms(arm, at);
        assert!(error < 0.5, "{name} by {step} ns: {error} ms");
        assert_eq!(kinds(&recordings["/imu"]), []);
        assert_eq!(arm.reading.time_base.anchor(), Some("/imu"));
        // of a single topic the longer course is taken as right
        let alone = &recorded(&log_of(&[("/arm", all(corrected))], false))["/arm"];
        found(alone, Kind::StampStep);
        let error = largest_scatter_ms(alone, at);
        assert!(error < 0.5, "{name} by {step} ns: {error} ms");
    }
}

#[test]
fn delays_of_the_transport_are_no_steps_of_the_stamps() {
    let delayed = |i: i64| {
        // the connection stalls; then it is slower
        let log = match i {
            500..600 => at(600),
            1200.. => at(i) + 200 * MS,
            _ => at(i),
        };
        sent(at(i), log + delay(i))
    };
    let topics = [("/arm", all(|i| sound(at(i), i))), ("/imu", all(delayed))];
    let recordings = recorded(&log_ordered(&topics, false, |_, i, _| i));
    let imu = &recordings["/imu"];
    assert!(
        !kinds(imu).contains(&Kind::StampStep),
        "{:?}",
        imu.reading.findings
    );
    assert_eq!(largest_error_ms(imu, at), 0.0);
}

#[test]
fn single_stamps_ahead_are_omitted_and_no_restarts() {
    let is_odd = |i: i64| (i * 7919) % 200 == 3;
    let odd = |i: i64| sound(at(i), i).stamped(at(i) + if is_odd(i) { (2 + i % 5) * S } else { 0 });
    let topics = [("/arm", all(|i| sound(at(i), i))), ("/imu", all(odd))];
    let imu = &recorded(&log_of(&topics, false))["/imu"];
    let strays = (0..MESSAGES).filter(|&i| is_odd(i)).count();
    assert_eq!(kinds(imu), [Kind::StrayStamps]);
    assert_eq!(imu.stamps_ns.len(), MESSAGES as usize - strays);
    assert_eq!(imu.reading.correction.restarts, 0);
    assert_eq!(largest_error_ms(imu, at), 0.0);
    // the same where the log time is all there is
    let file = log_ordered(
        &[("/table", all(|i| sent(0, odd(i).stamp)))],
        false,
        |_, i, _| i,
    );
    let table = &recorded(&file)["/table"];
    found(table, Kind::StrayStamps);
    assert_eq!(table.stamps_ns.len(), MESSAGES as usize - strays);
    assert_eq!(largest_error_ms(table, at), 0.0);
}

#[test]
fn stamps_of_whole_seconds_give_way_to_the_log_time() {
    let coarse = |i: i64| sound(at(i), i).stamped(at(i) / S * S);
    let topics = [("/arm", all(|i| sound(at(i), i))), ("/odom", all(coarse))];
    let odom = &recorded(&log_of(&topics, false))["/odom"];
    assert_eq!(odom.reading.clock.source, StampSource::Log);
    assert!(
        odom.reading.clock.reason.contains("resolution of 1 s"),
        "{:?}",
        odom.reading.clock
    );
    found(odom, Kind::NoHeaderStamp);
    let error = largest_error_ms(odom, at);
    assert!(error < 0.7, "{error} ms");
    assert_eq!(odom.stamps_ns.len(), MESSAGES as usize);
}

/// Two publishers by turns, of which one counts from the start of its computer: a clock that was corrected once would leave half of
/// the messages where they were.
#[test]
fn publishers_with_clocks_of_their_own_are_put_by_log_time() {
    for behind in [1000 * S, 3 * S] {
        let message = |i: i64| sound(at(i), i).stamped(at(i) - i % 2 * behind);
        let recordings = recorded(&log_of(&[("/a", all(message))], false));
        let recording = &recordings["/a"];
        assert!(largest_error_ms(recording, at) < 4.0);
        assert_eq!(recording.reading.clock.source, StampSource::Log);
        assert!(recording.reading.clock.reason.contains("share the topic"));
    }
    // one clock, and a transport that delays every other message
    let late = |i: i64| {
        let time = at(i - i % 2 * 30);
        sent(time, at(i) + delay(i))
    };
    let recordings = recorded(&log_of(&[("/a", all(late))], false));
    assert_eq!(recordings["/a"].reading.clock.source, StampSource::Header);
}
