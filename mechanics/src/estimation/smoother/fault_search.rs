//! The search for implausible spans in a whole log.
//!
//! A batch of samples is checked by itself, then compared with the lean of the platform, then in all other ways. Three
//! batches are on this way at the same time, so that threads share the work.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::pass::{Pass, Run, run_all};
use super::sorted_samples::{ByStamp, SortedSamples};
use super::source::SampleSource;
use crate::estimation::plausibility::{
    ByWheels, FaultSpan, FaultSpans, Finding, Judgement, LeanComparison, OtherComparisons,
    SignalChecks, Sound, room_for_findings,
};
use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors};

/// Samples of a batch: some milliseconds of work, beside which it costs little to wake a thread.
const BATCH: usize = 2048;

/// Finds implausible spans, checking all sensors together in stamp order. A sensor is `faulty` where one of them changes
/// how its samples are treated. `run` runs the parts of the work.
pub(super) fn find_faults<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    samples: &[SortedSamples<S>],
    faulty: &[AtomicBool],
    run: Run<'_>,
) -> Result<Vec<FaultSpan>, S::Error> {
    let mut checked = CheckedSamples {
        samples: ByStamp::new(samples.iter().collect()),
        checks: SignalChecks::new(machine, sensors),
        findings: room_for_findings(sensors),
    };
    let mut leaning = LeaningSamples {
        comparison: LeanComparison::new(machine, sensors),
        findings: room_for_findings(sensors),
    };
    let mut compared = ComparedSamples {
        comparisons: OtherComparisons::new(machine, sensors),
        spans: FaultSpans::default(),
        findings: room_for_findings(sensors),
        faulty,
    };
    let mut batches: [Batch; 3] = Default::default();
    loop {
        let [first, second, third] = &mut batches;
        let mut filled = Ok(());
        let parts: Vec<Pass<'_>> = vec![
            Box::new(|| filled = checked.fill(first)),
            Box::new(|| compared.take(third)),
            // the longest part: whoever runs the parts takes this one, and leaves the others
            Box::new(|| leaning.take(second)),
        ];
        run_all(run, parts);
        filled?;
        batches.rotate_right(1);
        if batches.iter().all(|batch| batch.samples.is_empty()) {
            return Ok(compared.spans.finish());
        }
    }
}

/// Consecutive samples that were checked by themselves.
#[derive(Default)]
struct Batch {
    samples: Vec<Checked>,
    values: Vec<f64>,
    findings: Vec<Finding>,
    /// What the comparison with the lean found beyond that, and what it tells of the wheels, by sample.
    leaning: Vec<(ByWheels, Range<usize>)>,
    findings_of_lean: Vec<Finding>,
}

impl Batch {
    fn sample(&self, checked: &Checked) -> Sample<'_> {
        Sample {
            sensor: checked.sensor,
            stamp_ns: checked.stamp_ns,
            values: &self.values[checked.values.clone()],
        }
    }
}

/// A sample of a batch.
struct Checked {
    /// Index of its sensor among the sources.
    which: usize,
    sensor: Sensor,
    stamp_ns: i64,
    values: Range<usize>,
    sound: Sound,
    findings: Range<usize>,
}

/// Samples in stamp order, and their checks by themselves.
struct CheckedSamples<'s, S> {
    samples: ByStamp<'s, S>,
    checks: SignalChecks,
    findings: Vec<Finding>,
}

impl<S: SampleSource> CheckedSamples<'_, S> {
    /// Replaces a batch by the next samples; none after the last.
    fn fill(&mut self, batch: &mut Batch) -> Result<(), S::Error> {
        batch.samples.clear();
        batch.values.clear();
        batch.findings.clear();
        while batch.samples.len() < BATCH
            && let Some((which, sample)) = self.samples.next()?
        {
            self.findings.clear();
            // A repeated or backward stamp is counted where the filter refuses it.
            let Ok(sound) = self.checks.step(&sample, &mut self.findings) else {
                continue;
            };
            let (value, finding) = (batch.values.len(), batch.findings.len());
            batch.values.extend_from_slice(sample.values);
            batch.findings.extend_from_slice(&self.findings);
            batch.samples.push(Checked {
                which,
                sensor: sample.sensor,
                stamp_ns: sample.stamp_ns,
                values: value..batch.values.len(),
                sound,
                findings: finding..batch.findings.len(),
            });
        }
        Ok(())
    }
}

/// The comparison of the samples with the lean of the platform.
struct LeaningSamples {
    comparison: LeanComparison,
    findings: Vec<Finding>,
}

impl LeaningSamples {
    fn take(&mut self, batch: &mut Batch) {
        batch.leaning.clear();
        batch.findings_of_lean.clear();
        for place in 0..batch.samples.len() {
            let checked = &batch.samples[place];
            let findings = &mut self.findings;
            findings.clear();
            findings.extend_from_slice(&batch.findings[checked.findings.clone()]);
            let known = findings.len();
            let sample = batch.sample(checked);
            let by_wheels = self.comparison.step(&sample, checked.sound, findings);
            let first = batch.findings_of_lean.len();
            (batch.findings_of_lean).extend_from_slice(&findings[known..]);
            let found = first..batch.findings_of_lean.len();
            batch.leaning.push((by_wheels, found));
        }
    }
}

/// The other comparisons of the samples with each other, and what was found so far.
struct ComparedSamples<'f> {
    comparisons: OtherComparisons,
    spans: FaultSpans,
    findings: Vec<Finding>,
    faulty: &'f [AtomicBool],
}

impl ComparedSamples<'_> {
    fn take(&mut self, batch: &Batch) {
        for (checked, (by_wheels, of_lean)) in batch.samples.iter().zip(&batch.leaning) {
            let sample = batch.sample(checked);
            let findings = &mut self.findings;
            findings.clear();
            findings.extend_from_slice(&batch.findings[checked.findings.clone()]);
            findings.extend_from_slice(&batch.findings_of_lean[of_lean.clone()]);
            (self.comparisons).step(&sample, checked.sound, *by_wheels, findings);
            self.spans.take(sample.sensor, sample.stamp_ns, findings);
            let lacks_a_value = findings.iter().any(Finding::lacks_a_value);
            if lacks_a_value || !Judgement::of(findings).is_clean() {
                self.faulty[checked.which].store(true, Ordering::Relaxed);
            }
        }
    }
}
