//! Objects read by position: what comes, what it costs, and what happens when it changes.

use tipwatch_storage::{ErrorKind, Location, Object};

use crate::server::{Fault, SECRET, Seen, Server};
use crate::support::{content, folder, open, read, serve};

const SIZE: usize = 3 << 20;

#[test]
fn planned_ranges_are_merged_and_nothing_comes_twice() {
    let server = serve("ranges");
    let bytes = content(SIZE);
    folder("s3://ranges").put("x", &bytes).unwrap();
    server.take_seen();
    let object = open("s3://ranges/x");
    assert_eq!(object.size(), SIZE as u64);
    assert_eq!(
        server.take_seen()[0].range.as_deref(),
        Some("bytes=-131072")
    );
    // the end is here
    assert_eq!(read(&object, SIZE - 100, 100), bytes[SIZE - 100..]);
    assert_eq!(server.take_seen().len(), 0);
    let ranges = [
        (0, 5000),
        (8000, 4000),
        (1_000_000, 200_000),
        (2_000_000, 10),
    ];
    let as_range = |(at, count): (usize, usize)| at as u64..(at + count) as u64;
    object.plan(ranges.map(as_range).into());
    for (at, count) in ranges {
        assert_eq!(read(&object, at, count), bytes[at..at + count]);
    }
    let seen = server.take_seen();
    assert_eq!(seen.len(), 3, "{seen:?}");
    assert_eq!(seen[0].range.as_deref(), Some("bytes=0-11999"));
    let cost = object.transfer();
    assert_eq!(
        (cost.requests, cost.bytes),
        (4, 131_072 + 12_000 + 200_000 + 10)
    );
    object.require_all().unwrap();
    assert!(object.is_whole() && std::fs::read(object.data()).unwrap() == bytes);
    // the ten bytes lie between two missing parts: one request is cheaper than two
    assert_eq!(object.transfer().bytes, SIZE as u64 + 10);
    let beyond = object.read_at(SIZE as u64 - 1, &mut [0; 2]).unwrap_err();
    assert_eq!(beyond.kind, ErrorKind::Incomplete);
}

#[test]
fn a_reader_that_stops_early_has_cost_little() {
    let server = serve("early");
    folder("s3://early").put("x", &content(SIZE)).unwrap();
    let object = open("s3://early/x");
    server.take_seen();
    object.plan((0..20).map(|i| i * 140_000..i * 140_000 + 1000).collect());
    read(&object, 0, 10);
    // the second may be under way
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert!(server.take_seen().len() <= 3);
}

#[test]
fn small_and_empty_objects_are_read() {
    let server = serve("small");
    for length in [0, 1, 100] {
        folder("s3://small")
            .put("x", &content(SIZE)[..length])
            .unwrap();
        if length == 0 {
            // as S3 answers; s3s-fs would stop
            server.inject(1, |seen| seen.range.is_some(), Fault::Status(416));
        }
        let object = open("s3://small/x");
        assert_eq!((object.size(), object.is_whole()), (length as u64, true));
        assert_eq!(read(&object, 0, length), content(SIZE)[..length]);
    }
    let absent = Object::open(&Location::parse("s3://small/none").unwrap());
    assert_eq!(absent.unwrap_err().kind, ErrorKind::NotFound);
    let bucket = Object::open(&Location::parse("s3://small").unwrap());
    assert_eq!(bucket.unwrap_err().kind, ErrorKind::NotFound);
}

#[test]
fn an_object_that_changes_between_two_reads_is_an_error() {
    let server = serve("changing");
    let there = folder("s3://changing");
    there.put("x", &content(SIZE)).unwrap();
    let object = open("s3://changing/x");
    read(&object, 0, 100);
    let mut other = content(SIZE);
    other[1_000_000] ^= 1;
    there.put("x", &other).unwrap();
    let error = object.read_at(1_000_000, &mut [0; 100]).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Changed, "{error}");
    // between the two halves of one request
    let object = open("s3://changing/x");
    let is_range = |seen: &Seen| {
        seen.range
            .as_ref()
            .is_some_and(|r| !r.starts_with("bytes=-"))
    };
    let path = server.folder().join("changing/x");
    server.inject(1, is_range, Fault::Cut(1000));
    server.inject(1, is_range, Fault::Replace(path, b"short now".to_vec()));
    let error = object.read_at(0, &mut [0; 5000]).unwrap_err();
    assert!(
        matches!(
            error.kind,
            ErrorKind::Changed | ErrorKind::Refused | ErrorKind::Incomplete
        ),
        "{error}"
    );
}

#[test]
fn objects_of_a_web_server_are_read_by_a_url_with_a_secret() {
    let server = Server::start_public("web");
    std::fs::write(server.folder().join("web/a b.bin"), content(SIZE)).unwrap();
    let url = format!("http://{}/web/a%20b.bin?token={SECRET}", server.address);
    let object = open(&url);
    assert_eq!(object.size(), SIZE as u64);
    assert_eq!(read(&object, 5000, 10), content(SIZE)[5000..5010]);
    for seen in server.take_seen() {
        assert!(seen.path.ends_with(&format!("?token={SECRET}")), "{seen:?}");
    }
    server.inject(9, |_| true, Fault::Status(403));
    let error = object.read_at(1_000_000, &mut [0; 9]).unwrap_err();
    assert_eq!(error.kind, ErrorKind::PermissionDenied);
    let shown = format!("{error} {object:?}");
    assert!(
        shown.contains("a%20b.bin") && !shown.contains(SECRET),
        "{shown}"
    );
}

#[test]
fn a_refusal_tells_the_code_and_the_region() {
    let server = serve("refusing");
    folder("s3://refusing").put("x", &content(10)).unwrap();
    let elsewhere = Some("eu-central-1");
    for (status, code, region, kind) in [
        (301, "PermanentRedirect", elsewhere, ErrorKind::Refused),
        (307, "TemporaryRedirect", elsewhere, ErrorKind::Refused),
        (
            400,
            "AuthorizationHeaderMalformed",
            elsewhere,
            ErrorKind::Refused,
        ),
        (400, "ExpiredToken", None, ErrorKind::PermissionDenied),
        (403, "InvalidAccessKeyId", None, ErrorKind::PermissionDenied),
        (
            403,
            "AccessDenied",
            Some("us-east-1"),
            ErrorKind::PermissionDenied,
        ),
        (404, "NoSuchKey", None, ErrorKind::NotFound),
        (503, "SlowDown", None, ErrorKind::Unavailable),
    ] {
        // GET, and HEAD, whose answer has no code
        server.inject(9, |_| true, Fault::Refusal(status, code, region));
        let error = Object::open(&Location::parse("s3://refusing/x").unwrap()).unwrap_err();
        assert_eq!(error.kind, kind, "{code}: {error}");
        let told = error.to_string();
        assert!(told.contains(&format!("{status} {code}")), "{code}: {told}");
        let is_elsewhere = region == elsewhere;
        assert_eq!(
            told.contains("AWS_REGION=eu-central-1"),
            is_elsewhere,
            "{told}"
        );
        assert_eq!(told.contains("AWS_REGION"), is_elsewhere, "{told}");
        assert!(!told.contains(SECRET), "{told}");
        server.heal();
    }
    assert_eq!(open("s3://refusing/x").size(), 10);
}
