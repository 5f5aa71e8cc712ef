//! Web servers: without ranges, without tags of versions, with broken answers.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tipwatch_storage::{Access, Error, ErrorKind, Location, Object, connect, set_whole_reads};

use crate::clouds::{Cloud, Fault, Request, SECRET, Tells};
use crate::support::{content, folder};

/// Larger than what is read when an object is opened.
const SIZE: usize = 1 << 20;

/// A server with one object.
fn serve(tells: Tells) -> Cloud {
    let cloud = Cloud::web(tells);
    let access = Access {
        timeout: Duration::from_secs(1),
        attempts: 3,
        first_wait: Duration::from_millis(5),
        ..Access::default()
    };
    connect(&cloud.place, access);
    cloud.objects().put("logs/x.mcap", &content(SIZE), false);
    cloud
}

fn open(cloud: &Cloud) -> Result<Object, Error> {
    let url = format!("{}?token={SECRET}", cloud.at("logs/x.mcap"));
    Object::open(&Location::parse(&url).unwrap())
}

fn read(object: &Object, at: usize, count: usize) -> Result<Vec<u8>, Error> {
    let mut bytes = vec![0; count];
    object.read_at(at as u64, &mut bytes).map(|()| bytes)
}

/// Whole reads are allowed or not for the process: one test at a time.
fn whole_reads(allowed: bool) -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    let guard = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    set_whole_reads(allowed);
    guard
}

fn kind_and_text(error: &Error) -> (ErrorKind, String) {
    let text = format!("{error} {error:?}");
    assert!(!text.contains(SECRET), "{text}");
    (error.kind, text)
}

#[test]
fn a_server_without_ranges_is_read_as_a_whole_if_allowed() {
    let tells = Tells {
        ranges: false,
        ..Tells::ALL
    };
    let cloud = serve(tells);
    {
        let _one = whole_reads(false);
        let (kind, text) = kind_and_text(&open(&cloud).unwrap_err());
        assert_eq!(kind, ErrorKind::NoRanges, "{text}");
        assert!(text.contains("--fetch-whole"), "{text}");
    }
    let _one = whole_reads(true);
    let object = open(&cloud).unwrap();
    assert!(object.is_whole());
    assert_eq!(read(&object, 5000, 100).unwrap(), content(SIZE)[5000..5100]);
    set_whole_reads(false);
}

#[test]
fn a_replaced_object_is_found_by_its_time_where_there_is_no_tag() {
    let tells = Tells {
        e_tag: false,
        ..Tells::ALL
    };
    let cloud = serve(tells);
    let object = open(&cloud).unwrap();
    assert_eq!(object.e_tag(), None);
    assert_eq!(read(&object, 0, 100).unwrap(), content(SIZE)[..100]);
    let mut other = content(SIZE);
    other[500_000] ^= 1;
    cloud.objects().put("logs/x.mcap", &other, false);
    let (kind, text) = kind_and_text(&read(&object, 500_000, 100).unwrap_err());
    assert_eq!(kind, ErrorKind::Changed, "{text}");
}

#[test]
fn a_server_that_tells_nothing_of_versions_is_read_in_one_request_only() {
    let tells = Tells {
        e_tag: false,
        modified: false,
        ..Tells::ALL
    };
    let cloud = serve(tells);
    {
        let _one = whole_reads(false);
        let (kind, text) = kind_and_text(&open(&cloud).unwrap_err());
        assert_eq!(kind, ErrorKind::NoRanges, "{text}");
        assert!(text.contains("Last-Modified"), "{text}");
        // a small one comes with the first request
        cloud
            .objects()
            .put("logs/x.mcap", &content(SIZE)[..1000], false);
        let object = open(&cloud).unwrap();
        assert_eq!(read(&object, 0, 1000).unwrap(), content(SIZE)[..1000]);
    }
    let _one = whole_reads(true);
    cloud.objects().put("logs/x.mcap", &content(SIZE), false);
    cloud.server.take_seen();
    let object = open(&cloud).unwrap();
    assert!(object.is_whole());
    assert_eq!(
        read(&object, 700_000, 9).unwrap(),
        content(SIZE)[700_000..700_009]
    );
    assert_eq!(cloud.server.take_seen().len(), 2);
    set_whole_reads(false);
}

#[test]
fn broken_bodies_are_asked_for_again_and_never_taken() {
    let cloud = serve(Tells::ALL);
    let is_get = |request: &Request| request.method == "GET";
    for fault in [
        Fault::Cut(100),
        Fault::Cut(0),
        Fault::StateLess(10),
        Fault::StateMore(10),
        Fault::OtherRange,
        Fault::Garbage,
        Fault::LoseAnswer,
    ] {
        // it passes
        let object = open(&cloud).unwrap();
        cloud.server.inject(2, is_get, fault.clone());
        let got = read(&object, 300_000, 5000).unwrap_or_else(|error| panic!("{fault:?}: {error}"));
        assert!(got == content(SIZE)[300_000..305_000], "{fault:?}");
        // it stays
        let object = open(&cloud).unwrap();
        cloud.server.inject(99, is_get, fault.clone());
        let (kind, text) = kind_and_text(&read(&object, 300_000, 5000).unwrap_err());
        let is_typed = matches!(kind, ErrorKind::Incomplete | ErrorKind::Unavailable);
        assert!(is_typed, "{fault:?}: {text}");
        assert!(text.contains("attempt 3 of 3"), "{fault:?}: {text}");
        // what has come before is there still
        let tail = read(&object, SIZE - 10, 10).unwrap();
        assert_eq!(tail, content(SIZE)[SIZE - 10..]);
        cloud.server.heal();
    }
}

#[test]
fn whole_bodies_that_break_are_never_taken_as_shorter_files() {
    let cloud = serve(Tells::ALL);
    let there = folder(&cloud.at("logs"));
    for fault in [Fault::Cut(1000), Fault::StateMore(10), Fault::LoseAnswer] {
        cloud.server.inject(99, |_| true, fault.clone());
        let (kind, text) = kind_and_text(&there.get("x.mcap").unwrap_err());
        let is_typed = matches!(kind, ErrorKind::Incomplete | ErrorKind::Unavailable);
        assert!(is_typed, "{fault:?}: {text}");
        cloud.server.heal();
    }
    // without its length it cannot be told from a shorter one
    cloud.server.inject(99, |_| true, Fault::Chunked);
    let (_, text) = kind_and_text(&there.get("x.mcap").unwrap_err());
    assert!(text.contains("Content-Length"), "{text}");
}

#[test]
fn what_a_web_server_cannot_do_is_told() {
    let cloud = serve(Tells::ALL);
    let there = folder(&cloud.at("logs"));
    let (kind, text) = kind_and_text(&there.list("*").unwrap_err());
    assert!(
        matches!(kind, ErrorKind::Refused | ErrorKind::Unsupported),
        "{text}"
    );
    assert!(text.contains("405"), "{text}");
    let (kind, text) = kind_and_text(&there.put_if_absent("new", b"x").unwrap_err());
    assert_eq!(kind, ErrorKind::Unsupported, "{text}");
    there.put("new", b"whole").unwrap();
    assert_eq!(cloud.objects().get("logs/new").unwrap().bytes, b"whole");
    assert!(cloud.objects().keys().contains(&"logs/new".to_owned()));
}
