//! Changes good machine files, URDFs and samples at random and feeds them to whatever reads them, for as
//! long as is asked for.
//!
//! `cargo run --release -p tipwatch-mechanics --example fuzz_machine -- [SECONDS for each] [SEED]`
//!
//! It runs with the stable compiler and is not guided by coverage; instead it knows the formats: it
//! plants numbers that are absurd, exchanges names, and cuts, repeats and moves lines. A machine that
//! passes all checks is evaluated, too. A panic and an input that takes longer than ten seconds are
//! findings; the input is kept.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "what it prints is its result"
)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use tipwatch_mechanics::estimation::plausibility::{FaultSpans, Plausibility};
use tipwatch_mechanics::estimation::{CausalEstimator, RowClock, SensorSamples, smooth};
use tipwatch_mechanics::machine::{LogFacts, Machine};
use tipwatch_mechanics::state::{MatchedSensors, OtherSensors, Sample, Sensor, Sensors};
use tipwatch_mechanics::{
    ClosedForm, MachineSpec, Scope, State, Workspace, closed_form, evaluate, static_outcome,
};

/// The samples of one sensor.
struct Recording {
    sensor: Sensor,
    stamps_ns: Vec<i64>,
    values: Vec<f64>,
}

impl Recording {
    fn samples(&self) -> SensorSamples<'_> {
        SensorSamples {
            sensor: self.sensor,
            stamps_ns: &self.stamps_ns,
            values: &self.values,
        }
    }
}

const SLOWEST: Duration = Duration::from_secs(10);

const MACHINES: [[&str; 2]; 4] = [
    [
        include_str!("../tests/data/rigid.toml"),
        include_str!("../tests/data/rigid.urdf"),
    ],
    [
        include_str!("../tests/data/bogie.toml"),
        include_str!("../tests/data/bogie.urdf"),
    ],
    [
        include_str!("../tests/data/six_wheels.toml"),
        include_str!("../tests/data/six_wheels.urdf"),
    ],
    [
        include_str!("../tests/data/petrovic_mattila.toml"),
        include_str!("../tests/data/petrovic_mattila.urdf"),
    ],
];

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

/// Words that are wrong in an interesting way.
const WORDS: [&str; 24] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "1e-320",
    "1e-160",
    "1e154",
    "1e308",
    "-1e308",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "99999999999999999999",
    "0x7f",
    "1e",
    "\"estimate\"",
    "[]",
    "{}",
    "true",
    "é",
    "&#x0;",
    "",
];

/// Keys that the good machine files do not have.
const MORE: [&str; 12] = [
    "[plausibility]\npolicy = \"widen\"\nfrozen_samples = 2\n",
    "[plausibility]\nspecific_force_max = 1e-300\nrange = \"report\"\n",
    "[[payload]]\nlink = \"tool\"\nmass = 1e300\n",
    "[[payload]]\nlink = \"base_link\"\nmass = \"estimate\"\nfrom = 3\nto = 1\n",
    "[uncertainty]\nmass_share = 1e200\n",
    "[estimator]\nmax_gap = 1e300\njoint_agility = 1e-300\n",
    "[estimator]\nmax_gap = 1e-300\nsettle = 1e300\n",
    "[suspension]\nlinkages = [\"lift\"]\nstroke = [0, 1]\nmax_velocity = 1\nmax_acceleration = 1\n",
    "[imu]\nlink = \"tool\"\nxyz = [1e300, 0, 0]\nrpy = [1e300, 1, 1]\n",
    "[limits]\nmin_load_share = 1e300\n",
    "[contact]\nground = \"plane\"\ntyre_stiffness = 1e-300\n",
    "[wheels.X]\nlink = \"base_link\"\nradius = 1\n",
];

fn change(text: &str, random: &mut Random) -> String {
    let mut text = text.to_string();
    for _ in 0..1 + random.below(4) {
        text = match random.below(9) {
            0 => changed_bytes(text, random),
            1 | 2 => exchanged_line(&text, random),
            3 => exchanged_name(&text, random),
            4 if random.below(4) == 0 => {
                format!("{text}\n{}", MORE[random.below(MORE.len())])
            }
            _ => planted_word(&text, random),
        };
    }
    text
}

fn changed_bytes(text: String, random: &mut Random) -> String {
    let mut bytes = text.into_bytes();
    if bytes.is_empty() {
        return String::new();
    }
    let at = random.below(bytes.len());
    match random.below(4) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => bytes.truncate(at),
        _ => {
            let end = (at + random.below(200)).min(bytes.len());
            bytes.drain(at..end);
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A line left out, doubled or moved.
fn exchanged_line(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.is_empty() {
        return String::new();
    }
    let from = random.below(lines.len());
    let line = lines[from];
    if random.below(2) == 0 {
        lines.remove(from);
    }
    if random.below(2) == 0 {
        for _ in 0..1 + random.below(3) {
            lines.insert(random.below(lines.len() + 1), line);
        }
    }
    lines.join("\n")
}

/// A quoted name in the place of another.
fn exchanged_name(text: &str, random: &mut Random) -> String {
    let quotes: Vec<usize> = text
        .char_indices()
        .filter(|(_, c)| matches!(c, '"' | '\''))
        .map(|(at, _)| at)
        .collect();
    if quotes.len() < 4 {
        return text.to_string();
    }
    let pair = |k: usize| quotes[2 * k] + 1..quotes[2 * k + 1];
    let (from, to) = (
        pair(random.below(quotes.len() / 2)),
        pair(random.below(quotes.len() / 2)),
    );
    format!("{}{}{}", &text[..to.start], &text[from], &text[to.end..])
}

/// A number in the place of another.
fn planted_word(text: &str, random: &mut Random) -> String {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e');
    let starts: Vec<usize> = text
        .char_indices()
        .filter(|&(at, c)| c.is_ascii_digit() && !text[..at].ends_with(is_number))
        .map(|(at, _)| at)
        .collect();
    if starts.is_empty() {
        return text.to_string();
    }
    let start = starts[random.below(starts.len())];
    let length = text[start..].find(|c| !is_number(c));
    let end = length.map_or(text.len(), |length| start + length);
    let word = WORDS[random.below(WORDS.len())];
    format!("{}{word}{}", &text[..start], &text[end..])
}

/// What is done with a machine: everything that a program does.
fn use_machine(machine: &Machine, random: &mut Random) {
    let joints = machine.joints().len();
    let posture: Vec<f64> = (0..joints).map(|_| number(random)).collect();
    let mut machine = machine.clone();
    let _ = static_outcome(&machine, &posture);
    machine.refer_to_posture(&posture);
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let mut state = State::<f64>::zero(&machine);
    for (joint, position) in state.joints.iter_mut().zip(&posture) {
        joint.position = *position;
        joint.rate = number(random);
        joint.acceleration = number(random);
    }
    state.imu.specific_force.z = machine.gravity();
    evaluate(&machine, &state, &mut workspace);
    let input = closed_form::ClosedFormInput::Velocity;
    let _ = ClosedForm::new(&machine, &posture, input);
    for linkage in 0..machine.linkages().len() {
        let _ = tipwatch_mechanics::actuator_force(&machine, &state, &workspace, linkage);
    }
}

fn number(random: &mut Random) -> f64 {
    match random.below(12) {
        0 => WORDS[random.below(13)].parse().unwrap_or(f64::NAN),
        1 => f64::from_bits(random.next()),
        _ => random.next() as f64 / u64::MAX as f64 * 4.0 - 2.0,
    }
}

/// Reads a machine file and a URDF as the program does, for logs of all and of some joints.
fn read_machine(toml: &str, urdf: &str, random: &mut Random) {
    let Ok(spec) = MachineSpec::from_toml(toml, "fuzzed.toml") else {
        return;
    };
    let Ok(machine) = spec.check(urdf, "fuzzed.urdf", LogFacts::default()) else {
        return;
    };
    use_machine(&machine, random);
    let mut names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    names.retain(|_| random.below(8) > 0);
    let facts = LogFacts {
        joint_names: Some(&names),
        lacks_imu: random.below(2) == 0,
        ..LogFacts::default()
    };
    if let Ok(machine) = spec.check(urdf, "fuzzed.urdf", facts) {
        use_machine(&machine, random);
    }
}

/// Samples of any value at any time through the checks and both estimators.
fn read_samples(random: &mut Random) {
    let [toml, urdf] = MACHINES[random.below(MACHINES.len())];
    let toml = match random.below(3) {
        0 => format!("{toml}\n[plausibility]\npolicy = \"widen\"\nfrozen_samples = 3\n"),
        1 => format!("{toml}\n[plausibility]\npolicy = \"report\"\n"),
        _ => toml.to_string(),
    };
    let spec = MachineSpec::from_toml(&toml, "good.toml").unwrap();
    let machine = spec.check(urdf, "good.urdf", LogFacts::default()).unwrap();
    let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    let others = OtherSensors {
        imu: random.below(3) > 0,
        odometry: random.below(2) == 0,
        tool_wrench: random.below(2) == 0,
    };
    let sensors = MatchedSensors::new(&machine, &[("all", &names)], others)
        .unwrap()
        .sensors;
    let mut recordings: Vec<Recording> = sensors
        .iter()
        .map(|sensor| Recording {
            sensor,
            stamps_ns: Vec::new(),
            values: Vec::new(),
        })
        .collect();
    let mut estimator = CausalEstimator::new(&machine, &sensors, row_clock(random));
    let mut workspace = Workspace::<f64>::new(&machine);
    let mut stamp_ns = 0_i64;
    for _ in 0..random.below(400) {
        stamp_ns = match random.below(40) {
            0 => random.next() as i64,
            1 => stamp_ns,
            2 => stamp_ns.wrapping_sub(7_000_000),
            _ => stamp_ns.wrapping_add(3_000_000),
        };
        let recording = &mut recordings[random.below(sensors.iter().count())];
        let width = sensors.value_count(recording.sensor).unwrap();
        let values: Vec<f64> = match recording.values.len() {
            // the same again, for what is frozen
            length @ 1.. if random.below(3) == 0 => recording.values[length - width..].to_vec(),
            _ => (0..width).map(|_| number(random)).collect(),
        };
        let sample = Sample {
            sensor: recording.sensor,
            stamp_ns,
            values: &values,
        };
        let _ = estimator.push(&machine, &sample, &mut |row| {
            evaluate(&machine, &row.state, &mut workspace);
        });
        recording.stamps_ns.push(stamp_ns);
        recording.values.extend(values);
    }
    check_all(&machine, &sensors, &recordings);
    let samples: Vec<_> = recordings.iter().map(Recording::samples).collect();
    let _ = smooth(&machine, &sensors, &samples, RowClock::JointStates);
}

fn row_clock(random: &mut Random) -> RowClock {
    match random.below(2) {
        0 => RowClock::JointStates,
        _ => RowClock::Rate(50.0),
    }
}

fn check_all(machine: &Machine, sensors: &Sensors, recordings: &[Recording]) {
    let mut plausibility = Plausibility::new(machine, sensors);
    let mut spans = FaultSpans::default();
    for recording in recordings {
        let width = sensors.value_count(recording.sensor).unwrap();
        for (values, &stamp_ns) in recording.values.chunks(width).zip(&recording.stamps_ns) {
            let sample = Sample {
                sensor: recording.sensor,
                stamp_ns,
                values,
            };
            if plausibility.step(&sample).is_ok() {
                spans.take(recording.sensor, stamp_ns, plausibility.findings());
            }
        }
    }
    for span in spans.finish() {
        let Sensor::Joints(_) = span.worst.sensor else {
            continue;
        };
        let _ = span.worst.part.subject(span.worst.sensor, machine);
    }
}

/// Changes something, feeds it, and leaves what it fed for a finding.
type Feed = fn(&mut Random, &mut String);

const FEEDS: [(&str, Feed); 4] = [
    ("machine files", |random, fed| {
        let [toml, urdf] = MACHINES[random.below(MACHINES.len())];
        *fed = change(toml, random);
        read_machine(fed, urdf, random);
    }),
    ("URDFs", |random, fed| {
        let [toml, urdf] = MACHINES[random.below(MACHINES.len())];
        *fed = change(urdf, random);
        read_machine(toml, fed, random);
    }),
    ("machine files with URDFs", |random, fed| {
        let toml = change(MACHINES[random.below(MACHINES.len())][0], random);
        let urdf = change(MACHINES[random.below(MACHINES.len())][1], random);
        *fed = format!("{toml}\n\n=====\n\n{urdf}");
        read_machine(&toml, &urdf, random);
    }),
    ("samples", |random, fed| {
        *fed = format!("state of the generator: {:#x}", random.0);
        read_samples(random);
    }),
];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| {
        arguments
            .next()
            .and_then(|text| text.parse().ok())
            .unwrap_or(default)
    };
    let (seconds, seed) = (number(10), number(1));
    let mut findings = 0;
    for (name, feed) in FEEDS {
        let mut random = Random(seed);
        let begin = Instant::now();
        let (mut inputs, mut slowest, mut fed) = (0_u64, Duration::ZERO, String::new());
        while begin.elapsed().as_secs() < seconds {
            let start = Instant::now();
            let attempt = catch_unwind(AssertUnwindSafe(|| feed(&mut random, &mut fed)));
            let took = start.elapsed();
            slowest = slowest.max(took);
            inputs += 1;
            if attempt.is_err() || took > SLOWEST {
                findings += 1;
                let kept = std::env::temp_dir().join(format!("tipwatch-machine-{findings}"));
                std::fs::write(&kept, &fed).unwrap();
                println!("{name}: took {took:?}: {}", kept.display());
            }
        }
        println!(
            "{name}: {inputs} inputs in {seconds} s, slowest {:.1} ms",
            slowest.as_secs_f64() * 1e3
        );
    }
    println!("{findings} findings");
    std::process::exit(i32::from(findings > 0));
}
