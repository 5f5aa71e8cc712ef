//! Sensors in blocks: concatenated and placed, they are the whole columns, to the bit.

use std::cmp::Reverse;

use mcap::{Compression, WriteOptions};
use tipwatch_ingest::{
    Log, MessageTimes, SensorKind, SensorReading, SensorRecording, SensorRequest, arrival_order,
    read_sensor_blocks, record_sensors,
};

use crate::{
    bags::{PACKINGS, bag},
    rosbag2::{JOINTS, database, joint_messages, rows},
    support::{
        COMPRESSIONS, FIRST_NS, Mcap, PERIOD_NS, Style, TempLog, imu_of_two_parts, joint_log,
        joint_state,
    },
};

/// More samples would not be a block.
const MOST_SAMPLES: usize = 4096;

/// The samples of one sensor, collected from blocks.
#[derive(Default)]
struct Collected {
    times: Vec<MessageTimes>,
    order: Vec<u32>,
    values: Vec<f64>,
    blocks: usize,
}

/// Reads the sensors both ways, compares every bit, and returns the number of blocks and the whole
/// columns.
pub(crate) fn blocks_and_columns(
    log: &Log,
    requests: &[SensorRequest],
) -> (usize, Vec<SensorRecording>) {
    let mut collected: Vec<Collected> = Vec::new();
    collected.resize_with(requests.len(), Collected::default);
    let (mut last_of_blocks, mut last_of_columns) = (0, 0);
    let from_blocks = read_sensor_blocks(
        log,
        requests,
        &mut |block| {
            let to = &mut collected[block.sensor];
            assert_eq!(block.first, to.times.len());
            assert!((1..=MOST_SAMPLES).contains(&block.len()) && !block.is_empty());
            assert_eq!(block.values().len(), block.len() * block.width());
            to.times.extend(block.times());
            to.order.extend(block.order());
            to.values.extend(block.values());
            to.blocks += 1;
        },
        &mut |bytes| last_of_blocks = bytes,
    );
    let from_columns = record_sensors(log, requests, &mut |bytes| last_of_columns = bytes);
    let ((readings, block_losses), (recordings, losses)) = match (from_blocks, from_columns) {
        (Ok(blocks), Ok(columns)) => (blocks, columns),
        (Err(blocks), Err(columns)) => {
            assert_eq!(blocks.to_string(), columns.to_string());
            return (0, Vec::new());
        }
        (blocks, columns) => panic!("{:?} {:?}", blocks.err(), columns.err()),
    };
    assert_eq!((block_losses, last_of_blocks), (losses, last_of_columns));
    assert_eq!(
        (readings.len(), recordings.len()),
        (requests.len(), requests.len())
    );
    let mut arrivals = Vec::new();
    for (place, (reading, recording)) in readings.iter().zip(&recordings).enumerate() {
        let found = &collected[place];
        assert_eq!(reading.samples, found.times.len());
        let (mut stamps, mut log_times, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for (index, times) in found.times.iter().enumerate() {
            let Some(stamp) = reading.placement.stamp_ns(index, times) else {
                continue;
            };
            let log_time_ns = reading.placement.log_ns(index, times.log_time_ns);
            let order = (log_time_ns, found.order[index], Reverse(place));
            arrivals.push((order, stamps.len()));
            stamps.push(stamp);
            log_times.push(log_time_ns);
            let width = recording.width;
            values.extend(&found.values[index * width..(index + 1) * width]);
        }
        assert_eq!(stamps, recording.stamps_ns);
        assert_eq!(log_times, recording.log_times_ns);
        assert_eq!(bits(&values), bits(&recording.values));
        let told = |of: &SensorReading| {
            let text = (
                &of.clock,
                &of.correction,
                &of.findings,
                of.time_base.anchor(),
            );
            let counts = (of.topic, of.unstamped, of.undecodable, of.without_value);
            format!("{text:?} {counts:?} {:?}", of.statistics.timing())
        };
        assert_eq!(told(reading), told(&recording.reading));
    }
    arrivals.sort_unstable();
    let arrivals: Vec<_> = (arrivals.into_iter())
        .map(|((.., Reverse(place)), index)| (place, index))
        .collect();
    let all: Vec<&SensorRecording> = recordings.iter().collect();
    assert_eq!(arrivals, arrival_order(&all));
    (collected.iter().map(|one| one.blocks).sum(), recordings)
}

/// Requests for the joint states of every topic that has them.
pub(crate) fn joint_requests(log: &Log, joints: &[&str]) -> Vec<SensorRequest> {
    let topics = log.topics().iter();
    let topics = topics.filter(|topic| SensorKind::JointStates.is_type(&topic.type_name));
    topics
        .map(|topic| {
            SensorRequest::typed(
                topic.id,
                SensorKind::JointStates,
                joints.iter().map(|&joint| joint.to_owned()).collect(),
            )
        })
        .collect()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn small_logs_of_every_format_give_one_block_per_sensor() {
    let mut logs = Vec::new();
    for compression in COMPRESSIONS {
        logs.push(joint_log(&Style::chunked(compression), 300));
    }
    for packing in PACKINGS {
        logs.push(bag(packing, true, 300));
    }
    let messages = joint_messages(0, 300);
    let database = database(&[JOINTS], &rows(&messages), true);
    logs.push(std::fs::read(&database.path).unwrap());
    for bytes in logs {
        let file = TempLog::new("log", &bytes);
        let log = Log::open(&file.path).unwrap();
        let (blocks, columns) = blocks_and_columns(&log, &joint_requests(&log, &["bb", "a"]));
        assert_eq!((blocks, columns[0].stamps_ns.len()), (1, 300));
    }
}

/// Joint states at 1000 Hz, an IMU of two parts at 100 Hz and a slow topic, in chunks of this size.
fn long_log(chunk_bytes: u64, messages: u32) -> Vec<u8> {
    let options = WriteOptions::new().compression(Some(Compression::Lz4));
    let options = options.compression_threads(0).chunk_size(Some(chunk_bytes));
    let mut writer = Mcap::new(options);
    let part = "float64 x\nfloat64 y\nfloat64 z\n";
    let channels = [
        writer.joints("/arm"),
        writer.joints("/slow"),
        writer.topic("/acceleration", "pkg/msg/Part", part),
        writer.topic("/rates", "pkg/msg/Part", part),
    ];
    let mut noise = 1_u64;
    for index in 0..messages {
        let time_ns = FIRST_NS + i64::from(index) * PERIOD_NS / 10;
        let mut write = |channel: usize, message: &[u8]| {
            writer.message(channels[channel], index, [time_ns as u64; 2], message);
        };
        noise = noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let value = (noise >> 11) as f64 * 1e-12;
        // the header has no stamp now and then
        let stamp_ns = if index % 777 == 5 { 0 } else { time_ns - 7 };
        let joints = joint_state(stamp_ns, &["a", "bb"], &[value, -value], &[0.5, value]);
        write(0, &joints);
        if index % 900 == 0 {
            write(1, &joints);
        }
        if index % 10 == 0 {
            let mut vector = vec![0, 1, 0, 0];
            vector.extend(
                [value, 2.0, 3.0]
                    .iter()
                    .flat_map(|number| number.to_le_bytes()),
            );
            write(2 + (index as usize / 10) % 2, &vector);
        }
    }
    writer.finish()
}

#[test]
fn long_logs_give_blocks_of_a_useful_size() {
    const MESSAGES: u32 = 75_000;
    // smaller and larger than a block
    for chunk_bytes in [30_000, 300_000, 3_000_000] {
        let intact = long_log(chunk_bytes, MESSAGES);
        assert!(
            intact.len() > 4 << 20,
            "several threads read it: {}",
            intact.len()
        );
        for damage in 0..5 {
            let mut bytes = intact.clone();
            for place in 0..damage {
                let at = intact.len() / 6 * (place + 1) + 1000 * damage;
                bytes[at] ^= 1 << damage;
            }
            let file = TempLog::new("log.mcap", &bytes);
            let log = Log::open(&file.path).unwrap();
            let mut requests = joint_requests(&log, &["bb", "a"]);
            requests.insert(1, imu_of_two_parts(&log));
            let (blocks, columns) = blocks_and_columns(&log, &requests);
            let samples: usize = columns.iter().map(|of| of.stamps_ns.len()).sum();
            assert!(samples > MESSAGES as usize / 20, "{samples}");
            let most = MESSAGES as usize / 1024 + requests.len();
            assert!(blocks <= most, "{blocks} blocks of {samples} samples");
            assert!(damage > 0 || columns[0].reading.unstamped == 97);
        }
    }
}
