//! A command of the user when a level is reached: a relay, a horn, a webhook. The bridge never waits for it.

use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::verdict::Level;

use super::follow::VerdictSink;
use super::view::View;
use crate::bridge::input::Teller;
use crate::safety_limits::START_UP_NS;
use crate::system::clock::unix_ns;

/// Period at which a running command is checked.
const LOOK: Duration = Duration::from_millis(5);

/// Rule that runs a command from a level on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandRule {
    /// The level from which on.
    pub level: Level,
    /// The command, for `sh -c`.
    pub command: String,
    /// After this time it is killed.
    pub limit: Duration,
}

/// A rule and the thread that runs its command: one at a time. What happens meanwhile is run next, the latest only.
pub struct Commands {
    rule: CommandRule,
    /// The level for which the command was run last, while it is reached.
    reached: Option<Level>,
    /// Time of the first look at the verdict (ns), until one has come: a monitor may start after the bridge.
    waits_since_ns: Option<i64>,
    has_begun: bool,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    next: Option<Environment>,
    ends: bool,
}

/// The environment of a command.
type Environment = Vec<(&'static str, String)>;

impl Commands {
    /// Starts the thread of a rule.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn start(rule: CommandRule, teller: Teller) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let thread = {
            let (rule, shared) = (rule.clone(), Arc::clone(&shared));
            std::thread::Builder::new()
                .name("command".into())
                .spawn(move || run_all(&rule, &shared, &teller))?
        };
        Ok(Self {
            rule,
            reached: None,
            waits_since_ns: None,
            has_begun: false,
            shared,
            thread: Some(thread),
        })
    }

    fn ask(&self, event: &str, view: Option<&View<'_>>) {
        let mut state = lock(&self.shared.state);
        state.next = Some(environment(event, view));
        self.shared.changed.notify_one();
    }
}

/// Whether the level of a verdict reaches a threshold; `None` where neither can be said: the level is unknown, or a lower one is held
/// while nobody knows which supports are on the ground.
fn reaches(view: &View<'_>, threshold: Level) -> Option<bool> {
    let level = view.level();
    let is_ground_known = view.verdict.is_none_or(|it| it.ground_gap().is_none());
    match level >= threshold {
        _ if level == Level::Unknown => None,
        true => Some(true),
        false => is_ground_known.then_some(false),
    }
}

impl VerdictSink for Commands {
    fn show(&mut self, view: &View<'_>) {
        self.has_begun |= view.verdict.is_some();
        let since_ns = *self.waits_since_ns.get_or_insert(view.now_ns);
        // what is unknown changes nothing: it neither alarms nor says that all is well
        let Some(is_reached) = reaches(view, self.rule.level) else {
            return;
        };
        if !self.has_begun && view.now_ns.saturating_sub(since_ns) < START_UP_NS {
            return;
        }
        let reached = is_reached.then_some(view.level());
        if std::mem::replace(&mut self.reached, reached) == reached {
            return;
        }
        self.ask(if is_reached { "reached" } else { "left" }, Some(view));
    }

    fn end(&mut self) {
        self.ask("ended", None);
        lock(&self.shared.state).ends = true;
        self.shared.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn environment(event: &str, view: Option<&View<'_>>) -> Environment {
    let number = |number: f64| match number.is_finite() {
        true => format!("{number:.4}"),
        false => String::new(),
    };
    let level = view.map_or(Level::Fault, View::level);
    let worst = view.and_then(|view| Some((view.worst_wheel()?, view)));
    let wheel = worst.map_or("", |((wheel, _), view)| view.wheel_name(wheel));
    vec![
        ("TIPWATCH_EVENT", event.to_owned()),
        ("TIPWATCH_LEVEL", level.name().to_owned()),
        (
            "TIPWATCH_MOMENTARY_LEVEL",
            view.map_or(Level::Fault, View::momentary).name().to_owned(),
        ),
        (
            "TIPWATCH_IS_CURRENT",
            u8::from(view.is_some_and(|view| view.verdict.is_some())).to_string(),
        ),
        ("TIPWATCH_WHEEL", wheel.to_owned()),
        (
            "TIPWATCH_OVERTURNING_FORCE_N",
            number(worst.map_or(f64::NAN, |((_, force), _)| force)),
        ),
        (
            "TIPWATCH_UTILISATION",
            number(view.map_or(f64::NAN, |view| view.number(Quantity::Utilisation))),
        ),
        (
            "TIPWATCH_TIME_TO_LIFT_OFF_S",
            number(view.map_or(f64::NAN, View::time_to_lift_off_s)),
        ),
        (
            "TIPWATCH_MACHINE",
            view.map_or("", |view| view.names.machine.as_str())
                .to_owned(),
        ),
        ("TIPWATCH_TIME_NS", unix_ns().to_string()),
    ]
}

fn run_all(rule: &CommandRule, shared: &Shared, teller: &Teller) {
    loop {
        let environment = {
            let mut state = lock(&shared.state);
            loop {
                if let Some(next) = state.next.take() {
                    break next;
                }
                if state.ends {
                    return;
                }
                state = shared
                    .changed
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner);
            }
        };
        if let Err(problem) = run(rule, environment) {
            let key = format!("command {}", rule.command);
            teller.fault(&key, &format!("--run \"{}\": {problem}", rule.command));
        }
    }
}

fn run(rule: &CommandRule, environment: Environment) -> Result<(), String> {
    let mut child = Command::new("sh")
        .args(["-c", &rule.command])
        .envs(environment)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .process_group(0)
        .spawn()
        .map_err(|error| format!("cannot be started: {error}"))?;
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) => return Err(format!("expected exit code 0, found {status}")),
            Ok(None) if start.elapsed() < rule.limit => std::thread::sleep(LOOK),
            Ok(None) => {
                kill_group(&mut child);
                let limit_s = rule.limit.as_secs_f64();
                return Err(format!("expected an end within {limit_s} s: killed"));
            }
            Err(error) => return Err(format!("cannot be waited for: {error}")),
        }
    }
}

/// Kills the command with all processes that it has started.
#[allow(
    unsafe_code,
    reason = "the standard library kills single processes only"
)]
fn kill_group(child: &mut Child) {
    if let Ok(group) = i32::try_from(child.id()) {
        // SAFETY: the call has no effect on this process: the child leads a group of its own and was not waited for,
        // so that its number cannot belong to another one.
        unsafe { libc::kill(-group, libc::SIGKILL) };
    }
    let _ = child.wait();
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::estimation::support_configuration::GroundGap;

    use super::*;
    use crate::wire::names::Names;
    use crate::wire::topics::WireVerdict;
    use crate::wire::verdict::GroundUnknown;

    struct Trial {
        folder: tempfile::TempDir,
        commands: Commands,
        names: Names,
        now_ns: i64,
    }

    impl Trial {
        fn new(command: &str, limit_ms: u64) -> Self {
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("out");
            let rule = CommandRule {
                level: Level::Danger,
                command: command.replace("OUT", out.to_str().unwrap()),
                limit: Duration::from_millis(limit_ms),
            };
            Self {
                folder,
                commands: Commands::start(rule, Teller::default()).unwrap(),
                names: Names {
                    machine: "m".into(),
                    wheels: vec!["fl".into(), "fr".into()],
                    edges: Vec::new(),
                    joints: Vec::new(),
                    load_sensors: Vec::new(),
                    arm_forces: Vec::new(),
                    commissioned: Vec::new(),
                },
                now_ns: 0,
            }
        }

        fn show(&mut self, level: Option<Level>) -> Duration {
            self.show_on(level, 0)
        }

        fn show_on(&mut self, level: Option<Level>, ground_gap: u32) -> Duration {
            let mut verdict = WireVerdict::unknown();
            verdict.ground_gap = ground_gap;
            let level_number = level.map_or(0, |level| level as u32);
            (verdict.level, verdict.latched_level) = (level_number, level_number);
            verdict.wheel_count = 2;
            (verdict.otf[0], verdict.otf[1]) = (500.0, -20.0);
            self.now_ns += 10_000_000;
            let view = View {
                verdict: level.map(|_| &verdict),
                names: &self.names,
                now_ns: self.now_ns,
            };
            let start = Instant::now();
            self.commands.show(&view);
            start.elapsed()
        }

        fn lines(&mut self) -> Vec<String> {
            self.commands.end();
            let text = std::fs::read_to_string(self.folder.path().join("out"));
            text.unwrap_or_default()
                .lines()
                .map(str::to_owned)
                .collect()
        }
    }

    const ECHO: &str =
        "echo $TIPWATCH_EVENT $TIPWATCH_LEVEL $TIPWATCH_WHEEL $TIPWATCH_OVERTURNING_FORCE_N >> OUT";

    fn settle() {
        std::thread::sleep(Duration::from_millis(300));
    }

    #[test]
    fn a_command_is_told_what_was_reached_and_what_was_left() {
        let mut trial = Trial::new(ECHO, 10_000);
        for level in [Level::Safe, Level::Warning, Level::Danger, Level::Danger] {
            trial.show(Some(level));
        }
        settle();
        // neither better nor worse
        trial.show(Some(Level::Unknown));
        trial.show(Some(Level::Fault));
        settle();
        trial.show(Some(Level::Warning));
        settle();
        assert_eq!(
            trial.lines(),
            [
                "reached danger fr -20.0000",
                "reached fault fr -20.0000",
                "left warning fr -20.0000",
                "ended fault"
            ]
        );
    }

    /// A danger that was taken back while the weight passes to other supports leaves the warning before it.
    #[test]
    fn nothing_is_left_while_the_ground_is_unknown() {
        let gaps = [
            GroundUnknown::Gap(GroundGap::Transition),
            GroundUnknown::Gap(GroundGap::Taken),
            GroundUnknown::Impossible,
            GroundUnknown::NoReferenceLoads,
        ];
        for gap in gaps.map(GroundUnknown::number) {
            let mut trial = Trial::new(ECHO, 10_000);
            // a wheel that carries nothing is one on any ground
            trial.show_on(Some(Level::Danger), gap);
            settle();
            trial.show_on(Some(Level::Warning), gap);
            settle();
            trial.show(Some(Level::Danger));
            settle();
            trial.show(Some(Level::Warning));
            settle();
            assert_eq!(
                trial.lines(),
                [
                    "reached danger fr -20.0000",
                    "left warning fr -20.0000",
                    "ended fault"
                ]
            );
        }
    }

    #[test]
    fn a_verdict_that_expires_counts_as_a_fault_and_one_that_never_comes_too() {
        let mut trial = Trial::new(ECHO, 10_000);
        trial.show(Some(Level::Safe));
        trial.show(None);
        settle();
        assert_eq!(trial.lines()[0], "reached fault");
        // nor does one that was unknown begin the wait for a first one
        let mut trial = Trial::new(ECHO, 10_000);
        trial.show(Some(Level::Unknown));
        trial.show(None);
        settle();
        assert_eq!(trial.lines(), ["reached fault", "ended fault"]);
        let mut trial = Trial::new(ECHO, 10_000);
        for _ in 0..190 {
            trial.show(None);
        }
        settle();
        assert!(
            !trial.folder.path().join("out").exists(),
            "a monitor may start later"
        );
        for _ in 0..20 {
            trial.show(None);
        }
        settle();
        assert_eq!(trial.lines(), ["reached fault", "ended fault"]);
    }

    #[test]
    fn a_command_that_hangs_holds_nobody_up_and_is_killed_with_its_children() {
        let mut trial = Trial::new(
            "echo $TIPWATCH_EVENT $TIPWATCH_LEVEL >> OUT; sleep 60 & wait",
            200,
        );
        let start = Instant::now();
        trial.show(Some(Level::Danger));
        settle();
        let mut slowest = Duration::ZERO;
        for round in 1..50 {
            let level = if round % 2 == 0 {
                Level::Danger
            } else {
                Level::Safe
            };
            slowest = slowest.max(trial.show(Some(level)));
        }
        assert!(slowest < Duration::from_millis(100), "{slowest:?}");
        let lines = trial.lines();
        // the first, the latest of those that came meanwhile, and the end; one at a time
        assert!(
            lines.len() <= 4 && start.elapsed() < Duration::from_secs(10),
            "{lines:?}"
        );
        assert_eq!(lines[0], "reached danger");
    }
}
