//! Child processes that end with this one.

use std::io;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// Longest time for a child to end in order, before it is killed.
const END_LIMIT: Duration = Duration::from_secs(10);
/// Time between two looks at it.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Starts a child that is asked to end (SIGTERM) when the thread that calls this ends, even by SIGKILL.
///
/// # Errors
/// It cannot be started.
#[allow(
    unsafe_code,
    reason = "the standard library cannot do this between fork and exec"
)]
pub fn start(command: &mut Command) -> io::Result<Child> {
    use std::os::unix::process::CommandExt;
    let parent = std::process::id();
    let bind = move || {
        // SAFETY: neither call uses memory of this process.
        let (bound, found) = unsafe {
            (
                libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM),
                libc::getppid(),
            )
        };
        match bound == 0 && u32::try_from(found) == Ok(parent) {
            true => Ok(()),
            // the parent has ended meanwhile
            false => Err(io::ErrorKind::BrokenPipe.into()),
        }
    };
    // SAFETY: between fork and exec it makes two system calls, and neither allocates nor locks.
    unsafe { command.pre_exec(bind) }.spawn()
}

/// Asks a child to end, as `kill` does, and waits until it has ended; one that does not is killed.
///
/// # Errors
/// The system does not tell what became of it.
#[allow(
    unsafe_code,
    reason = "the standard library can only kill a child at once"
)]
pub fn end(child: &mut Child) -> io::Result<ExitStatus> {
    let asked = Instant::now();
    if child.try_wait()?.is_none()
        && let Ok(id) = child.id().try_into()
    {
        // SAFETY: no memory is passed; the child was not waited for, so the number is still its own.
        unsafe { libc::kill(id, libc::SIGTERM) };
    }
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if asked.elapsed() > END_LIMIT {
            child.kill()?;
            return child.wait();
        }
        std::thread::sleep(LOOK_PERIOD);
    }
}
