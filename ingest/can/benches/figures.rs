//! Decoding speed on whole files, compared with python-can and cantools on the same file in the same run.
//!
//! `cargo bench -p tipwatch-can --bench figures -- [FRAMES]` makes a file of frames in every format, decodes all
//! signals of each with both, and prints the ratio of the best times. python-can and cantools come from the
//! interpreter `PYTHON` (default `python3`); it also writes the formats other than candump text. The lines that begin
//! with `figure` are read by the table of releases.

// What it prints is its result.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{
    fmt::Write as _,
    fs::{self, File},
    io::BufReader,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use tipwatch_can::{Container, Database, Decoder, Frame, FrameSource, Selection};

const ROUNDS: usize = 3;
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/python_can.py");
const FORMATS: [&str; 4] = ["log", "asc", "blf", "mf4"];

fn main() {
    let is_number = |argument: String| argument.parse().ok();
    let frames: u32 = std::env::args()
        .skip(1)
        .find_map(is_number)
        .unwrap_or(100_000);
    let folder = std::env::temp_dir().join(format!("tipwatch-can-bench-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let dbc = folder.join("bench.dbc");
    fs::write(&dbc, DBC).unwrap();
    let text = folder.join("bench.log");
    fs::write(&text, candump(frames)).unwrap();
    for format in FORMATS {
        let path = folder.join(format!("bench.{format}"));
        if !path.exists() && python(&["convert".into(), text.clone(), path.clone()]).is_none() {
            println!("{format}: skipped");
            continue;
        }
        measure(format, &path, &dbc, frames);
    }
    let _ = fs::remove_dir_all(&folder);
}

/// Four messages of eight bytes, with signals of both byte orders.
const DBC: &str = "VERSION \"\"\nNS_ :\nBS_:\nBU_: A\n\
    BO_ 288 Boom: 8 A\n SG_ Angle : 0|16@1- (0.01,0) [-180|180] \"deg\" A\n SG_ Length : 16|16@1+ (1,0) [0|65535] \"mm\" A\n \
    SG_ Pressure : 32|16@1+ (0.01,0) [0|655.35] \"bar\" A\n\
    BO_ 289 Slew: 8 A\n SG_ Angle : 7|16@0- (0.02,-10) [-700|700] \"deg\" A\n SG_ Rate : 23|16@0- (0.05,0) [-2000|2000] \"deg/s\" A\n\
    BO_ 290 Drive: 8 A\n SG_ Speed : 0|16@1- (0.001,0) [-33|33] \"m/s\" A\n SG_ Steering : 16|16@1- (0.001,0) [-33|33] \"rad\" A\n\
    BO_ 291 Load: 8 A\n SG_ Force : 0|32@1- (1,0) [0|0] \"kN\" A\n SG_ Radius : 32|32@1- (1,0) [0|0] \"m\" A\n\
    SIG_VALTYPE_ 291 Force : 1;\nSIG_VALTYPE_ 291 Radius : 1;\n";

fn candump(frames: u32) -> String {
    let mut text = String::new();
    for index in 0..frames {
        let id = 288 + index % 4;
        let mut data = (u64::from(index).wrapping_mul(0x9e37_79b9_7f4a_7c15)).to_le_bytes();
        if id == 288 {
            data[..2]
                .copy_from_slice(&((index % 36_000) as i16).wrapping_sub(18_000).to_le_bytes());
        }
        if id == 291 {
            data[..4].copy_from_slice(&(index as f32 * 1e-3).to_le_bytes());
            data[4..].copy_from_slice(&(index as f32 * 1e-4).to_le_bytes());
        }
        let bytes: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        let micros = u64::from(index) * 500;
        let (seconds, rest) = (1_700_000_000 + micros / 1_000_000, micros % 1_000_000);
        writeln!(text, "({seconds}.{rest:06}) can0 {id:03X}#{bytes}").unwrap();
    }
    text
}

fn measure(format: &str, path: &Path, dbc: &Path, frames: u32) {
    let mut best = [f64::INFINITY; 2];
    let mut counts = [(0, 0); 2];
    for _ in 0..ROUNDS {
        let start = Instant::now();
        counts[0] = decode(path, dbc);
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        let Some(peer) = python(&[path.into(), dbc.into()]) else {
            println!("{format}: no comparison");
            return;
        };
        let parts: Vec<&str> = peer.trim().split('\t').collect();
        counts[1] = (parts[0].parse().unwrap(), parts[1].parse().unwrap());
        best[1] = best[1].min(parts[2].parse().unwrap());
    }
    assert_eq!(counts[0], counts[1], "frames and signals of both");
    assert_eq!(counts[0].0, u64::from(frames));
    let [ours, peer] = best.map(|seconds| seconds * 1e9 / f64::from(frames));
    println!("{format:4} {ours:8.0} ns a frame, python-can and cantools {peer:8.0} ns");
    println!("figure can-{format}-vs-python {:.1}", best[1] / best[0]);
}

/// Frames, and signals that are numbers or not.
fn decode(path: &Path, dbc: &Path) -> (u64, u64) {
    let database = Database::parse(&fs::read(dbc).unwrap()).unwrap();
    let mut decoder = Decoder::new(database.messages.into_iter().map(Selection::of).collect());
    let mut source = Container::open(BufReader::new(File::open(path).unwrap())).unwrap();
    let mut frame = Frame::default();
    let (mut frames, mut signals) = (0, 0);
    let mut sum = 0.0;
    while source.next_frame(&mut frame).unwrap() {
        frames += 1;
        decoder.decode(&frame, &mut |_, values| {
            signals += values.len() as u64;
            sum += values.iter().sum::<f64>();
        });
    }
    std::hint::black_box(sum);
    (frames, signals)
}

fn python(arguments: &[PathBuf]) -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python).arg(SCRIPT).args(arguments).output();
    match output {
        Ok(output) if output.status.success() => {
            Some(String::from_utf8_lossy(&output.stdout).into_owned())
        }
        Ok(output) => {
            let problem = String::from_utf8_lossy(&output.stderr);
            println!(
                "Python: {}",
                problem.lines().last().unwrap_or("it tells nothing")
            );
            None
        }
        Err(error) => {
            println!("Python: {python} does not start: {error}");
            None
        }
    }
}
