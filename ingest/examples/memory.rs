//! Reads a large log and prints the memory used.
//!
//! `cargo run --release -p tipwatch-ingest --example memory -- LOG make [GIGABYTES]` generates a
//! log of images (nine tenths) and joint states; `... -- LOG` reads every message, then the columns
//! of the joint states, and prints the peak anonymous memory (`RssAnon` of Linux).

// What it prints is its result.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../benches/figures/cdr.rs"]
mod cdr;

use std::{
    collections::BTreeMap, fs::File, io::BufWriter, ops::ControlFlow, path::Path, time::Instant,
};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use tipwatch_ingest::{Log, SensorKind, SensorRequest, joint_names_in, record_sensors};

use crate::cdr::{put, put_text};

const JOINTS: usize = 6;
const IMAGE_BYTES: usize = 250_000;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("the path of a log");
    let path = Path::new(&path);
    if arguments.next().is_some() {
        let gigabytes = arguments.next().map_or(4.0, |text| text.parse().unwrap());
        make(path, (gigabytes * 1e9) as u64);
    } else {
        read(path);
    }
}

fn anonymous_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("RssAnon:"));
    let kilobytes: f64 = line
        .unwrap()
        .trim()
        .trim_end_matches(" kB")
        .parse()
        .unwrap();
    kilobytes * 1024e-6
}

fn read(path: &Path) {
    let start = Instant::now();
    let log = Log::open(path).unwrap();
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let (mut most, mut bytes) = (0.0_f64, 0);
    log.read_with_progress(
        &ids,
        &mut |message| {
            bytes += message.data.len();
            ControlFlow::Continue(())
        },
        &mut |_| most = most.max(anonymous_megabytes()),
    )
    .unwrap();
    let took = start.elapsed().as_secs_f64();
    println!("every message: {bytes} bytes in {took:.2} s, at most {most:.0} MB");
    let joints = log.topics().iter();
    let joints = joints.filter(|topic| SensorKind::JointStates.is_type(&topic.type_name));
    let requests: Vec<SensorRequest> = joints
        .map(|topic| {
            SensorRequest::typed(
                topic.id,
                SensorKind::JointStates,
                joint_names_in(&log, topic.id).unwrap(),
            )
        })
        .collect();
    let (start, mut most) = (Instant::now(), 0.0_f64);
    let mut progress = |_| most = most.max(anonymous_megabytes());
    let (recordings, _) = record_sensors(&log, &requests, &mut progress).unwrap();
    let samples: usize = recordings.iter().map(|one| one.stamps_ns.len()).sum();
    let (took, after) = (start.elapsed().as_secs_f64(), anonymous_megabytes());
    println!(
        "{samples} samples in {took:.2} s, at most {:.0} MB",
        most.max(after)
    );
}

fn make(path: &Path, bytes: u64) {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .compression_threads(0)
        .create(BufWriter::new(File::create_new(path).unwrap()))
        .unwrap();
    let definition = "std_msgs/Header header\nstring[] name\nfloat64[] position\n\
        float64[] velocity\nfloat64[] effort\n";
    let channel = |writer: &mut mcap::Writer<_>, topic: &str, name: &str, text: &str| {
        let schema = writer.add_schema(name, "ros2msg", text.as_bytes()).unwrap();
        writer
            .add_channel(schema, topic, "cdr", &BTreeMap::new())
            .unwrap()
    };
    let joints = channel(
        &mut writer,
        "/joint_states",
        "sensor_msgs/msg/JointState",
        definition,
    );
    let images = channel(
        &mut writer,
        "/camera",
        "own_msgs/msg/Image",
        "uint8[] data\n",
    );
    let (mut written, mut index, mut state) = (0, 0_u64, 1_u64);
    let mut image = vec![0_u8; IMAGE_BYTES];
    while written < bytes {
        let header = |channel_id| MessageHeader {
            channel_id,
            sequence: index as u32,
            log_time: 1_700_000_000_000_000_000 + index * 1_000_000,
            publish_time: 1_700_000_000_000_000_000 + index * 1_000_000,
        };
        let message = joint_state(index);
        writer
            .write_to_known_channel(&header(joints), &message)
            .unwrap();
        written += message.len() as u64;
        if index % (IMAGE_BYTES as u64 / 9 / message.len() as u64) == 0 {
            image.fill_with(|| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 56) as u8
            });
            writer
                .write_to_known_channel(&header(images), &image)
                .unwrap();
            written += image.len() as u64;
        }
        index += 1;
    }
    writer.finish().unwrap();
}

fn joint_state(index: u64) -> Vec<u8> {
    let mut cdr = vec![0, 1, 0, 0];
    put(
        &mut cdr,
        (1_700_000_000 + (index / 1000) as i32).to_le_bytes(),
    );
    put(&mut cdr, ((index % 1000) as u32 * 1_000_000).to_le_bytes());
    put_text(&mut cdr, "base_link");
    put(&mut cdr, (JOINTS as u32).to_le_bytes());
    for joint in 0..JOINTS {
        put_text(&mut cdr, &format!("arm_joint_{joint}"));
    }
    for rate in [0.3, 0.7, 1.1] {
        put(&mut cdr, (JOINTS as u32).to_le_bytes());
        for joint in 0..JOINTS {
            let value = (index as f64 * 0.001 * rate + joint as f64).sin();
            put(&mut cdr, value.to_le_bytes());
        }
    }
    cdr
}
