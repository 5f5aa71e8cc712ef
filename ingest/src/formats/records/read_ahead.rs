//! Reads and decompresses chunks ahead of the walk, on as many threads as there are processors.
//!
//! The walk requests one chunk after the other. Meanwhile worker threads read and decompress the
//! next ones, and decode them if there is an [`Intake`]; a walk that would have to wait helps. The
//! result does not depend on which thread handled a chunk.
//!
//! The threads start when there is work ahead for them. A walk that only looks at the first messages of a topic
//! usually stops in its first chunk: it starts none, and its chunk is kept for the next walk.

use std::{
    collections::VecDeque,
    marker::PhantomData,
    ops::Range,
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
};

use super::{
    decompress::Decompressor,
    grammar::{Grammar, Kind},
    head_window::HeadWindow,
    intake::Intake,
    unpacked::{Buffers, LoadMode, Unpacked},
    visitor::Visitor,
};
use crate::{file::FileBytes, message::Error};

/// Compressed bytes of the chunks in flight; a larger chunk is read alone.
const AHEAD_LIMIT_BYTES: u64 = 24 << 20;
/// Fewer compressed bytes ahead are not worth a second thread: it starts in the time that one needs for as many.
const WORTH_A_THREAD_BYTES: u64 = 64 << 10;
/// Shorter files are read in some milliseconds.
const SHORT_FILE_BYTES: u64 = 4 << 20;
const MOST_THREADS: usize = 8;

enum Job {
    Waiting(Unpacked),
    Running,
    Done(Result<Unpacked, Error>),
}

struct State {
    jobs: VecDeque<(Range<u64>, Job)>,
    spare: Vec<Unpacked>,
    is_over: bool,
}

/// The tools of one thread.
struct Worker<'s> {
    file: &'s FileBytes,
    intake: Option<&'s Intake<'s>>,
    decompressor: Decompressor,
    /// Used for chunk after chunk while their content is not needed later, so that it stays in the
    /// processor's cache.
    buffers: Buffers,
}

impl<'s> Worker<'s> {
    fn new(file: &'s FileBytes, intake: Option<&'s Intake<'s>>) -> Self {
        Self {
            file,
            intake,
            decompressor: Decompressor::default(),
            buffers: Buffers::default(),
        }
    }

    fn unpack<G: Grammar>(
        &mut self,
        unpacked: &mut Unpacked,
        bytes: &Range<u64>,
    ) -> Result<(), Error> {
        if !unpacked.was_kept() {
            unpacked.exchange(&mut self.buffers);
            unpacked.load::<G>(self.file, bytes, LoadMode::Whole, &mut self.decompressor)?;
        }
        if let Some(intake) = self.intake {
            let share = (bytes.end - bytes.start) as f64 / self.file.len() as f64;
            unpacked.take_in::<G>(intake, share);
        }
        if unpacked.is_done_with_content() {
            unpacked.exchange(&mut self.buffers);
            self.buffers.forget_large();
        }
        Ok(())
    }
}

/// State shared by the threads.
pub(super) struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // No thread panics while holding the lock, and the state would still be consistent.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&self) {
        self.lock().is_over = true;
        self.changed.notify_all();
    }

    /// Decompresses one waiting chunk, if any.
    fn help<'s, G: Grammar>(
        &'s self,
        mut state: MutexGuard<'s, State>,
        worker: &mut Worker<'_>,
    ) -> Result<MutexGuard<'s, State>, MutexGuard<'s, State>> {
        let waiting = state
            .jobs
            .iter_mut()
            .find(|(_, job)| matches!(job, Job::Waiting(_)));
        let Some((bytes, job)) = waiting else {
            return Err(state);
        };
        let bytes = bytes.clone();
        let Job::Waiting(mut unpacked) = std::mem::replace(job, Job::Running) else {
            return Err(state);
        };
        drop(state);
        let done = worker.unpack::<G>(&mut unpacked, &bytes).map(|()| unpacked);
        let mut state = self.lock();
        if let Some((_, job)) = state.jobs.iter_mut().find(|(known, _)| *known == bytes) {
            *job = Job::Done(done);
        }
        self.changed.notify_all();
        Ok(state)
    }

    fn work<G: Grammar>(&self, mut worker: Worker<'_>) {
        let mut state = self.lock();
        while !state.is_over {
            state = match self.help::<G>(state, &mut worker) {
                Ok(state) => state,
                Err(state) => self
                    .changed
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner),
            };
        }
    }
}

/// The chunk in which the last walk over a file was stopped, unpacked.
#[derive(Default)]
pub(super) struct KeptChunk(Mutex<Option<(Range<u64>, Unpacked)>>);

impl KeptChunk {
    fn lock(&self) -> MutexGuard<'_, Option<(Range<u64>, Unpacked)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// State shared by several threads, and the function that starts them.
#[derive(Clone, Copy)]
struct Threads<'s> {
    shared: &'s Shared,
    start: &'s dyn Fn(),
}

/// Delivers chunks in the order of the walk.
pub(super) struct Chunks<'s, G> {
    file: &'s FileBytes,
    threads: Option<Threads<'s>>,
    are_started: bool,
    is_first: bool,
    worker: Worker<'s>,
    spare: Unpacked,
    /// Chunk that the walk before has left, with its range of bytes.
    kept: Option<(Range<u64>, Unpacked)>,
    /// Slot in which this walk may leave a chunk.
    keep_in: &'s KeptChunk,
    /// Finds the next chunks without reading them.
    scout: HeadWindow<'s>,
    scouted: u64,
    most_jobs: usize,
    grammar: PhantomData<G>,
}

/// Runs `walk` with chunks read ahead where that is worthwhile.
pub(super) fn with_chunks<G: Grammar, R>(
    file: &FileBytes,
    intake: Option<&Intake<'_>>,
    kept: &KeptChunk,
    walk: impl FnOnce(Chunks<'_, G>) -> R,
) -> R {
    let threads = threads_for(file);
    let worker = Worker::new(file, intake);
    if threads < 2 {
        return walk(Chunks::new(worker, None, 0, kept));
    }
    let shared = Shared {
        state: Mutex::new(State {
            jobs: VecDeque::new(),
            spare: Vec::new(),
            is_over: false,
        }),
        changed: Condvar::new(),
    };
    std::thread::scope(|scope| {
        let shared = &shared;
        let start = || {
            for _ in 1..threads {
                scope.spawn(move || shared.work::<G>(Worker::new(file, intake)));
            }
        };
        // Also if the walk panics in the caller's code: the threads must not wait forever.
        let _end = EndGuard(shared);
        let several = Threads {
            shared,
            start: &start,
        };
        walk(Chunks::new(worker, Some(several), 2 * threads, kept))
    })
}

/// Returns the largest number of threads that read a file.
fn threads_for(file: &FileBytes) -> usize {
    // A worker of a fleet is alone in its pool: the other processors have workers of their own, and a second thread
    // would only cost its start and its memory.
    let is_alone = rayon::current_thread_index().is_some() && rayon::current_num_threads() == 1;
    match file.len() {
        // what is transferred from a bucket is read ahead there
        _ if file.is_partial() => 1,
        ..SHORT_FILE_BYTES if is_alone => 1,
        _ => {
            let processors = std::thread::available_parallelism().map_or(1, usize::from);
            processors.min(MOST_THREADS)
        }
    }
}

struct EndGuard<'s>(&'s Shared);

impl Drop for EndGuard<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}

impl<'s, G: Grammar> Chunks<'s, G> {
    fn new(
        worker: Worker<'s>,
        threads: Option<Threads<'s>>,
        most_jobs: usize,
        keep_in: &'s KeptChunk,
    ) -> Self {
        let file = worker.file;
        Self {
            file,
            threads,
            are_started: false,
            is_first: true,
            worker,
            spare: Unpacked::default(),
            // Taken in any case: it is needed now or never.
            kept: keep_in.lock().take(),
            keep_in,
            scout: HeadWindow::new(file),
            scouted: 0,
            most_jobs,
            grammar: PhantomData,
        }
    }

    /// The chunk at these bytes. The visitor decides which of the following chunks to read ahead.
    pub(super) fn take<V: Visitor>(
        &mut self,
        bytes: &Range<u64>,
        visitor: &V,
    ) -> Result<Unpacked, Error> {
        let is_first = std::mem::take(&mut self.is_first);
        let threads = self
            .threads
            .filter(|_| !is_first || self.worker.intake.is_some());
        let Some(threads) = threads else {
            let mut unpacked = self.unused(bytes);
            self.worker.unpack::<G>(&mut unpacked, bytes)?;
            return Ok(unpacked);
        };
        self.send_ahead(threads, bytes, visitor)?;
        let shared = threads.shared;
        let mut state = shared.lock();
        loop {
            match state.jobs.front_mut() {
                Some((known, job)) if known == bytes => {
                    match std::mem::replace(job, Job::Running) {
                        Job::Done(done) => {
                            state.jobs.pop_front();
                            return done;
                        }
                        Job::Waiting(mut unpacked) => {
                            state.jobs.pop_front();
                            drop(state);
                            self.worker.unpack::<G>(&mut unpacked, bytes)?;
                            return Ok(unpacked);
                        }
                        Job::Running => {}
                    }
                }
                _ => {
                    drop(state);
                    return self.load(bytes, LoadMode::Whole);
                }
            }
            state = match shared.help::<G>(state, &mut self.worker) {
                Ok(state) => state,
                Err(state) => shared
                    .changed
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    /// Returns the buffer to unpack a chunk into, or the kept chunk if it is the same.
    fn unused(&mut self, bytes: &Range<u64>) -> Unpacked {
        let of_kept = self.kept.take_if(|(known, _)| known.start <= bytes.start);
        match of_kept.filter(|(known, _)| known == bytes) {
            Some((_, unpacked)) => unpacked,
            None => match self.threads {
                Some(Threads { shared, .. }) => shared.lock().spare.pop().unwrap_or_default(),
                None => std::mem::take(&mut self.spare),
            },
        }
    }

    /// Keeps a chunk for the next walk.
    pub(super) fn keep(&mut self, bytes: &Range<u64>, unpacked: Unpacked) {
        match unpacked.keep() {
            Ok(unpacked) => *self.keep_in.lock() = Some((bytes.clone(), unpacked)),
            Err(unpacked) => self.give_back(unpacked),
        }
    }

    /// Reads a chunk now.
    pub(super) fn load(&mut self, bytes: &Range<u64>, how: LoadMode) -> Result<Unpacked, Error> {
        let mut unpacked = std::mem::take(&mut self.spare);
        unpacked.load::<G>(self.file, bytes, how, &mut self.worker.decompressor)?;
        Ok(unpacked)
    }

    /// Returns a chunk, to reuse its buffers.
    pub(super) fn give_back(&mut self, mut unpacked: Unpacked) {
        unpacked.forget_large();
        match self.threads {
            Some(Threads { shared, .. }) => {
                let mut state = shared.lock();
                if state.spare.len() < self.most_jobs {
                    state.spare.push(unpacked);
                }
            }
            None => self.spare = unpacked,
        }
    }

    /// Finds the next wanted chunks and queues them for the threads.
    fn send_ahead<V: Visitor>(
        &mut self,
        Threads { shared, start }: Threads<'_>,
        bytes: &Range<u64>,
        visitor: &V,
    ) -> Result<(), Error> {
        let mut state = shared.lock();
        // The walk no longer needs chunks that it has passed.
        while state
            .jobs
            .front()
            .is_some_and(|(known, _)| known.start < bytes.start)
        {
            state.jobs.pop_front();
        }
        let mut count = state.jobs.len();
        let sizes = state.jobs.iter().map(|(known, _)| known.end - known.start);
        let mut sum: u64 = sizes.sum();
        drop(state);
        self.scouted = self.scouted.max(bytes.start);
        while count < self.most_jobs {
            let Some((next, is_wanted)) = self.scout_one(visitor)? else {
                break;
            };
            let size = next.end - next.start;
            if is_wanted && count > 0 && sum + size > AHEAD_LIMIT_BYTES {
                break;
            }
            self.scouted = next.end;
            if !is_wanted {
                continue;
            }
            let unpacked = self.unused(&next);
            shared.lock().jobs.push_back((next, Job::Waiting(unpacked)));
            shared.changed.notify_one();
            count += 1;
            sum += size;
        }
        if !self.are_started && sum.saturating_sub(bytes.end - bytes.start) >= WORTH_A_THREAD_BYTES
        {
            self.are_started = true;
            start();
        }
        Ok(())
    }

    /// The next record, and whether it is a wanted chunk; `None` where only the walk can proceed.
    fn scout_one<V: Visitor>(&mut self, visitor: &V) -> Result<Option<(Range<u64>, bool)>, Error> {
        let offset = self.scouted;
        let head = self.scout.bytes(offset, G::HEAD_BYTES as u64)?;
        let Some(frame) = G::frame(head) else {
            return Ok(None);
        };
        let end = offset.saturating_add(frame.length_bytes);
        let is_chunk = match frame.kind {
            Kind::Chunk => visitor.wants_chunk(offset),
            Kind::Index => false,
            _ => return Ok(None),
        };
        Ok((end <= self.file.len()).then_some((offset..end, is_chunk)))
    }
}
