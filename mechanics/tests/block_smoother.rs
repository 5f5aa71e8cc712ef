//! Blocks smoothed independently are the whole recording smoothed at once.

use std::ops::Range;
use std::sync::Mutex;

use crate::support;
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_assert_eq, prop_oneof, proptest};
use tipwatch_mechanics::estimation::plausibility::{FaultSpan, FaultSpans, Plausibility};
use tipwatch_mechanics::estimation::{
    BlockSmoother, EstimatedStates, Pass, RowClock, SampleSource, SensorSamples,
};
use tipwatch_mechanics::state::{MatchedSensors, OtherSensors, Sample, Sensor, Sensors};
use tipwatch_mechanics::{Machine, StateColumns};

/// Longest gap of the filters, as the machine file has it by default (s).
const MAX_GAP_S: f64 = 0.25;

/// Difference that rounding may make. An acceleration takes the rounding of positions, 1e-16, some 6 / dt^2 times: 3e4
/// at the 14 ms between the closest samples of the joints.
const ROUNDING: f64 = 1e-11;

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

/// Faults of a recording.
#[derive(Debug, Clone, Copy)]
struct Disorder {
    seed: u64,
    /// Share of samples that are missing, not finite, far off, repeated, or late in the file.
    missing: f64,
    not_finite: f64,
    far_off: f64,
    repeated: f64,
    swapped: f64,
    /// Share of the recording after which a sensor other than the joints sends only NaN.
    dies_at: f64,
    imu: bool,
    odometry: bool,
}

/// Numbers between 0 and 1, the same for each seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(0x5851_f42d_4c95_7f2d)
            .wrapping_add(0x1405_7b7e_f767_814f);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn noise(&mut self, sigma: f64) -> f64 {
        sigma * (self.next() + self.next() + self.next() + self.next() - 2.0) * 3.0_f64.sqrt()
    }
}

fn sensors(machine: &Machine, case: &Disorder) -> Sensors {
    let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    let (arm, rest) = names.split_at(2);
    let others = OtherSensors {
        imu: case.imu,
        odometry: case.odometry,
        tool_wrench: true,
    };
    MatchedSensors::new(machine, &[("arm", arm), ("rest", rest)], others)
        .unwrap()
        .sensors
}

/// Eight seconds of motion.
fn recordings(sensors: &Sensors, case: &Disorder) -> Vec<Recording> {
    recordings_of(sensors, case, 8.0)
}

/// Returns the recordings of so many seconds of motion.
fn recordings_of(sensors: &Sensors, case: &Disorder, seconds: f64) -> Vec<Recording> {
    let mut numbers = Numbers(case.seed);
    let sensors = sensors.iter().map(|sensor| {
        let width = sensors.value_count(sensor).unwrap();
        let rate_hz = match sensor {
            Sensor::Joints(0) => 50.0,
            Sensor::Imu => 100.0,
            _ => 25.0,
        };
        let mut recording = Recording {
            sensor,
            stamps_ns: Vec::new(),
            values: Vec::new(),
        };
        let count = (seconds * rate_hz) as usize;
        let mut k = 0;
        while k < count {
            let t = (k as f64 + 0.3 * numbers.next()) / rate_hz;
            k += 1;
            if numbers.next() < case.missing {
                // Some gaps are longer than the filters bridge.
                k += (2.0 * MAX_GAP_S * rate_hz * numbers.next()) as usize;
                continue;
            }
            let values: Vec<f64> = match sensor {
                Sensor::Imu | Sensor::Odometry => {
                    let tilt = 0.05 * (0.3 * t).sin() + numbers.noise(1e-3);
                    let half = 0.5 * tilt;
                    let up = if sensor == Sensor::Imu { 9.8 } else { 0.5 };
                    let vector = [up * tilt.sin(), 0.1 * (0.7 * t).sin(), up * tilt.cos()];
                    let noisy = vector.map(|v| v + numbers.noise(0.02));
                    let turning = [0.015 * (0.3 * t).cos(), 0.0, 0.1 * (0.2 * t).sin()];
                    let turning = turning.map(|w| w + numbers.noise(1e-3));
                    let orientation = [0.0, half.sin(), 0.0, half.cos()];
                    noisy
                        .into_iter()
                        .chain(turning)
                        .chain(orientation)
                        .collect()
                }
                Sensor::Joints(_) => {
                    let joint = |i: usize| (0.2 * (i + 1) as f64, i as f64);
                    let positions = (0..width / 2).map(joint);
                    let positions = positions.map(|(w, phase)| 0.3 * (w * t + phase).sin());
                    let rates = (0..width / 2).map(joint);
                    let rates = rates.map(|(w, phase)| 0.3 * w * (w * t + phase).cos());
                    let values: Vec<f64> = positions.chain(rates).collect();
                    values
                        .into_iter()
                        .map(|v| v + numbers.noise(1e-3))
                        .collect()
                }
                _ => (0..width)
                    .map(|i| 10.0 * i as f64 + numbers.noise(5.0))
                    .collect(),
            };
            let is_dead = k as f64 > case.dies_at * count as f64;
            let mut spoiled = values.clone();
            if numbers.next() < case.not_finite || is_dead && !matches!(sensor, Sensor::Joints(_)) {
                spoiled[0] = f64::NAN;
            }
            if numbers.next() < case.far_off {
                spoiled[width / 2] += 40.0 * numbers.noise(1.0);
            }
            recording
                .stamps_ns
                .push(1_700_000_000_000_000_000 + (t * 1e9) as i64);
            recording.values.extend(spoiled);
            if numbers.next() < case.repeated {
                recording
                    .stamps_ns
                    .extend(recording.stamps_ns.last().copied());
                recording.values.extend(values);
            }
        }
        for k in 1..recording.stamps_ns.len() {
            if numbers.next() < case.swapped {
                recording.stamps_ns.swap(k - 1, k);
                for i in 0..width {
                    recording.values.swap((k - 1) * width + i, k * width + i);
                }
            }
        }
        recording
    });
    sensors.collect()
}

/// Passes on a thread each.
fn on_threads(passes: Vec<Pass<'_>>) {
    std::thread::scope(|scope| {
        for pass in passes {
            scope.spawn(pass);
        }
    });
}

/// Passes one after another.
fn one_by_one(passes: Vec<Pass<'_>>) {
    passes.into_iter().for_each(|pass| pass());
}

/// Implausible spans, found by one check of all sensors in stamp order.
fn faults_one_by_one(
    machine: &Machine,
    sensors: &Sensors,
    recordings: &[Recording],
) -> Vec<FaultSpan> {
    let mut order: Vec<(i64, usize, usize)> = Vec::new();
    for (which, recording) in recordings.iter().enumerate() {
        let stamps = recording.stamps_ns.iter().enumerate();
        order.extend(stamps.map(|(k, &stamp_ns)| (stamp_ns, which, k)));
    }
    order.sort_unstable();
    let mut checks = Plausibility::new(machine, sensors);
    let mut spans = FaultSpans::default();
    for (stamp_ns, which, k) in order {
        let Recording { sensor, values, .. } = &recordings[which];
        let width = sensors.value_count(*sensor).unwrap();
        let sample = Sample::new(*sensor, stamp_ns, &values[k * width..(k + 1) * width]);
        if checks.step(&sample).is_ok() {
            spans.take(*sensor, stamp_ns, checks.findings());
        }
    }
    spans.finish()
}

/// All rows, smoothed in blocks by two threads, the last block first.
fn in_blocks<S: SampleSource<Error: std::fmt::Debug>>(
    machine: &Machine,
    smoother: &BlockSmoother<S>,
) -> EstimatedStates {
    let waiting = Mutex::new((0..smoother.blocks()).collect::<Vec<_>>());
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let mut worker = smoother.worker(machine);
                let mut block = EstimatedStates::empty(machine);
                while let Some(k) = { waiting.lock().unwrap().pop() } {
                    worker.smooth(k, &mut block).unwrap();
                    assert_eq!(block.reasons.len(), smoother.rows(k).len());
                    done.lock().unwrap().push((k, block.clone()));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap();
    done.sort_by_key(|(k, _)| *k);
    let mut all = EstimatedStates::empty(machine);
    for (_, block) in done {
        all.append(&block);
    }
    all
}

/// The numbers of all rows, column by column.
fn columns(states: &StateColumns) -> Vec<Vec<f64>> {
    let columns = (0..states.width()).map(|column| states.column(column).collect());
    columns.collect()
}

fn disorder() -> impl Strategy<Value = Disorder> {
    let share = || prop_oneof![Just(0.0), 0.0..0.02_f64];
    let shares = (share(), share(), share(), share(), share());
    (
        any::<u64>(),
        shares,
        0.3..2.0_f64,
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(
            |(seed, (missing, not_finite, far_off, repeated, swapped), dies_at, imu, odometry)| {
                Disorder {
                    seed,
                    missing,
                    not_finite,
                    far_off,
                    repeated,
                    swapped,
                    dies_at,
                    imu,
                    odometry,
                }
            },
        )
}

/// A source of which only the first samples can be read.
struct Broken<'a> {
    samples: SensorSamples<'a>,
    readable: usize,
}

#[derive(Debug, PartialEq)]
struct Unreadable(Range<usize>);

impl SampleSource for Broken<'_> {
    type Error = Unreadable;

    fn sensor(&self) -> Sensor {
        self.samples.sensor
    }

    fn stamps_ns(&self) -> &[i64] {
        self.samples.stamps_ns
    }

    fn read(&self, samples: Range<usize>, values: &mut [f64]) -> Result<(), Unreadable> {
        if samples.end > self.readable {
            return Err(Unreadable(samples));
        }
        let Ok(()) = self.samples.read(samples, values);
        Ok(())
    }
}

#[test]
fn samples_that_cannot_be_read_are_an_error() {
    let machine = support::machine("rigid");
    let case = Disorder {
        seed: 1,
        missing: 0.0,
        not_finite: 0.0,
        far_off: 0.0,
        repeated: 0.0,
        swapped: 0.0,
        dies_at: 2.0,
        imu: true,
        odometry: true,
    };
    let sensors = sensors(&machine, &case);
    let recordings = recordings(&sensors, &case);
    let sources = |readable: usize| {
        let sources = recordings.iter().map(|recording| Broken {
            samples: recording.samples(),
            readable,
        });
        let clock = RowClock::JointStates;
        let sources = sources.collect();
        BlockSmoother::new(&machine, &sensors, sources, clock, 100, &on_threads)
    };
    assert_eq!(sources(usize::MAX).unwrap().blocks(), 4);
    let Err(Unreadable(samples)) = sources(300) else {
        panic!("expected an error");
    };
    assert!(samples.contains(&300), "{samples:?}");
}

#[test]
fn faults_of_a_long_recording_are_those_found_sample_by_sample() {
    let machine = support::machine("rigid");
    for seed in 1..4 {
        let case = Disorder {
            seed,
            missing: 0.01,
            not_finite: 0.003,
            far_off: 0.003,
            repeated: 0.01,
            swapped: 0.01,
            dies_at: 0.9,
            imu: true,
            odometry: true,
        };
        let sensors = sensors(&machine, &case);
        let recordings = recordings_of(&sensors, &case, 60.0);
        let faults = faults_one_by_one(&machine, &sensors, &recordings);
        assert!(faults.len() > 20, "{}", faults.len());
        for run in [&one_by_one as &(dyn Fn(Vec<Pass<'_>>) + Sync), &on_threads] {
            let sources = recordings.iter().map(Recording::samples).collect();
            let clock = RowClock::JointStates;
            let Ok(smoother) = BlockSmoother::new(&machine, &sensors, sources, clock, 100, run);
            // Faults hold NaN where there is no limit.
            assert_eq!(format!("{:?}", smoother.faults()), format!("{faults:?}"));
        }
    }
}

proptest! {
    #![proptest_config(support::cases(16))]

    #[test]
    fn blocks_of_any_size_equal_one_block(
        case in disorder(),
        rows_per_block in prop_oneof![3..9_usize, 10..150_usize],
        rate in prop_oneof![Just(None), (20.0..130.0_f64).prop_map(Some)],
    ) {
        let machine = support::machine("rigid");
        let sensors = sensors(&machine, &case);
        let recordings = recordings(&sensors, &case);
        let samples: Vec<_> = recordings.iter().map(Recording::samples).collect();
        let clock = rate.map_or(RowClock::JointStates, RowClock::Rate);
        let smoother = |rows_per_block: usize, run: &(dyn Fn(Vec<Pass<'_>>) + Sync)| {
            let sources = samples.clone();
            let Ok(smoother) =
                BlockSmoother::new(&machine, &sensors, sources, clock, rows_per_block, run);
            smoother
        };
        let whole = smoother(usize::MAX, &one_by_one);
        let blocks = smoother(rows_per_block, &on_threads);
        prop_assert_eq!(whole.blocks(), 1);
        prop_assert!(whole.counts().eq(blocks.counts()));
        // Faults hold NaN where there is no limit.
        prop_assert_eq!(format!("{:?}", whole.faults()), format!("{:?}", blocks.faults()));
        prop_assert_eq!(whole.row_times_ns(), blocks.row_times_ns());
        let (whole, blocks) = (in_blocks(&machine, &whole), in_blocks(&machine, &blocks));
        prop_assert_eq!(&whole.reasons, &blocks.reasons);
        let states = [&whole, &blocks].map(|rows| columns(&rows.states));
        for (column, (a, b)) in states[0].iter().zip(&states[1]).enumerate() {
            for (row, (a, b)) in a.iter().zip(b).enumerate() {
                let same = a == b || a.is_nan() && b.is_nan();
                prop_assert!(
                    same || (a - b).abs() <= ROUNDING * (1.0 + a.abs()),
                    "row {row}, column {column}: {a} {b}"
                );
            }
        }
    }
}
