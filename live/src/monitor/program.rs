//! The monitor between the services of the shared memory.

use std::path::Path;

use anyhow::{Result, anyhow};
use jiff::Timestamp;
use tipwatch_binding::{Commissioning, MachineFile, Urdf};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::{Inherited, KnownPosition, SignalDoubt};
use tipwatch_mechanics::machine::{Commissioned, Proof, Proofs};
use tipwatch_mechanics::verdict::{
    Conditions, HeldProblems, InputFault, InputFaults, Level, Verdict,
};

use super::contradiction::{Stands, overrules, overrules_doubt, recorded_from};
use super::observer::Observer;
use super::session_monitor::{Monitor, measured};
use crate::alarm::{
    Acknowledged, AlarmSeen, AlarmStore, DoubtedSignal, DoubtedSignals, Kept, LastPosition,
    LastPositions, SignalName,
};
use crate::node::{
    ExpiringSender, LiveNode, LoopOptions, Receiver, Sender, SessionFollower, SessionHost, Waiter,
};
use crate::safety_limits::{HEARTBEAT_NS, MAX_DELAY_NS, REFUSAL_NOTICE_NS, START_UP_NS};
use crate::system::clock::Clock;
use crate::system::clock::monotonic_ns;
use crate::system::signals;
use crate::wire::fingerprint::Fingerprint;
use crate::wire::identity::new_identity;
use crate::wire::opening::{Untimed, open_session};
use crate::wire::refusal::{Refusal, SessionRefused};
use crate::wire::sample::SampleCounts;
use crate::wire::session::{Progress, Session, machine_hash};
use crate::wire::topics::{
    WireAcknowledge, WireMachine, WireRefusal, WireSample, WireSession, WireVerdict,
};

/// Options of a monitor.
#[derive(Debug, Clone, Copy)]
pub struct MonitorOptions<'a> {
    /// Options of the loop that follows sessions.
    pub running: LoopOptions,
    /// Policy for sessions whose clock is unrelated to real time.
    pub untimed: Untimed,
    /// The folder for latched alarms.
    pub state: &'a Path,
}

/// Follows sessions and publishes verdicts.
#[derive(Debug)]
pub struct MonitorProgram<'a> {
    stays: bool,
    acknowledgements: Receiver<WireAcknowledge>,
    ignored_acknowledgements: u64,
    not_trusted: Proofs,
    waiter: Waiter,
    outputs: Outputs<'a>,
    idle: Idle,
    counts: SampleCounts,
    follower: SessionFollower<Monitor>,
    /// The latched alarm, and the time of the last contradiction.
    kept: Kept,
    /// Last known positions of the joints.
    positions: LastPositions,
    /// The session whose own contradiction is kept.
    contradicted_session: Option<u64>,
    store: AlarmStore,
}

#[derive(Debug)]
struct Outputs<'a> {
    file: &'a MachineFile,
    urdf: &'a Urdf,
    untimed: Untimed,
    commissioning: Option<&'a Commissioning>,
    fingerprint: Option<&'a Fingerprint>,
    machines: Sender<WireMachine>,
    refusals: Sender<WireRefusal>,
    verdicts: ExpiringSender<'a, WireVerdict>,
    alarm: AlarmSeen,
    refused: Option<Refused>,
}

/// The announced session that is refused.
#[derive(Debug)]
struct Refused {
    session: u64,
    reason: SessionRefused,
    since_ns: i64,
}

/// One cycle's view of the program: its outputs, and who observes them.
struct Cycle<'c, 'a> {
    outputs: &'c mut Outputs<'a>,
    observer: &'c mut dyn Observer,
    kept: &'c mut Kept,
    positions: &'c mut LastPositions,
    contradicted_session: &'c mut Option<u64>,
}

impl Cycle<'_, '_> {
    /// Keeps what outlives a session.
    fn keep(&mut self, monitor: &Monitor) {
        self.kept.latch = monitor.latch();
        self.keep_contradiction(monitor);
        self.keep_doubts(monitor);
        self.keep_positions(monitor);
    }

    /// Keeps where the joints are. One of which that is not known now stays where it was seen last.
    fn keep_positions(&mut self, monitor: &Monitor) {
        let (session, is_replay) = (monitor.session(), monitor.is_replay());
        if self.positions.session != session && (self.positions.is_replay || is_replay) {
            *self.positions = LastPositions::default();
        }
        (self.positions.session, self.positions.is_replay) = (session, is_replay);
        let now_ns = monotonic_ns();
        for (host_ns, at) in monitor.known_positions() {
            if let Some(place) = self.positions.joints.get_mut(at.joint) {
                // stamps that run fast are ahead of now: too early is only laxer
                *place = Some(LastPosition {
                    host_ns: host_ns.min(now_ns),
                    position: at.position,
                });
            }
        }
    }

    /// Returns the positions of the joints before a session, by the session's clock. A replay goes on from nothing but itself.
    fn known_positions(&self, session: &Session, measured: Proofs) -> Vec<KnownPosition> {
        let last = &self.positions;
        let is_another = last.session != session.id;
        let is_replay = last.is_replay || session.total_samples != 0;
        if session.pace <= 0.0 || (is_another && is_replay) {
            return Vec::new();
        }
        let joints = last.joints.iter().enumerate();
        let known = joints.filter_map(|(joint, at)| {
            let LastPosition { host_ns, position } = (*at)?;
            // by so much the clocks of two sessions may be apart
            let stamp_ns = (session.clock).stamp_ns(host_ns - MAX_DELAY_NS, session.pace);
            measured.has(Proof::Joint(joint)).then_some(KnownPosition {
                joint,
                // as exact as it is recorded
                stamp_ns: stamp_ns / 1000 * 1000,
                position,
            })
        });
        known.collect()
    }

    /// Keeps the time of a contradiction that a session has found.
    fn keep_contradiction(&mut self, monitor: &Monitor) {
        let session = Some(monitor.session());
        if !monitor.has_found_contradiction() || *self.contradicted_session == session {
            return;
        }
        *self.contradicted_session = session;
        *self.kept = (self.kept).contradicted_at(self.after_the_drive());
    }

    /// Now; whatever the clock of the computer says, it is after the drive of the commissioning that was bound before.
    fn after_the_drive(&self) -> Timestamp {
        let drive = self.outputs.commissioning.and_then(recorded_from);
        let now = Timestamp::now();
        drive.map_or(now, |drive| drive.max(now))
    }

    /// Keeps the signals that a session doubts, and no others of those that it measures.
    fn keep_doubts(&mut self, monitor: &Monitor) {
        if self.kept.doubted.is_empty() && monitor.doubts().next().is_none() {
            return;
        }
        let machine = monitor.machine();
        let measured = monitor.measured();
        let before = std::mem::take(&mut self.kept.doubted);
        let is_measured = |signal: &DoubtedSignal| {
            let of_machine = signal.of_machine(machine);
            of_machine.is_some_and(|doubt| measured.has(doubt.signal))
        };
        for signal in before.iter().filter(|signal| !is_measured(signal)) {
            *self.kept = self.kept.doubting(*signal);
        }
        for doubt in monitor.doubts() {
            *self.kept = self.doubting(&before, &doubt, machine);
        }
    }

    /// Returns the kept state with this doubt added. A doubt that is in `before` keeps its time; one that differs from it has
    /// failed again.
    fn doubting(
        &mut self,
        before: &DoubtedSignals,
        doubt: &SignalDoubt,
        machine: &Machine,
    ) -> Kept {
        let Some(name) = SignalName::of(doubt.signal, machine) else {
            return self.kept.contradicted_at(self.after_the_drive());
        };
        let found = DoubtedSignal {
            name,
            by: doubt.by,
            moved: doubt.moved,
            since: self.after_the_drive(),
        };
        // the mean of a specific force goes on changing: what was found first suffices
        let is_known = |it: &&DoubtedSignal| {
            let is_off_alike = it.by == doubt.by || doubt.signal == Proof::SpecificForce;
            it.is_alike(&found) && is_off_alike
        };
        let known = before.iter().find(is_known);
        if known.is_none() && before.iter().any(|it| it.name == name) {
            let (_, next) = self.outputs.verdicts.next();
            self.outputs.alarm.fails_again(doubt.signal, next);
        }
        self.kept.doubting(known.copied().unwrap_or(found))
    }

    /// The signals that a session begins by doubting: those that it measures, and that no commissioning has proven since.
    fn inherited_doubts(&mut self, machine: &Machine, measured: Proofs) -> Vec<SignalDoubt> {
        let mut doubts = Vec::new();
        let before = std::mem::take(&mut self.kept.doubted);
        for signal in before.iter() {
            let doubt = signal.of_machine(machine);
            let Some(doubt) = doubt.filter(|doubt| measured.has(doubt.signal)) else {
                *self.kept = self.kept.doubting(*signal);
                continue;
            };
            let commissioning = self.outputs.commissioning;
            match overrules_doubt(commissioning, signal.since, &doubt, machine) {
                Ok(()) => eprintln!("monitor: {}: proven by the commissioning", signal.name),
                Err(stands) => {
                    tell_doubt(signal, &doubt, &stands);
                    *self.kept = self.kept.doubting(*signal);
                    doubts.push(doubt);
                }
            }
        }
        doubts
    }

    fn publish(&mut self, verdict: &mut WireVerdict) -> i64 {
        let outputs = &mut *self.outputs;
        let (_, sequence) = outputs.verdicts.next();
        outputs.alarm.publish(verdict, sequence);
        let refused = outputs.refused.as_ref();
        verdict.refused_session = refused.map_or(0, |refused| refused.session);
        verdict.refusal = refused.map_or(0, |refused| refused.reason.reason as u32);
        let now_ns = outputs.verdicts.send(verdict);
        self.observer.verdict(verdict);
        now_ns
    }

    fn open(&mut self, announced: &WireSession) -> Result<Monitor> {
        let Outputs {
            file,
            urdf,
            untimed,
            fingerprint,
            commissioning,
            ..
        } = *self.outputs;
        let (session, machine, sensors) = open_session(announced, file, urdf, untimed)?;
        let inherited = Inherited {
            doubts: self.inherited_doubts(&machine, measured(&sensors)),
            positions: self.known_positions(&session, measured(&sensors)),
        };
        let commissioned = commissioning.map_or(Commissioned::NONE, |commissioning| {
            commissioning.proven(&machine)
        });
        let mut message = WireMachine::new(&machine, session.id)?
            .inheriting(&inherited)
            .commissioned(&commissioned);
        if let Some(fingerprint) = fingerprint {
            fingerprint.write_to(&mut message)?;
        }
        self.outputs.machines.send(&mut message)?;
        let now_ns = self.outputs.verdicts.now_ns();
        let needed = machine.needed_proofs(&sensors).on(None);
        let contradicted = self.kept.contradicted.map(|time| {
            let stands = overrules(commissioning, time, needed, &machine).err();
            (time, stands)
        });
        let mut monitor =
            Monitor::new(machine, &sensors, &session, now_ns).commissioned(commissioned);
        monitor.resume(self.kept.latch);
        monitor.inherit(&inherited);
        if let Some((time, Some(stands))) = contradicted {
            eprintln!(
                "monitor: the sensors were contradicted at {time}, and stay doubted: {stands}. Mend them, record a new drive, and \
                 bind its commissioning, in which all that the loads hang on is proven"
            );
            monitor.remember_contradiction();
        }
        self.observer.session(&monitor, &session)?;
        Ok(monitor)
    }
}

impl SessionHost for Cycle<'_, '_> {
    type Session = Monitor;

    fn id(monitor: &Monitor) -> u64 {
        monitor.session()
    }

    fn begin(&mut self, announced: &WireSession, before: Option<&Monitor>) -> Result<Monitor> {
        if let Some(before) = before {
            self.keep(before);
        }
        let opened = self.open(announced);
        self.outputs.refused = None;
        if let Err(error) = &opened {
            let refused = Refused {
                session: announced.source,
                reason: SessionRefused::of(error),
                since_ns: self.outputs.verdicts.now_ns(),
            };
            let mut message = WireRefusal::new(refused.session, &refused.reason);
            self.outputs.refusals.send(&mut message)?;
            self.outputs.refused = Some(refused);
        }
        opened
    }

    fn succeed(&mut self, _: &mut Monitor, before: Monitor) -> Result<()> {
        tell_untested(&before);
        Ok(())
    }

    /// Verdicts tell of it, and without `--stay` the program ends after a while.
    fn refuse(&mut self, error: anyhow::Error) -> Result<()> {
        eprintln!("monitor: session refused: {error:#}");
        Ok(())
    }

    fn reject(&mut self, running: &mut Monitor, error: &anyhow::Error) {
        eprintln!("monitor: session refused: {error:#}");
        running.note(InputFault::SessionRefused);
        if SessionRefused::of(error).reason == Refusal::OtherMachine {
            running.note(InputFault::WrongMachine);
        }
    }

    fn take(&mut self, monitor: &mut Monitor, sample: &WireSample) -> Result<Progress> {
        let now_ns = self.outputs.verdicts.now_ns();
        Ok(monitor.take(sample, now_ns, &mut |verdict| self.publish(verdict)))
    }
}

impl<'a> MonitorProgram<'a> {
    /// Opens all services, and the latched alarm on the disk.
    ///
    /// # Errors
    /// Another monitor has them, or another version of this program.
    pub fn new(
        node: &LiveNode,
        file: &'a MachineFile,
        urdf: &'a Urdf,
        clock: &'a dyn Clock,
        options: MonitorOptions<'_>,
    ) -> Result<Self> {
        let hash = machine_hash(file, urdf);
        let source = new_identity(hash);
        // first of all: of two monitors, one may not touch the other's alarm
        let verdicts = ExpiringSender::new(node, source, hash, clock)?;
        let (identity, unnumbered) = (file.spec.identity(), file.spec.unnumbered_identity());
        let (store, kept) = AlarmStore::open(options.state, hash, &identity, unnumbered)?;
        Ok(Self {
            stays: options.running.stays,
            acknowledgements: node.receiver()?,
            ignored_acknowledgements: 0,
            not_trusted: Proofs::NONE,
            waiter: Waiter::new::<WireSample>(node, options.running.wake)?,
            outputs: Outputs {
                file,
                urdf,
                untimed: options.untimed,
                commissioning: None,
                fingerprint: None,
                machines: node.sender(source, hash)?,
                refusals: node.sender(source, hash)?,
                verdicts,
                alarm: AlarmSeen::new(source, hash),
                refused: None,
            },
            idle: Idle::new(clock.now_ns()),
            counts: SampleCounts::default(),
            follower: SessionFollower::new(node)?,
            kept,
            positions: LastPositions::read(options.state, hash),
            contradicted_session: None,
            store,
        })
    }

    /// Publishes with every session what this program is.
    #[must_use]
    pub fn with_fingerprint(mut self, fingerprint: &'a Fingerprint) -> Self {
        self.outputs.fingerprint = Some(fingerprint);
        self
    }

    /// Takes what a commissioning of the machine file has proven as proven.
    #[must_use]
    pub fn with_commissioning(mut self, commissioning: Option<&'a Commissioning>) -> Self {
        self.outputs.commissioning = commissioning;
        self
    }

    /// Acknowledgements that did not count: damaged, of another machine, or of a verdict without the latched alarm.
    #[must_use]
    pub fn ignored_acknowledgements(&self) -> u64 {
        self.ignored_acknowledgements
    }

    /// The signals that somebody has acknowledged, and that stayed doubted in spite of it.
    #[must_use]
    pub fn not_trusted(&self) -> Proofs {
        self.not_trusted
    }

    /// Tells on stderr what the session that ends with the program has not shown.
    pub fn tell_untested(&self) {
        self.follower.active.iter().for_each(tell_untested);
    }

    /// Runs until the session is over, or forever with [`LoopOptions::stays`]; until a signal in any case.
    ///
    /// # Errors
    /// The first session is of another machine, or the shared memory fails.
    pub fn run(&mut self, observer: &mut dyn Observer) -> Result<SampleCounts> {
        while signals::check().is_ok()
            && observer.wants_more()
            && self.cycle(observer)? == Progress::Running
        {
            self.waiter.wait();
        }
        Ok(self.counts)
    }

    /// Handles everything that waits; returns whether more is to come.
    ///
    /// # Errors
    /// The session is refused and the monitor does not stay, or the shared memory fails.
    pub fn cycle(&mut self, observer: &mut dyn Observer) -> Result<Progress> {
        let follower = &mut self.follower;
        let mut cycle = Cycle {
            outputs: &mut self.outputs,
            observer,
            kept: &mut self.kept,
            positions: &mut self.positions,
            contradicted_session: &mut self.contradicted_session,
        };
        if follower.active.is_none() {
            follower.look_for_session(&mut cycle)?;
        }
        let progress = follower.take_samples(&mut cycle)?;
        if let Some(monitor) = &follower.active {
            // before what was acknowledged by verdicts of before
            cycle.keep_doubts(monitor);
        }
        while let Some(acknowledged) = self.acknowledgements.receive(|message| *message)? {
            let (_, next) = cycle.outputs.verdicts.next();
            let Some(acknowledged) = cycle.outputs.alarm.acknowledged(&acknowledged, next) else {
                self.ignored_acknowledgements += 1;
                continue;
            };
            match (acknowledged, &mut follower.active) {
                (Acknowledged::Alarm, Some(monitor)) => monitor.acknowledge(),
                (Acknowledged::Alarm, None) => cycle.kept.latch.acknowledge(),
                (Acknowledged::Signals(signals), Some(monitor)) => monitor.trust(signals),
                // without a session no verdict doubts a signal
                (Acknowledged::Signals(_), None) => self.ignored_acknowledgements += 1,
            }
        }
        let now_ns = cycle.outputs.verdicts.now_ns();
        if follower.has_lost_producer()
            && let Some(monitor) = &mut follower.active
        {
            monitor.note(InputFault::ProducerGone);
            self.counts = monitor.counts();
            follower.look_for_session(&mut cycle)?;
        }
        let is_unsaved = self.store.is_unsaved();
        match &mut follower.active {
            Some(monitor) => {
                if is_unsaved {
                    monitor.caution(InputFault::AlarmUnsaved);
                }
                monitor.tick(now_ns, &mut |verdict| cycle.publish(verdict));
                self.not_trusted = self.not_trusted.with(tell_not_trusted(monitor));
                self.counts = monitor.counts();
                cycle.keep(monitor);
            }
            None => (self.idle).tick(now_ns, is_unsaved, &mut cycle),
        }
        self.store.keep(cycle.kept);
        self.store.keep_positions(cycle.positions);
        cycle.outputs.verdicts.check()?;
        cycle.observer.cycle();
        if let Some(refused) = &self.outputs.refused
            && follower.active.is_none()
            && !self.stays
            && now_ns.saturating_sub(refused.since_ns) >= REFUSAL_NOTICE_NS
        {
            return Err(anyhow!("{}", refused.reason));
        }
        if progress == Progress::Ended {
            if !self.stays {
                return Ok(Progress::Ended);
            }
            if let Some(ended) = follower.active.take() {
                tell_untested(&ended);
            }
            self.idle = Idle::new(now_ns);
        }
        self.outputs.machines.update_connections()?;
        self.outputs.refusals.update_connections()?;
        Ok(Progress::Running)
    }
}

/// Tells which signal a session begins by doubting, and what would end that.
fn tell_doubt(signal: &DoubtedSignal, doubt: &SignalDoubt, stands: &Stands) {
    let DoubtedSignal {
        name,
        by,
        moved,
        since,
    } = signal;
    let has_turned = doubt.signal == Proof::AngularVelocity;
    let failure = match (*by == 0.0, moved.is_infinite()) {
        (true, true) if doubt.disobeys() => "not shown what its controller asks".into(),
        (true, true) => "been contradicted as stopped by the lean of the platform".into(),
        (true, false) => "not been measured".into(),
        (false, _) if has_turned => format!("been in a housing that may be turned by {by} rad"),
        (false, _) => format!("been off by {by}"),
    };
    eprintln!(
        "monitor: {name} has {failure} since {since}, and stays doubted: {stands}. Mend it, and acknowledge it: tipwatch-live \
         acknowledge --signal {name}"
    );
}

/// Tells which acknowledgements of signals were refused, and returns them.
fn tell_not_trusted(monitor: &mut Monitor) -> Proofs {
    let refused = monitor.take_not_trusted();
    for name in refused.names(monitor.machine()) {
        eprintln!(
            "monitor: {name} was acknowledged and stays doubted: expected a signal that is measured again, found one that still \
             repeats one value"
        );
    }
    refused
}

/// Tells what a session that is over has not shown.
fn tell_untested(ended: &Monitor) {
    if let Some(statement) = ended.untested() {
        eprintln!("monitor: {statement}");
    }
}

/// Without a session the verdict is unknown, and after [`START_UP_NS`] a fault. The latched alarm stays.
#[derive(Debug)]
struct Idle {
    since_ns: i64,
    published_ns: i64,
}

impl Idle {
    fn new(now_ns: i64) -> Self {
        Self {
            since_ns: now_ns,
            published_ns: i64::MIN,
        }
    }

    fn tick(&mut self, now_ns: i64, is_unsaved: bool, cycle: &mut Cycle<'_, '_>) {
        let latch = cycle.kept.latch;
        if now_ns.saturating_sub(self.published_ns) < HEARTBEAT_NS {
            return;
        }
        let mut conditions = Conditions::default();
        let mut level = Level::Unknown;
        if is_unsaved {
            conditions.cautions = InputFaults::from(InputFault::AlarmUnsaved);
            level = Level::Warning;
        }
        if now_ns.saturating_sub(self.since_ns) > START_UP_NS {
            conditions.faults.add(InputFault::NeverReceived);
        }
        if cycle.outputs.refused.is_some() {
            conditions.faults.add(InputFault::SessionRefused);
        }
        if !conditions.faults.is_empty() {
            level = Level::Fault;
        }
        let verdict = Verdict {
            level,
            latched_level: latch.over(level),
            held: HeldProblems {
                faults: conditions.faults,
                ..HeldProblems::default()
            },
            ..Verdict::default()
        };
        let mut message = WireVerdict::unknown();
        message.set_verdict(verdict, conditions, SampleCounts::default());
        message.set_alarm(latch);
        self.published_ns = cycle.publish(&mut message);
    }
}
