//! `tipwatch-live rehearse`: one log through monitor, recorder and display, all in one terminal.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{IsTerminal, Read, Seek, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use tipwatch_binding::{program_beside, running_file};

use super::arguments::{MachineArgs, ServiceArgs};
use super::exit::{FAILED, LOST};
use super::replay::speed;
use crate::node::pause;
use crate::replay::Speed;
use crate::system::{children, signals};

/// The program that analyses what was recorded.
const ANALYSIS: &str = "tipwatch";
/// Time between two looks at the children.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// Longest time that monitor and recorder may go on after the replay: the end of the session may be lost.
const END_LIMIT: Duration = Duration::from_secs(10);
/// Time that the replay waits for monitor and recorder (s).
const WAIT_S: &str = "60";

#[derive(Debug, Args)]
pub(super) struct RehearseArgs {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Output folder: for the analysis of what is recorded, and in its folder `recording` for the recording.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Speed relative to the recording, or "max".
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    speed: Speed,
}

pub(super) fn run_rehearse(args: &RehearseArgs) -> Result<ExitCode> {
    signals::listen();
    // what is wrong with it is told once, and not by every child
    args.machine.read()?;
    let recording = args.out.join("recording");
    fs::create_dir_all(&recording)
        .with_context(|| format!("{}: cannot be created", recording.display()))?;
    let before = sessions(&recording)?;
    // an alarm of the machine itself is neither taken over nor changed
    let state = tempfile::tempdir().context("no temporary folder can be made")?;
    let has_display = stdin().is_terminal() && stdout().is_terminal();
    let messages = has_display.then(tempfile::tempfile).transpose();
    let mut rehearsal = Rehearsal {
        args,
        messages: messages.context("no temporary file can be made")?,
        running: Vec::new(),
    };
    let ran = rehearsal.run(&recording, state.path());
    let ended = rehearsal.end();
    rehearsal.tell()?;
    let ran = ran?;
    ended?;
    if ran == Ran::Stopped {
        eprintln!(
            "rehearse: stopped before the end of the log; {} has what was recorded",
            recording.display()
        );
        return Ok(ExitCode::from(FAILED));
    }
    let mut new = sessions(&recording)?
        .into_iter()
        .filter(|it| !before.contains(it));
    let (Some(session), None) = (new.next(), new.next()) else {
        bail!("{}: expected one new session there", recording.display());
    };
    rehearsal.analyse(&session)
}

/// Outcome of the run of a rehearsal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ran {
    /// The whole log was sent.
    Whole,
    /// The user stopped it.
    Stopped,
}

struct Rehearsal<'a> {
    args: &'a RehearseArgs,
    /// Messages of the children, which are shown when the display is gone; `None` without a display.
    messages: Option<File>,
    running: Vec<(&'static str, Child)>,
}

impl Rehearsal<'_> {
    fn run(&mut self, recording: &Path, state: &Path) -> Result<Ran> {
        let is_untimed = self.args.speed == Speed::Max;
        let untimed = is_untimed.then_some("--allow-untimed");
        let shown = match self.messages {
            Some(_) => "--quiet",
            None => "--changes",
        };
        let state = [OsStr::new("--state"), state.as_os_str()];
        self.start(
            "monitor",
            [OsStr::new(shown)]
                .into_iter()
                .chain(state)
                .chain(untimed.map(OsStr::new)),
        )?;
        self.start("record", [recording.as_os_str()])?;
        let speed = match self.args.speed {
            Speed::Factor(factor) => factor.to_string(),
            Speed::Max => "max".into(),
        };
        let lossless = is_untimed.then_some("--lossless");
        let options = ["--speed", &speed, "--readers", "2", "--wait", WAIT_S];
        let options = options.into_iter().chain(lossless).map(OsStr::new);
        self.start(
            "replay",
            [self.args.log.as_os_str()].into_iter().chain(options),
        )?;
        if self.messages.is_some() {
            self.start("watch", [])?;
        }
        self.wait()
    }

    /// Starts a command of this program.
    fn start<'o>(
        &mut self,
        name: &'static str,
        options: impl IntoIterator<Item = &'o OsStr>,
    ) -> Result<()> {
        let mut command = Command::new(running_file()?);
        command.arg(name).args(options);
        let is_display = name == "watch";
        if !is_display {
            self.args.machine.pass_to(&mut command);
            if let Some(urdf) = &self.args.machine.urdf {
                command.arg("--urdf").arg(urdf);
            }
            command.stdin(Stdio::null());
        }
        self.args.service.pass_to(&mut command);
        if let Some(messages) = &self.messages {
            command.stderr(messages.try_clone()?);
        }
        let child =
            children::start(&mut command).with_context(|| format!("{name}: cannot be started"))?;
        self.running.push((name, child));
        Ok(())
    }

    /// Waits until the log was sent and its session is over.
    fn wait(&mut self) -> Result<Ran> {
        let mut sent = None;
        loop {
            let mut ended = Vec::new();
            for (name, child) in &mut self.running {
                if let Some(status) = child.try_wait()? {
                    require_done(name, status)?;
                    ended.push(*name);
                }
            }
            self.running.retain(|(name, _)| !ended.contains(name));
            if ended.contains(&"replay") {
                sent = Some(Instant::now());
            }
            let is_left =
                (self.running.iter()).any(|(name, _)| matches!(*name, "monitor" | "record"));
            if let Some(sent) = sent
                && (!is_left || sent.elapsed() > END_LIMIT)
            {
                return Ok(Ran::Whole);
            }
            if (sent.is_none() && ended.contains(&"watch")) || pause(LOOK_PERIOD).is_err() {
                return Ok(Ran::Stopped);
            }
        }
    }

    /// Ends what still runs.
    fn end(&mut self) -> Result<()> {
        // all are asked, and waited for, before an error is told
        let ended: Vec<_> = (self.running.drain(..).rev())
            .map(|(name, mut child)| {
                children::end(&mut child).with_context(|| format!("{name}: cannot be ended"))
            })
            .collect();
        ended.into_iter().try_for_each(|ended| ended.map(drop))
    }

    /// Prints what the children had to say while there was a display.
    fn tell(&mut self) -> Result<()> {
        if let Some(mut messages) = self.messages.take() {
            let mut text = String::new();
            messages.rewind()?;
            messages.read_to_string(&mut text)?;
            eprint!("{text}");
        }
        Ok(())
    }

    /// Analyses a session as the monitor did, and says where its report is.
    fn analyse(&mut self, session: &Path) -> Result<ExitCode> {
        let program = program_beside(ANALYSIS);
        let mut command = Command::new(&program);
        command
            .arg("analyze")
            .arg(session)
            .arg("--out")
            .arg(&self.args.out);
        // the recording has the URDF
        command.args(["--estimator", "causal"]);
        self.args.machine.pass_to(&mut command);
        let started = children::start(&mut command).with_context(|| {
            format!(
                "{}: cannot be started; {ANALYSIS} analyses {} if it is beside this program or in the search path",
                program.display(),
                session.display()
            )
        });
        let mut child = started?;
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if pause(LOOK_PERIOD).is_err() {
                children::end(&mut child)?;
                bail!(
                    "stopped; {} is recorded, and not analysed",
                    session.display()
                );
            }
        };
        let report = self.args.out.join("report.html");
        if report.is_file() {
            let report = report.canonicalize().unwrap_or(report);
            writeln!(stdout(), "report: {}", report.display())?;
        }
        let code = status.code().and_then(|code| u8::try_from(code).ok());
        Ok(ExitCode::from(code.unwrap_or(FAILED)))
    }
}

/// Checks that a child has ended well. Losses are no failure: they are in the recording, and so in its analysis.
fn require_done(name: &str, status: ExitStatus) -> Result<()> {
    match status.code() {
        Some(code) if code == 0 || code == i32::from(LOST) => Ok(()),
        _ => bail!("{name} has failed ({status})"),
    }
}

/// The sessions in a folder.
fn sessions(folder: &Path) -> Result<BTreeSet<PathBuf>> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let entries = entries.with_context(|| format!("{}: cannot be listed", folder.display()))?;
    let folders = entries.into_iter().map(|entry| entry.path());
    Ok(folders.filter(|path| path.is_dir()).collect())
}
