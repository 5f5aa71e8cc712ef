//! Messages that wait for the recorder's disk.

use std::collections::VecDeque;

use loom::sync::Arc;
use loom::sync::atomic::{AtomicBool, Ordering};
use loom::thread;

use crate::pending::{Dropped, Encoded, Kind, Pending};

fn message(sequence: u32) -> Encoded {
    Encoded {
        kind: Kind::Sample(0),
        sequence,
        session_ns: 0,
        log_time_ns: 0,
        publish_time_ns: 0,
        data: vec![0; 8],
    }
}

fn sequences(messages: &VecDeque<Encoded>) -> Vec<u32> {
    messages.iter().map(|message| message.sequence).collect()
}

/// Two messages and a loss, while the writer empties the queue until it is told the end. `fails` tells of which looks
/// the writing fails.
fn written(fails: fn(usize) -> bool) {
    loom::model(move || {
        let pending = Arc::new(Pending::default());
        let ends = Arc::new(AtomicBool::new(false));
        let writer = {
            let (pending, ends) = (Arc::clone(&pending), Arc::clone(&ends));
            thread::spawn(move || {
                let (mut written, mut lost) = (Vec::new(), Dropped::default());
                for look in 0.. {
                    // as the writer does: first the flag, then the queue
                    let is_last = ends.load(Ordering::Acquire);
                    let (messages, dropped) = pending.take();
                    if fails(look) && !is_last {
                        pending.give_back(messages, dropped);
                    } else {
                        written.extend(sequences(&messages));
                        lost.samples += dropped.samples;
                        lost.verdicts += dropped.verdicts;
                    }
                    if is_last {
                        break;
                    }
                    thread::yield_now();
                }
                (written, lost)
            })
        };
        pending.push(message(1));
        pending.note_dropped(3, 1);
        pending.push(message(2));
        ends.store(true, Ordering::Release);
        let (written, lost) = writer.join().expect("a writer that ends");
        assert_eq!(written, [1, 2], "all, once, in order");
        assert_eq!((lost.samples, lost.verdicts), (3, 1));
    });
}

// requirement: TW-RECORD-03
#[test]
fn everything_before_the_end_is_written_once_and_in_order() {
    written(|_| false);
}

// requirement: TW-RECORD-03
#[test]
fn what_could_not_be_written_keeps_its_place() {
    written(|look| look == 0);
}

/// The model finds the error that the rule excludes: a writer that looks at the queue first loses messages.
#[test]
#[should_panic(expected = "lost at the end")]
fn emptying_the_queue_before_looking_for_the_end_loses_messages() {
    loom::model(|| {
        let pending = Arc::new(Pending::default());
        let ends = Arc::new(AtomicBool::new(false));
        let writer = {
            let (pending, ends) = (Arc::clone(&pending), Arc::clone(&ends));
            thread::spawn(move || {
                let mut written = 0;
                loop {
                    written += pending.take().0.len();
                    if ends.load(Ordering::Acquire) {
                        return written;
                    }
                    thread::yield_now();
                }
            })
        };
        pending.push(message(1));
        ends.store(true, Ordering::Release);
        assert_eq!(writer.join().expect("a writer"), 1, "lost at the end");
    });
}
