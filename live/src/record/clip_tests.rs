//! The black box without shared memory: messages in, clips out.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tipwatch_binding::monitor_topic;

use super::clip_list::adopt_all;
use super::clip_writer::{ClipOptions, ClipWriter};
use super::pending::{Encoded, Kind, Pending};
use super::retention::Retention;
use super::segment::{Channels, Preamble};
use super::topics::{self, Topic};
use super::trigger::Trigger;
use super::writer::{Plan, RecordCounts};

const SECOND_NS: i64 = 1_000_000_000;
/// Session time of a message, in tenths of a second; the time of day is 1000 s later.
const STEP_NS: i64 = SECOND_NS / 10;

fn options() -> ClipOptions {
    ClipOptions {
        on: vec![Trigger::Warning],
        before: Duration::from_secs(3),
        after: Duration::from_secs(1),
        longest: Duration::from_secs(600),
        ring_bytes: 1 << 20,
    }
}

fn plan(root: &Path) -> Plan {
    Plan {
        folder: root.join("session"),
        preamble: Preamble {
            topics: vec![
                topics::odometry(),
                Topic {
                    name: monitor_topic::NAME.into(),
                    ..topics::imu()
                },
                topics::command(),
                topics::gap(),
                topics::program(),
            ],
            channels: Channels {
                verdicts: 1,
                commands: 2,
                gaps: 3,
                programs: 4,
            },
            attachments: [
                ("m.toml".into(), "machine".into()),
                ("m.urdf".into(), "urdf".into()),
            ],
            metadata: BTreeMap::new(),
            begun_ns: 1,
        },
        split: Duration::ZERO,
        retention: Retention::new(root, None),
    }
}

/// A black box fed by hand: one sample and one verdict in every step.
struct BlackBox {
    pending: Arc<Pending>,
    writer: ClipWriter,
    sequence: u32,
}

impl BlackBox {
    fn new(root: &Path, options: ClipOptions) -> Self {
        let pending = Arc::new(Pending::default());
        let writer = ClipWriter::begin(plan(root), options, 0.0, Arc::clone(&pending));
        Self {
            writer: writer.unwrap(),
            pending,
            sequence: 0,
        }
    }

    /// Steps until there are `steps`, with a trigger in those listed.
    fn run(&mut self, steps: u32, triggers: &[u32], bytes: usize) {
        while self.sequence < steps {
            self.push(triggers.contains(&self.sequence), bytes);
            self.writer.step(false);
        }
    }

    fn push(&mut self, is_met: bool, bytes: usize) {
        let verdict = Kind::Verdict {
            is_new: is_met,
            trigger: is_met.then_some(Trigger::Warning),
        };
        for kind in [Kind::Sample(0), verdict] {
            let session_ns = i64::from(self.sequence) * STEP_NS;
            self.pending.push(Encoded {
                kind,
                sequence: self.sequence,
                session_ns,
                log_time_ns: session_ns + 1000 * SECOND_NS,
                publish_time_ns: session_ns,
                data: vec![7; bytes],
            });
        }
        self.sequence += 1;
    }

    fn end(mut self) -> RecordCounts {
        self.writer.step(true);
        self.writer.finish();
        self.writer.counts()
    }
}

fn clips(root: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root.join("session"))
        .into_iter()
        .flatten();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// The steps of the samples in a clip: the first, the last and their number.
fn steps(path: &Path) -> (u32, u32, usize) {
    let bytes = std::fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap();
    let messages = messages.map(Result::unwrap);
    let samples = messages.filter(|message| message.channel.topic == topics::odometry().name);
    let steps: Vec<u32> = samples.map(|message| message.sequence).collect();
    assert!(steps.is_sorted_by(|a, b| a + 1 == *b), "{steps:?}");
    (steps[0], steps[steps.len() - 1], steps.len())
}

fn metadata(path: &Path, name: &str) -> Option<BTreeMap<String, String>> {
    let bytes = std::fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap()?;
    let mut indices = summary.metadata_indexes.iter();
    let index = indices.find(|index| index.name == name)?;
    Some(mcap::read::metadata(&bytes, index).unwrap().metadata)
}

fn lines(root: &Path) -> Vec<serde_json::Value> {
    let text = std::fs::read_to_string(root.join("clips.jsonl")).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn clip_spans_the_time_before_and_after_its_trigger() {
    let root = tempfile::tempdir().unwrap();
    let mut black_box = BlackBox::new(root.path(), options());
    black_box.run(200, &[100], 50);
    let counts = black_box.end();
    let clips = clips(root.path());
    assert_eq!(clips.len(), 1);
    assert_eq!(steps(&clips[0]), (70, 110, 41));
    assert_eq!(
        (counts.clips, counts.samples, counts.short_clips),
        (1, 41, 0)
    );
    let found = metadata(&clips[0], "tipwatch_clip").unwrap();
    assert_eq!(found["trigger_0000"], "1010000000000 warning");
    let line = &lines(root.path())[0];
    assert_eq!(line["is_complete"], true);
    assert_eq!(line["samples"], 41);
    assert_eq!(line["first_log_time_ns"], 1_007_000_000_000_i64);
}

/// Windows that overlap are one clip, even where the first has ended; others are clips of their own.
#[test]
fn overlapping_windows_are_joined() {
    for (second, joined) in [
        (105, true),
        (130, true),
        (140, true),
        (141, false),
        (190, false),
    ] {
        let root = tempfile::tempdir().unwrap();
        let mut black_box = BlackBox::new(root.path(), options());
        black_box.run(300, &[100, second], 50);
        black_box.end();
        let spans: Vec<_> = clips(root.path()).iter().map(|clip| steps(clip)).collect();
        let expected = match joined {
            true => vec![(70, second + 10, second as usize - 59)],
            false => vec![(70, 110, 41), (second - 30, second + 10, 41)],
        };
        assert_eq!(spans, expected, "{second}");
    }
}

#[test]
fn clip_of_a_lasting_condition_goes_on_in_the_next_file() {
    let root = tempfile::tempdir().unwrap();
    let options = ClipOptions {
        longest: Duration::from_secs(5),
        ..options()
    };
    let mut black_box = BlackBox::new(root.path(), options);
    let lasting: Vec<u32> = (100..200).collect();
    black_box.run(300, &lasting, 50);
    black_box.end();
    let clips = clips(root.path());
    let spans: Vec<_> = clips.iter().map(|clip| steps(clip)).collect();
    assert_eq!(spans[0], (70, 120, 51));
    for pair in spans.windows(2) {
        assert_eq!(pair[1].0, pair[0].1 + 1, "{spans:?}");
    }
    assert_eq!(spans[spans.len() - 1].1, 209);
    let name = clips[0].file_name().unwrap().to_string_lossy().into_owned();
    assert_eq!(
        metadata(&clips[1], "tipwatch").unwrap()["clip_continues"],
        name
    );
}

/// The file that goes on lacks nothing where the one before it began too late.
#[test]
fn file_that_continues_a_short_one_is_complete() {
    let root = tempfile::tempdir().unwrap();
    let options = ClipOptions {
        longest: Duration::from_secs(5),
        ..options()
    };
    let mut black_box = BlackBox::new(root.path(), options);
    let lasting: Vec<u32> = (52..150).collect();
    black_box.sequence = 50;
    black_box.run(200, &lasting, 50);
    let counts = black_box.end();
    assert_eq!((counts.clips, counts.short_clips), (3, 1));
    let listed = lines(root.path());
    let complete: Vec<_> = listed.iter().map(|line| &line["is_complete"]).collect();
    assert_eq!(complete, [false, true, true]);
    // the next recorder finds the same in the files
    std::fs::remove_file(root.path().join("clips.jsonl")).unwrap();
    adopt_all(root.path());
    assert_eq!(lines(root.path()), listed);
}

/// The ring keeps what fits; the clip and the counts tell what is missing.
#[test]
fn ring_without_room_is_told() {
    let root = tempfile::tempdir().unwrap();
    let mut black_box = BlackBox::new(root.path(), options());
    black_box.run(200, &[100], 50_000);
    let counts = black_box.end();
    let clips = clips(root.path());
    let (first, last, _) = steps(&clips[0]);
    assert!((89..92).contains(&first), "{first}");
    assert_eq!(last, 110);
    assert_eq!((counts.clips, counts.short_clips), (1, 1));
    let missing: f64 = metadata(&clips[0], "tipwatch").unwrap()["clip_missing_s"]
        .parse()
        .unwrap();
    assert!(
        (missing - f64::from(first - 70) * 0.1).abs() < 0.11,
        "{missing}"
    );
}

/// A recorder that is started while the alarm is on has missed what was before it; one that was there from the beginning has
/// not, however early the trigger comes.
#[test]
fn recorder_that_joins_during_an_alarm_tells_what_is_missing() {
    for (joins, trigger, missing_s) in [(50, 52, 2.8), (50, 79, 0.1), (50, 81, 0.0), (0, 2, 0.0)] {
        let root = tempfile::tempdir().unwrap();
        let mut black_box = BlackBox::new(root.path(), options());
        black_box.sequence = joins;
        black_box.run(150, &[trigger], 100);
        let counts = black_box.end();
        let clips = clips(root.path());
        let found: f64 = metadata(&clips[0], "tipwatch").unwrap()["clip_missing_s"]
            .parse()
            .unwrap();
        assert!(
            (found - missing_s).abs() < 1e-6,
            "{joins} {trigger}: {found}"
        );
        let is_short = u64::from(missing_s > 0.0);
        assert_eq!(
            (counts.clips, counts.short_clips),
            (1, is_short),
            "{joins} {trigger}"
        );
        let listed = lines(root.path());
        assert_eq!(listed[0]["is_complete"], is_short == 0);
        // the next recorder finds the same in the file
        std::fs::remove_file(root.path().join("clips.jsonl")).unwrap();
        adopt_all(root.path());
        assert_eq!(lines(root.path()), listed);
    }
}

/// One damaged chunk of a finished clip does not make it an interrupted one, and takes no trigger from it.
#[test]
fn finished_clip_with_a_damaged_chunk_is_listed_as_finished() {
    let root = tempfile::tempdir().unwrap();
    let mut black_box = BlackBox::new(root.path(), options());
    black_box.run(200, &[100], 50);
    black_box.end();
    let mut expected = lines(root.path());
    let path = &clips(root.path())[0];
    let mut bytes = std::fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let chunk = &summary.chunk_indexes[0];
    bytes[(chunk.chunk_start_offset + chunk.chunk_length) as usize - 1] ^= 1;
    std::fs::write(path, &bytes).unwrap();
    std::fs::remove_file(root.path().join("clips.jsonl")).unwrap();
    adopt_all(root.path());
    let found = &lines(root.path())[0];
    assert_ne!(found["sha256"], expected[0]["sha256"]);
    assert!(found["samples"].is_null());
    // the rest is as it was
    for key in [
        "sha256",
        "samples",
        "verdicts",
        "first_log_time_ns",
        "last_log_time_ns",
    ] {
        expected[0][key] = found[key].clone();
    }
    assert_eq!(*found, expected[0]);
}

/// Where no file can be created, every message of the clip counts as lost, and the recorder goes on.
#[test]
fn clip_that_cannot_be_written_is_counted_as_lost() {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("session"), "in the way").unwrap();
    let mut black_box = BlackBox::new(root.path(), options());
    black_box.run(160, &[100], 50);
    std::fs::remove_file(root.path().join("session")).unwrap();
    black_box.run(300, &[250], 50);
    let counts = black_box.end();
    assert_eq!((counts.samples_lost, counts.verdicts_lost), (41, 41));
    assert_eq!((counts.clips, counts.short_clips), (1, 1));
    assert_eq!(steps(&clips(root.path())[0]), (220, 260, 41));
}

/// The last batch has no later try: it goes into a new file at once.
#[test]
fn last_batch_that_fails_is_tried_in_a_new_file() {
    let root = tempfile::tempdir().unwrap();
    let mut black_box = BlackBox::new(root.path(), options());
    black_box.run(105, &[100], 50);
    // no file may be as long
    black_box.writer.clip.as_mut().unwrap().segment.written = i64::MAX as u64;
    black_box.push(false, 50);
    let counts = black_box.end();
    assert_eq!((counts.samples, counts.samples_lost), (36, 0));
    let clips = clips(root.path());
    let mut spans: Vec<_> = clips.iter().map(|clip| steps(clip)).collect();
    spans.sort_unstable();
    assert_eq!(spans, [(70, 104, 35), (105, 105, 1)]);
    // it lacks what is in the partial one, as the list says, and as the next recorder finds in the file
    let is_complete = || {
        let listed = lines(root.path());
        let is_finished =
            |line: &&serde_json::Value| !line["file"].as_str().unwrap().ends_with("_partial.mcap");
        listed.iter().find(is_finished).unwrap()["is_complete"].clone()
    };
    assert_eq!(is_complete(), false);
    std::fs::remove_file(root.path().join("clips.jsonl")).unwrap();
    adopt_all(root.path());
    assert_eq!(is_complete(), false);
}

/// Killed at any step, finished clips stay as they are; the one in progress is complete up to there, and says so.
#[test]
fn kill_leaves_finished_clips_and_a_partial_one() {
    for killed in [95, 101, 109, 125, 150, 201, 215] {
        let root = tempfile::tempdir().unwrap();
        let mut black_box = BlackBox::new(root.path(), options());
        black_box.run(killed, &[100, 200], 50);
        // as a kill does: nothing is finished
        std::mem::forget(black_box.writer);
        for path in clips(root.path()) {
            // the lock of the killed process is gone
            let copy = path.with_extension("copy");
            std::fs::copy(&path, &copy).unwrap();
            std::fs::rename(&copy, &path).unwrap();
        }
        adopt_all(root.path());
        let found = clips(root.path());
        let is_partial = |path: &PathBuf| path.to_string_lossy().ends_with("_partial.mcap");
        let partial: Vec<_> = found.iter().filter(|path| is_partial(path)).collect();
        let finished: Vec<_> = found.iter().filter(|path| !is_partial(path)).collect();
        assert_eq!(
            partial.len(),
            usize::from((101..=140).contains(&killed) || killed > 200)
        );
        assert_eq!(finished.len(), usize::from(killed > 140), "{killed}");
        for path in finished {
            assert_eq!(steps(path), (70, 110, 41));
        }
        for path in partial {
            let (first, last, _) = steps(path);
            assert!((70..=170).contains(&first) && last <= killed, "{killed}");
            assert_eq!(metadata(path, "tipwatch_clip"), None);
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let listed = lines(root.path());
            let is_it = |line: &&serde_json::Value| line["file"] == format!("session/{name}");
            let line = listed.iter().find(is_it).unwrap();
            let log_time_ns = |step: u32| i64::from(step) * STEP_NS + 1000 * SECOND_NS;
            let trigger = if killed > 200 { 200 } else { 100 };
            let triggers = serde_json::json!([["warning", log_time_ns(trigger)]]);
            assert_eq!(line["triggers"], triggers);
            assert_eq!(line["first_log_time_ns"], log_time_ns(first));
            assert_eq!(line["last_log_time_ns"], log_time_ns(last));
            assert_eq!(line["samples"], last - first + 1);
        }
        let listed = if found.is_empty() {
            Vec::new()
        } else {
            lines(root.path())
        };
        let listed: Vec<_> = listed
            .iter()
            .map(|line| line["is_complete"] == false)
            .collect();
        assert_eq!(
            listed,
            (found.iter().map(is_partial)).collect::<Vec<_>>(),
            "{killed}"
        );
    }
}
