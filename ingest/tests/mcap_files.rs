use std::ops::ControlFlow;

use tipwatch_ingest::{Error, Format, Log, joint_names_in};

use crate::support::{
    COMPRESSIONS, FIRST_NS, PERIOD_NS, Style, TempLog, joint_log, joint_samples, topic_named,
};

const COUNT: usize = 500;

#[test]
fn every_writer_option_gives_the_same_samples() {
    for compression in COMPRESSIONS {
        for (chunked, summary) in [(true, true), (true, false), (false, true), (false, false)] {
            let style = Style {
                compression,
                chunked,
                summary,
                crc: true,
            };
            let file = TempLog::new("log.anything", &joint_log(&style, COUNT));
            let (samples, losses) = joint_samples(&file.path);
            assert_eq!(samples.len(), COUNT);
            assert!(losses.is_empty(), "{losses:?}");
            assert_eq!(losses.integrity.note().is_some(), !chunked);
            for (index, sample) in samples.iter().enumerate() {
                let value = index as f64;
                let stamp_ns = FIRST_NS + index as i64 * PERIOD_NS;
                assert_eq!(sample.header_stamp_ns, Some(stamp_ns));
                assert_eq!(
                    (sample.log_time_ns, sample.publish_time_ns),
                    (stamp_ns + 5, stamp_ns + 3)
                );
                assert_eq!(sample.values, [-value, value, value * 0.25, 0.5]);
            }
        }
    }
}

#[test]
fn topics_are_known_after_opening() {
    for summary in [true, false] {
        let style = Style {
            summary,
            ..Style::chunked(None)
        };
        let file = TempLog::new("log.mcap", &joint_log(&style, COUNT));
        let log = Log::open(&file.path).unwrap();
        assert_eq!(log.format(), Format::Mcap);
        assert_eq!(log.format().to_string(), "MCAP");
        assert_eq!(log.topics().len(), 2);
        for topic in log.topics() {
            assert_eq!(topic.message_count, Some(COUNT as u64));
        }
        assert_eq!(
            joint_names_in(&log, topic_named(&log, "/joint_states")).unwrap(),
            ["a", "bb"]
        );
        let chatter = topic_named(&log, "/chatter");
        assert!(
            joint_names_in(&log, chatter)
                .unwrap_err()
                .to_string()
                .contains("expected")
        );
    }
}

#[test]
fn visit_can_break_and_progress_reaches_the_size() {
    let file = TempLog::new("log.mcap", &joint_log(&Style::chunked(None), COUNT));
    let log = Log::open(&file.path).unwrap();
    let wanted = [topic_named(&log, "/chatter")];
    let mut seen = 0;
    let mut stop_at_ten = |_: &tipwatch_ingest::RawMessage<'_>| {
        seen += 1;
        if seen < 10 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    log.read(&wanted, &mut stop_at_ten).unwrap();
    assert_eq!(seen, 10);

    let mut reports = Vec::new();
    let mut pass = |_: &tipwatch_ingest::RawMessage<'_>| ControlFlow::Continue(());
    log.read_with_progress(&wanted, &mut pass, &mut |bytes| reports.push(bytes))
        .unwrap();
    assert!(reports.is_sorted() && reports.len() > 10);
    assert_eq!(reports.last(), Some(&log.bytes()));
}

#[test]
fn other_files_are_refused_with_a_reason() {
    let refused = |bytes: &[u8]| {
        let file = TempLog::new("log.mcap", bytes);
        Log::open(&file.path).unwrap_err().to_string()
    };
    assert!(refused(b"").contains("not a log") && refused(b"").contains("an empty file"));
    let text = refused(b"hello\x01");
    assert!(
        text.contains("not a log") && text.contains("first bytes \"hello\\x01\""),
        "{text}"
    );
    assert!(
        refused(b"#ROSBAG V1.2\n")
            .contains("unsupported format: ROS bag of a version other than 2.0")
    );
    let missing = Log::open(std::path::Path::new("/nowhere/x.mcap")).unwrap_err();
    assert!(matches!(missing, Error::Io { .. }));
}
