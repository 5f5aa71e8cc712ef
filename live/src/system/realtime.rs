//! Real-time settings of the operating system for a loop.

use anyhow::{Context, Result, bail};

/// The settings.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RealTime {
    /// Whether all present and future memory is locked in RAM.
    pub lock_memory: bool,
    /// The processor core to run on.
    pub core: Option<usize>,
    /// Priority under SCHED_FIFO, 1 to 99.
    pub priority: Option<i32>,
}

impl RealTime {
    /// Applies them to this thread, and memory locking to the whole process.
    ///
    /// # Errors
    /// The system refuses. The message names the missing capability.
    #[allow(
        unsafe_code,
        reason = "the standard library has no interface to these calls"
    )]
    pub fn apply(&self) -> Result<()> {
        if self.lock_memory {
            // SAFETY: no memory is passed.
            let result = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
            done(result).context("--lock-memory: expected CAP_IPC_LOCK or a high `ulimit -l`")?;
        }
        if let Some(core) = self.core {
            if core >= libc::CPU_SETSIZE as usize {
                bail!(
                    "--core: expected less than {}, found {core}",
                    libc::CPU_SETSIZE
                );
            }
            // SAFETY: a set of zeros is the empty set; `core` is within it; the set outlives the call.
            let result = unsafe {
                let mut set: libc::cpu_set_t = std::mem::zeroed();
                libc::CPU_SET(core, &mut set);
                libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set)
            };
            done(result).with_context(|| {
                format!("--core {core}: expected a core that this process may use")
            })?;
        }
        if let Some(priority) = self.priority {
            let parameter = libc::sched_param {
                sched_priority: priority,
            };
            // SAFETY: the parameter outlives the call.
            let result =
                unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) };
            done(result).with_context(|| {
                format!("--priority {priority}: expected CAP_SYS_NICE, 1 to 99")
            })?;
        }
        Ok(())
    }
}

fn done(result: libc::c_int) -> Result<()> {
    if result == 0 {
        Ok(())
    } else {
        Err(std::io::Error::last_os_error().into())
    }
}
