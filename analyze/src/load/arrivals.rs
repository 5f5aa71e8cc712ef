//! The order in which the recorder of a log received samples.

use std::cmp::Reverse;
use std::io;

use super::recording::{Recording, SampleReader};
use super::sample_store::Arrival;

/// Number of arrivals read at a time.
const CHUNK: usize = 1024;

/// Visits the samples of all recordings by log time, then by file order: index of the recording, of the sample in it,
/// and its values. Among samples of one message, the first recording comes last: rows are computed at its samples and
/// must include the others.
///
/// # Errors
/// Arrivals cannot be read from their temporary file.
pub(super) fn for_each_arrival(
    recordings: &[&Recording],
    mut visit: impl FnMut(usize, usize, &[f64]),
) -> io::Result<()> {
    let walks = recordings.iter().map(|recording| Walk::new(recording));
    let mut walks = walks.collect::<io::Result<Vec<_>>>()?;
    loop {
        let heads = walks.iter().enumerate();
        let heads = heads.filter_map(|(which, walk)| Some((walk.head?, Reverse(which))));
        let Some((_, Reverse(which))) = heads.min() else {
            return Ok(());
        };
        let walk = &mut walks[which];
        let sample = walk.sample();
        visit(which, sample, walk.reader.sample(sample));
        walk.advance()?;
    }
}

/// Walks over the samples of one recording.
struct Walk<'r> {
    recording: &'r Recording,
    reader: SampleReader<'r>,
    /// Indices of the samples by arrival, where that is not file order.
    order: Option<Vec<usize>>,
    next: usize,
    head: Option<Arrival>,
    /// Arrivals from the one with index `first` on.
    arrivals: Vec<Arrival>,
    first: usize,
}

impl<'r> Walk<'r> {
    fn new(recording: &'r Recording) -> io::Result<Self> {
        let mut walk = Self {
            recording,
            reader: recording.reader(),
            order: None,
            next: 0,
            head: None,
            arrivals: Vec::new(),
            first: 0,
        };
        if !recording.arrived_in_order() {
            walk.arrivals.resize(recording.len(), Arrival::default());
            recording.read_arrivals(0, &mut walk.arrivals)?;
            let mut order: Vec<usize> = (0..recording.len()).collect();
            order.sort_by_key(|&sample| walk.arrivals[sample]);
            walk.order = Some(order);
        }
        walk.find_head()?;
        Ok(walk)
    }

    /// Index of the next sample.
    fn sample(&self) -> usize {
        match &self.order {
            Some(order) => order[self.next],
            None => self.next,
        }
    }

    fn advance(&mut self) -> io::Result<()> {
        self.next += 1;
        self.find_head()
    }

    fn find_head(&mut self) -> io::Result<()> {
        self.head = None;
        if self.next < self.recording.len() {
            let sample = self.sample();
            if !(self.first..self.first + self.arrivals.len()).contains(&sample) {
                let count = CHUNK.min(self.recording.len() - sample);
                self.arrivals.resize(count, Arrival::default());
                self.first = sample;
                self.recording.read_arrivals(sample, &mut self.arrivals)?;
            }
            self.head = Some(self.arrivals[sample - self.first]);
        }
        Ok(())
    }
}
