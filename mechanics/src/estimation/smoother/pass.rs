//! Parts of the passes over a whole log.

use std::sync::{Mutex, PoisonError};

/// A part of a pass over a whole log, independent of the others that it is run with.
pub type Pass<'p> = Box<dyn FnOnce() + Send + 'p>;

/// Runs the parts that it is given, on one thread or on several.
pub(super) type Run<'r> = &'r (dyn Fn(Vec<Pass<'_>>) + Sync);

/// Fills one batch while another is taken, by turns, until `is_over` by both. `run` runs the parts of the work.
pub(super) fn by_turns<B: Default + Send, E: Send>(
    run: Run<'_>,
    mut fill: impl FnMut(&mut B) -> Result<(), E> + Send,
    mut take: impl FnMut(&mut B) + Send,
    is_over: impl Fn(&[B; 2]) -> bool,
) -> Result<(), E> {
    let mut batches = [B::default(), B::default()];
    loop {
        let [first, second] = &mut batches;
        let mut filled = Ok(());
        let parts: Vec<Pass<'_>> = vec![
            Box::new(|| filled = fill(first)),
            // the longer part: whoever runs the parts takes this one, and leaves the other
            Box::new(|| take(second)),
        ];
        run_all(run, parts);
        filled?;
        batches.rotate_right(1);
        if is_over(&batches) {
            return Ok(());
        }
    }
}

/// Runs all parts: those that `run` leaves out are run here.
fn run_all(run: Run<'_>, parts: Vec<Pass<'_>>) {
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
