//! Priority for tests in real time: on a busy computer they would measure its other work.

/// While this lives, the thread and its children have priority over all ordinary ones, if that is allowed.
pub struct Prioritised(());

pub fn prioritise() -> Prioritised {
    schedule(libc::SCHED_FIFO, 1);
    Prioritised(())
}

impl Drop for Prioritised {
    fn drop(&mut self) {
        schedule(libc::SCHED_OTHER, 0);
    }
}

#[allow(
    unsafe_code,
    reason = "the standard library has no interface to this call"
)]
fn schedule(policy: libc::c_int, priority: libc::c_int) {
    let parameter = libc::sched_param {
        sched_priority: priority,
    };
    // SAFETY: the parameter outlives the call. Without the privilege it has no effect.
    unsafe { libc::sched_setscheduler(0, policy, &raw const parameter) };
}
