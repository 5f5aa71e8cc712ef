//! Changes good inputs at random and feeds them to every parser, for as long as is asked for.
//!
//! `cargo run --release -p tipwatch-ingest --example fuzz -- [SECONDS for each parser] [SEED]`
//!
//! It runs with the stable compiler and is not guided by coverage; instead it knows the formats: it
//! plants lengths that are absurd, cuts, repeats and moves parts, and packs changed content into
//! chunks whose checksums are right. A panic, an input that takes longer than ten seconds and an
//! allocation of more than 64 MB are findings; the input is kept.

// What it prints is its result; the shared helpers have more than is used here.
#![allow(clippy::print_stdout, clippy::unwrap_used, unused)]

#[path = "../tests/bags.rs"]
mod bags;
#[path = "../tests/rosbag2.rs"]
mod rosbag2;
#[path = "../tests/support.rs"]
mod support;

use std::{
    alloc::{GlobalAlloc, Layout as Block, System},
    io::Write as _,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

use tipwatch_ingest::{
    FieldPath, Fields, Layout, Log, SensorDecoder, SensorKind, SensorSample, Topic,
};

use crate::support::{Cdr, JOINT_STATE, Style};

const LARGEST_ALLOCATION_BYTES: usize = 64 << 20;
const SLOWEST: Duration = Duration::from_secs(10);

/// Notes the largest allocation.
struct Watching;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Watching = Watching;

// SAFETY: every call is passed on to the system's allocator as it is.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, block: Block) -> *mut u8 {
        LARGEST.fetch_max(block.size(), Ordering::Relaxed);
        unsafe { System.alloc(block) }
    }

    unsafe fn dealloc(&self, place: *mut u8, block: Block) {
        unsafe { System.dealloc(place, block) }
    }

    unsafe fn realloc(&self, place: *mut u8, block: Block, size: usize) -> *mut u8 {
        LARGEST.fetch_max(size, Ordering::Relaxed);
        unsafe { System.realloc(place, block, size) }
    }
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// Numbers that are wrong in an interesting way.
const NUMBERS: [u64; 12] = [
    0,
    1,
    7,
    0x7f,
    0xff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0xffff_fff0,
    1 << 40,
    i64::MAX as u64,
    u64::MAX,
];

fn change(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        let longest = 1 << random.below(9);
        let end = (at + 1 + random.below(longest)).min(bytes.len());
        match random.below(9) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            1 if !bytes.is_empty() => bytes[at] = random.next() as u8,
            2 => bytes[at..end].fill(0),
            3 => {
                bytes.drain(at..end);
            }
            4 => {
                let part = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, part);
            }
            5 => bytes.truncate(at),
            _ => {
                let number = NUMBERS[random.below(NUMBERS.len())];
                let width = [1, 2, 4, 8][random.below(4)];
                let planted = match random.below(2) {
                    0 => number.to_le_bytes()[..width].to_vec(),
                    _ => number.to_be_bytes()[8 - width..].to_vec(),
                };
                for (target, byte) in bytes[at..].iter_mut().zip(planted) {
                    *target = byte;
                }
            }
        }
    }
}

/// Opens and reads a log, decodes whatever fits a sensor, and recovers it.
fn read_log(folder: &Path, bytes: &[u8]) {
    let path = folder.join("fuzzed");
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
    let out = folder.join("recovered.mcap");
    let _ = std::fs::remove_file(&out);
    let _ = tipwatch_ingest::recover(&log, &out);
}

/// An MCAP file of one chunk, with a checksum that is right.
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

fn decode(layout: &Layout, message: &[u8]) {
    let mut fields = Fields::new();
    let _ = layout.decode(message, &mut fields);
    let _ = (fields.numbers(3).len(), fields.texts(2).count());
}

const METADATA: &str = "info:\n  relative_file_paths:\n    - drive_0.db3\n  topics_with_message_count:\n    \
    - topic_metadata:\n        name: /joint_states\n      message_count: 5\n  compression_format: zstd\n  \
    compression_mode: FILE\n  files:\n  - path: drive_0.db3\n    message_count: 5\n";

type Parser = Box<dyn FnMut(&Path, &mut Random, &mut Vec<u8>)>;

/// One parser with its good inputs; it changes one of them and tells what it fed.
fn on_seeds(seeds: Vec<Vec<u8>>, mut parse: impl FnMut(&Path, &[u8]) + 'static) -> Parser {
    Box::new(move |folder, random, fed| {
        fed.clone_from(&seeds[random.below(seeds.len())]);
        change(fed, random);
        parse(folder, fed);
    })
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

fn parsers() -> Vec<(&'static str, Parser)> {
    let loose = Style {
        chunked: false,
        summary: false,
        ..Style::chunked(None)
    };
    let content = support::joint_log(&loose, 30)[8..].to_vec();
    let packed: Parser = Box::new(move |folder, random, fed| {
        let mut changed = content.clone();
        change(&mut changed, random);
        *fed = chunk_of(&changed, random.below(3));
        read_log(folder, fed);
    });
    let bags = bags::PACKINGS
        .iter()
        .flat_map(|packing| [bags::bag(packing, true, 30), bags::bag(packing, false, 30)])
        .collect();
    let recorded = rosbag2::joint_messages(0, 100);
    let database = rosbag2::database(&[rosbag2::JOINTS], &rosbag2::rows(&recorded), true);
    let database = std::fs::read(&database.path).unwrap();
    let recorded = rosbag2::joint_messages(0, 5);
    let small_database = rosbag2::database(&[rosbag2::JOINTS], &rosbag2::rows(&recorded), true);
    let small_database = std::fs::read(&small_database.path).unwrap();
    let definitions = [
        JOINT_STATE,
        "string<=5 a\nfloat64[<=3] b\nP[2] c\n===\nMSG: p/P\nint8 x\n",
    ];
    let joint_paths = paths(&JOINT_PATHS);
    let cdr = Layout::of_topic(&topic_like("cdr", "ros2msg", JOINT_STATE), &joint_paths).unwrap();
    let ros1 = Layout::of_topic(&topic_like("ros1", "ros1msg", JOINT_STATE), &joint_paths).unwrap();
    let json = Layout::of_topic(&topic_like("json", "jsonschema", "{}"), &joint_paths).unwrap();
    let joint_state = support::joint_state(1, &["a", "bb"], &[1.0, 2.0], &[3.0]);
    let proto_topic = |set: &[u8]| Topic {
        descriptors: Some(set.to_vec()),
        type_name: "JointState".to_owned(),
        ..topic_like("protobuf", "protobuf", "")
    };
    let proto_paths = paths(&[
        "name[]",
        "position[]",
        "header.header.position[1]",
        "frame_id",
    ]);
    let protobuf = Layout::of_topic(&proto_topic(&protobuf_set()), &proto_paths).unwrap();
    let proto_message = b"\x12\x01a\x12\x02bb\x1a\x10\0\0\0\0\0\0\xf0\x3f\0\0\0\0\0\0\0\x40\x22\x01x\x0a\x03\x22\x01y";
    let set_topic = proto_topic(&[]);
    vec![
        ("MCAP files", on_seeds(mcap_seeds(), read_log)),
        ("MCAP chunks with right checksums", packed),
        ("bags", on_seeds(bags, read_log)),
        ("databases", on_seeds(vec![database], read_log)),
        (
            "metadata of folders",
            on_seeds(vec![METADATA.as_bytes().to_vec()], move |folder, bytes| {
                let drive = folder.join("drive");
                std::fs::create_dir_all(&drive).unwrap();
                std::fs::write(drive.join("drive_0.db3"), &small_database).unwrap();
                std::fs::write(drive.join("metadata.yaml"), bytes).unwrap();
                if let Ok(log) = Log::open(&drive) {
                    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
                    let _ = log.read(&ids, &mut |_| ControlFlow::Continue(()));
                }
            }),
        ),
        (
            "paths of fields",
            on_seeds(
                ["position[]", "a.b[2].c", "forces[17].x"].map(|path| path.as_bytes().to_vec()).to_vec(),
                |_, bytes| {
                    let _ = String::from_utf8_lossy(bytes).parse::<FieldPath>();
                },
            ),
        ),
        (
            "message definitions",
            on_seeds(
                definitions.map(|text| text.as_bytes().to_vec()).to_vec(),
                |_, bytes| {
                    let text = String::from_utf8_lossy(bytes);
                    let wanted = paths(&["position[]", "c[].x"]);
                    for path in wanted {
                        let _ = Layout::compile(&text, "p/msg/Root", &[path]);
                    }
                },
            ),
        ),
        ("CDR", on_seeds(vec![joint_state.clone()], move |_, bytes| decode(&cdr, bytes))),
        ("ros1", on_seeds(vec![joint_state], move |_, bytes| decode(&ros1, bytes))),
        (
            "JSON",
            on_seeds(
                vec![br#"{"header":{"stamp":{"sec":1},"frame_id":"x"},"name":["a","b"],"position":[1.5,-2e3,null],"velocity":[]}"#.to_vec()],
                move |_, bytes| decode(&json, bytes),
            ),
        ),
        (
            "protobuf",
            on_seeds(vec![proto_message.to_vec()], move |_, bytes| decode(&protobuf, bytes)),
        ),
        (
            "protobuf descriptors",
            on_seeds(vec![protobuf_set()], move |_, bytes| {
                let topic = Topic {
                    descriptors: Some(bytes.to_vec()),
                    ..set_topic.clone()
                };
                let _ = Layout::of_topic(&topic, &proto_paths);
            }),
        ),
    ]
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| {
        arguments
            .next()
            .and_then(|text| text.parse().ok())
            .unwrap_or(default)
    };
    let (seconds, seed) = (number(10), number(1));
    let folder = tempfile::tempdir().unwrap();
    let mut findings = 0;
    for (name, mut parse) in parsers() {
        let mut random = Random(seed);
        let begin = Instant::now();
        let mut inputs: u64 = 0;
        let mut slowest = Duration::ZERO;
        let mut largest = 0;
        let mut fed = Vec::new();
        while begin.elapsed().as_secs() < seconds {
            LARGEST.store(0, Ordering::Relaxed);
            let start = Instant::now();
            let attempt = catch_unwind(AssertUnwindSafe(|| {
                parse(folder.path(), &mut random, &mut fed);
            }));
            let took = start.elapsed();
            slowest = slowest.max(took);
            let allocated = LARGEST.load(Ordering::Relaxed);
            largest = largest.max(allocated);
            inputs += 1;
            if attempt.is_err() || took > SLOWEST || allocated > LARGEST_ALLOCATION_BYTES {
                findings += 1;
                let kept = std::env::temp_dir().join(format!("tipwatch-finding-{findings}"));
                std::fs::write(&kept, &fed).unwrap();
                println!(
                    "{name}: took {took:?}, allocated {allocated} bytes: {}",
                    kept.display()
                );
            }
        }
        println!(
            "{name}: {inputs} inputs in {seconds} s, slowest {:.1} ms, largest allocation {:.1} MB",
            slowest.as_secs_f64() * 1e3,
            largest as f64 * 1e-6,
        );
    }
    println!("{findings} findings");
    std::process::exit(i32::from(findings > 0));
}
