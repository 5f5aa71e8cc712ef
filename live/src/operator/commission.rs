//! The guided commissioning: it reads live samples, tells a person what to do next, and what has been proven so far.
//!
//! Output and answers are lines, so that a terminal, a pipe and a test can use it alike.

use std::collections::BTreeMap;
use std::io::{BufRead, Write, stdin, stdout};
use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use tipwatch_binding::{
    Commissioning, CommissioningSource, MachineFile, Urdf, commissioning_text, sha256,
};
use tipwatch_calibration::commissioning::{Answers, Assessment, Recording, Status, assess};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Sensors;

use crate::guard::{Admitted, Guard};
use crate::node::{LiveNode, SessionFollower, SessionHost, pause};
use crate::system::clock::{knows_the_day, monotonic_ns, unix_ns};
use crate::system::signals;
use crate::wire::opening::{Untimed, open_session};
use crate::wire::session::Progress;
use crate::wire::topics::{WireSample, WireSession};

/// Time between two looks at the shared memory.
const POLL_PERIOD: Duration = Duration::from_millis(2);
/// Time between the beginnings of two assessments.
const ASSESS_PERIOD: Duration = Duration::from_secs(2);
/// Time after which a guide without a session tells that it waits.
const WAITING: Duration = Duration::from_secs(3);

/// The session that is commissioned.
struct Guided {
    id: u64,
    machine: Machine,
    sensors: Sensors,
    guard: Guard,
    recording: Recording,
    /// Whether the session is the replay of a log.
    is_replayed: bool,
    /// Beginning of the session by this computer's clock (ns since 1970).
    begun_ns: i64,
    /// Samples taken.
    taken: u64,
    /// Their hashes, one over the other.
    hash: String,
    unhashed: Vec<u8>,
}

struct Host<'a> {
    file: &'a MachineFile,
    urdf: &'a Urdf,
}

/// Bytes of samples that are hashed at once.
const HASHED_AT_ONCE: usize = 1 << 16;

impl Guided {
    fn take(&mut self, wire: &WireSample) -> Progress {
        let Ok(admitted) = self.guard.admit(wire, monotonic_ns()) else {
            return Progress::Running;
        };
        match admitted {
            Admitted::End => Progress::Ended,
            Admitted::Sample(sample) => {
                let sample = sample.sample();
                if self.recording.push(sample).is_ok() {
                    self.taken += 1;
                    self.unhashed.extend(sample.stamp_ns.to_le_bytes());
                    self.unhashed
                        .extend(sample.values.iter().flat_map(|value| value.to_le_bytes()));
                    if self.unhashed.len() > HASHED_AT_ONCE {
                        self.rehash();
                    }
                }
                Progress::Running
            }
        }
    }

    /// Returns the time at which the drive began (ns since 1970): by its stamps, since a session can be the replay of an old log.
    /// Stamps that do not know the day, such as those since the start of a controller, are of a drive of now, unless the session
    /// is such a replay. `None` without a sample.
    fn recorded_from_ns(&self) -> Option<i64> {
        let first_ns = self.recording.first_ns()?;
        Some(began_ns(first_ns, self.begun_ns, self.is_replayed))
    }

    fn rehash(&mut self) {
        let mut bytes = std::mem::take(&mut self.hash).into_bytes();
        bytes.append(&mut self.unhashed);
        self.hash = sha256(&bytes);
    }
}

impl SessionHost for Host<'_> {
    type Session = Guided;

    fn id(session: &Guided) -> u64 {
        session.id
    }

    fn begin(&mut self, announced: &WireSession, _: Option<&Guided>) -> Result<Guided> {
        let (session, machine, sensors) =
            open_session(announced, self.file, self.urdf, Untimed::Allowed)?;
        Ok(Guided {
            id: session.id,
            // the length of a log is known, and its clock is another
            is_replayed: session.total_samples > 0 || session.pace != 1.0,
            begun_ns: unix_ns(),
            guard: Guard::new(&session, &machine, &sensors, monotonic_ns()),
            recording: Recording::new(&sensors),
            machine,
            sensors,
            taken: 0,
            hash: String::new(),
            unhashed: Vec::new(),
        })
    }

    /// Another session is another drive: what was recorded before does not count.
    fn succeed(&mut self, _: &mut Guided, _: Guided) -> Result<()> {
        Ok(())
    }

    fn reject(&mut self, _: &mut Guided, error: &anyhow::Error) {
        eprintln!("check-machine: a session was refused: {error:#}");
    }

    fn take(&mut self, session: &mut Guided, sample: &WireSample) -> Result<Progress> {
        Ok(session.take(sample))
    }
}

/// Result of a guided commissioning.
#[derive(Debug)]
pub struct LiveCommissioning {
    /// The answers.
    pub assessment: Assessment,
    /// Samples that never arrived.
    pub lost: u64,
}

/// Guides a person through the commissioning of a machine until the session ends, everything is proven, the person enters
/// `done` or input ends with the session; then asks what only a person can confirm, prints the result and writes it to
/// `out`.
///
/// # Errors
/// The session is of another machine, the shared memory fails, or a file cannot be written.
pub fn commission(
    node: &LiveNode,
    file: &MachineFile,
    urdf: &Urdf,
    out: Option<&Path>,
) -> Result<LiveCommissioning> {
    let mut guide = Guide::new();
    guide.say("Commissioning. Each line \"next\" says what to do; enter \"done\" to end early.")?;
    let mut host = Host { file, urdf };
    let mut follower: SessionFollower<Guided> = SessionFollower::new(node)?;
    let started = Instant::now();
    let mut is_waiting = false;
    loop {
        signals::check()
            .ok()
            .context("stopped by a signal; no result was written")?;
        if follower.active.is_none() {
            follower.look_for_session(&mut host)?;
            if !is_waiting && follower.active.is_none() && started.elapsed() > WAITING {
                is_waiting = true;
                guide.say("waiting for a session: start the producer of samples")?;
            }
        }
        let progress = follower.take_samples(&mut host)?;
        guide.poll(follower.active.as_ref())?;
        let is_over = progress == Progress::Ended || guide.is_done();
        if is_over || follower.has_lost_producer() {
            break;
        }
        if pause(POLL_PERIOD).is_err() {
            continue;
        }
    }
    let mut guided = follower
        .active
        .take()
        .context("expected a session with samples, found none")?;
    guided.rehash();
    let assessment = guide.finish(&guided)?;
    let source = CommissioningSource {
        name: format!("live session {:016x}", guided.id),
        sha256: guided.hash.clone(),
        tipwatch_version: env!("CARGO_PKG_VERSION").into(),
        made_at: now(),
        recorded_from_ns: guided.recorded_from_ns(),
    };
    let result = Commissioning::new(file, urdf, source, &assessment);
    let proven = result.proven(&guided.machine);
    let text = commissioning_text(&assessment, &guided.machine, &proven);
    write!(stdout(), "\n{text}")?;
    if let Some(path) = out {
        std::fs::write(path, result.to_json())
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    Ok(LiveCommissioning {
        assessment,
        lost: guided.guard.counts().lost,
    })
}

/// Returns the time at which a drive began (ns since 1970): by its first stamp, or by this computer's clock if the stamp does not
/// know the day and the session is no replay.
fn began_ns(first_stamp_ns: i64, begun_ns: i64, is_replayed: bool) -> i64 {
    match is_replayed || knows_the_day(first_stamp_ns) {
        true => first_stamp_ns,
        false => begun_ns,
    }
}

/// Now, in UTC.
fn now() -> String {
    let stamp = jiff::Timestamp::from_nanosecond(i128::from(unix_ns()));
    stamp.map_or(String::new(), |now| {
        now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
    })
}

/// The conversation with the person.
struct Guide {
    lines: Receiver<String>,
    input_ended: bool,
    done: bool,
    assessing: Option<JoinHandle<Assessment>>,
    assessed: Option<Instant>,
    shown: BTreeMap<String, Status>,
    next: String,
    /// Samples at the last assessment.
    taken: u64,
}

impl Guide {
    fn new() -> Self {
        let (sender, lines) = channel();
        // It ends with the program, or with the input.
        std::thread::spawn(move || {
            for line in stdin().lock().lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Self {
            lines,
            input_ended: false,
            done: false,
            assessing: None,
            assessed: None,
            shown: BTreeMap::new(),
            next: String::new(),
            taken: 0,
        }
    }

    fn say(&self, text: &str) -> Result<()> {
        let mut out = stdout().lock();
        writeln!(out, "{text}")?;
        Ok(out.flush()?)
    }

    fn is_done(&self) -> bool {
        self.done
    }

    /// A line that the person entered.
    fn line(&mut self) -> Option<String> {
        match self.lines.try_recv() {
            Ok(line) => Some(line.trim().to_lowercase()),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.input_ended = true;
                None
            }
        }
    }

    /// Starts and collects assessments, beside the loop that must keep up with the samples.
    fn poll(&mut self, guided: Option<&Guided>) -> Result<()> {
        while let Some(line) = self.line() {
            self.done |= line == "done" || line == "q";
        }
        if self.assessing.as_ref().is_some_and(JoinHandle::is_finished) {
            let found = self.assessing.take().map(JoinHandle::join);
            if let Some(Ok(assessment)) = found {
                self.progress(&assessment)?;
            }
        }
        let is_due = self.assessed.is_none_or(|at| at.elapsed() >= ASSESS_PERIOD);
        if let Some(guided) = guided
            && self.assessing.is_none()
            && is_due
            && guided.taken > self.taken
        {
            self.taken = guided.taken;
            self.assessed = Some(Instant::now());
            let (machine, sensors) = (guided.machine.clone(), guided.sensors.clone());
            let recording = guided.recording.clone();
            self.assessing = Some(std::thread::spawn(move || {
                assess(&machine, &sensors, &recording, &Answers::new())
            }));
        }
        Ok(())
    }

    /// Tells what has changed, and what to do next.
    fn progress(&mut self, assessment: &Assessment) -> Result<()> {
        for item in &assessment.items {
            let before = self.shown.insert(item.key.clone(), item.status);
            let before = before.unwrap_or(Status::NotShown);
            if before != item.status {
                let detail = match item.status {
                    Status::Contradicted => format!(": {}", item.text),
                    _ => String::new(),
                };
                let words = item.status.words();
                self.say(&format!(
                    "{words}: {}, {}{detail}",
                    item.signal, item.property
                ))?;
            }
        }
        let all = assessment.items.len();
        let open = assessment
            .items
            .iter()
            .filter(|item| item.status == Status::NotShown);
        let next = match open.clone().next() {
            Some(item) => format!(
                "next ({} of {all} items open): {}",
                open.count(),
                item.motion
            ),
            None => "nothing is left to do".into(),
        };
        if next != self.next {
            self.say(&next)?;
            self.next = next;
        }
        self.done |= all > 0 && assessment.is_complete();
        Ok(())
    }

    /// The final assessment, with what the person confirms.
    fn finish(&mut self, guided: &Guided) -> Result<Assessment> {
        if let Some(last) = self.assessing.take() {
            // Its result is out of date.
            let _ = last.join();
        }
        let all = |answers: &Answers| {
            assess(&guided.machine, &guided.sensors, &guided.recording, answers)
        };
        let found = all(&Answers::new());
        let mut answers = Answers::new();
        for item in found
            .items
            .iter()
            .filter(|item| item.status == Status::NotShown)
        {
            if let Some(question) = &item.asks
                && let Some(answer) = self.ask(&format!("{} ({})", question, item.signal))?
            {
                answers.insert(item.key.clone(), answer);
            }
        }
        Ok(if answers.is_empty() {
            found
        } else {
            all(&answers)
        })
    }

    /// Asks for yes or no; `None` for any other answer, or without input.
    fn ask(&mut self, question: &str) -> Result<Option<bool>> {
        if self.input_ended {
            return Ok(None);
        }
        self.say(&format!(
            "question: {question} [y/n, or enter to leave it open]"
        ))?;
        let answer = self.lines.recv();
        self.input_ended = answer.is_err();
        Ok(
            match answer.unwrap_or_default().trim().to_lowercase().as_str() {
                "y" | "yes" => Some(true),
                "n" | "no" => Some(false),
                _ => None,
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // requirement: TW-VERDICT-29
    #[test]
    fn drive_of_a_controller_that_does_not_know_the_day_is_of_now_unless_it_is_replayed() {
        const DAY_NS: i64 = 86_400_000_000_000;
        let now_ns = 20_000 * DAY_NS;
        for (first_ns, is_replayed, expected_ns) in [
            (DAY_NS, false, now_ns),
            (DAY_NS, true, DAY_NS),
            (now_ns - 30 * DAY_NS, false, now_ns - 30 * DAY_NS),
        ] {
            assert_eq!(began_ns(first_ns, now_ns, is_replayed), expected_ns);
        }
    }
}
