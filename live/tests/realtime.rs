//! A tick of the monitor after its start: no allocation, and no call of the system.
//!
//! First the monitor by itself, then the program's own loop over shared memory, in a thread of this
//! process. There iceoryx2 0.10 takes one small block from the heap for every message that is lent and
//! gives it back when that is sent: these are counted, and nothing beside them may be.

#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    unsafe_code,
    reason = "a counting allocator and a filter of system calls have no safe interface; figures are printed"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::time::Duration;

use tipwatch_live::control::Control;
use tipwatch_live::monitor::Monitor;
use tipwatch_live::monitor::{MonitorOptions, MonitorProgram, Observer};
use tipwatch_live::node::LiveNode;
use tipwatch_live::node::{LoopOptions, Wake};
use tipwatch_live::system::clock::Monotonic;
use tipwatch_live::wire::command::Mode;
use tipwatch_live::wire::opening::Untimed;
use tipwatch_live::wire::session::Session;
use tipwatch_live::wire::topics::{
    EVENT_ROW, Head, Kind, Wire, WireCommand, WireSample, WireVerdict,
};
use tipwatch_mechanics::verdict::{Basis, Level};

mod support;

use support::World;
use support::feed::{machine, samples};
use support::obeying::Obeying;
use support::prioritise::prioritise;
use support::producing::Producing;
use support::seal;

thread_local! {
    static IS_COUNTED: Cell<bool> = const { Cell::new(false) };
}

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
static SYSTEM_CALLS: AtomicU64 = AtomicU64::new(0);
static LAST_CALL: AtomicI64 = AtomicI64::new(-1);
static PUBLISHED: AtomicU64 = AtomicU64::new(0);
static DONE: AtomicBool = AtomicBool::new(false);

/// Rows before counting begins, and rows while counting.
const START_ROWS: u64 = 60;
const COUNTED_ROWS: u64 = 400;

struct Counting;

// SAFETY: everything is handed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

fn count() {
    if IS_COUNTED.try_with(Cell::get).unwrap_or(false) {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

extern "C" fn trapped(_: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
    SYSTEM_CALLS.fetch_add(1, Ordering::Relaxed);
    // SAFETY: the kernel hands over the information of a trapped call: its number stands after the
    // three common fields and the address of the call.
    let number = unsafe { *info.cast::<libc::c_int>().add(6) };
    LAST_CALL.store(number.into(), Ordering::Relaxed);
}

/// Every call of the system by this thread is counted and not done, from now on, but for its end and the
/// return from the handler that counts.
fn trap_system_calls() {
    const fn statement(code: u32, k: u32) -> libc::sock_filter {
        libc::sock_filter {
            code: code as u16,
            jt: 0,
            jf: 0,
            k,
        }
    }
    const fn jump_if(k: u32, jt: u8) -> libc::sock_filter {
        libc::sock_filter {
            code: (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16,
            jt,
            jf: 0,
            k,
        }
    }
    let mut filter = [
        // the number of the call
        statement(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0),
        jump_if(libc::SYS_rt_sigreturn as u32, 2),
        jump_if(libc::SYS_exit as u32, 1),
        statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_TRAP),
        statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_ALLOW),
    ];
    let program = libc::sock_fprog {
        len: filter.len() as u16,
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: the handler only stores to atomics; the filter outlives the call.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = trapped as *const () as libc::sighandler_t;
        action.sa_flags = libc::SA_SIGINFO;
        assert_eq!(
            libc::sigaction(libc::SIGSYS, &raw const action, std::ptr::null_mut()),
            0
        );
        assert_eq!(libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), 0);
        let mode = libc::SECCOMP_MODE_FILTER;
        assert_eq!(
            libc::prctl(libc::PR_SET_SECCOMP, mode, &raw const program),
            0
        );
    }
}

struct Counter {
    rows: u64,
    published: u64,
}

impl Observer for Counter {
    fn session(&mut self, _: &Monitor, _: &Session) -> anyhow::Result<()> {
        Ok(())
    }

    fn verdict(&mut self, verdict: &WireVerdict) {
        self.rows += u64::from(verdict.event == EVENT_ROW);
        if IS_COUNTED.get() {
            self.published += 1;
        }
    }

    fn cycle(&mut self) {
        if self.rows >= START_ROWS && self.published == 0 && !IS_COUNTED.get() {
            trap_system_calls();
            IS_COUNTED.set(true);
        }
    }

    fn wants_more(&self) -> bool {
        let wants_more = self.rows < START_ROWS + COUNTED_ROWS;
        if !wants_more {
            // what the loop leaves behind is no tick
            IS_COUNTED.set(false);
        }
        wants_more
    }
}

#[test]
fn tick_makes_no_allocation_and_no_system_call() {
    monitor_alone();
    control_alone();
    loop_over_shared_memory();
}

/// The samples of a log as its session would send them, each when the log has it.
fn sealed(name: &str) -> (Session, Vec<WireSample>) {
    let (recording, mut samples) = samples(name);
    let session = recording.session;
    for (sequence, sample) in samples.iter_mut().enumerate() {
        let published_ns = sample.log_time_ns;
        seal(sample, &session, sequence as u64, published_ns);
    }
    (session, samples)
}

fn monitor_alone() {
    let (file, urdf) = machine("tiny_lift");
    let (session, samples) = sealed("tiny_lift");
    let (machine, sensors) = session.machine(&file, &urdf).unwrap();
    let mut monitor = Monitor::new(machine, &sensors, &session, 0);
    let mut rows = 0;
    for (at, sample) in samples.iter().enumerate() {
        IS_COUNTED.set(at > 50);
        let mut publish = |verdict: &mut WireVerdict| {
            rows += u64::from(verdict.event == EVENT_ROW);
            sample.published_ns
        };
        monitor.take(sample, sample.published_ns, &mut publish);
        monitor.tick(sample.published_ns, &mut publish);
    }
    IS_COUNTED.set(false);
    assert!(rows > 300, "{rows} rows");
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed), 0);
}

/// The control with safe verdicts in a closed loop: its valves follow, and the rods follow them.
fn control_alone() {
    let (file, urdf) = machine("second_paper");
    let (session, samples) = sealed("second_paper");
    let (machine, sensors) = session.machine(&file, &urdf).unwrap();
    let mut rods = Obeying::new(&machine, &session.streams[0]);
    let mut control = Control::new(machine, &sensors, &session, 0).unwrap();
    let mut verdict = WireVerdict::unknown();
    verdict.session = session.id;
    verdict.level = Level::Safe as u32;
    verdict.basis = Basis::Proven as u32;
    let (mut steered, mut rows, mut last) = (0, 0, WireCommand::closed());
    let start = rods.cylinders[0].extension;
    for (at, mut sample) in samples.into_iter().enumerate() {
        let now_ns = sample.published_ns;
        verdict.valid_until_ns = now_ns + 1;
        verdict.seal(Head {
            machine_hash: session.machine_hash,
            ..Head::default()
        });
        if sample.kind == Kind::Joints as u32 {
            rods.obey(&last.opening, &mut sample);
        }
        IS_COUNTED.set(at > 50);
        let mut send = |command: &mut WireCommand| {
            let is_row = command.event == EVENT_ROW;
            rows += u64::from(is_row);
            steered += u64::from(is_row && command.mode() == Mode::Follow);
            last = *command;
            now_ns
        };
        control.verdict(&verdict);
        control.take(&sample, now_ns, &mut send).unwrap();
        control.tick(now_ns, &mut send);
        IS_COUNTED.set(false);
    }
    let moved = rods.cylinders[0].extension - start;
    println!("{steered} of {rows} rows steered, rods moved by {moved:.3} m");
    assert!(
        10 * steered >= 9 * rows && rows > 300,
        "{steered} of {rows}"
    );
    // beyond the trial of their direction
    assert!(moved.abs() > 0.003, "{moved}");
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed), 0);
}

fn loop_over_shared_memory() {
    let _prioritised = prioritise();
    let world = World::new("rt");
    let (place, state) = (world.address(), world.state.path().to_owned());
    std::thread::spawn(move || {
        // one that polls must not come before others: it would never let them go on
        drop(prioritise());
        let (file, urdf) = machine("forwarder6");
        let node = LiveNode::new(&place, "monitor").unwrap();
        let options = MonitorOptions {
            running: LoopOptions {
                wake: Wake::Poll,
                stays: true,
            },
            untimed: Untimed::Refused,
            state: &state,
        };
        let mut monitor = MonitorProgram::new(&node, &file, &urdf, &Monotonic, options).unwrap();
        let mut counter = Counter {
            rows: 0,
            published: 0,
        };
        let ran = monitor.run(&mut counter);
        assert!(ran.is_ok());
        PUBLISHED.store(counter.published, Ordering::Relaxed);
        DONE.store(true, Ordering::Release);
        // this thread can make no system call any more and is left behind
        // SAFETY: ends this thread alone.
        unsafe { libc::syscall(libc::SYS_exit, 0) };
    });
    let producing = Producing::start(&world.address(), "forwarder6");
    for _ in 0..12_000 {
        if DONE.load(Ordering::Acquire) {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(
        DONE.load(Ordering::Acquire),
        "the monitor gave too few rows"
    );
    producing.end();
    let allocations = ALLOCATIONS.load(Ordering::Relaxed);
    let calls = SYSTEM_CALLS.load(Ordering::Relaxed);
    let last = LAST_CALL.load(Ordering::Relaxed);
    let published = PUBLISHED.load(Ordering::Relaxed);
    println!(
        "{COUNTED_ROWS} rows, {published} messages: {allocations} allocations and releases, {calls} system calls"
    );
    // one block for each message, taken and given back: those of the transport
    assert_eq!(allocations, 2 * published);
    assert_eq!(calls, 0, "the last was number {last}");
}
