//! Sensors in blocks take memory for their times and for some blocks, however long the log is. A
//! program of its own, because it counts every allocation.

// The exception in clippy.toml covers test functions, not the helpers they share.
#![allow(clippy::unwrap_used)]

#[path = "../benches/figures/cdr.rs"]
mod cdr;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    collections::BTreeMap,
    fs::File,
    io::BufWriter,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use tipwatch_ingest::{
    Log, SensorKind, SensorRequest, joint_names_in, read_sensor_blocks, record_sensors,
};

use crate::cdr::{put, put_text};

const JOINTS: usize = 12;
/// Stamps and log times.
const BYTES_OF_TIMES: usize = 2 * size_of::<i64>();
/// Chunks and samples in flight, and what is collected for statistics.
const BOUND_BYTES: usize = 24 << 20;

/// Counts the bytes in use, and the most since the last [`Counting::forget`].
struct Counting;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

impl Counting {
    fn add(bytes: usize) {
        let now = IN_USE.fetch_add(bytes, Relaxed) + bytes;
        MOST.fetch_max(now, Relaxed);
    }

    /// Runs something and returns the most bytes that it had in use.
    fn most_bytes(run: impl FnOnce()) -> usize {
        let before = IN_USE.load(Relaxed);
        MOST.store(before, Relaxed);
        run();
        MOST.load(Relaxed) - before
    }
}

// SAFETY: every call is passed on to the allocator of the system.
#[allow(unsafe_code, reason = "an allocator that counts")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: the caller keeps the contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn blocks_take_no_memory_for_the_values_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    for messages in [100_000, 300_000] {
        let path = folder.path().join(format!("{messages}.mcap"));
        write_log(&path, messages);
        let log = Log::open(&path).unwrap();
        let topic = log.topics()[0].id;
        let request = SensorRequest::typed(
            topic,
            SensorKind::JointStates,
            joint_names_in(&log, topic).unwrap(),
        );
        let requests = [request];
        let mut samples = 0;
        let in_blocks = Counting::most_bytes(|| {
            let mut take = |block: &tipwatch_ingest::SensorBlock<'_>| samples += block.len();
            read_sensor_blocks(&log, &requests, &mut take, &mut |_| {}).unwrap();
        });
        assert_eq!(samples, messages);
        let whole = Counting::most_bytes(|| {
            record_sensors(&log, &requests, &mut |_| {}).unwrap();
        });
        let values = messages * 2 * JOINTS * size_of::<f64>();
        assert!(whole > values, "the columns are held whole: {whole} bytes");
        let bound = messages * BYTES_OF_TIMES + BOUND_BYTES;
        assert!(in_blocks < bound, "{in_blocks} bytes, {values} of values");
    }
}

fn write_log(path: &Path, messages: usize) {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .compression_threads(0)
        .chunk_size(Some(1 << 20))
        .create(BufWriter::new(File::create_new(path).unwrap()))
        .unwrap();
    let definition = b"std_msgs/Header header\nstring[] name\nfloat64[] position\n\
        float64[] velocity\nfloat64[] effort\n";
    let schema = writer
        .add_schema("sensor_msgs/msg/JointState", "ros2msg", definition)
        .unwrap();
    let channel_id = writer
        .add_channel(schema, "/joint_states", "cdr", &BTreeMap::new())
        .unwrap();
    for index in 0..messages {
        let time = 1_700_000_000_000_000_000 + index as u64 * 1_000_000;
        let header = MessageHeader {
            channel_id,
            sequence: index as u32,
            log_time: time,
            publish_time: time,
        };
        let message = joint_state(time, index);
        writer.write_to_known_channel(&header, &message).unwrap();
    }
    writer.finish().unwrap();
}

fn joint_state(time: u64, index: usize) -> Vec<u8> {
    let mut cdr = vec![0, 1, 0, 0];
    put(&mut cdr, ((time / 1_000_000_000) as i32).to_le_bytes());
    put(&mut cdr, ((time % 1_000_000_000) as u32).to_le_bytes());
    put_text(&mut cdr, "base_link");
    put(&mut cdr, (JOINTS as u32).to_le_bytes());
    for joint in 0..JOINTS {
        put_text(&mut cdr, &format!("arm_joint_{joint}"));
    }
    for scale in [1.0, 0.5, 0.0] {
        put(&mut cdr, (JOINTS as u32).to_le_bytes());
        for joint in 0..JOINTS {
            put(
                &mut cdr,
                (scale * (index * JOINTS + joint) as f64).to_le_bytes(),
            );
        }
    }
    cdr
}
