//! Folders: the same contract for a local one and a bucket, and faults of the latter.

use tipwatch_storage::{
    Access, Error, ErrorKind, Expanded, Folder, Location, Put, connect, expand,
};

use crate::server::{Fault, SECRET, Server};
use crate::support::{access, errors_of, folder, serve};

/// Checks the contract that every folder keeps.
pub(crate) fn keeps_its_contract(folder: &Folder) {
    let keys = |pattern: &str| -> Vec<String> {
        let found = folder.list(pattern).unwrap();
        found.into_iter().map(|entry| entry.key).collect()
    };
    assert_eq!(keys("**"), [""; 0], "an absent folder is empty");
    assert_eq!(
        folder.put_if_absent("logs/a.json", b"first").unwrap(),
        Put::Written
    );
    assert_eq!(
        folder.put_if_absent("logs/a.json", b"second").unwrap(),
        Put::AlreadyThere
    );
    assert_eq!(folder.get("logs/a.json").unwrap(), b"first");
    folder.put("logs/2026/b.json", b"b").unwrap();
    folder.put("logs/2026/b.json", b"bb").unwrap();
    folder.put("other machine=fw%2001/c.txt", b"").unwrap();
    assert_eq!(keys("logs/*.json"), ["logs/a.json"]);
    assert_eq!(keys("**/*.json"), ["logs/2026/b.json", "logs/a.json"]);
    assert_eq!(keys("logs/2???/b.json"), ["logs/2026/b.json"]);
    assert_eq!(
        keys("**"),
        [
            "logs/2026/b.json",
            "logs/a.json",
            "other machine=fw%2001/c.txt"
        ]
    );
    assert_eq!(folder.list("**").unwrap()[0].bytes, 2);
    assert_eq!(folder.get("other machine=fw%2001/c.txt").unwrap(), b"");
    folder.delete("logs/a.json").unwrap();
    folder.delete("logs/a.json").unwrap();
    assert_eq!(
        folder.get("logs/a.json").unwrap_err().kind,
        ErrorKind::NotFound
    );
    for outside in ["../x", "a//b", "", "/x", "a/./b"] {
        let error = folder.put(outside, b"").unwrap_err();
        assert_eq!(error.kind, ErrorKind::NotAPlace, "{outside}: {error}");
    }
}

#[test]
fn local_folders_keep_the_contract() {
    let temporary = tempfile::tempdir().unwrap();
    let place = format!("file://{}/new", temporary.path().display());
    keeps_its_contract(&folder(&place));
    assert!(temporary.path().join("new/logs/2026/b.json").is_file());
}

#[test]
fn buckets_keep_the_contract() {
    let _server = serve("contract");
    keeps_its_contract(&folder("s3://contract/some/prefix"));
}

#[test]
fn large_files_arrive_in_parts_or_not_at_all() {
    let server = serve("parts");
    let temporary = tempfile::NamedTempFile::new().unwrap();
    let bytes: Vec<u8> = (0..40_000_000_u32).map(|i| (i % 251) as u8).collect();
    std::fs::write(temporary.path(), &bytes).unwrap();
    let patient = Access {
        timeout: std::time::Duration::from_secs(60),
        ..access(&server)
    };
    connect("s3://parts", patient);
    let folder = folder("s3://parts/x");
    // one part fails once, later one fails for good
    server.inject(
        1,
        |seen| seen.path.contains("partNumber=2"),
        Fault::Status(503),
    );
    folder.put_file("whole.bin", temporary.path()).unwrap();
    assert!(folder.get("whole.bin").unwrap() == bytes);
    server.inject(
        9,
        |seen| seen.path.contains("partNumber=3"),
        Fault::Status(503),
    );
    let error = folder.put_file("torn.bin", temporary.path()).unwrap_err();
    // a server that refuses a part may close the connection before all of it was sent
    let is_lost = matches!(error.kind, ErrorKind::Unavailable | ErrorKind::Incomplete);
    assert!(is_lost, "{error}");
    assert_eq!(folder.list("**").unwrap().len(), 1);
}

#[test]
fn of_several_writers_exactly_one_succeeds() {
    let _server = serve("race");
    let written = std::thread::scope(|scope| {
        let write = |writer: u8| {
            move || {
                let folder = folder("s3://race/records");
                folder.put_if_absent("log.json", &[writer; 9]).unwrap()
            }
        };
        let writers: Vec<_> = (0..8).map(|writer| scope.spawn(write(writer))).collect();
        let results = writers.into_iter().map(|writer| writer.join().unwrap());
        results.filter(|put| *put == Put::Written).count()
    });
    assert_eq!(written, 1);
}

#[test]
fn a_write_whose_answer_was_lost_counts_as_written() {
    let server = serve("lost");
    let folder = folder("s3://lost");
    let is_put = |seen: &crate::server::Seen| seen.method == "PUT";
    server.inject(1, is_put, Fault::LoseAnswer);
    assert_eq!(folder.put_if_absent("a", b"same").unwrap(), Put::Written);
    // another writer was first
    server.inject(1, is_put, Fault::Status(503));
    assert_eq!(
        folder.put_if_absent("a", b"other").unwrap(),
        Put::AlreadyThere
    );
    assert_eq!(folder.get("a").unwrap(), b"same");
}

#[test]
fn faults_that_pass_are_survived_and_counted() {
    let server = serve("passing");
    let folder = folder("s3://passing");
    folder.put("a", &[7; 5000]).unwrap();
    for fault in [
        Fault::Status(503),
        Fault::Status(500),
        Fault::Status(429),
        Fault::Hang,
        Fault::Cut(100),
        Fault::LoseAnswer,
    ] {
        let before = folder.transfer();
        server.inject(2, |_| true, fault.clone());
        assert!(folder.get("a").unwrap() == [7; 5000], "{fault:?}");
        assert_eq!(folder.transfer().requests - before.requests, 3, "{fault:?}");
    }
}

#[test]
fn faults_that_stay_are_typed_errors_without_secrets() {
    let server = serve("staying");
    let folder = folder("s3://staying");
    folder.put("a", &[7; 5000]).unwrap();
    let all = |fault: Fault| -> Error {
        server.heal();
        server.inject(99, |_| true, fault);
        let errors = errors_of([
            &|| folder.get("a").err(),
            &|| folder.list("**").err(),
            &|| folder.put("b", b"x").err(),
            &|| folder.put_if_absent("b", b"x").err(),
        ]);
        for error in &errors {
            assert_eq!(error.kind, errors[0].kind, "{error}");
            let text = format!("{error} {error:?}");
            assert!(
                text.contains("s3://staying") && !text.contains(SECRET),
                "{text}"
            );
        }
        errors[0].clone()
    };
    assert_eq!(all(Fault::Status(503)).kind, ErrorKind::Unavailable);
    assert_eq!(all(Fault::Status(403)).kind, ErrorKind::PermissionDenied);
    assert_eq!(all(Fault::Status(400)).kind, ErrorKind::Refused);
    let hung = all(Fault::Hang);
    assert_eq!(hung.kind, ErrorKind::TimedOut);
    assert!(hung.to_string().contains("attempt 3 of 3"), "{hung}");
    server.heal();
    assert_eq!(folder.list("**").unwrap().len(), 1, "nothing was written");
    assert_eq!(all(Fault::LoseAnswer).kind, ErrorKind::Unavailable);
}

#[test]
fn wrong_credentials_and_absent_buckets_are_told() {
    let server = Server::start("there");
    let mut wrong = access(&server);
    wrong
        .variables
        .push(("AWS_SECRET_ACCESS_KEY".into(), "wrong".into()));
    connect("s3://there", wrong);
    connect("s3://absent", access(&server));
    let error = folder("s3://there").get("a").unwrap_err();
    assert_eq!(error.kind, ErrorKind::PermissionDenied, "{error}");
    assert!(
        error.to_string().contains("SignatureDoesNotMatch"),
        "{error}"
    );
    assert_eq!(
        folder("s3://absent").get("a").unwrap_err().kind,
        ErrorKind::NotFound
    );
    let nobody = Access {
        variables: vec![("AWS_ENDPOINT_URL".into(), "http://127.0.0.1:1".into())],
        ..access(&server)
    };
    connect(
        "s3://nobody",
        Access {
            variables: [server.variables(), nobody.variables.clone()].concat(),
            ..nobody
        },
    );
    let error = folder("s3://nobody").list("**").unwrap_err();
    assert_eq!(error.kind, ErrorKind::Unavailable, "{error}");
}

#[test]
fn patterns_name_objects() {
    let _server = serve("pattern");
    let folder = folder("s3://pattern");
    for key in [
        "2026-10/a.mcap",
        "2026-11/b.mcap",
        "2026-11/deep/c.mcap",
        "2026-11/d.txt",
    ] {
        folder.put(key, b"log").unwrap();
    }
    let names = |text: &str| -> Vec<String> {
        let Expanded { found, unnameable } = expand(text).unwrap().unwrap();
        assert_eq!(unnameable, [""; 0]);
        found
            .iter()
            .map(|found| found.location.to_string())
            .collect()
    };
    assert_eq!(
        names("s3://pattern/2026-*/*.mcap"),
        ["s3://pattern/2026-10/a.mcap", "s3://pattern/2026-11/b.mcap"]
    );
    assert_eq!(names("s3://pattern/2026-11/**/*.mcap").len(), 2);
    assert_eq!(names("s3://pattern/none/*"), [""; 0]);
    assert!(expand("s3://pattern/2026-11/d.txt").unwrap().is_none());
}

#[test]
fn names_of_places_hide_their_secrets_and_are_found_again() {
    let shown = |text: &str| Location::parse(text).unwrap().to_string();
    assert_eq!(shown("s3://b/a b/c%20d.mcap/"), "s3://b/a b/c%20d.mcap");
    assert_eq!(shown("gs://b"), "gs://b");
    assert_eq!(shown("file:///tmp/a%20b.mcap"), "/tmp/a b.mcap");
    assert_eq!(shown("relative/x.mcap"), "relative/x.mcap");
    let signed = Location::parse("https://me:pw@host:8443/a%20b.mcap?sig=abc").unwrap();
    assert_eq!(signed.to_string(), "https://host:8443/a%20b.mcap");
    let other = Location::parse("https://host:8443/a%20b.mcap?sig=def").unwrap();
    assert_ne!(signed.path(), other.path());
    assert_eq!(Location::of(signed.path()).unwrap(), signed);
    assert_eq!(Location::of(other.path()).unwrap(), other);
    let debug = format!("{signed:?} {other:?}");
    assert!(!debug.contains("pw") && !debug.contains("sig"), "{debug}");
    for wrong in [
        "ftp://x/y",
        "s3://",
        "s3:///key",
        "s3://b/k?X-Amz-Signature=secret",
        "https://",
    ] {
        let error = Location::parse(wrong).unwrap_err();
        assert_eq!(error.kind, ErrorKind::NotAPlace);
        assert!(!error.to_string().contains("secret"), "{error}");
    }
}
