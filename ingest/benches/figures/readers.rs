//! The compared readers. Each reads a file and counts its output.

use std::{fs::File, hint::black_box, ops::ControlFlow, path::Path};

use tipwatch_ingest::{
    Log, MessageTimes, SensorBlock, SensorDecoder, SensorKind, SensorRequest, SensorSample, Topic,
    TopicId, read_sensor_blocks, record_sensors,
};

use crate::{
    logs::{JOINTS, joint_names},
    lz4,
};

pub(crate) type Reader = fn(&Path) -> u64;

/// Readers by name; the second is the baseline.
pub(crate) const READERS: [(&str, Reader); 10] = [
    (BARE, decompress_on_all_cores),
    ("mcap crate, stream, no CRC", crate_stream),
    ("mcap crate, stream, CRC", crate_stream_checked),
    ("bare decompressor, one core", decompress),
    ("Log::read, every topic", walk),
    ("Log::read, one topic", walk_one),
    ("Log::read, decoded", decoded),
    ("Log::read to columns", plain_columns),
    (BLOCKS, blocks),
    ("record_sensors", columns),
];
pub(crate) const PEER: usize = 1;
/// Name of the row that bounds all readers: decompression alone, which no reader can be faster than.
pub(crate) const BARE: &str = "bare decompressor, all cores";
/// Name of the reader in blocks, as the analysis takes the samples.
pub(crate) const BLOCKS: &str = "sensors in blocks";

/// The bytes of all messages.
pub(crate) fn payload_bytes(path: &Path) -> u64 {
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

fn joint_topics(log: &Log) -> impl Iterator<Item = &Topic> {
    let is_joint = |topic: &&Topic| SensorKind::JointStates.is_type(&topic.type_name);
    log.topics().iter().filter(is_joint)
}

fn joint_ids(log: &Log) -> Vec<TopicId> {
    joint_topics(log).map(|topic| topic.id).collect()
}

fn walk(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    walk_topics(&log, &ids(&log))
}

fn walk_one(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    walk_topics(&log, &joint_ids(&log)[..1])
}

fn walk_topics(log: &Log, wanted: &[TopicId]) -> u64 {
    let mut count = 0;
    log.read(wanted, &mut |message| {
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
    joint_topics(log).map(decoder).collect()
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
    let counts = || joint_topics(&log).map(|topic| topic.message_count.unwrap_or(0) as usize);
    let mut stamps: Vec<Vec<i64>> = counts().map(Vec::with_capacity).collect();
    let mut values: Vec<Vec<f64>> = counts()
        .map(|count| Vec::with_capacity(2 * JOINTS * count))
        .collect();
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

fn requests(log: &Log) -> Vec<SensorRequest> {
    let request = |topic| SensorRequest::typed(topic, SensorKind::JointStates, joint_names());
    joint_ids(log).into_iter().map(request).collect()
}

/// Every sample with its times and values, and its place on the common clock.
fn blocks(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let mut sum = 0_u64;
    let mut take = |block: &SensorBlock<'_>| {
        let times = block.times();
        let of_time = |times: MessageTimes| times.header_stamp_ns.unwrap_or(0) as u64;
        let values = block.values().iter().map(|value| value.to_bits());
        sum = (times.map(of_time).chain(values)).fold(sum, u64::wrapping_add);
    };
    let (readings, losses) =
        read_sensor_blocks(&log, &requests(&log), &mut take, &mut |_| {}).expect("readable");
    assert!(losses.is_empty(), "{losses:?}");
    black_box(sum);
    readings.iter().map(|reading| reading.samples as u64).sum()
}

fn columns(path: &Path) -> u64 {
    let log = Log::open(path).expect("a log");
    let (recordings, losses) =
        record_sensors(&log, &requests(&log), &mut |_| {}).expect("readable");
    assert!(losses.is_empty(), "{losses:?}");
    let samples = recordings
        .iter()
        .map(|recording| recording.stamps_ns.len() as u64);
    samples.sum()
}

fn map(path: &Path) -> memmap2::Mmap {
    let file = File::open(path).expect("the file");
    // SAFETY: the files of this benchmark are not written to while it runs.
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

fn decompress(path: &Path) -> u64 {
    decompress_with(path, 1)
}

fn decompress_on_all_cores(path: &Path) -> u64 {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    decompress_with(path, threads)
}

/// Decompresses every chunk with the reader's decompressor, without CRC and walk.
fn decompress_with(path: &Path, threads: usize) -> u64 {
    let mapped = map(path);
    let summary = mcap::Summary::read(&mapped)
        .expect("a summary")
        .expect("a summary");
    let chunks = &summary.chunk_indexes;
    std::thread::scope(|scope| {
        let unpack = |first: usize| {
            let mapped = &mapped;
            move || {
                let mut unpacker = Unpacker::default();
                let of_thread = chunks.iter().skip(first).step_by(threads);
                of_thread.map(|chunk| unpacker.bytes(mapped, chunk)).sum()
            }
        };
        let handles: Vec<_> = (1..threads)
            .map(|first| scope.spawn(unpack(first)))
            .collect();
        let own: u64 = unpack(0)();
        let others = handles
            .into_iter()
            .map(|handle| handle.join().expect("no panic"));
        own + others.sum::<u64>()
    })
}

#[derive(Default)]
struct Unpacker {
    buffer: Vec<u8>,
    lz4: lz4::Decoder,
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Unpacker {
    fn bytes(&mut self, mapped: &[u8], index: &mcap::records::ChunkIndex) -> u64 {
        let start = index.compressed_data_offset().expect("an offset") as usize;
        let data = &mapped[start..start + index.compressed_size as usize];
        let wanted = index.uncompressed_size as usize;
        if self.buffer.len() < wanted {
            self.buffer.resize(wanted, 0);
        }
        let target = &mut self.buffer[..wanted];
        match index.compression.as_str() {
            "lz4" => {
                let skipped = lz4::FrameChecksums::Skipped;
                let (filled, end) = self.lz4.unpack(data, target, skipped);
                assert_eq!((filled, end), (wanted, lz4::End::Complete));
            }
            "zstd" => {
                let zstd = self.zstd.get_or_insert_with(|| {
                    zstd::bulk::Decompressor::new().expect("a decompressor")
                });
                zstd.decompress_to_buffer(data, target).expect("zstd");
            }
            _ => target.copy_from_slice(data),
        }
        black_box(target).len() as u64
    }
}
