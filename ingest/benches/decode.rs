//! Speed of walking and decoding a log of joint states.
//!
//! `walk` visits every message, `decode` turns each into a sample, both for 200 000 messages of ten
//! joints. `layout` decodes one message repeatedly.

#[path = "figures/cdr.rs"]
mod cdr;

use std::{collections::BTreeMap, hint::black_box, io::Cursor, ops::ControlFlow, path::Path};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mcap::{Compression, WriteOptions, records::MessageHeader};
use tipwatch_ingest::{Log, RawMessage, SensorDecoder, SensorKind, SensorSample, TopicId};

use crate::cdr::{put, put_text};

const MESSAGES: u64 = 200_000;
const JOINTS: usize = 10;
const DEFINITION: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\n\
    float64[] velocity\nfloat64[] effort\n";
const IMU_DEFINITION: &str = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n\
    float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n\
    float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n\
    float64[9] linear_acceleration_covariance\n";

fn header(index: u64) -> Vec<u8> {
    let mut cdr = vec![0, 1, 0, 0];
    put(
        &mut cdr,
        (1_700_000_000 + (index / 100) as i32).to_le_bytes(),
    );
    put(&mut cdr, ((index % 100) as u32 * 10_000_000).to_le_bytes());
    put_text(&mut cdr, "base_link");
    cdr
}

fn joint_state(index: u64) -> Vec<u8> {
    let mut cdr = header(index);
    put(&mut cdr, (JOINTS as u32).to_le_bytes());
    for name in joint_names() {
        put_text(&mut cdr, &name);
    }
    for rate in [0.3, 0.7, 1.1] {
        put(&mut cdr, (JOINTS as u32).to_le_bytes());
        for joint in 0..JOINTS {
            let value = (index as f64 * 0.01 * rate + joint as f64).sin();
            put(&mut cdr, value.to_le_bytes());
        }
    }
    cdr
}

fn imu(index: u64) -> Vec<u8> {
    let mut cdr = header(index);
    let values = (0..37).map(|place| if place == 3 { 1.0 } else { 0.0_f64 });
    for value in values {
        put(&mut cdr, value.to_le_bytes());
    }
    cdr
}

fn joint_names() -> Vec<String> {
    (0..JOINTS)
        .map(|joint| format!("arm_joint_{joint}"))
        .collect()
}

fn write_log(path: &Path, compression: Option<Compression>) {
    let options = WriteOptions::new()
        .compression(compression)
        .chunk_size(Some(4 << 20));
    let mut writer = options.create(Cursor::new(Vec::new())).expect("writer");
    let add = |writer: &mut mcap::Writer<_>, name: &str, definition: &str, topic: &str| {
        let schema = writer
            .add_schema(name, "ros2msg", definition.as_bytes())
            .expect("schema");
        writer
            .add_channel(schema, topic, "cdr", &BTreeMap::new())
            .expect("channel")
    };
    let joints = add(
        &mut writer,
        "sensor_msgs/msg/JointState",
        DEFINITION,
        "/joint_states",
    );
    // One message, so that the layout of an IMU can be measured too.
    let imus = add(&mut writer, "sensor_msgs/msg/Imu", IMU_DEFINITION, "/imu");
    let header = |channel_id, index: u64| {
        let time_ns = index * 10_000_000;
        MessageHeader {
            channel_id,
            sequence: index as u32,
            log_time: time_ns,
            publish_time: time_ns,
        }
    };
    for index in 0..MESSAGES {
        let message = joint_state(index);
        writer
            .write_to_known_channel(&header(joints, index), &message)
            .expect("message");
    }
    writer
        .write_to_known_channel(&header(imus, 0), &imu(0))
        .expect("message");
    writer.finish().expect("end of log");
    std::fs::write(path, writer.into_inner().into_inner()).expect("a temporary file");
}

fn topic_of(log: &Log, kind: SensorKind) -> TopicId {
    let topic = log
        .topics()
        .iter()
        .find(|topic| kind.is_type(&topic.type_name));
    topic.expect("the topic was written").id
}

fn decoder(log: &Log, kind: SensorKind) -> SensorDecoder {
    let topic = log.topic(topic_of(log, kind)).expect("known topic");
    SensorDecoder::new(topic, kind, &joint_names()).expect("decodable topic")
}

fn logs(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut group = criterion.benchmark_group("log");
    group
        .throughput(Throughput::Elements(MESSAGES))
        .sample_size(10);
    let kinds = [
        ("none", None),
        ("lz4", Some(Compression::Lz4)),
        ("zstd", Some(Compression::Zstd)),
    ];
    for (name, compression) in kinds {
        let path = folder.path().join(name);
        write_log(&path, compression);
        let log = Log::open(&path).expect("a log");
        let wanted = [topic_of(&log, SensorKind::JointStates)];
        group.bench_function(format!("walk/{name}"), |bencher| {
            bencher.iter(|| {
                let mut bytes = 0;
                let mut visit = |message: &RawMessage<'_>| {
                    bytes += message.data.len();
                    ControlFlow::Continue(())
                };
                log.read(&wanted, &mut visit).expect("readable");
                bytes
            });
        });
        group.bench_function(format!("decode/{name}"), |bencher| {
            let mut decoder = decoder(&log, SensorKind::JointStates);
            let mut sample = SensorSample::default();
            bencher.iter(|| {
                let mut sum = 0.0;
                let mut visit = |message: &RawMessage<'_>| {
                    decoder.decode(message, &mut sample).expect("decodable");
                    sum += sample.values[0];
                    ControlFlow::Continue(())
                };
                log.read(&wanted, &mut visit).expect("readable");
                sum
            });
        });
    }
    group.finish();
    layouts(criterion, &folder.path().join("none"));
}

fn layouts(criterion: &mut Criterion, path: &Path) {
    let log = Log::open(path).expect("a log");
    let mut group = criterion.benchmark_group("layout");
    group.throughput(Throughput::Elements(1));
    for (kind, data) in [
        (SensorKind::JointStates, joint_state(7)),
        (SensorKind::Imu, imu(7)),
    ] {
        let mut decoder = decoder(&log, kind);
        let mut sample = SensorSample::default();
        let topic = topic_of(&log, kind);
        group.bench_function(kind.signal_key(), |bencher| {
            bencher.iter(|| {
                let data = black_box(data.as_slice());
                let message = RawMessage {
                    topic,
                    log_time_ns: 0,
                    publish_time_ns: 0,
                    sequence: 0,
                    writer: 0,
                    data,
                };
                decoder.decode(&message, &mut sample).expect("decodable");
                sample.values[0]
            });
        });
    }
    group.finish();
}

criterion_group!(benches, logs);
criterion_main!(benches);
