//! Obtains the pages of large columns shortly before they are filled.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed},
};

use super::{
    page_size::PageSizes,
    region::Region,
    system::{HUGE_PAGE_BYTES, obtain, thread_time_ns},
};

/// Samples for which pages are obtained ahead: some chunks of all threads.
const SAMPLES_AHEAD: usize = 1 << 16;

/// The memory of the large columns of one pass, shared by its threads.
#[derive(Debug, Default)]
pub(crate) struct FreshMemory {
    regions: Vec<Region>,
    /// Samples in the columns of each sensor.
    filled: Vec<AtomicUsize>,
    sizes: Mutex<PageSizes>,
    /// The system obtains no pages on request: they come when the columns are filled.
    is_refused: AtomicBool,
}

impl FreshMemory {
    pub(crate) fn new(sensors: usize, regions: Vec<Region>) -> Self {
        Self {
            regions,
            filled: (0..sensors).map(|_| AtomicUsize::new(0)).collect(),
            ..Self::default()
        }
    }

    /// Counts samples that were added to the columns of a sensor.
    pub(crate) fn fill(&self, sensor: usize, samples: usize) {
        if let Some(filled) = self.filled.get(sensor) {
            filled.fetch_add(samples, Relaxed);
        }
    }

    /// Obtains the pages that will be filled next. Any thread may call it; each page is obtained
    /// once.
    pub(crate) fn prepare(&self) {
        for region in &self.regions {
            let filled = self.filled.get(region.sensor);
            let filled = filled.map_or(0, |filled| filled.load(Relaxed));
            let ahead = (filled + SAMPLES_AHEAD).saturating_mul(region.sample_bytes);
            let until = region.addresses.start.saturating_add(ahead);
            while self.obtain_next(region, until.min(region.addresses.end)) {}
        }
    }

    /// Obtains the next huge page's worth of a region, if it begins before this address.
    fn obtain_next(&self, region: &Region, until: usize) -> bool {
        if self.is_refused.load(Relaxed) {
            return false;
        }
        let step = |start: usize| {
            let end = start + HUGE_PAGE_BYTES;
            (start < until && end <= region.addresses.end).then_some(end)
        };
        let Ok(start) = region.obtained.fetch_update(Relaxed, Relaxed, step) else {
            return false;
        };
        let size = self.sizes().choose();
        let before = thread_time_ns();
        if !obtain(start, size) {
            self.is_refused.store(true, Relaxed);
            return false;
        }
        let cost_ns = thread_time_ns().saturating_sub(before);
        self.sizes().learn(size, cost_ns);
        true
    }

    fn sizes(&self) -> std::sync::MutexGuard<'_, PageSizes> {
        self.sizes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::region::reserve, *};

    #[test]
    fn pages_are_obtained_ahead_of_the_samples_and_change_nothing() {
        const SAMPLES: u64 = 1 << 19;
        const WIDTH: usize = 12;
        let mut column = vec![7.5_f64; 5];
        let region = reserve(&mut column, SAMPLES, WIDTH, 1).unwrap();
        let end = region.addresses.end;
        let memory = FreshMemory::new(2, vec![region]);
        let obtained = || memory.regions[0].obtained.load(Relaxed);
        let first = obtained();
        memory.prepare();
        let ahead = obtained() - first;
        let lead = SAMPLES_AHEAD * WIDTH * size_of::<f64>();
        let is_available = !memory.is_refused.load(Relaxed);
        assert!(
            !is_available || (1..=lead + HUGE_PAGE_BYTES).contains(&ahead),
            "{ahead}"
        );
        memory.fill(0, SAMPLES as usize);
        memory.prepare();
        assert_eq!(obtained() - first, ahead, "another sensor's samples");
        memory.fill(1, SAMPLES as usize);
        memory.prepare();
        assert!(!is_available || end - obtained() < HUGE_PAGE_BYTES);
        assert_eq!(column, [7.5; 5]);
        column.resize(WIDTH * SAMPLES as usize, 1.0);
        assert!(column[5..].iter().all(|&value| value == 1.0));
    }
}
