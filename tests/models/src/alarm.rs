//! The latched alarm on its way to the disk.

use loom::sync::Arc;
use loom::sync::atomic::{AtomicU64, Ordering};
use loom::thread;

use crate::exchange::Exchange;

/// Nothing is on the disk.
const NOTHING: u64 = 99;

/// A disk whose first writes fail.
struct Disk {
    // relaxed: whoever reads it relies on the exchange alone
    alarm: AtomicU64,
    failures: AtomicU64,
}

impl Disk {
    fn new(failures: u64) -> Arc<Self> {
        Arc::new(Self {
            alarm: AtomicU64::new(NOTHING),
            failures: AtomicU64::new(failures),
        })
    }

    fn write(&self, alarm: u64) -> bool {
        let failures = self.failures.load(Ordering::Relaxed);
        if failures > 0 {
            self.failures.store(failures - 1, Ordering::Relaxed);
            return false;
        }
        self.alarm.store(alarm, Ordering::Relaxed);
        true
    }
}

/// Alarms 1 and 2 are raised while the other thread writes; `check` is called after each.
fn raised(failures: u64, check: fn(&Exchange, &Disk, u64)) {
    loom::model(move || {
        let exchange = Arc::new(Exchange::new(0));
        let disk = Disk::new(failures);
        let writing = {
            let (exchange, disk) = (Arc::clone(&exchange), Arc::clone(&disk));
            let pause = |_: &Exchange| {
                thread::yield_now();
                true
            };
            thread::spawn(move || exchange.run(pause, |alarm, _| disk.write(alarm)))
        };
        for alarm in 1..=2 {
            exchange.want(alarm);
            check(&exchange, &disk, alarm);
        }
        exchange.end();
        writing.join().expect("a writer that ends");
        check(&exchange, &disk, 2);
        assert_eq!(disk.alarm.load(Ordering::Relaxed), 2, "the last alarm");
        assert!(exchange.is_saved(2) && !exchange.has_failed());
    });
}

// requirement: TW-VERDICT-20
#[test]
fn the_last_alarm_is_on_the_disk_and_none_is_called_saved_before() {
    raised(0, |exchange, disk, alarm| {
        if exchange.is_saved(alarm) {
            assert_eq!(disk.alarm.load(Ordering::Relaxed), alarm);
        }
    });
}

// requirement: TW-FAULT-19
#[test]
fn alarm_whose_write_has_failed_is_not_called_saved() {
    loom::model(|| {
        let exchange = Arc::new(Exchange::new(0));
        let disk = Disk::new(u64::MAX);
        let writing = {
            let (exchange, disk) = (Arc::clone(&exchange), Arc::clone(&disk));
            thread::spawn(move || {
                let pause = |_: &Exchange| {
                    thread::yield_now();
                    true
                };
                exchange.run(pause, |alarm, _| disk.write(alarm));
            })
        };
        exchange.want(1);
        assert!(!exchange.is_saved(1));
        exchange.end();
        writing.join().expect("a writer that ends");
        assert!(exchange.has_failed() && !exchange.is_saved(1));
    });
}
