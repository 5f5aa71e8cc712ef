//! Tests of the whole crate.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests fail by panicking, and print figures"
)]

/// Alarms outlive everything but an acknowledgement.
mod alarms;
/// Measured forces of the arm that nothing is computed by.
mod arm_forces;
/// Clips around triggers, and recorders that come too late.
mod black_box;
/// Messages of networks become the samples of a log.
mod bridge;
/// The guided commissioning, and its result at the start of a monitor.
mod commissioning;
/// The suspension is controlled, and its valves close on every fault.
mod control;
/// Every decision of the control, without shared memory.
mod control_decisions;
/// The loop of the control, from session to session.
mod control_program;
/// Killed processes.
mod crash;
/// Data are late whatever their stamps say.
mod delays;
/// Hashes of what runs, and what a supervisor is told.
mod evidence;
/// Every fault of the input, injected in shared memory.
mod faults;
/// Good sensors are never called faulty.
mod good_sensors;
/// The edges of the limits of the guard.
mod guard;
/// The C header is current, and the client in C works.
mod header;
/// A client that knows only the C header.
mod independent;
/// Many hours of machine time.
mod long_run;
/// Signals from single-number topics.
mod number_signals;
/// Offline analysis gives the same bits.
mod offline_equals_live;
/// Payloads whose mass is known row by row.
mod payloads;
/// Places of readers that are kept.
mod places;
/// The producer and the subscriber in Python.
mod producer;
/// Recordings, and their reproduction offline.
mod record;
/// The reference loads are those of the machine.
mod reference;
/// Monitor, recorder and replay in one terminal.
mod rehearsal;
/// Shared memory that is full.
mod room;
/// No input makes the verdict "safe" wrongly.
mod safety;
/// Sessions that do not give what the machine file binds.
mod sessions;
/// Isolated worlds in shared memory, and the programs in them.
mod support;
/// Signals that failed visibly are doubted over restarts, until they are back or trusted.
mod visible_failures;
