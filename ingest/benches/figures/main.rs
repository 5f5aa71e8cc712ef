//! Reading speed on whole files, compared with the `mcap` crate, the Python readers and the bare
//! decompressors.
//!
//! `cargo bench -p tipwatch-ingest --bench figures -- [FOLDER] [MESSAGES] [FILE] [READER]` makes the
//! files whose name contains FILE in FOLDER (a temporary one by default), reads each several times,
//! reader after reader in turn, and prints the best and the median of each. Given READER, only the
//! peer and the readers whose name contains it take part. All readers see the same file in the same run;
//! it is in the page cache. Ratios are those of the times, best to best and median to median.
//!
//! Obtaining half a gigabyte for columns can take longer than filling them, especially in a virtual
//! machine whose host reclaims freed memory. One reader therefore uses the memory of its last round.
//!
//! (a) joint states on three topics, 5 million by default; (b) a tenth as many bytes of joint states
//! among images on other topics, in chunks of their own and in chunks with the joint states.
//!
//! `-- --short` reads a million joint states with lz4 and zstd alone. The lines that begin with `figure` are read by the
//! table of releases (`tipwatch-benchmarks`, bench `by_release`).
//!
//! The Python readers (`mcap`, `rosbags`) take part if the interpreter `PYTHON` (default `python3`)
//! has them; they read only the first messages, and their rates are compared.

// What it prints is its result.
#![allow(clippy::print_stdout)]

mod cdr;
mod logs;
#[path = "../../src/formats/records/lz4.rs"]
#[allow(dead_code)]
mod lz4;
mod python;
mod readers;

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use tipwatch_allocator::Allocator;

use self::{
    logs::Content,
    readers::{BARE, BLOCKS, PEER, READERS},
};

/// Allocator of the `tipwatch` program.
#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

const ROUNDS: usize = 5;

fn main() {
    let is_short = std::env::args().any(|argument| argument == "--short");
    let mut arguments = std::env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with("--"));
    let given = arguments.next().map(PathBuf::from);
    let messages: u64 = arguments
        .next()
        .and_then(|count| count.parse().ok())
        .unwrap_or(if is_short { 1_000_000 } else { 5_000_000 });
    let part_of_name = arguments.next().unwrap_or_default();
    let part_of_reader = arguments.next().unwrap_or_default();
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder = given.unwrap_or_else(|| temporary.path().to_path_buf());
    let apart = Content::Images { are_apart: true };
    let mixed = Content::Images { are_apart: false };
    let files = [
        ("a_joints", Content::Joints, "lz4", messages),
        ("a_joints", Content::Joints, "zstd", messages),
        ("a_joints", Content::Joints, "none", messages),
        ("b_images_apart", apart, "lz4", messages / 15),
        ("b_images_apart", apart, "none", messages / 15),
        ("b_images_mixed", mixed, "lz4", messages / 15),
        ("b_images_mixed", mixed, "zstd", messages / 15),
        ("b_images_mixed", mixed, "none", messages / 15),
    ];
    for (name, content, packing, joint_states) in files {
        let name = format!("{name}_{packing}");
        let is_in_short = matches!(name.as_str(), "a_joints_lz4" | "a_joints_zstd");
        if name.contains(&part_of_name) && (is_in_short || !is_short) {
            let path = folder.join(format!("{name}.mcap"));
            logs::make(&path, content, packing, joint_states);
            measure(&name, &path, &part_of_reader);
        }
    }
}

fn measure(name: &str, path: &Path, part_of_reader: &str) {
    let payload = readers::payload_bytes(path);
    let bytes = std::fs::metadata(path).expect("the file").len();
    println!(
        "\n{name}: {:.3} GB, {:.3} GB of payload\n{:30}{:>8}{:>8}{:>7}{:>8}{:>14}{:>10}",
        bytes as f64 * 1e-9,
        payload as f64 * 1e-9,
        "",
        "best s",
        "median",
        "CPU s",
        "MB/s",
        "x the stream",
        "messages",
    );
    let mut times = [[0.0; ROUNDS]; READERS.len()];
    let mut processor = [[0.0; ROUNDS]; READERS.len()];
    let mut counts = [0; READERS.len()];
    let takes_part = |index: usize| index == PEER || READERS[index].0.contains(part_of_reader);
    for round in 0..ROUNDS {
        for (index, (_, read)) in READERS.iter().enumerate() {
            if !takes_part(index) {
                continue;
            }
            let before = processor_seconds();
            let start = Instant::now();
            counts[index] = read(path);
            times[index][round] = start.elapsed().as_secs_f64();
            processor[index][round] = processor_seconds() - before;
        }
    }
    for times in times.iter_mut().chain(&mut processor) {
        times.sort_by(f64::total_cmp);
    }
    let (best, median) = (
        |times: &[f64; ROUNDS]| times[0],
        |times: &[f64; ROUNDS]| times[ROUNDS / 2],
    );
    for (index, (name, _)) in READERS.iter().enumerate() {
        if !takes_part(index) {
            continue;
        }
        println!(
            "{name:30}{:8.3}{:8.3}{:7.2}{:8.0}{:7.2}{:7.2}{:10}",
            best(&times[index]),
            median(&times[index]),
            median(&processor[index]),
            payload as f64 * 1e-6 / best(&times[index]),
            best(&times[PEER]) / best(&times[index]),
            median(&times[PEER]) / median(&times[index]),
            counts[index],
        );
    }
    let of = |reader: &str| READERS.iter().position(|(name, _)| *name == reader);
    let packing = name.strip_prefix("a_joints_").unwrap_or("none");
    if let Some(blocks) = of(BLOCKS).filter(|&index| takes_part(index) && packing != "none") {
        let blocks_s = median(&times[blocks]);
        let stream = median(&times[PEER]) / blocks_s;
        println!("figure sensors-{packing}-vs-stream {stream:.3}");
        if let Some(bare) = of(BARE).filter(|&index| takes_part(index)) {
            let share = median(&times[bare]) / blocks_s;
            println!("figure sensors-{packing}-vs-decompressor {share:.3}");
        }
    }
    if !takes_part(READERS.len() - 1) {
        return;
    }
    let stream_rate = counts[PEER] as f64 / best(&times[PEER]);
    let columns_rate = counts[READERS.len() - 1] as f64 / best(&times[READERS.len() - 1]);
    python::measure(path, stream_rate, columns_rate);
}

/// CPU time of all threads of this process, to a hundredth of a second; zero if unavailable.
fn processor_seconds() -> f64 {
    const TICKS_PER_S: f64 = 100.0;
    let told = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The program name is in parentheses and may contain anything.
    let numbers = told.rsplit(')').next().unwrap_or_default();
    let ticks = numbers.split_whitespace().skip(11).take(2);
    ticks
        .filter_map(|field| field.parse::<f64>().ok())
        .sum::<f64>()
        / TICKS_PER_S
}
