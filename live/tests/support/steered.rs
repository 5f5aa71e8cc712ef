//! Monitor and control in simulated time: the programs' own loops over shared memory, in the thread of the
//! test. Times of detection are exact, however busy the computer is.

use std::path::PathBuf;
use std::time::Duration;

use tipwatch_binding::{Commissioning, MachineFile, Urdf};
use tipwatch_live::control::ControlProgram;
use tipwatch_live::monitor::Monitor;
use tipwatch_live::monitor::{MonitorOptions, MonitorProgram, Observer};
use tipwatch_live::node::LiveNode;
use tipwatch_live::node::{LoopOptions, Wake};
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::opening::Untimed;
use tipwatch_live::wire::session::Session;
use tipwatch_live::wire::topics::WireVerdict;
use tipwatch_mechanics::machine::Proofs;

use super::World;
use super::feed::{Time, machine};
use super::steered_clock::SteeredClock;

/// Before now, so that programs in real time beside it find no message from the future (ns).
const BEFORE_NS: i64 = 3_600_000_000_000;
/// Period of a loop without notifications (ns).
const CYCLE_NS: i64 = 1_000_000;

/// The loops, and the clock that they go by.
pub struct Steered {
    clock: &'static SteeredClock,
    file: &'static MachineFile,
    urdf: &'static Urdf,
    node: LiveNode,
    state: PathBuf,
    // a test moves several of them
    monitor: Option<Box<MonitorProgram<'static>>>,
    control: Option<ControlProgram<'static>>,
    /// Whether the loops hang: time then goes on without them.
    pub hang: bool,
    /// Policy for untimed sessions of the monitor that is started next.
    pub untimed: Untimed,
    /// Commissioning to which the monitor that is started next is bound.
    pub commissioning: Option<&'static Commissioning>,
}

impl Steered {
    /// A monitor of a machine of the test data. What the loops borrow lives as long as the tests.
    pub fn monitor(world: &World, name: &str) -> Self {
        let (file, urdf) = machine(name);
        let clock = SteeredClock::at(monotonic_ns() - BEFORE_NS);
        let mut steered = Self {
            clock: Box::leak(Box::new(clock)),
            file: Box::leak(Box::new(file)),
            urdf: Box::leak(Box::new(urdf)),
            node: world.join(),
            state: world.state_folder.clone(),
            monitor: None,
            control: None,
            hang: false,
            untimed: Untimed::Refused,
            commissioning: None,
        };
        steered.start_monitor();
        steered
    }

    pub fn start_monitor(&mut self) {
        let options = MonitorOptions {
            running: LoopOptions {
                wake: Wake::Poll,
                stays: true,
            },
            untimed: self.untimed,
            state: &self.state,
        };
        let started = MonitorProgram::new(&self.node, self.file, self.urdf, self.clock, options);
        let started = started.unwrap().with_commissioning(self.commissioning);
        self.monitor = Some(Box::new(started));
    }

    /// Returns the signals that the running monitor was asked to trust, and does not.
    pub fn not_trusted(&self) -> Proofs {
        self.monitor.as_ref().unwrap().not_trusted()
    }

    pub fn stop_monitor(&mut self) {
        self.monitor = None;
    }

    pub fn start_control(&mut self) {
        let options = LoopOptions {
            wake: Wake::Poll,
            stays: true,
        };
        let started = ControlProgram::new(&self.node, self.file, self.urdf, self.clock, options);
        self.control = Some(started.unwrap());
    }

    pub fn stop_control(&mut self) {
        self.control = None;
    }

    /// Makes the loops take this time from one look at the clock to the next.
    pub fn slow_down(&mut self, look: Duration) {
        self.clock.look_ns.set(look.as_nanos() as i64);
    }
}

impl Time for Steered {
    fn now_ns(&self) -> i64 {
        self.clock.now_ns.get()
    }

    fn pass_until(&mut self, then_ns: i64) {
        while self.now_ns() < then_ns {
            self.clock.now_ns.set(then_ns.min(self.now_ns() + CYCLE_NS));
            self.wake();
        }
    }

    fn wake(&mut self) {
        if self.hang {
            return;
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.cycle(&mut Silent).unwrap();
        }
        if let Some(control) = &mut self.control {
            control.cycle(false).unwrap();
        }
    }
}

struct Silent;

impl Observer for Silent {
    fn session(&mut self, _: &Monitor, _: &Session) -> anyhow::Result<()> {
        Ok(())
    }

    fn verdict(&mut self, _: &WireVerdict) {}
}
