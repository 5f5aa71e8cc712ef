//! Logs whose samples do not stay in memory.

use tipwatch_analyze::load::{LoadedLog, load, load_within, smooth};
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::State;
use tipwatch_mechanics::estimation::RowClock;

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

/// The bits of all rows, and what was found out about the signals.
fn smoothed(loaded: &LoadedLog) -> (Vec<Vec<u64>>, String) {
    let rows = smooth(loaded, RowClock::JointStates).unwrap();
    let columns = 0..State::<f64>::size(&loaded.machine);
    let columns = columns.map(|column| {
        let mut values = Vec::new();
        rows.states.column_values(column, &mut values);
        values.into_iter().map(f64::to_bits).collect()
    });
    let (counts, faults, reasons) = (rows.counts, rows.faults, rows.reasons);
    (
        columns.collect(),
        format!("{counts:?} {faults:?} {reasons:?}"),
    )
}

#[test]
fn samples_in_temporary_files_give_the_same_bits() {
    let path = data("tiny.mcap");
    let log = Log::open(&path).unwrap();
    let file = MachineFile::read(&path.with_extension("toml")).unwrap();
    let in_memory = load(&log, &file, &mut |_| {}).unwrap();
    let in_files = load_within(&log, &file, 0, &mut |_| {}).unwrap();
    assert_eq!(arrivals(&in_memory), arrivals(&in_files));
    assert_eq!(smoothed(&in_memory), smoothed(&in_files));
    for (a, b) in in_memory.signals.iter().zip(in_files.signals.iter()) {
        let (mut a, mut b) = (a.recording.reader(), b.recording.reader());
        // there and back, so that the reader must read anew
        for sample in [0, 1, 1500, 2, 1] {
            assert_eq!(a.sample(sample), b.sample(sample), "{sample}");
        }
    }
}
