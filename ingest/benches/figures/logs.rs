//! The logs that are read: generated once, always the same bytes.

use std::{collections::BTreeMap, fs::File, io::BufWriter, path::Path};

use mcap::{Compression, WriteOptions, records::MessageHeader};

use crate::cdr::{put, put_text};

pub(crate) const JOINTS: usize = 6;
const IMAGE_BYTES: usize = 900_000;
const DEFINITION: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\n\
    float64[] velocity\nfloat64[] effort\n====\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n====\nMSG: builtin_interfaces/Time\n\
    int32 sec\nuint32 nanosec\n";

/// The content of a log.
#[derive(Clone, Copy)]
pub(crate) enum Content {
    /// Joint states of three topics.
    Joints,
    /// Nine bytes of images per byte of joint states, in separate chunks or not.
    Images { are_apart: bool },
}

pub(crate) fn compression(name: &str) -> Option<Compression> {
    match name {
        "lz4" => Some(Compression::Lz4),
        "zstd" => Some(Compression::Zstd),
        _ => None,
    }
}

/// Generates a log unless it exists.
pub(crate) fn make(path: &Path, content: Content, packing: &str, joint_states: u64) {
    if path.exists() {
        return;
    }
    let part = path.with_extension("part");
    match content {
        Content::Joints => write_joints(&part, compression(packing), joint_states),
        Content::Images { are_apart } => {
            write_images(&part, compression(packing), are_apart, joint_states);
        }
    }
    std::fs::rename(&part, path).expect("a file of this name");
}

pub(crate) fn joint_names() -> Vec<String> {
    (0..JOINTS)
        .map(|joint| format!("arm_joint_{joint}"))
        .collect()
}

/// Positions of a 16-bit encoder; velocities and efforts as their differences.
fn joint_state(index: u64, names: &[String]) -> Vec<u8> {
    let mut cdr = vec![0, 1, 0, 0];
    put(
        &mut cdr,
        (1_700_000_000 + (index / 1000) as i32).to_le_bytes(),
    );
    put(&mut cdr, ((index % 1000) as u32 * 1_000_000).to_le_bytes());
    put_text(&mut cdr, "base_link");
    put(&mut cdr, (names.len() as u32).to_le_bytes());
    for name in names {
        put_text(&mut cdr, name);
    }
    for (rate, step) in [(0.3, 1e-4), (0.7, 1e-3), (1.1, 0.5)] {
        put(&mut cdr, (names.len() as u32).to_le_bytes());
        for joint in 0..names.len() {
            let value = (index as f64 * 0.001 * rate + joint as f64).sin() * 3.0;
            put(&mut cdr, ((value / step).round() * step).to_le_bytes());
        }
    }
    cdr
}

type LogWriter = mcap::Writer<BufWriter<File>>;

fn create(path: &Path, compression: Option<Compression>, chunk_bytes: u64) -> LogWriter {
    WriteOptions::new()
        .profile("ros2")
        .compression(compression)
        .compression_threads(0)
        .chunk_size(Some(chunk_bytes))
        .create(BufWriter::new(File::create(path).expect("a file")))
        .expect("a writer")
}

fn channel(writer: &mut LogWriter, topic: &str, type_name: &str, definition: &str) -> u16 {
    let schema = writer
        .add_schema(type_name, "ros2msg", definition.as_bytes())
        .expect("schema");
    writer
        .add_channel(schema, topic, "cdr", &BTreeMap::new())
        .expect("channel")
}

fn header(channel_id: u16, index: u64) -> MessageHeader {
    let time_ns = 1_700_000_000_000_000_000 + index * 1_000_000;
    MessageHeader {
        channel_id,
        sequence: index as u32,
        log_time: time_ns,
        publish_time: time_ns,
    }
}

fn joint_channel(writer: &mut LogWriter, topic: &str) -> u16 {
    channel(writer, topic, "sensor_msgs/msg/JointState", DEFINITION)
}

fn write_joints(path: &Path, compression: Option<Compression>, messages: u64) {
    let mut writer = create(path, compression, 4 << 20);
    let topics = [
        "/arm/joint_states",
        "/wheels/joint_states",
        "/crane/joint_states",
    ];
    let channels = topics.map(|topic| joint_channel(&mut writer, topic));
    let names = joint_names();
    for index in 0..messages {
        let channel = channels[(index % 3) as usize];
        writer
            .write_to_known_channel(&header(channel, index), &joint_state(index, &names))
            .expect("message");
    }
    writer.finish().expect("end of log");
}

/// Nine bytes of images per byte of joint states. Camera images are compressed already, so they are
/// noise.
fn write_images(path: &Path, compression: Option<Compression>, are_apart: bool, joints: u64) {
    let mut writer = create(path, compression, 1 << 20);
    let joint = joint_channel(&mut writer, "/joint_states");
    let definition = "std_msgs/Header header\nstring format\nuint8[] data\n====\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n====\n\
        MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let image = channel(
        &mut writer,
        "/camera",
        "sensor_msgs/msg/CompressedImage",
        definition,
    );
    let names = joint_names();
    let mut noise = vec![0_u8; IMAGE_BYTES];
    let mut state = 1_u64;
    noise.fill_with(|| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 56) as u8
    });
    let message_bytes = joint_state(0, &names).len() as u64;
    let joints_for_an_image = IMAGE_BYTES as u64 / 9 / message_bytes;
    for index in 0..joints {
        writer
            .write_to_known_channel(&header(joint, index), &joint_state(index, &names))
            .expect("message");
        if index % joints_for_an_image == joints_for_an_image - 1 {
            // Like a recorder that ends the chunk before and after a large message.
            if are_apart {
                writer.flush().expect("end of chunk");
            }
            writer
                .write_to_known_channel(&header(image, index), &noise)
                .expect("message");
            if are_apart {
                writer.flush().expect("end of chunk");
            }
        }
    }
    writer.finish().expect("end of log");
}
