//! Parts of the passes over a whole log.

use std::sync::{Mutex, PoisonError};

/// A part of a pass over a whole log, independent of the others that it is run with.
pub type Pass<'p> = Box<dyn FnOnce() + Send + 'p>;

/// Runs the parts that it is given, on one thread or on several.
pub(super) type Run<'r> = &'r (dyn Fn(Vec<Pass<'_>>) + Sync);

/// Runs all parts: those that `run` leaves out are run here.
pub(super) fn run_all(run: Run<'_>, parts: Vec<Pass<'_>>) {
    let parts: Vec<_> = parts
        .into_iter()
        .map(|part| Mutex::new(Some(part)))
        .collect();
    let run_once = |part: &Mutex<Option<Pass<'_>>>| {
        let part = part.lock().unwrap_or_else(PoisonError::into_inner).take();
        part.into_iter().for_each(|part| part());
    };
    let once = &run_once;
    let passes = parts
        .iter()
        .map(|part| -> Pass<'_> { Box::new(move || once(part)) });
    run(passes.collect());
    parts.iter().for_each(run_once);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_runs_once_whichever_are_left_out() {
        for skipped in 0..=3 {
            let run =
                |passes: Vec<Pass<'_>>| passes.into_iter().skip(skipped).for_each(|pass| pass());
            let mut counts = [0; 3];
            let parts = counts
                .iter_mut()
                .map(|count| -> Pass<'_> { Box::new(|| *count += 1) });
            run_all(&run, parts.collect());
            assert_eq!(counts, [1; 3], "without {skipped}");
        }
    }
}
