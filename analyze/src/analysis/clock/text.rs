//! Text about clocks: notes and the table of `inspect`.

use schemars::JsonSchema;
use tipwatch_ingest::{ClockFinding, Treatment};
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Note;

use super::super::notes::{NotedLog, Notes};
use super::offsets::{ClockOffsets, PairOffset, TopicOffset};
use crate::load::Signal;

/// Anomalies of the clocks, each once, with the topics concerned.
#[must_use]
pub(crate) fn findings<'a>(
    topics: impl Iterator<Item = (&'a str, &'a [ClockFinding])>,
) -> Vec<TopicsFinding> {
    let mut found: Vec<TopicsFinding> = Vec::new();
    for (topic, findings) in topics {
        for finding in findings {
            match found.iter_mut().find(|known| known.finding == *finding) {
                Some(known) if known.topics.iter().any(|name| name == topic) => {}
                Some(known) => known.topics.push(topic.to_owned()),
                None => found.push(TopicsFinding {
                    topics: vec![topic.to_owned()],
                    finding: finding.clone(),
                }),
            }
        }
    }
    found.sort_by_key(|found| match found.finding.treatment {
        Treatment::Refused => 0,
        Treatment::Reported => 1,
        Treatment::Handled => 2,
    });
    found
}

/// An anomaly of the clocks, and the topics concerned.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
pub struct TopicsFinding {
    /// The topics.
    pub topics: Vec<String>,
    /// The anomaly and its treatment.
    #[serde(flatten)]
    pub finding: ClockFinding,
}

impl std::fmt::Display for TopicsFinding {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}: {}", self.topics.join(", "), self.finding)
    }
}

/// The clocks of a log.
#[derive(Debug, serde::Serialize, JsonSchema)]
#[schemars(rename = "ClockSummary")]
pub struct Clocks {
    /// Anomalies of the clocks.
    pub findings: Vec<TopicsFinding>,
    /// Offsets between the clocks of topics, estimated from the physics.
    pub offsets: ClockOffsets,
}

impl Clocks {
    /// The clocks of loaded signals with these offsets.
    pub(in crate::analysis) fn new(signals: &[Signal], offsets: ClockOffsets) -> Self {
        let findings = findings(signals.iter().map(|signal| {
            let found = &signal.recording.reading.findings;
            (signal.topic.as_str(), found.as_slice())
        }));
        Self { findings, offsets }
    }
}

/// Anomalies, relevant offsets, and estimates that contradict each other.
impl Notes for Clocks {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        let findings = self.findings.iter().map(|finding| format!("{finding}."));
        let offsets = of_offsets(&self.offsets);
        findings.chain(offsets).map(Note::from).collect()
    }
}

/// Notes on relevant offsets, and on estimates that contradict each other.
fn of_offsets(offsets: &ClockOffsets) -> Vec<String> {
    let reference = offsets.reference.as_deref().unwrap_or("");
    let topics = offsets.topics.iter();
    let mut notes: Vec<String> = topics
        .filter_map(|topic| note(topic, reference, &offsets.pairs))
        .collect();
    let left_out = (offsets.pairs.iter()).filter(|pair| pair.late_s.is_some());
    for why_not in left_out.filter_map(|pair| pair.why_not.as_ref()) {
        let note = say!("Clocks: not used, {why_not}.");
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    notes
}

fn note(topic: &TopicOffset, reference: &str, pairs: &[PairOffset]) -> Option<String> {
    let stated = topic.stated_s.map(|stated_s| {
        say!(
            "{}: stamps corrected by {:+.1} ms, as stated in the machine file.",
            topic.topic,
            stated_s * 1e3
        )
    });
    if !topic.matters() {
        return stated;
    }
    let (offset_ms, sigma_ms) = (topic.offset_s? * 1e3, topic.sigma_s? * 1e3);
    let direction = if offset_ms < 0.0 {
        word!("late")
    } else {
        word!("early")
    };
    let by: Vec<&str> = (pairs.iter())
        .filter(|pair| pair.late_s.is_some() && pair.why_not.is_none())
        .filter(|pair| pair.topic == topic.topic || pair.against == topic.topic)
        .map(|pair| pair.by)
        .collect();
    let done = match topic.applied {
        true => word!("corrected, as requested").to_owned(),
        false => {
            // a text: as the machine file reads it
            let offset = format!("{:.4}", topic.offset_s? + topic.stated_s.unwrap_or(0.0));
            say!(
                "not applied; to apply it use --apply-clock-offsets estimated, or in the machine file [clock] offset = \
                 {{ \"{}\" = {offset} }}",
                topic.topic
            )
        }
    };
    Some(say!(
        "{}{}: its stamps are {:.1} ms {direction} relative to {reference} (standard deviation {sigma_ms:.1} ms), from {}; {done}.",
        stated.map_or(String::new(), |stated| format!("{stated} ")),
        topic.topic,
        offset_ms.abs(),
        by.join(word!(" and "))
    ))
}

/// Table of the offsets of topics and pairs.
#[must_use]
pub(crate) fn table(offsets: &ClockOffsets) -> String {
    let milliseconds = |seconds: f64| format!("{:+.1} ms", seconds * 1e3 + 0.0);
    let known = |offset: Option<f64>, sigma: Option<f64>, why_not: &Option<String>| match (
        offset.zip(sigma),
        why_not,
    ) {
        (Some((offset, sigma)), why_not) => format!(
            "{} (standard deviation {:.1} ms){}",
            milliseconds(offset),
            sigma * 1e3,
            if why_not.is_some() { ", not used" } else { "" }
        ),
        (None, why_not) => format!("unknown: {}", why_not.as_deref().unwrap_or("")),
    };
    let mut text = String::new();
    let reference = offsets.reference.as_deref().unwrap_or("-");
    for topic in &offsets.topics {
        let offset = known(topic.offset_s, topic.sigma_s, &topic.why_not);
        text += &match topic.topic == reference {
            true => format!("  {}: reference\n", topic.topic),
            false => format!("  {}: correction of its stamps: {offset}\n", topic.topic),
        };
    }
    for pair in &offsets.pairs {
        let late = known(pair.late_s, pair.sigma_s, &pair.why_not);
        text += &format!(
            "      delay of {} relative to {} from {}: {late}\n",
            pair.topic, pair.against, pair.by
        );
    }
    text
}
