//! The search for implausible spans in a whole log.
//!
//! Samples are checked by themselves a batch ahead of being compared with each other, so that two threads share the work.

use std::mem;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::pass::Run;
use super::sorted_samples::{ByStamp, SortedSamples};
use super::source::SampleSource;
use crate::estimation::plausibility::{
    Comparisons, FaultSpan, FaultSpans, Finding, Judgement, SignalChecks, Sound, room_for_findings,
};
use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors};

/// Samples of a batch: some milliseconds of work, beside which it costs little to wake a thread.
const BATCH: usize = 4096;

/// Finds implausible spans, checking all sensors together in stamp order. A sensor is `faulty` where one of them changes
/// how its samples are treated. `run` runs the two halves of the work.
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
    let mut compared = ComparedSamples {
        comparisons: Comparisons::new(machine, sensors),
        spans: FaultSpans::default(),
        findings: room_for_findings(sensors),
        faulty,
    };
    let (mut batch, mut next) = (Batch::default(), Batch::default());
    checked.fill(&mut batch)?;
    while !batch.samples.is_empty() {
        let (mut filled, mut is_taken) = (None, false);
        run(vec![
            Box::new(|| filled = Some(checked.fill(&mut next))),
            Box::new(|| {
                compared.take(&batch);
                is_taken = true;
            }),
        ]);
        match filled {
            Some(filled) => filled?,
            None => checked.fill(&mut next)?,
        }
        if !is_taken {
            compared.take(&batch);
        }
        mem::swap(&mut batch, &mut next);
    }
    Ok(compared.spans.finish())
}

/// Consecutive samples that were checked by themselves.
#[derive(Default)]
struct Batch {
    samples: Vec<Checked>,
    values: Vec<f64>,
    findings: Vec<Finding>,
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

/// Comparisons of the samples with each other, and what was found so far.
struct ComparedSamples<'f> {
    comparisons: Comparisons,
    spans: FaultSpans,
    findings: Vec<Finding>,
    faulty: &'f [AtomicBool],
}

impl ComparedSamples<'_> {
    fn take(&mut self, batch: &Batch) {
        for checked in &batch.samples {
            let sample = Sample {
                sensor: checked.sensor,
                stamp_ns: checked.stamp_ns,
                values: &batch.values[checked.values.clone()],
            };
            let findings = &mut self.findings;
            findings.clear();
            findings.extend_from_slice(&batch.findings[checked.findings.clone()]);
            (self.comparisons).step(&sample, checked.sound, findings);
            self.spans.take(sample.sensor, sample.stamp_ns, findings);
            let lacks_a_value = findings.iter().any(Finding::lacks_a_value);
            if lacks_a_value || !Judgement::of(findings).is_clean() {
                self.faulty[checked.which].store(true, Ordering::Relaxed);
            }
        }
    }
}
