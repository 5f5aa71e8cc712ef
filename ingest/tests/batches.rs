use std::ops::ControlFlow;

use mcap::{Compression, WriteOptions};
use tipwatch_ingest::{
    FieldRequest, Log, Losses, NumberField, SensorDecoder, SensorKind, SensorRequest, SensorSample,
    arrival_order, record_fields, record_sensors,
};

use crate::sensor_blocks::blocks_and_columns;
use crate::support::{COMPRESSIONS, FIRST_NS, Mcap, PERIOD_NS, TempLog, joint_state};

const TOPICS: [&str; 2] = ["/arm", "/wheels"];
/// Smaller files are read by one thread.
const READ_BY_SEVERAL_BYTES: usize = 4 << 20;

/// Two alternating topics with joints in changing order and some truncated messages. The publish
/// time differs from the log time from the middle on, and some headers have no stamp.
fn log_of_two_topics(compression: Option<Compression>) -> Vec<u8> {
    let options = WriteOptions::new().compression(compression);
    let options = options.compression_threads(0).chunk_size(Some(100_000));
    let mut writer = Mcap::new(options);
    let channels = TOPICS.map(|topic| writer.joints(topic));
    let mut noise = 1_u64;
    let mut value = || {
        noise = noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (noise >> 11) as f64 * 1e-12
    };
    for index in 0..70_000_u32 {
        let time_ns = FIRST_NS + i64::from(index) * PERIOD_NS;
        let names = if index % 5000 < 4000 {
            ["a", "bb"]
        } else {
            ["bb", "a"]
        };
        let stamp_ns = if index % 777 == 0 { 0 } else { time_ns - 7 };
        let (positions, rates) = ([value(), value()], [value(), value()]);
        let mut message = joint_state(stamp_ns, &names, &positions, &rates);
        if index % 1009 == 0 {
            message.truncate(30);
        }
        let sooner_ns = u64::from(index > 25_000);
        let times = [time_ns as u64, time_ns as u64 - sooner_ns];
        writer.message(channels[(index % 2) as usize], index, times, &message);
    }
    writer.finish()
}

fn joint_names() -> Vec<String> {
    ["bb", "a"].map(str::to_owned).to_vec()
}

/// The samples decoded one by one, by topic and log time, and the number of undecodable ones.
fn one_by_one(log: &Log) -> (Vec<(usize, SensorSample)>, u64, Losses) {
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let decoder =
        |topic| SensorDecoder::new(topic, SensorKind::JointStates, &joint_names()).unwrap();
    let mut decoders: Vec<_> = log.topics().iter().map(decoder).collect();
    let (mut found, mut undecodable) = (Vec::new(), 0);
    let mut sample = SensorSample::default();
    let losses = log.read(&ids, &mut |message| {
        let topic = message.topic.index();
        match decoders[topic].decode(message, &mut sample) {
            Ok(()) => found.push((topic, sample.clone())),
            Err(_) => undecodable += 1,
        }
        ControlFlow::Continue(())
    });
    (found, undecodable, losses.unwrap())
}

fn check(bytes: &[u8]) -> usize {
    let file = TempLog::new("log.mcap", bytes);
    let log = Log::open(&file.path).unwrap();
    let (mut expected, undecodable, expected_losses) = one_by_one(&log);
    let requests: Vec<SensorRequest> = log
        .topics()
        .iter()
        .map(|topic| SensorRequest::typed(topic.id, SensorKind::JointStates, joint_names()))
        .collect();
    let (recordings, mut losses) = record_sensors(&log, &requests, &mut |_| {}).unwrap();
    blocks_and_columns(&log, &requests);
    // Recordings omit messages without a stamp.
    let unstamped = expected.len();
    expected.retain(|(_, sample)| sample.header_stamp_ns.is_some());
    let unstamped = unstamped - expected.len();
    expected.sort_by_key(|(_, sample)| sample.log_time_ns);
    let recordings: Vec<_> = recordings.iter().collect();
    let sum = |count: fn(&tipwatch_ingest::SensorRecording) -> u64| -> u64 {
        recordings.iter().map(|recording| count(recording)).sum()
    };
    assert_eq!(sum(|of| of.reading.undecodable), undecodable);
    assert_eq!(sum(|of| of.reading.unstamped), unstamped as u64);
    let found = arrival_order(&recordings);
    assert_eq!(found.len(), expected.len());
    for ((topic, index), (expected_topic, expected)) in found.into_iter().zip(&expected) {
        let recording = recordings[topic];
        assert_eq!(topic, *expected_topic);
        assert_eq!(recording.log_times_ns[index], expected.log_time_ns);
        assert_eq!(Some(recording.stamps_ns[index]), expected.header_stamp_ns);
        assert_eq!(recording.sample(index), expected.values);
    }
    assert_eq!(
        losses.undecodable_messages.values().sum::<u64>(),
        undecodable
    );
    losses.undecodable_messages.clear();
    assert_eq!(losses, expected_losses);
    expected.len()
}

#[test]
fn several_threads_decode_the_same_samples_as_one() {
    for compression in COMPRESSIONS {
        let intact = log_of_two_topics(compression);
        assert!(intact.len() > READ_BY_SEVERAL_BYTES, "{}", intact.len());
        let all = check(&intact);
        assert!(all > 69_000, "{all}");
        let mut lost_something = 0;
        for variant in 1..=8 {
            let mut damaged = intact.clone();
            for place in 0..variant {
                let at = (damaged.len() / 9) * (place + 1) + 1000 * variant;
                damaged[at] ^= 1 << (variant % 8);
            }
            lost_something += usize::from(check(&damaged) < all);
        }
        assert!(lost_something >= 6, "{lost_something} of 8 lost a chunk");
        let cut = check(&intact[..intact.len() * 3 / 4]);
        assert!(cut > all / 2 && cut < all, "{cut}");
    }
}

#[test]
fn several_threads_find_the_same_numbers_as_one() {
    let bytes = log_of_two_topics(None);
    let file = TempLog::new("log.mcap", &bytes);
    let log = Log::open(&file.path).unwrap();
    let request = |joint: &str| FieldRequest {
        topic: TOPICS[0].to_owned(),
        number: NumberField {
            field: "position".to_owned(),
            joint: Some(joint.to_owned()),
            scale: 1.0,
            offset: 0.0,
        },
    };
    let (recordings, _) = record_fields(&log, &[request("a")], None).unwrap();
    let (samples, ..) = one_by_one(&log);
    let of_topic = samples.iter().filter(|(topic, _)| *topic == 0);
    let expected: Vec<f64> = of_topic
        .filter(|(_, sample)| sample.header_stamp_ns.is_some())
        .map(|(_, sample)| sample.values[1])
        .collect();
    assert_eq!(recordings[0].values, expected);

    let error = record_fields(&log, &[request("c")], None)
        .unwrap_err()
        .to_string();
    let decodable = samples.iter().filter(|(topic, _)| *topic == 0).count();
    assert!(error.contains(&decodable.to_string()), "{error}");
    assert!(error.contains("bb"), "{error}");
}
