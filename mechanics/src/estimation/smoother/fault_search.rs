//! The search for implausible spans in a whole log.
//!
//! A batch of samples is checked by itself, then its sensors are compared with each other. Two batches are on this way at
//! the same time, so that threads share the work.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::pass::{Run, by_turns};
use super::sorted_samples::{ByStamp, SortedSamples};
use super::source::SampleSource;
use crate::estimation::plausibility::{
    FaultSpan, FaultSpans, Finding, Judgement, Relations, SignalChecks, Sound, room_for_findings,
};
use crate::machine::{Machine, SessionProofs};
use crate::state::{Sample, Sensor, Sensors};

/// Samples of a batch: some milliseconds of work, beside which it costs little to wake a thread.
const BATCH: usize = 2048;

/// Result of the search for faults.
#[derive(Debug)]
pub(super) struct Searched {
    /// Implausible spans, sorted by start.
    pub(super) faults: Vec<FaultSpan>,
    /// Proofs and doubts about the sensors by the whole log.
    pub(super) shown: SessionProofs,
    /// The probability that each joint of the arm has the other sign.
    pub(super) reversed: Vec<(usize, f64)>,
}

/// Finds implausible spans, checking all sensors together in stamp order. A sensor is `faulty` where one of them changes
/// how its samples are treated. `run` runs the parts of the work.
pub(super) fn find_faults<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    samples: &[SortedSamples<S>],
    faulty: &[AtomicBool],
    run: Run<'_>,
) -> Result<Searched, S::Error> {
    let mut checked = CheckedSamples {
        samples: ByStamp::new(samples.iter().collect()),
        checks: SignalChecks::in_retrospect(machine, sensors),
        findings: room_for_findings(sensors),
    };
    let mut compared = ComparedSamples {
        relations: Relations::new(machine, sensors),
        spans: FaultSpans::default(),
        findings: room_for_findings(sensors),
        faulty,
    };
    by_turns(
        run,
        |batch: &mut Batch| checked.fill(batch),
        |batch| compared.take(batch),
        |batches| batches.iter().all(|batch| batch.samples.is_empty()),
    )?;
    Ok(Searched {
        shown: SessionProofs {
            proven: compared.relations.proven(),
            disputed: (compared.relations.disputed()).with(checked.checks.turned_housing()),
            unchanged: checked.checks.unchanged(&|_| false),
            at_zero: checked.checks.at_zero(),
        },
        reversed: compared.relations.reversed(),
        faults: compared.spans.finish(),
    })
}

/// Consecutive samples that were checked by themselves.
#[derive(Default)]
struct Batch {
    samples: Vec<Checked>,
    values: Vec<f64>,
    findings: Vec<Finding>,
}

impl Batch {
    fn sample(&self, checked: &Checked) -> Sample<'_> {
        Sample::new(
            checked.sensor,
            checked.stamp_ns,
            &self.values[checked.values.clone()],
        )
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
            let Ok(sound) = self.checks.step(&sample, &[], &mut self.findings) else {
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

/// The relations between the samples of all sensors, and the faults found so far.
struct ComparedSamples<'f> {
    relations: Relations,
    spans: FaultSpans,
    findings: Vec<Finding>,
    faulty: &'f [AtomicBool],
}

impl ComparedSamples<'_> {
    fn take(&mut self, batch: &Batch) {
        for checked in &batch.samples {
            let sample = batch.sample(checked);
            let findings = &mut self.findings;
            findings.clear();
            findings.extend_from_slice(&batch.findings[checked.findings.clone()]);
            (self.relations).step(&sample, checked.sound, true, findings);
            self.spans.take(sample.sensor, sample.stamp_ns, findings);
            let lacks_a_value = findings.iter().any(Finding::lacks_a_value);
            if lacks_a_value || !Judgement::of(findings).is_clean() {
                self.faulty[checked.which].store(true, Ordering::Relaxed);
            }
        }
    }
}
