//! Clips of the log around its events: `clips/NNNN_KIND.mcap`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::Result;
use tipwatch_ingest::{ClipRequest, Log, MetadataRecord, write_clips};

use crate::analysis::Analysis;
use crate::base::clip::{Clip, ClipEvent, END_KEY, ORIGIN, START_KEY};
use crate::base::file_hash::{FileHash, hash_file};
use crate::base::files::make_folder;
use crate::events::{Event, EventKind};

/// Folder of the clips, in the output folder.
pub(crate) const CLIPS: &str = "clips";

/// Options for cutting clips.
#[derive(Debug, Clone, PartialEq)]
pub struct ClipOptions {
    /// Time before the start of an event (s).
    pub before_s: f64,
    /// Time after the end of an event (s).
    pub after_s: f64,
    /// The kinds of events; empty for every kind that rows show.
    pub kinds: Vec<EventKind>,
}

impl ClipOptions {
    fn wants(&self, event: &Event) -> bool {
        match self.kinds.as_slice() {
            [] => event.kind.is_observed(),
            kinds => kinds.contains(&event.kind),
        }
    }
}

/// A span of the log with its events, by the times of the log (ns).
#[derive(Debug, Clone, PartialEq)]
struct Span<'a> {
    start_ns: i64,
    end_ns: i64,
    events: Vec<&'a Event>,
}

/// Cuts a clip around each group of events out of the log, and notes them in the analysis. The clips of an earlier
/// analysis in the same folder are removed.
///
/// # Errors
/// The log cannot be read again, or a clip cannot be written.
pub fn cut(
    analysis: &mut Analysis,
    log: &Path,
    folder: &Path,
    options: &ClipOptions,
) -> Result<()> {
    let clips = folder.join(CLIPS);
    remove_earlier(&clips);
    let spans = spans(analysis, options);
    if spans.is_empty() {
        analysis.clips = Some(Vec::new());
        return Ok(());
    }
    make_folder(&clips)?;
    let requests: Vec<ClipRequest> = (spans.iter().enumerate())
        .map(|(index, span)| ClipRequest {
            path: clips.join(name(index, span)),
            start_ns: span.start_ns,
            end_ns: span.end_ns,
            origin: origin(analysis, span),
        })
        .collect();
    let (reports, _) = write_clips(&Log::open(log)?, &requests)?;
    let written = spans.iter().zip(requests).zip(reports);
    let written = written.map(|((span, request), report)| {
        let file = hash_file(&request.path)?;
        let path = relative(&request.path);
        Ok(Clip {
            file: FileHash { path, ..file },
            start_log_ns: span.start_ns,
            end_log_ns: span.end_ns,
            events: span.events.iter().map(|event| clip_event(event)).collect(),
            messages: report.messages,
            carried: report.carried,
            left_out: report.left_out,
        })
    });
    let written: Vec<Clip> = written.collect::<Result<_>>()?;
    analysis.clips = Some(written);
    Ok(())
}

fn spans<'a>(analysis: &'a Analysis, options: &ClipOptions) -> Vec<Span<'a>> {
    let log_ns = |time_ns| analysis.log_times.log_ns(time_ns);
    let last_ns = analysis.rows.times_ns.last().copied().unwrap_or(0);
    let wanted = analysis.events.iter().filter(|event| options.wants(event));
    let spans = wanted.map(|event| Span {
        start_ns: log_ns(event.start_ns).saturating_sub(nanoseconds(options.before_s)),
        end_ns: log_ns(event.end_ns.unwrap_or(last_ns))
            .saturating_add(nanoseconds(options.after_s)),
        events: vec![event],
    });
    joined(spans.collect())
}

/// Spans in order, joined where they overlap.
fn joined(mut spans: Vec<Span<'_>>) -> Vec<Span<'_>> {
    spans.sort_by_key(|span| (span.start_ns, span.end_ns));
    let mut joined: Vec<Span> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if span.start_ns <= last.end_ns => {
                last.end_ns = last.end_ns.max(span.end_ns);
                last.events.extend(span.events);
            }
            _ => joined.push(span),
        }
    }
    joined
}

/// The gravest of its events names a clip.
fn name(index: usize, span: &Span<'_>) -> String {
    let kinds = span.events.iter().map(|event| event.kind);
    let gravest = kinds.min_by_key(|kind| kind.rank());
    let kind = gravest.map_or("", EventKind::name);
    format!("{:04}_{kind}.mcap", index + 1)
}

/// Returns the record of where a clip comes from.
fn origin(analysis: &Analysis, span: &Span<'_>) -> MetadataRecord {
    let mut values = BTreeMap::from([
        ("tipwatch_version".into(), env!("CARGO_PKG_VERSION").into()),
        (START_KEY.into(), span.start_ns.to_string()),
        (END_KEY.into(), span.end_ns.to_string()),
    ]);
    for (index, file) in analysis.provenance.log.iter().enumerate() {
        values.extend(file.entries(index));
    }
    for (index, event) in span.events.iter().enumerate() {
        let text = format!("{} {} {}", event.kind.name(), event.subject, event.start_ns);
        values.insert(format!("event_{index:04}"), text);
    }
    MetadataRecord {
        name: ORIGIN.into(),
        values,
    }
}

fn clip_event(event: &Event) -> ClipEvent {
    ClipEvent {
        kind: event.kind.name(),
        subject: event.subject.clone(),
        start_ns: event.start_ns,
    }
}

fn relative(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!("{CLIPS}/{name}")
}

/// Removes the files that [`name`] may have named.
fn remove_earlier(clips: &Path) {
    let entries = fs::read_dir(clips).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        if is_clip(&path) {
            // creating the new one tells what is wrong
            let _ = fs::remove_file(path);
        }
    }
}

fn is_clip(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let is_mcap = path
        .extension()
        .is_some_and(|extension| extension == "mcap");
    let kind = stem.split_once('_').filter(|(number, _)| {
        number.len() >= 4 && number.bytes().all(|byte| byte.is_ascii_digit())
    });
    is_mcap && kind.is_some_and(|(_, kind)| EventKind::ALL.iter().any(|known| known.name() == kind))
}

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_spans_are_joined() {
        let span = |start_ns, end_ns| Span {
            start_ns,
            end_ns,
            events: Vec::new(),
        };
        let joined = joined(vec![
            span(50, 60),
            span(0, 10),
            span(10, 20),
            span(21, 40),
            span(22, 30),
        ]);
        assert_eq!(joined, [span(0, 20), span(21, 40), span(50, 60)]);
    }

    #[test]
    fn only_clips_of_this_program_are_removed() {
        let is_ours = |name: &str| is_clip(Path::new(name));
        assert!(is_ours("0001_tip_over.mcap") && is_ours("12345_wheel_lift.mcap"));
        for foreign in [
            "0001_mine.mcap",
            "1_tip_over.mcap",
            "0001_tip_over.bag",
            "tip_over.mcap",
        ] {
            assert!(!is_ours(foreign), "{foreign}");
        }
    }
}
