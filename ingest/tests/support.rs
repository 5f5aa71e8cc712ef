//! CDR messages and logs made in memory.

use std::{
    collections::BTreeMap,
    io::Cursor,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use mcap::{Compression, WriteOptions, Writer, records::MessageHeader};
use proptest::test_runner::{Config as ProptestConfig, FileFailurePersistence};
use tempfile::TempDir;
use tipwatch_ingest::{
    Log, Losses, NumberField, SampleSpec, SensorDecoder, SensorKind, SensorRequest, SensorSample,
    TopicId, ValueSource,
};

pub(crate) const JOINT_STATE: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\n\
    float64[] velocity\nfloat64[] effort\n====\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n====\nMSG: builtin_interfaces/Time\n\
    int32 sec\nuint32 nanosec\n";
pub(crate) const FIRST_NS: i64 = 1_700_000_000_000_000_000;
pub(crate) const PERIOD_NS: i64 = 10_000_000;

/// Writes CDR values with the required padding.
pub(crate) struct Cdr {
    pub(crate) bytes: Vec<u8>,
    big_endian: bool,
}

macro_rules! writers {
    ($($name:ident: $kind:ty),*) => {
        $(pub(crate) fn $name(&mut self, value: $kind) -> &mut Self {
            let bytes = if self.big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
            self.align(bytes.len());
            self.bytes.extend(bytes);
            self
        })*
    };
}

impl Cdr {
    pub(crate) fn new(big_endian: bool) -> Self {
        Self {
            bytes: vec![0, u8::from(!big_endian), 0, 0],
            big_endian,
        }
    }

    fn align(&mut self, size: usize) {
        while !(self.bytes.len() - 4).is_multiple_of(size) {
            self.bytes.push(0xEE);
        }
    }

    writers!(u8: u8, i16: i16, u32: u32, i32: i32, f32: f32, u64: u64, f64: f64);

    pub(crate) fn text(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
        self
    }

    pub(crate) fn texts(&mut self, texts: &[&str]) -> &mut Self {
        self.u32(texts.len() as u32);
        for text in texts {
            self.text(text);
        }
        self
    }

    pub(crate) fn numbers(&mut self, numbers: &[f64]) -> &mut Self {
        self.u32(numbers.len() as u32);
        self.all(numbers)
    }

    pub(crate) fn all(&mut self, numbers: &[f64]) -> &mut Self {
        for &number in numbers {
            self.f64(number);
        }
        self
    }

    pub(crate) fn header(&mut self, stamp_ns: i64, frame_id: &str) -> &mut Self {
        self.i32((stamp_ns / 1_000_000_000) as i32)
            .u32((stamp_ns % 1_000_000_000) as u32);
        self.text(frame_id)
    }
}

pub(crate) fn joint_state(
    stamp_ns: i64,
    names: &[&str],
    positions: &[f64],
    rates: &[f64],
) -> Vec<u8> {
    let mut cdr = Cdr::new(false);
    cdr.header(stamp_ns, "/base")
        .texts(names)
        .numbers(positions)
        .numbers(rates)
        .numbers(&[]);
    cdr.bytes
}

/// An MCAP file that is written in memory.
pub(crate) struct Mcap(pub(crate) Writer<Cursor<Vec<u8>>>);

impl Mcap {
    pub(crate) fn new(options: WriteOptions) -> Self {
        Self(options.create(Cursor::new(Vec::new())).unwrap())
    }

    /// A topic of CDR messages, whose type is defined by this text.
    pub(crate) fn topic(&mut self, name: &str, type_name: &str, text: &str) -> u16 {
        self.topic_of(name, "cdr", (type_name, "ros2msg", text.as_bytes()))
    }

    /// A topic of joint states.
    pub(crate) fn joints(&mut self, name: &str) -> u16 {
        self.topic(name, "sensor_msgs/msg/JointState", JOINT_STATE)
    }

    /// A topic of messages in this encoding; a schema is its name, its language and its text.
    pub(crate) fn topic_of(
        &mut self,
        name: &str,
        encoding: &str,
        (type_name, language, text): (&str, &str, &[u8]),
    ) -> u16 {
        let schema = self.0.add_schema(type_name, language, text).unwrap();
        let channel = (self.0).add_channel(schema, name, encoding, &BTreeMap::new());
        channel.unwrap()
    }

    /// A message: its topic, its number, its log time and its publish time (ns).
    pub(crate) fn message(&mut self, topic: u16, number: u32, times: [u64; 2], data: &[u8]) {
        let header = MessageHeader {
            channel_id: topic,
            sequence: number,
            log_time: times[0],
            publish_time: times[1],
        };
        self.0.write_to_known_channel(&header, data).unwrap();
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.0.finish().unwrap();
        self.0.into_inner().into_inner()
    }
}

/// Options of an MCAP file.
#[derive(Clone)]
pub(crate) struct Style {
    pub(crate) compression: Option<Compression>,
    pub(crate) chunked: bool,
    pub(crate) summary: bool,
    pub(crate) crc: bool,
}

impl Style {
    pub(crate) fn chunked(compression: Option<Compression>) -> Self {
        Self {
            compression,
            chunked: true,
            summary: true,
            crc: true,
        }
    }

    pub(crate) fn options(&self) -> WriteOptions {
        WriteOptions::new()
            .compression(self.compression)
            .compression_threads(0)
            .use_chunks(self.chunked)
            .chunk_size(Some(4096))
            .emit_summary_records(self.summary)
            .emit_summary_offsets(self.summary)
            .calculate_chunk_crcs(self.crc)
    }
}

pub(crate) const COMPRESSIONS: [Option<Compression>; 3] =
    [None, Some(Compression::Lz4), Some(Compression::Zstd)];

/// Joint states on `/joint_states`, alternating with strings on `/chatter`.
pub(crate) fn joint_log(style: &Style, message_count: usize) -> Vec<u8> {
    let mut writer = Mcap::new(style.options());
    let joints = writer.joints("/joint_states");
    let chatter = writer.topic("/chatter", "std_msgs/msg/String", "string data\n");
    for index in 0..message_count {
        let value = index as f64;
        let stamp_ns = FIRST_NS + index as i64 * PERIOD_NS;
        let times = [5, 3].map(|later_ns| stamp_ns as u64 + later_ns);
        let joint = joint_state(
            stamp_ns,
            &["a", "bb"],
            &[value, -value],
            &[0.5, value * 0.25],
        );
        writer.message(joints, index as u32, times, &joint);
        let mut text = Cdr::new(false);
        text.text(&format!("message {index}"));
        writer.message(chatter, index as u32, times, &text.bytes);
    }
    writer.finish()
}

/// A file that is deleted with the value.
pub(crate) struct TempLog {
    folder: TempDir,
    pub(crate) path: PathBuf,
}

impl TempLog {
    pub(crate) fn new(name: &str, bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Self { folder, path }
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }
}

pub(crate) fn topic_named(log: &Log, name: &str) -> TopicId {
    log.topics()
        .iter()
        .find(|topic| topic.name == name)
        .unwrap()
        .id
}

/// Failing cases are kept, and tried first in later runs.
pub(crate) fn proptest_config(cases: u32) -> ProptestConfig {
    let kept = FileFailurePersistence::Direct("tests/proptest-regressions.txt");
    ProptestConfig {
        cases,
        failure_persistence: Some(Box::new(kept)),
        ..ProptestConfig::default()
    }
}

/// All samples of a topic, and the losses.
pub(crate) fn samples(
    log: &Log,
    topic: TopicId,
    kind: SensorKind,
    joints: &[&str],
) -> (Vec<SensorSample>, Losses) {
    let joints: Vec<String> = joints.iter().map(|&joint| joint.to_owned()).collect();
    let mut decoder = SensorDecoder::new(log.topic(topic).unwrap(), kind, &joints).unwrap();
    let mut found = Vec::new();
    let mut sample = SensorSample::default();
    let losses = log
        .read(&[topic], &mut |message| {
            if decoder.decode(message, &mut sample).is_ok() {
                found.push(sample.clone());
            }
            ControlFlow::Continue(())
        })
        .unwrap();
    (found, losses)
}

pub(crate) fn joint_samples(path: &Path) -> (Vec<SensorSample>, Losses) {
    let log = Log::open(path).unwrap();
    samples(
        &log,
        topic_named(&log, "/joint_states"),
        SensorKind::JointStates,
        &["bb", "a"],
    )
}

/// An IMU whose accelerations and rates are the fields x, y, z of two topics.
pub(crate) fn imu_of_two_parts(log: &Log) -> SensorRequest {
    let topic = |name: &str| topic_named(log, name);
    let part = |first: usize| {
        let mut values = vec![ValueSource::Absent; 10];
        for (place, field) in (first..).zip(["x", "y", "z"]) {
            values[place] = ValueSource::Field(NumberField {
                field: field.into(),
                joint: None,
                scale: 1.0,
                offset: 0.0,
            });
        }
        SampleSpec {
            values,
            has_roll_pitch_yaw: false,
        }
    };
    SensorRequest {
        topic: topic("/acceleration"),
        kind: SensorKind::Imu,
        joint_names: Vec::new(),
        numbers: Some(part(0)),
        other_parts: vec![(topic("/rates"), part(3))],
        frame_id: None,
    }
}

/// Topic, log time (ns), publish time (ns), sequence number and payload of a message.
pub(crate) type RecordedMessage = (String, i64, i64, u32, Vec<u8>);

/// All messages of a log, in order.
pub(crate) fn messages(path: &Path) -> Vec<RecordedMessage> {
    let log = Log::open(path).unwrap();
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let mut found = Vec::new();
    log.read(&ids, &mut |message| {
        found.push((
            log.topic(message.topic).unwrap().name.clone(),
            message.log_time_ns,
            message.publish_time_ns,
            message.sequence,
            message.data.to_vec(),
        ));
        ControlFlow::Continue(())
    })
    .unwrap();
    found
}
