//! Two hundred damaged variants of each format: nothing panics, undamaged messages are read, and
//! the damage is reported.

// Positions of bytes are ranges, even if there is only one.
#![allow(clippy::single_range_in_vec_init)]

use std::{
    collections::{BTreeMap, HashSet},
    ops::{ControlFlow, Range},
};

use mcap::Compression;
use tipwatch_ingest::{Log, Losses};

use crate::{
    bags::bag,
    rosbag2::{JOINTS, database, joint_messages, rows},
    sensor_blocks::{blocks_and_columns, joint_requests},
    support::{Style, TempLog, joint_log},
};

/// Variants per format; the environment variable `TIPWATCH_VARIANTS` sets another number.
fn variants() -> u64 {
    let more = std::env::var("TIPWATCH_VARIANTS").ok();
    more.and_then(|count| count.parse().ok()).unwrap_or(200)
}

const MESSAGES: usize = 150;

/// SplitMix64: the same numbers in every run.
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
        (self.next() % limit as u64) as usize
    }
}

/// A log and the positions of its messages.
struct Original {
    name: &'static str,
    bytes: Vec<u8>,
    /// Bytes that must be intact for a message to be read: its chunk or the message itself.
    messages: BTreeMap<Key, Range<usize>>,
    /// Bytes without which nothing is readable.
    vital: Vec<Range<usize>>,
    /// Definitions of topics without a checksum.
    definitions: Range<usize>,
    /// Whether a flipped bit in a message is detected.
    is_checked: bool,
    /// Whether bytes may be removed: not in a file of pages.
    may_shift: bool,
}

/// Topic, time, content.
type Key = (String, i64, Vec<u8>);

fn read(log: &Log) -> (HashSet<Key>, Losses) {
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let mut found = HashSet::new();
    let losses = log
        .read(&ids, &mut |message| {
            let topic = log.topic(message.topic).unwrap().name.clone();
            found.insert((topic, message.log_time_ns, message.data.to_vec()));
            ControlFlow::Continue(())
        })
        .unwrap();
    (found, losses)
}

fn messages_of(bytes: &[u8]) -> HashSet<Key> {
    let file = TempLog::new("whole", bytes);
    read(&Log::open(&file.path).unwrap()).0
}

fn position(bytes: &[u8], part: &[u8]) -> usize {
    bytes
        .windows(part.len())
        .position(|window| window == part)
        .unwrap()
}

fn last_position(bytes: &[u8], part: &[u8]) -> usize {
    bytes
        .windows(part.len())
        .rposition(|window| window == part)
        .unwrap()
}

/// Prepares a log of a format that stores messages literally.
fn plain(name: &'static str, bytes: Vec<u8>, before: usize, vital: Vec<Range<usize>>) -> Original {
    let messages = messages_of(&bytes)
        .into_iter()
        .map(|key| {
            // A split page keeps its old content.
            let at = last_position(&bytes, &key.2);
            let range = at - before..at + key.2.len();
            (key, range)
        })
        .collect();
    Original {
        name,
        bytes,
        messages,
        vital,
        definitions: 0..0,
        is_checked: false,
        may_shift: true,
    }
}

fn mcap_chunks(name: &'static str, style: &Style) -> Original {
    let bytes = joint_log(style, MESSAGES);
    let indexed = joint_log(
        &Style {
            summary: true,
            ..style.clone()
        },
        MESSAGES,
    );
    let summary = mcap::Summary::read(&indexed).unwrap().unwrap();
    let mut messages = BTreeMap::new();
    let mut first_chunk = 0..0;
    for index in &summary.chunk_indexes {
        let start = index.chunk_start_offset as usize;
        let range = start..start + index.chunk_length as usize;
        if first_chunk.is_empty() {
            first_chunk = range.clone();
        }
        for message in summary.stream_chunk(&indexed, index).unwrap() {
            let message = message.unwrap();
            let key = (
                message.channel.topic.clone(),
                message.log_time as i64,
                message.data.into_owned(),
            );
            messages.insert(key, range.clone());
        }
    }
    let mut vital = vec![0..8];
    if !style.summary {
        // Without it the topics are unknown.
        vital.push(first_chunk);
    }
    Original {
        name,
        bytes,
        messages,
        vital,
        definitions: 0..0,
        is_checked: style.crc,
        may_shift: true,
    }
}

fn bag_chunks(packing: &'static str) -> Original {
    let bytes = bag(packing, true, MESSAGES);
    let mark = b"compression=";
    let starts: Vec<usize> = (0..bytes.len())
        .filter(|&at| bytes[at..].starts_with(mark))
        .map(|at| at - 8)
        .collect();
    let mut messages = BTreeMap::new();
    for key in messages_of(&bytes) {
        let index = (key.1 - crate::support::FIRST_NS) / crate::support::PERIOD_NS;
        let chunk = index as usize / 20;
        // The index of this chunk follows.
        let rest = &bytes[starts[chunk]..];
        let length = 4 + 4 + 12 + packing.len() + 4 + 4 + 4 + 9;
        let data_bytes = u32::from_le_bytes(rest[length..length + 4].try_into().unwrap());
        let end = starts[chunk] + length + 4 + data_bytes as usize;
        messages.insert(key, starts[chunk]..end);
    }
    Original {
        name: packing,
        definitions: index_of_bag(&bytes)..bytes.len(),
        bytes,
        messages,
        vital: vec![0..13],
        is_checked: packing != "none",
        may_shift: true,
    }
}

fn index_of_bag(bytes: &[u8]) -> usize {
    let at = position(bytes, b"index_pos=") + 10;
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

fn originals() -> Vec<Vec<Original>> {
    let lz4 = Style::chunked(Some(Compression::Lz4));
    let zstd = Style::chunked(Some(Compression::Zstd));
    let none = Style::chunked(None);
    let bare = |style: &Style| Style {
        summary: false,
        ..style.clone()
    };
    let loose = Style {
        chunked: false,
        ..none.clone()
    };
    let loose_bytes = joint_log(&loose, MESSAGES);
    let recorded = joint_messages(0, 1500);
    let database = database(&[JOINTS], &rows(&recorded), true);
    let db3 = std::fs::read(&database.path).unwrap();
    let bag_bytes = bag("none", true, MESSAGES);
    let index = index_of_bag(&bag_bytes)..bag_bytes.len();
    let mut plain_bag = plain("none", bag_bytes, 4 + 48 + 4, vec![0..13]);
    plain_bag.definitions = index;
    vec![
        vec![
            mcap_chunks("lz4", &lz4),
            mcap_chunks("zstd", &zstd),
            mcap_chunks("none", &none),
            mcap_chunks("lz4 without summary", &bare(&lz4)),
            plain("without chunks", loose_bytes, 9 + 22, vec![0..8]),
        ],
        vec![bag_chunks("lz4"), bag_chunks("bz2"), plain_bag],
        vec![database_pages(db3)],
    ]
}

/// Prepares a database, in which a message is lost with its page.
fn database_pages(bytes: Vec<u8>) -> Original {
    const PAGE: usize = 4096;
    let mut original = plain("db3", bytes, 0, vec![0..3 * PAGE]);
    original.may_shift = false;
    for range in original.messages.values_mut() {
        *range = range.start / PAGE * PAGE..range.end.next_multiple_of(PAGE);
    }
    original
}

/// The damaged bytes, and which original bytes were changed.
fn damage(original: &Original, random: &mut Random) -> (Vec<u8>, Vec<Range<usize>>, &'static str) {
    let bytes = &original.bytes;
    let mut damaged = bytes.clone();
    let at = random.below(bytes.len());
    let longest = 1 << random.below(12);
    let length = 1 + random.below(longest);
    let end = (at + length).min(bytes.len());
    match random.below(6) {
        0 => {
            damaged.truncate(at);
            (damaged, vec![at..bytes.len()], "cut")
        }
        1 => {
            damaged[at..end].fill(0);
            (damaged, vec![at..end], "zeroed")
        }
        2 => {
            damaged[at..end].fill_with(|| random.next() as u8);
            (damaged, vec![at..end], "overwritten")
        }
        3 if original.may_shift => {
            damaged.drain(at..end);
            (damaged, vec![at.saturating_sub(1)..end], "removed")
        }
        4 => {
            damaged[at] ^= 1 << random.below(8);
            (damaged, vec![at..at + 1], "one bit")
        }
        _ => {
            let places: Vec<usize> = (0..3).map(|_| random.below(bytes.len())).collect();
            for &place in &places {
                damaged[place] = random.next() as u8;
            }
            let touched = places.iter().map(|&place| place..place + 1).collect();
            (damaged, touched, "three bytes")
        }
    }
}

fn overlap(left: &Range<usize>, right: &Range<usize>) -> bool {
    left.start < right.end && right.start < left.end
}

/// Whether a loss covers this time.
fn is_told(losses: &Losses, time_ns: i64) -> bool {
    losses.ranges.iter().any(|range| {
        range.first_time_ns.is_none_or(|first| first <= time_ns)
            && range.last_time_ns.is_none_or(|last| time_ns <= last)
    })
}

fn check(original: &Original, seed: u64) -> Option<bool> {
    let mut random = Random(seed);
    let (bytes, touched, kind) = damage(original, &mut random);
    let context = format!("{}, seed {seed}, {kind} {touched:?}", original.name);
    let is_touched = |range: &Range<usize>| touched.iter().any(|part| overlap(part, range));
    let file = TempLog::new("damaged", &bytes);
    let is_hopeless = original.vital.iter().any(is_touched);
    let log = match Log::open(&file.path) {
        Ok(log) => log,
        Err(_) if is_hopeless => return None,
        Err(error) => panic!("{context}: {error}"),
    };
    blocks_and_columns(&log, &joint_requests(&log, &["bb", "a"]));
    let (found, losses) = read(&log);
    if is_hopeless {
        return None;
    }
    if losses
        .ranges
        .iter()
        .any(|range| range.reason.contains("not defined"))
    {
        // All definitions of a topic were hit.
        return Some(true);
    }
    let mut lost: BTreeMap<&str, u64> = BTreeMap::new();
    let is_renamed = is_touched(&original.definitions);
    let unnamed: HashSet<_> = found.iter().map(|key| (key.1, &key.2)).collect();
    for (key, range) in &original.messages {
        if found.contains(key) || is_renamed && unnamed.contains(&(key.1, &key.2)) {
            continue;
        }
        *lost.entry(&key.0).or_default() += 1;
        let place = format!("{context}: {} at {} in {range:?}", key.0, key.1);
        assert!(is_touched(range), "{place}: lost without need: {losses:?}");
        let is_silent = !original.is_checked && losses.integrity.note().is_some();
        assert!(
            is_told(&losses, key.1) || is_silent,
            "{place}: not told: {losses:?}"
        );
    }
    if original.is_checked && !is_renamed {
        check_numbers(&losses, &lost, &context);
        for key in &found {
            assert!(
                original.messages.contains_key(key),
                "{context}: invented {key:?}"
            );
        }
    }
    let is_reported = !losses.is_empty() || !losses.notes.is_empty();
    let is_same = bytes == original.bytes;
    let is_silent = losses.integrity.note().is_some();
    let is_between = lost.is_empty() && original.is_checked;
    assert!(
        is_reported || is_same || is_silent || is_between,
        "{context}: nothing is told"
    );
    Some(is_reported || is_same)
}

/// Wherever the losses state a number of lost messages, it is correct.
fn check_numbers(losses: &Losses, lost: &BTreeMap<&str, u64>, context: &str) {
    let mut told: BTreeMap<&str, u64> = BTreeMap::new();
    for range in &losses.ranges {
        for (topic, count) in &range.messages {
            *told.entry(topic).or_default() += count;
        }
        if let Some(count) = range.message_count {
            let sum: u64 = range.messages.values().sum();
            assert_eq!(count, sum, "{context}: {losses:?}");
        }
    }
    let actual = |topic: &str| lost.get(topic).copied().unwrap_or(0);
    for (topic, count) in &told {
        assert!(*count <= actual(topic), "{context}: {lost:?} {losses:?}");
    }
    if losses.ranges.iter().all(|r| r.message_count.is_some()) {
        assert_eq!(&told, lost, "{context}: {losses:?}");
    }
    for (topic, count) in &losses.missing_messages {
        assert_eq!(*count, actual(topic), "{context}: {losses:?}");
    }
}

fn check_format(originals: &[Original]) {
    let mut read = 0;
    let mut told = 0;
    let variants = variants();
    for variant in 0..variants {
        let original = &originals[variant as usize % originals.len()];
        if let Some(is_told) = check(original, variant * 7919 + 13) {
            read += 1;
            told += u64::from(is_told);
        }
    }
    eprintln!(
        "{variants} variants, {read} with a readable beginning, {told} told by bytes or notes"
    );
    assert!(read > variants / 2);
}

#[test]
fn damaged_mcap_files_yield_intact_messages() {
    check_format(&originals()[0]);
}

#[test]
fn damaged_bags_yield_intact_messages() {
    check_format(&originals()[1]);
}

#[test]
fn damaged_databases_yield_intact_messages() {
    check_format(&originals()[2]);
}
