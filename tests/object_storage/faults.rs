//! Faults while a log is read: a typed error, or every message.

use std::time::Duration;

use mcap::Compression;
use tipwatch_ingest::Error;
use tipwatch_storage::ErrorKind;
use tipwatch_tests::data;

use super::image_log::image_log;
use super::server::{Fault, Seen};
use super::{messages, open, serve, serve_within, upload};

/// Timeout short enough to wait for an answer that never comes, and a thousand times as long as the server of the tests takes for
/// an answer.
const SHORT: Duration = Duration::from_secs(3);

fn is_range(seen: &Seen) -> bool {
    // not the suffix read of the opening
    seen.range
        .as_ref()
        .is_some_and(|range| !range.starts_with("bytes=-"))
}

fn kind(error: &Error) -> ErrorKind {
    let Error::Storage(error) = error else {
        panic!("{error:?}")
    };
    error.kind
}

#[test]
fn faults_that_pass_change_no_message() {
    let server = serve_within("passing-log", SHORT);
    let bytes = image_log(&data("tiny_lift.mcap"), Some(Compression::Zstd));
    upload("passing-log", "log.mcap", &bytes);
    let expected = messages(&open("s3://passing-log/log.mcap").unwrap(), "/")
        .unwrap()
        .0;
    for fault in [
        Fault::Status(503),
        Fault::Status(429),
        Fault::Cut(1000),
        Fault::Short(1000),
        Fault::LoseAnswer,
        Fault::Hang,
    ] {
        server.heal();
        server.inject(1, |seen| !is_range(seen), fault.clone());
        server.inject(2, is_range, fault.clone());
        let log = open("s3://passing-log/log.mcap").unwrap();
        let (found, losses) = messages(&log, "/").unwrap();
        assert!(found == expected && losses.is_empty(), "{fault:?}");
    }
}

#[test]
fn faults_that_stay_are_typed_errors() {
    let server = serve_within("staying-log", SHORT);
    let bytes = image_log(&data("tiny_lift.mcap"), Some(Compression::Zstd));
    upload("staying-log", "log.mcap", &bytes);
    for (fault, expected) in [
        (Fault::Status(503), ErrorKind::Unavailable),
        (Fault::Status(403), ErrorKind::PermissionDenied),
        (Fault::Status(404), ErrorKind::NotFound),
        (Fault::Short(1000), ErrorKind::Incomplete),
        (Fault::Hang, ErrorKind::TimedOut),
    ] {
        server.heal();
        let log = open("s3://staying-log/log.mcap").unwrap();
        // the first part comes, a later one does not
        let mut ranges = 0;
        let later = std::sync::Mutex::new(move |seen: &Seen| {
            ranges += usize::from(is_range(seen));
            ranges > 2
        });
        server.inject(99, move |seen| later.lock().unwrap()(seen), fault.clone());
        let error = messages(&log, "/").unwrap_err();
        assert_eq!(kind(&error), expected, "{fault:?}: {error}");
        let text = error.to_string();
        assert!(text.starts_with("s3://staying-log/log.mcap: "), "{text}");
        // also for whoever asks next
        assert!(messages(&log, "/camera").is_err());
    }
}

#[test]
fn a_log_that_is_replaced_while_it_is_read_is_an_error() {
    let server = serve("replaced");
    let bytes = image_log(&data("tiny_lift.mcap"), Some(Compression::Zstd));
    upload("replaced", "log.mcap", &bytes);
    let log = open("s3://replaced/log.mcap").unwrap();
    let mut other = bytes.clone();
    let middle = other.len() / 2;
    other[middle] ^= 1;
    upload("replaced", "log.mcap", &other);
    server.take_seen();
    let error = messages(&log, "/camera").unwrap_err();
    assert_eq!(kind(&error), ErrorKind::Changed, "{error}");
    assert!(
        error.to_string().contains("replaced after it was opened"),
        "{error}"
    );
    // as far as it is known already, the old version is complete
    assert!(messages(&log, "/none").unwrap().0.is_empty());
}

#[test]
fn a_log_without_index_is_not_transferred_unasked() {
    let server = serve("cut");
    let bytes = image_log(&data("tiny_lift.mcap"), Some(Compression::Zstd));
    upload("cut", "log.mcap", &bytes[..bytes.len() - 40_000]);
    server.take_seen();
    let error = open("s3://cut/log.mcap").unwrap_err();
    assert_eq!(kind(&error), ErrorKind::WholeRead, "{error}");
    assert!(error.to_string().contains("--fetch-whole"), "{error}");
    assert!(server.take_seen().len() <= 2);
    let error = open("s3://cut/absent.mcap").unwrap_err();
    assert_eq!(kind(&error), ErrorKind::NotFound, "{error}");
}
