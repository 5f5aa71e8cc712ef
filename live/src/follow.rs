//! Follows a session from shared memory to its end: samples in, rows printed.

use std::io::ErrorKind;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, Urdf};

use crate::monitor::{Counts, Monitor, Progress};
use crate::node::Reader;
use crate::output::{Format, Printer};
use crate::session::Session;

/// The wait when there is no sample.
const IDLE_PERIOD: Duration = Duration::from_micros(100);
/// How often a writer that died is looked for.
const DEAD_CHECK_PERIOD: Duration = Duration::from_millis(500);
/// Samples between two looks for a signal while they come without a pause.
const SIGNAL_CHECK_SAMPLES: u32 = 1024;

/// Waits for a session of the machine, and prints its rows until it ends or a signal comes.
///
/// # Errors
/// The session is of another machine, the writer has gone before the end, or the shared memory or the
/// output fails.
pub fn follow(reader: &Reader, file: &MachineFile, urdf: &Urdf, format: Format) -> Result<Counts> {
    let Some(session) = wait_for_session(reader)? else {
        return Ok(Counts::default());
    };
    let (machine, sensors) = session.machine(file, urdf)?;
    let mut printer = Printer::new(format, &machine);
    let mut monitor = Monitor::new(machine, &sensors, session.id);
    match print_rows(reader, &mut monitor, &mut printer) {
        // Who reads the rows has read enough.
        Err(error) if is_broken_pipe(&error) => Ok(monitor.counts()),
        Err(error) => Err(error),
        Ok(()) => Ok(monitor.counts()),
    }
}

/// The first session; `None` after a signal.
fn wait_for_session(reader: &Reader) -> Result<Option<Session>> {
    loop {
        if let Some(wire) = reader.session()? {
            return Ok(Some(Session::try_from(&wire)?));
        }
        if reader.pause(Duration::from_millis(1)).is_err() {
            return Ok(None);
        }
    }
}

fn print_rows(reader: &Reader, monitor: &mut Monitor, printer: &mut Printer) -> Result<()> {
    let mut checked = Instant::now();
    let mut since_pause = 0;
    loop {
        let mut printed = Ok(());
        let taken =
            reader.sample(|wire| monitor.take(wire, &mut |row| printed = printer.row(row)))?;
        printed?;
        match taken {
            Some(Progress::Ended) => return Ok(printer.flush()?),
            Some(Progress::Running) => since_pause += 1,
            None => {
                printer.flush()?;
                if checked.elapsed() >= DEAD_CHECK_PERIOD {
                    checked = Instant::now();
                    check_writer(reader)?;
                }
            }
        }
        if taken.is_none() || since_pause >= SIGNAL_CHECK_SAMPLES {
            since_pause = 0;
            let pause = if taken.is_none() {
                IDLE_PERIOD
            } else {
                Duration::ZERO
            };
            if reader.pause(pause).is_err() {
                return Ok(printer.flush()?);
            }
        }
    }
}

fn check_writer(reader: &Reader) -> Result<()> {
    reader.forget_the_dead();
    if !reader.has_writer() && !reader.has_samples()? {
        bail!("expected the end of the session, found that its writer has gone");
    }
    Ok(())
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .downcast_ref::<std::io::Error>()
        .is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}
