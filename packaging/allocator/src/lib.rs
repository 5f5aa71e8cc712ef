//! Memory of the programs: kept for the next use, given back between the steps of an analysis.
//!
//! A log's columns come and go by the megabyte, and asking the system for fresh pages each time costs as much as the
//! mechanics. So freed memory is kept. Where one step of an analysis ends and the next needs memory of other sizes,
//! what is kept would only add to the peak: there it is given back.

/// The allocator of a program: `#[global_allocator] static ALLOCATOR: Allocator = Allocator;`
pub use mimalloc::MiMalloc as Allocator;

/// Gives memory that is kept but not used back to the system: that of this thread, and of all threads of its [`rayon`]
/// pool, after what they are at.
///
/// Without [`Allocator`] as the program's allocator it has no effect.
pub fn give_back() {
    rayon::broadcast(|_| give_back_of_thread());
    give_back_of_thread();
}

#[allow(unsafe_code, reason = "the allocator is a C library")]
fn give_back_of_thread() {
    // SAFETY: this is its signature in C, and it may be called at any time: it touches no memory that is in use.
    unsafe extern "C" {
        safe fn mi_collect(force: bool);
    }
    mi_collect(true);
}
