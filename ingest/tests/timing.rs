use tipwatch_ingest::{Log, StampSource, TopicStatistics};

use crate::{
    bags::bag,
    rosbag2::{JOINTS, database, joint_messages, rows},
    support::{FIRST_NS, PERIOD_NS, Style, TempLog, joint_log},
};

const MS: i64 = 1_000_000;
const DAY_NS: i64 = 1_700_000_000_000_000_000;

fn statistics(messages: impl Iterator<Item = (Option<i64>, i64, i64)>) -> TopicStatistics {
    let mut statistics = TopicStatistics::default();
    for (header, publish, log) in messages {
        statistics.push(header, publish, log);
    }
    statistics
}

#[test]
fn periods_gaps_and_disorder_are_counted() {
    let stamps_ms = [0, 10, 20, 20, 30, 25, 40, 190, 200, 210, 220];
    let messages = stamps_ms.iter().map(|&ms| {
        let stamp = DAY_NS + ms * MS;
        (Some(stamp), stamp, stamp + 2 * MS)
    });
    let timing = statistics(messages).timing();
    assert_eq!(timing.clock.source, StampSource::Header);
    assert_eq!(
        (
            timing.duplicate_stamps,
            timing.backward_stamps,
            timing.zero_stamps
        ),
        (1, 1, 0)
    );
    assert_eq!(timing.median_period_s, Some(0.01));
    assert_eq!(timing.max_period_s, Some(0.15));
    let [gap] = timing.gaps.as_slice() else {
        panic!("{:?}", timing.gaps)
    };
    assert_eq!((gap.start_ns, gap.duration_s), (DAY_NS + 40 * MS, 0.15));
    let offset = timing.header_minus_log.unwrap();
    assert_eq!(
        (offset.min_s, offset.median_s, offset.max_s),
        (-0.002, -0.002, -0.002)
    );
    let step = timing.largest_backward.unwrap();
    assert_eq!((step.from_ns, step.size_s()), (DAY_NS + 30 * MS, 0.005));
    let json = serde_json::to_string(&timing).unwrap();
    assert!(
        json.contains("\"median_period_s\":0.01") && json.contains("drift_ppm"),
        "{json}"
    );
}

#[test]
fn drift_of_stamps_at_half_speed_is_found() {
    let messages = (0..100).map(|i| (Some((i + 1) * 5 * MS), 0, DAY_NS + i * 10 * MS));
    let timing = statistics(messages).timing();
    assert_eq!(timing.clock.source, StampSource::Header);
    assert_eq!(timing.stamps_not_dates, 100);
    let drift = timing.header_minus_log.unwrap().drift_ppm;
    assert!((drift + 500_000.0).abs() < 1.0, "{drift}");
}

#[test]
fn memory_does_not_grow_with_the_number_of_messages() {
    // a gap every hundred messages, and a clock that runs 30 ppm fast
    let messages = (0..1_000_000_i64).map(|i| {
        let log = DAY_NS + i * 10 * MS + i / 100 * 500 * MS;
        (Some(log + i * 300), log, log)
    });
    let timing = statistics(messages).timing();
    assert_eq!(timing.message_count, 1_000_000);
    assert!(timing.has_more_gaps);
    assert_eq!(timing.gaps.len(), 1000);
    assert!((timing.median_period_s.unwrap() - 0.01).abs() < 1e-6);
    let offset = timing.header_minus_log.unwrap();
    assert!((offset.drift_ppm - 20.0).abs() < 0.1, "{offset:?}");
    assert!((offset.max_s - 0.2999997).abs() < 1e-9, "{offset:?}");
}

#[test]
fn next_clock_is_used_without_usable_header_stamps() {
    let absent = statistics((0..9).map(|i| (None, DAY_NS + i, DAY_NS + i)));
    assert_eq!(absent.decide().source, StampSource::Log);
    let constant = statistics((0..9).map(|i| (Some(7), DAY_NS + i, DAY_NS + 2 * i)));
    let decision = constant.decide();
    assert_eq!(decision.source, StampSource::Publish);
    assert!(decision.reason.contains("header.stamp is constant"));
    let never_sent = statistics((0..9).map(|i| (None, 0, DAY_NS + i)));
    assert_eq!(never_sent.decide().source, StampSource::Log);
    assert_eq!(never_sent.timing().zero_stamps, 9);
    assert_eq!(TopicStatistics::default().timing().rate_hz, None);
}

/// With an index and without, and of messages that no reader asks for.
#[test]
fn a_log_spans_the_messages_of_all_topics() {
    let last_ns = FIRST_NS + 89 * PERIOD_NS;
    let messages = joint_messages(0, 90);
    let whole = joint_log(&Style::chunked(None), 90);
    let logs = [
        (TempLog::new("log.mcap", &whole), 5),
        (TempLog::new("log.bag", &bag("none", true, 90)), 5),
        (TempLog::new("log.bag", &bag("none", false, 90)), 5),
        (database(&[JOINTS], &rows(&messages), true), 0),
    ];
    for (file, offset_ns) in logs {
        let span_ns = Log::open(&file.path).unwrap().span_ns();
        let expected = (FIRST_NS + offset_ns, last_ns + offset_ns);
        assert_eq!(span_ns, Some(expected), "{}", file.path.display());
    }
    let cut = TempLog::new("cut.mcap", &whole[..whole.len() / 2]);
    let (first, last) = Log::open(&cut.path).unwrap().span_ns().unwrap();
    assert_eq!(first, FIRST_NS + 5);
    assert!((first + 10 * PERIOD_NS..last_ns).contains(&last));
}
