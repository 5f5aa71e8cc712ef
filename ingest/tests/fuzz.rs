//! Fuzz targets: every parser reads damaged copies of valid inputs.
//!
//! `cargo test` runs each target for a second, with new inputs every time; `BOLERO_RANDOM_TEST_TIME_MS`
//! sets another duration, `BOLERO_RANDOM_SEED` repeats a failure. `cargo bolero test` runs the same targets
//! guided by coverage. A panic and an allocation far beyond the size of the input are failures.

use std::{
    alloc::{GlobalAlloc, Layout as Block, System},
    cell::Cell,
    io::Write as _,
    ops::ControlFlow,
    path::Path,
};

use bolero::TypeGenerator;
use tipwatch_ingest::{
    FieldPath, Fields, Layout, Log, SensorDecoder, SensorKind, SensorSample, Topic, recover,
};

use crate::{
    bags,
    rosbag2::{JOINTS, database, joint_messages, rows},
    support::{self, JOINT_STATE, Style},
};

const LARGEST_ALLOCATION_BYTES: usize = 64 << 20;

/// Records the largest allocation of each thread.
struct Watching;

thread_local! {
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

#[global_allocator]
static ALLOCATOR: Watching = Watching;

impl Watching {
    fn note(bytes: usize) {
        // A thread that is ending has no thread-local storage left.
        let _ = LARGEST.try_with(|largest| largest.set(largest.get().max(bytes)));
    }
}

// SAFETY: every call is passed on unchanged to the system's allocator.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, block: Block) -> *mut u8 {
        Self::note(block.size());
        unsafe { System.alloc(block) }
    }

    unsafe fn alloc_zeroed(&self, block: Block) -> *mut u8 {
        Self::note(block.size());
        unsafe { System.alloc_zeroed(block) }
    }

    unsafe fn dealloc(&self, place: *mut u8, block: Block) {
        unsafe { System.dealloc(place, block) }
    }

    unsafe fn realloc(&self, place: *mut u8, block: Block, size: usize) -> *mut u8 {
        Self::note(size);
        unsafe { System.realloc(place, block, size) }
    }
}

/// Integers at the limits of their types, where length checks fail first.
const LIMITS: [u64; 8] = [
    0,
    0x7f,
    0xff,
    0x7fff_ffff,
    0xffff_fff0,
    1 << 40,
    i64::MAX as u64,
    u64::MAX,
];

/// One change of an input. Positions and lengths are taken modulo the size of the input.
#[derive(Debug, Clone, TypeGenerator)]
enum Damage {
    Flip { at: u32, bit: u8 },
    Set { at: u32, byte: u8 },
    Zero { at: u32, length: u8 },
    Remove { at: u32, length: u8 },
    Copy { from: u32, length: u8, to: u32 },
    Cut { at: u32 },
    Limit { at: u32, number: u8, width: u8 },
    LimitBigEndian { at: u32, number: u8, width: u8 },
}

impl Damage {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        let size = bytes.len();
        let place = |at: u32| at as usize % size;
        let range = |at: u32, length: u8| place(at)..(place(at) + length as usize).min(size);
        let width = |width: u8| [1, 2, 4, 8][width as usize % 4];
        let limit = |number: u8| LIMITS[number as usize % LIMITS.len()];
        let planted = match *self {
            Self::Flip { at, bit } => return bytes[place(at)] ^= 1 << (bit % 8),
            Self::Set { at, byte } => return bytes[place(at)] = byte,
            Self::Zero { at, length } => return bytes[range(at, length)].fill(0),
            Self::Remove { at, length } => return drop(bytes.drain(range(at, length))),
            Self::Copy { from, length, to } => {
                let part = bytes[range(from, length)].to_vec();
                return drop(bytes.splice(place(to)..place(to), part));
            }
            Self::Cut { at } => return bytes.truncate(place(at)),
            Self::Limit {
                at,
                number,
                width: w,
            } => (at, limit(number).to_le_bytes()[..width(w)].to_vec()),
            Self::LimitBigEndian {
                at,
                number,
                width: w,
            } => (at, limit(number).to_be_bytes()[8 - width(w)..].to_vec()),
        };
        for (target, byte) in bytes[place(planted.0)..].iter_mut().zip(planted.1) {
            *target = byte;
        }
    }
}

/// Which seed is damaged, one to four changes of it, and a choice that is left to the target.
#[derive(Debug, Clone, TypeGenerator)]
struct Input {
    seed: u8,
    damage: [Damage; 4],
    changes: u8,
    choice: u8,
}

impl Input {
    fn of(&self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = seeds[self.seed as usize % seeds.len()].clone();
        for damage in &self.damage[..1 + self.changes as usize % 4] {
            damage.apply(&mut bytes);
        }
        bytes
    }
}

/// Runs a target, named by the function in which it stands.
macro_rules! fuzz {
    ($seeds:expr, $parse:expr) => {{
        let (seeds, parse) = ($seeds, $parse);
        bolero::check!()
            .with_type::<Input>()
            .for_each(|input: &Input| {
                let bytes = input.of(&seeds);
                LARGEST.set(0);
                parse(bytes.as_slice(), input.choice);
                let largest = LARGEST.get();
                assert!(
                    largest <= LARGEST_ALLOCATION_BYTES,
                    "allocated {largest} bytes at once"
                );
            });
    }};
}

/// Opens and reads a log, decodes its joint states, and recovers it.
fn read_log(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fuzzed");
    std::fs::write(&path, bytes).unwrap();
    let Ok(log) = Log::open(&path) else {
        return;
    };
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let joints = ["a".to_owned()];
    let mut decoders: Vec<_> = log
        .topics()
        .iter()
        .map(|topic| SensorDecoder::new(topic, SensorKind::JointStates, &joints).ok())
        .collect();
    let mut sample = SensorSample::default();
    let _ = log.read(&ids, &mut |message| {
        if let Some(decoder) = &mut decoders[message.topic.index()] {
            let _ = decoder.decode(message, &mut sample);
        }
        ControlFlow::Continue(())
    });
    let _ = recover(&log, &folder.path().join("recovered.mcap"));
}

/// An MCAP file of one chunk, with a correct checksum.
fn chunk_of(content: &[u8], packing: usize) -> Vec<u8> {
    let (name, data) = match packing {
        0 => ("", content.to_vec()),
        1 => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(content).unwrap();
            ("lz4", encoder.finish().unwrap())
        }
        _ => ("zstd", zstd::bulk::compress(content, 1).unwrap()),
    };
    let mut chunk = vec![0; 16];
    chunk.extend((content.len() as u64).to_le_bytes());
    chunk.extend(crc32fast::hash(content).to_le_bytes());
    chunk.extend((name.len() as u32).to_le_bytes());
    chunk.extend(name.as_bytes());
    chunk.extend((data.len() as u64).to_le_bytes());
    chunk.extend(data);
    let mut bytes = mcap::MAGIC.to_vec();
    bytes.push(mcap::records::op::CHUNK);
    bytes.extend((chunk.len() as u64).to_le_bytes());
    bytes.extend(chunk);
    bytes
}

fn topic_like(encoding: &str, schema_encoding: &str, definition: &str) -> Topic {
    let file = support::TempLog::new("log", &support::joint_log(&Style::chunked(None), 1));
    Topic {
        encoding: encoding.to_owned(),
        schema_encoding: schema_encoding.to_owned(),
        definition: Some(definition.to_owned()),
        ..Log::open(&file.path).unwrap().topics()[0].clone()
    }
}

fn paths(texts: &[&str]) -> Vec<FieldPath> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

const JOINT_PATHS: [&str; 6] = [
    "header.stamp.sec",
    "header.frame_id",
    "name[]",
    "position[]",
    "velocity[1]",
    "effort[]",
];

const METADATA: &str = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - drive_0.db3\n\
    \x20 topics_with_message_count:\n    - topic_metadata:\n        name: /joint_states\n\
    \x20     message_count: 5\n  compression_format: zstd\n  compression_mode: FILE\n  files:\n\
    \x20 - path: drive_0.db3\n    message_count: 5\n";

fn decode(layout: &Layout, message: &[u8]) {
    let mut fields = Fields::new();
    let _ = layout.decode(message, &mut fields);
    let _ = (fields.numbers(3).len(), fields.texts(2).count());
}

fn mcap_seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for compression in support::COMPRESSIONS {
        for (chunked, summary, crc) in [
            (true, true, true),
            (true, false, false),
            (false, true, false),
        ] {
            let style = Style {
                compression,
                chunked,
                summary,
                crc,
            };
            seeds.push(support::joint_log(&style, 30));
        }
    }
    seeds
}

fn protobuf_set() -> Vec<u8> {
    // A file of one message: a repeated double, a string, and itself.
    let field = |name: &str, number: u8, label: u8, kind: u8, part: &str| {
        let mut field = vec![0x0a, name.len() as u8];
        field.extend(name.as_bytes());
        field.extend([0x18, number, 0x20, label, 0x28, kind]);
        if !part.is_empty() {
            field.extend([0x32, part.len() as u8]);
            field.extend(part.as_bytes());
        }
        field
    };
    let nested = |tag: u8, inner: &[u8]| [&[tag, inner.len() as u8][..], inner].concat();
    let message = [
        nested(0x0a, b"JointState"),
        nested(0x12, &field("name", 2, 3, 9, "")),
        nested(0x12, &field("position", 3, 3, 1, "")),
        nested(0x12, &field("header", 1, 1, 11, ".JointState")),
        nested(0x12, &field("frame_id", 4, 1, 9, "")),
    ]
    .concat();
    nested(0x0a, &nested(0x22, &message))
}

fn texts(seeds: &[&str]) -> Vec<Vec<u8>> {
    seeds.iter().map(|text| text.as_bytes().to_vec()).collect()
}

fn joint_layout(encoding: &str, schema_encoding: &str, definition: &str) -> Layout {
    let topic = topic_like(encoding, schema_encoding, definition);
    Layout::of_topic(&topic, &paths(&JOINT_PATHS)).unwrap()
}

fn protobuf_topic(set: &[u8]) -> Topic {
    Topic {
        descriptors: Some(set.to_vec()),
        type_name: "JointState".to_owned(),
        ..topic_like("protobuf", "protobuf", "")
    }
}

fn protobuf_paths() -> Vec<FieldPath> {
    paths(&[
        "name[]",
        "position[]",
        "header.header.position[1]",
        "frame_id",
    ])
}

#[test]
fn mcap_files() {
    fuzz!(mcap_seeds(), |bytes: &[u8], _| read_log(bytes));
}

#[test]
fn mcap_chunks_with_correct_checksums() {
    let style = Style {
        chunked: false,
        summary: false,
        ..Style::chunked(None)
    };
    let content = support::joint_log(&style, 30)[8..].to_vec();
    fuzz!(vec![content], |bytes: &[u8], choice: u8| {
        read_log(&chunk_of(bytes, choice as usize % 3));
    });
}

#[test]
fn ros1_bags() {
    let both = |packing: &&'static str| [true, false].map(|index| bags::bag(packing, index, 30));
    let seeds: Vec<_> = bags::PACKINGS.iter().flat_map(both).collect();
    fuzz!(seeds, |bytes: &[u8], _| read_log(bytes));
}

#[test]
fn rosbag2_databases() {
    let database = database(&[JOINTS], &rows(&joint_messages(0, 100)), true);
    let seed = std::fs::read(&database.path).unwrap();
    fuzz!(vec![seed], |bytes: &[u8], _| read_log(bytes));
}

#[test]
fn can_containers() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("can/tests/data");
    let names = [
        "mixed.log",
        "mixed.asc",
        "mixed.blf",
        "mixed.mf4",
        "mixed_plain.mf4",
        "layout_virtual_bus.mf4",
        "layout_variable_mixed.mf4",
        "classical.trc",
        "classical_1_0.trc",
    ];
    let seeds = names.map(|name| std::fs::read(folder.join(name)).unwrap());
    fuzz!(seeds.to_vec(), |bytes: &[u8], _| read_log(bytes));
}

#[test]
fn csv_tables() {
    let seeds = texts(&[
        "time_s,x,y\n1,2,3\n2,,nan\n3,-1e3,x\n",
        "\"t [ms]\";a\n1,5;2,5\n2,5;true\n",
        "timestamp,x\n2023-11-14T22:13:20Z,1\n2023-11-14 22:13:21,2\n",
        "{\"t_s\":1,\"x\":[2,{\"y\":3}]}\n{\"t_s\":2,\"x\":[null]}\n",
        "#group,false,true\n#datatype,dateTime:RFC3339,double\n#default,,\n,_time,_value\n,1970-01-01T00:00:01Z,5\n",
        "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2\n166064000,0000021A,false,Rx,0,2,00,37,\n",
    ]);
    fuzz!(seeds, |bytes: &[u8], _| read_log(bytes));
}

#[test]
fn rosbag2_folder_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let database = database(&[JOINTS], &rows(&joint_messages(0, 5)), true);
    std::fs::copy(&database.path, folder.path().join("drive_0.db3")).unwrap();
    let folder: &Path = folder.path();
    fuzz!(texts(&[METADATA]), |bytes: &[u8], _| {
        std::fs::write(folder.join("metadata.yaml"), bytes).unwrap();
        if let Ok(log) = Log::open(folder) {
            let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
            let _ = log.read(&ids, &mut |_| ControlFlow::Continue(()));
        }
    });
}

#[test]
fn field_paths() {
    let seeds = texts(&["position[]", "a.b[2].c", "forces[17].x"]);
    fuzz!(seeds, |bytes: &[u8], _| {
        let _ = String::from_utf8_lossy(bytes).parse::<FieldPath>();
    });
}

#[test]
fn message_definitions() {
    let bounded = "string<=5 a\nfloat64[<=3] b\nP[2] c\n===\nMSG: p/P\nint8 x\n";
    fuzz!(texts(&[JOINT_STATE, bounded]), |bytes: &[u8], _| {
        let text = String::from_utf8_lossy(bytes);
        for path in paths(&["position[]", "c[].x"]) {
            let _ = Layout::compile(&text, "p/msg/Root", &[path]);
        }
    });
}

#[test]
fn protobuf_descriptors() {
    let (topic, paths) = (protobuf_topic(&[]), protobuf_paths());
    fuzz!(vec![protobuf_set()], |bytes: &[u8], _| {
        let topic = Topic {
            descriptors: Some(bytes.to_vec()),
            ..topic.clone()
        };
        let _ = Layout::of_topic(&topic, &paths);
    });
}

#[test]
fn cdr_and_ros1_messages() {
    let cdr = joint_layout("cdr", "ros2msg", JOINT_STATE);
    let ros1 = joint_layout("ros1", "ros1msg", JOINT_STATE);
    let seed = support::joint_state(1, &["a", "bb"], &[1.0, 2.0], &[3.0]);
    fuzz!(vec![seed], |bytes: &[u8], choice: u8| {
        decode(
            if choice.is_multiple_of(2) {
                &cdr
            } else {
                &ros1
            },
            bytes,
        );
    });
}

#[test]
fn json_messages() {
    let layout = joint_layout("json", "jsonschema", "{}");
    let seed = r#"{"header":{"stamp":{"sec":1},"frame_id":"x"},"name":["a","b"],"position":[1.5,-2e3,null],"velocity":[]}"#;
    fuzz!(texts(&[seed]), |bytes: &[u8], _| decode(&layout, bytes));
}

#[test]
fn protobuf_messages() {
    let layout = Layout::of_topic(&protobuf_topic(&protobuf_set()), &protobuf_paths()).unwrap();
    let seed = b"\x12\x01a\x12\x02bb\x1a\x10\0\0\0\0\0\0\xf0\x3f\0\0\0\0\0\0\0\x40\x22\x01x\x0a\x03\x22\x01y";
    fuzz!(vec![seed.to_vec()], |bytes: &[u8], _| decode(
        &layout, bytes
    ));
}
