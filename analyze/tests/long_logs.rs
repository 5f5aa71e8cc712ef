//! Logs whose samples do not stay in memory.

use std::io;
use std::ops::Range;

use tipwatch_analyze::base::options::Estimator;
use tipwatch_analyze::load::{LoadedLog, Signal, load, load_within};
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::estimation::{
    BlockSmoother, EstimatedStates, Pass, RowClock, SampleSource,
};
use tipwatch_mechanics::state::Sensor;

use super::support::data;

/// The bits of all samples in the order of arrival, each with sensor and stamp.
fn arrivals(loaded: &LoadedLog) -> Vec<String> {
    let mut all = Vec::new();
    let walked = loaded.for_each_arrival(|sample| {
        let bits: Vec<u64> = sample.values.iter().map(|value| value.to_bits()).collect();
        all.push(format!("{:?} {} {bits:x?}", sample.sensor, sample.stamp_ns));
    });
    walked.unwrap();
    all
}

struct Samples<'a>(&'a Signal);

impl SampleSource for Samples<'_> {
    type Error = io::Error;

    fn sensor(&self) -> Sensor {
        self.0.sensor
    }

    fn stamps_ns(&self) -> &[i64] {
        &self.0.recording.stamps_ns
    }

    fn read(&self, samples: Range<usize>, values: &mut [f64]) -> io::Result<()> {
        self.0.recording.read(samples, values)
    }
}

/// Returns the bits of all rows, and the findings about the signals.
fn smoothed(loaded: &LoadedLog) -> (Vec<u64>, String) {
    let (machine, sensors) = (&loaded.machine, &loaded.matched.sensors);
    let samples = loaded.signals.iter().map(Samples).collect();
    let clock = RowClock::JointStates;
    let one_by_one = |passes: Vec<Pass<'_>>| passes.into_iter().for_each(|pass| pass());
    let smoother = BlockSmoother::new(machine, sensors, samples, clock, 500, &one_by_one).unwrap();
    let mut worker = smoother.worker(machine);
    let mut block = EstimatedStates::empty(machine);
    let mut bits = Vec::new();
    let mut reasons = Vec::new();
    for k in 0..smoother.blocks() {
        worker.smooth(k, &mut block).unwrap();
        for column in 0..block.states.width() {
            bits.extend(block.states.column(column).map(f64::to_bits));
        }
        reasons.extend_from_slice(&block.reasons);
    }
    let counts: Vec<_> = smoother.counts().collect();
    (
        bits,
        format!("{counts:?} {:?} {reasons:?}", smoother.faults()),
    )
}

#[test]
fn samples_in_temporary_files_give_the_same_bits() {
    let path = data("tiny.mcap");
    let log = Log::open(&path).unwrap();
    let file = MachineFile::read(&path.with_extension("toml")).unwrap();
    let in_memory = load(&log, &file, Estimator::Smoother, &mut |_| {}).unwrap();
    let in_files = load_within(&log, &file, Estimator::Smoother, 0, &mut |_| {}).unwrap();
    assert_eq!(arrivals(&in_memory), arrivals(&in_files));
    assert_eq!(smoothed(&in_memory), smoothed(&in_files));
    for (a, b) in in_memory.signals.iter().zip(in_files.signals.iter()) {
        let last = a.recording.len() - 1;
        let (mut a, mut b) = (a.recording.reader(), b.recording.reader());
        // there and back, so that the reader must read anew
        for sample in [0, 1, last, 2, 1] {
            assert_eq!(a.sample(sample), b.sample(sample), "{sample}");
        }
    }
}
