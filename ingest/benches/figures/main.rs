//! Reading speed on whole files, beside the stream of the `mcap` crate and the bare decompressors.
//!
//! `cargo bench -p tipwatch-ingest --bench figures -- [FOLDER] [MESSAGES]` makes the files in FOLDER
//! (a temporary one by default), reads each several times in turn, and prints the best of each
//! reader. All readers see the same file in the same run; it is in the page cache.
//!
//! (a) joint states on three topics, 5 million by default; (b) a tenth as many bytes of joint states
//! among images on other topics, in chunks of their own and in chunks with the joint states.

// What it prints is its result.
#![allow(clippy::print_stdout)]

use std::{
    collections::BTreeMap,
    fs::File,
    hint::black_box,
    io::{BufWriter, Read},
    ops::ControlFlow,
    path::{Path, PathBuf},
    time::Instant,
};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use tipwatch_ingest::{
    Log, SensorDecoder, SensorKind, SensorRequest, SensorSample, Topic, TopicId, record_sensors,
};

const JOINTS: usize = 6;
const ROUNDS: usize = 3;
const IMAGE_BYTES: usize = 900_000;
const DEFINITION: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\n\
    float64[] velocity\nfloat64[] effort\n====\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n====\nMSG: builtin_interfaces/Time\n\
    int32 sec\nuint32 nanosec\n";

fn main() {
    let mut arguments = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench");
    let given = arguments.next().map(PathBuf::from);
    let messages: u64 = arguments
        .next()
        .and_then(|count| count.parse().ok())
        .unwrap_or(5_000_000);
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder = given.unwrap_or_else(|| temporary.path().to_path_buf());
    for (name, compression) in [
        ("lz4", Some(Compression::Lz4)),
        ("zstd", Some(Compression::Zstd)),
        ("none", None),
    ] {
        let path = folder.join(format!("joints_{name}.mcap"));
        make(&path, |path| write_joints(path, compression, messages));
        println!("\n(a) {messages} joint states, {name}: {}", size(&path));
        measure(&path);
    }
    for (name, is_apart) in [
        ("images in chunks of their own", true),
        ("mixed chunks", false),
    ] {
        for (packing, compression) in [("lz4", Some(Compression::Lz4)), ("none", None)] {
            let path = folder.join(format!("images_{is_apart}_{packing}.mcap"));
            make(&path, |path| {
                write_images(path, compression, is_apart, messages / 15);
            });
            println!("\n(b) {name}, {packing}: {}", size(&path));
            measure(&path);
        }
    }
}

/// Makes a file once.
fn make(path: &Path, write: impl FnOnce(&Path)) {
    if !path.exists() {
        write(path);
    }
}

fn size(path: &Path) -> String {
    let bytes = std::fs::metadata(path).expect("the file").len();
    format!("{:.3} GB", bytes as f64 * 1e-9)
}

/// Reads a file and counts what it handed out.
type Reader = fn(&Path) -> u64;

fn measure(path: &Path) {
    let payload = wanted_payload(path);
    let readers: [(&str, Reader); 8] = [
        ("the decompressor alone, one thread", decompress),
        ("mcap crate, MessageStream, no CRC", crate_stream),
        ("mcap crate, MessageStream, CRC", crate_stream_checked),
        ("Log::read, CRC", walk),
        ("Log::read, CRC, one topic", walk_one),
        ("Log::read, decoded, CRC", decoded),
        ("Log::read to columns, CRC", plain_columns),
        ("record_sensors, CRC", columns),
    ];
    let mut best = [f64::INFINITY; 8];
    let mut counts = [0; 8];
    for _ in 0..ROUNDS {
        for (index, (_, read)) in readers.iter().enumerate() {
            let start = Instant::now();
            counts[index] = read(path);
            best[index] = best[index].min(start.elapsed().as_secs_f64());
        }
    }
    for (index, (name, _)) in readers.iter().enumerate() {
        println!(
            "{name:36} {:7.3} s  {:6.0} MB/s of payload  {:5.2} x the crate  ({})",
            best[index],
            payload as f64 * 1e-6 / best[index],
            best[1] / best[index],
            counts[index],
        );
    }
}

fn wanted_payload(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let mut bytes = 0;
    log.read(&ids(&log), &mut |message| {
        bytes += message.data.len() as u64;
        ControlFlow::Continue(())
    })
    .expect("readable");
    bytes
}

fn ids(log: &Log) -> Vec<TopicId> {
    log.topics().iter().map(|topic| topic.id).collect()
}

fn joint_ids(log: &Log) -> Vec<TopicId> {
    let is_joint = |type_name: &str| SensorKind::JointStates.is_type(type_name);
    let topics = log
        .topics()
        .iter()
        .filter(|topic| is_joint(&topic.type_name));
    topics.map(|topic| topic.id).collect()
}

fn joint_names() -> Vec<String> {
    (0..JOINTS)
        .map(|joint| format!("arm_joint_{joint}"))
        .collect()
}

fn walk(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let mut count = 0;
    log.read(&ids(&log), &mut |message| {
        count += u64::from(!black_box(message.data).is_empty());
        ControlFlow::Continue(())
    })
    .expect("readable");
    count
}

fn walk_one(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let mut count = 0;
    let wanted = joint_ids(&log);
    log.read(&wanted[..1], &mut |message| {
        count += u64::from(!black_box(message.data).is_empty());
        ControlFlow::Continue(())
    })
    .expect("readable");
    count
}

fn decoders(log: &Log) -> Vec<SensorDecoder> {
    let decoder = |topic: &Topic| {
        SensorDecoder::new(topic, SensorKind::JointStates, &joint_names()).expect("decodable")
    };
    let topics = log.topics().iter();
    let joints = topics.filter(|topic| SensorKind::JointStates.is_type(&topic.type_name));
    joints.map(decoder).collect()
}

fn decoded(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let mut decoders = decoders(&log);
    let mut sample = SensorSample::default();
    let mut count = 0;
    log.read(&joint_ids(&log), &mut |message| {
        let decoder = &mut decoders[message.topic.index()];
        decoder.decode(message, &mut sample).expect("decodable");
        count += black_box(sample.values.len()) as u64 / (2 * JOINTS) as u64;
        ControlFlow::Continue(())
    })
    .expect("readable");
    count
}

/// Stamps and values of each topic, and nothing else.
fn plain_columns(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let mut decoders = decoders(&log);
    let mut stamps: Vec<Vec<i64>> = vec![Vec::new(); decoders.len()];
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); decoders.len()];
    let mut sample = SensorSample::default();
    log.read(&joint_ids(&log), &mut |message| {
        let topic = message.topic.index();
        decoders[topic]
            .decode(message, &mut sample)
            .expect("decodable");
        stamps[topic].push(sample.header_stamp_ns.unwrap_or(0));
        values[topic].extend_from_slice(&sample.values);
        ControlFlow::Continue(())
    })
    .expect("readable");
    black_box(&values);
    stamps.iter().map(|stamps| stamps.len() as u64).sum()
}

fn columns(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let request = |topic| SensorRequest {
        topic,
        kind: SensorKind::JointStates,
        joint_names: joint_names(),
        numbers: None,
    };
    let requests: Vec<SensorRequest> = joint_ids(&log).into_iter().map(request).collect();
    let (recordings, losses) = record_sensors(&log, &requests, &mut |_| {}).expect("readable");
    assert!(losses.is_empty(), "{losses:?}");
    let samples = recordings
        .iter()
        .map(|recording| recording.stamps_ns.len() as u64);
    samples.sum()
}

fn map(path: &Path) -> memmap2::Mmap {
    let file = File::open(path).expect("the file");
    // SAFETY: nobody writes to the files of this benchmark while it runs.
    #[allow(unsafe_code)]
    unsafe {
        memmap2::Mmap::map(&file).expect("mapped")
    }
}

fn crate_stream(path: &Path) -> u64 {
    let mapped = map(path);
    let stream = mcap::MessageStream::new(&mapped).expect("a log");
    stream.map(|message| u64::from(message.is_ok())).sum()
}

fn crate_stream_checked(path: &Path) -> u64 {
    let mapped = map(path);
    let options = mcap::read::Options::ValidateChunkCrcs.into();
    let stream = mcap::MessageStream::new_with_options(&mapped, options).expect("a log");
    stream.map(|message| u64::from(message.is_ok())).sum()
}

/// All chunks through the decompressors that the reader uses, and nothing else.
fn decompress(path: &Path) -> u64 {
    let mapped = map(path);
    let summary = mcap::Summary::read(&mapped)
        .expect("a summary")
        .expect("a summary");
    let mut buffer = Vec::new();
    let mut bytes = 0;
    let mut zstd = zstd::bulk::Decompressor::new().expect("a decompressor");
    for index in &summary.chunk_indexes {
        let data = index.compressed_data_offset().expect("an offset") as usize;
        let data = &mapped[data..data + index.compressed_size as usize];
        buffer.resize(index.uncompressed_size as usize, 0);
        match index.compression.as_str() {
            "lz4" => lz4_flex::frame::FrameDecoder::new(data)
                .read_exact(&mut buffer)
                .expect("lz4"),
            "zstd" => {
                zstd.decompress_to_buffer(data, &mut buffer).expect("zstd");
            }
            _ => buffer.copy_from_slice(data),
        }
        bytes += black_box(&buffer).len() as u64;
    }
    bytes
}

/// Appends after padding to the size of the value, as CDR demands.
fn put<const N: usize>(cdr: &mut Vec<u8>, value: [u8; N]) {
    while !(cdr.len() - 4).is_multiple_of(N) {
        cdr.push(0);
    }
    cdr.extend(value);
}

fn put_text(cdr: &mut Vec<u8>, text: &str) {
    put(cdr, (text.len() as u32 + 1).to_le_bytes());
    cdr.extend(text.as_bytes());
    cdr.push(0);
}

/// Positions as an encoder of 16 bits gives them, rates and efforts as differences do.
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

/// Nine bytes of images for one of joint states. Images of cameras are packed already: noise.
fn write_images(path: &Path, compression: Option<Compression>, is_apart: bool, joints: u64) {
    let mut writer = create(path, compression, 1 << 20);
    let joint = joint_channel(&mut writer, "/joint_states");
    let definition = "std_msgs/Header header\nstring format\nuint8[] data\n";
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
            // A recorder that ends the chunk before and after a large message.
            if is_apart {
                writer.flush().expect("end of chunk");
            }
            writer
                .write_to_known_channel(&header(image, index), &noise)
                .expect("message");
            if is_apart {
                writer.flush().expect("end of chunk");
            }
        }
    }
    writer.finish().expect("end of log");
}
