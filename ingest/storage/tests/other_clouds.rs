//! Google Cloud Storage and Azure Blob Storage: the contract of every bucket, and the same faults as on S3.

use std::time::Duration;

use tipwatch_storage::{Access, ErrorKind, Folder, Location, Object, Put, connect, expand};

use crate::clouds::{Cloud, Fault, Request, SECRET};
use crate::folders::keeps_its_contract;
use crate::support::{content, errors_of, folder, open, read};

/// Both, with a bucket of this name each.
fn both(name: &str) -> [Cloud; 2] {
    let both = [Cloud::gcs(name), Cloud::azure(name)];
    for cloud in &both {
        connect(&cloud.place, access(cloud));
    }
    both
}

fn access(cloud: &Cloud) -> Access {
    Access {
        variables: cloud.variables.clone(),
        timeout: Duration::from_secs(1),
        attempts: 3,
        first_wait: Duration::from_millis(5),
        ..Access::default()
    }
}

fn is_put(request: &Request) -> bool {
    request.method == "PUT"
}

#[test]
fn they_keep_the_contract() {
    for cloud in both("contract") {
        keeps_its_contract(&folder(&cloud.at("some/prefix")));
        assert!(
            cloud
                .objects()
                .get("some/prefix/logs/2026/b.json")
                .is_some()
        );
    }
}

#[test]
fn listings_of_several_pages_are_whole() {
    for cloud in both("pages") {
        for number in 0..7 {
            let key = format!("logs/m={}/a & b {number}.mcap", number % 3);
            cloud.objects().put(&key, b"log", false);
        }
        let found = expand(&cloud.at("logs/*/*.mcap")).unwrap().unwrap().found;
        assert_eq!(found.len(), 7, "{}", cloud.place);
        assert_eq!(
            found[0].location.to_string(),
            cloud.at("logs/m=0/a & b 0.mcap")
        );
        let (entries, folders) = folder(&cloud.place).children("logs").unwrap();
        assert_eq!((entries.len(), folders.len()), (0, 3), "{folders:?}");
    }
}

#[test]
fn keys_that_no_request_can_name_do_not_hide_the_others() {
    for cloud in both("unnameable") {
        let unnameable = ["in//b.mcap", "in/./c.mcap", "in/d//e/f.mcap"];
        for key in ["in/a.mcap", "in/b.mcap", "in/d/e/f.mcap", "other"]
            .iter()
            .chain(&unnameable)
        {
            cloud.objects().put(key, b"log", false);
        }
        let folder = folder(&cloud.at("in"));
        let (entries, found) = folder.list_all("**").unwrap();
        let keys: Vec<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
        assert_eq!(keys, ["a.mcap", "b.mcap", "d/e/f.mcap"], "{}", cloud.place);
        assert_eq!(found, ["./c.mcap", "/b.mcap", "d//e/f.mcap"]);
        assert_eq!(folder.list("**").unwrap(), entries);
        let (entries, folders) = folder.children("d").unwrap();
        assert_eq!((entries.len(), folders), (0, vec!["d/e".to_owned()]));
        let expanded = expand(&cloud.at("in/**/f.mcap")).unwrap().unwrap();
        assert_eq!(expanded.found.len(), 1);
        assert_eq!(expanded.unnameable, [cloud.at("in/d//e/f.mcap")]);
        for key in unnameable.iter().chain(&["/in/a.mcap"]) {
            let error = Location::parse(&cloud.at(key)).unwrap_err();
            assert_eq!(error.kind, ErrorKind::NotAPlace, "{error}");
        }
    }
}

#[test]
fn objects_are_read_in_parts_of_one_version() {
    for cloud in both("parts") {
        let bytes = content(3 << 20);
        folder(&cloud.place).put("x", &bytes).unwrap();
        cloud.server.take_seen();
        let object = open(&cloud.at("x"));
        assert_eq!(object.size(), 3 << 20);
        // Azure knows no suffixes: its length has to be asked for
        let requests = if cloud.place.starts_with("az") { 2 } else { 1 };
        assert_eq!(cloud.server.take_seen().len(), requests);
        object.plan(vec![0..5000, 8000..12_000, 1_000_000..1_200_000]);
        assert_eq!(read(&object, 8000, 4000), bytes[8000..12_000]);
        assert_eq!(read(&object, 1_000_000, 9), bytes[1_000_000..1_000_009]);
        let asked: Vec<Request> = cloud.server.take_seen();
        assert_eq!(asked.len(), 2, "{asked:?}");
        assert_eq!(asked[0].header("range"), Some("bytes=0-11999"));
        assert!(asked[0].header("if-match").is_some());
        // replaced by one of equal length
        let mut other = bytes.clone();
        other[2_000_000] ^= 1;
        folder(&cloud.place).put("x", &other).unwrap();
        let error = object.read_at(2_000_000, &mut [0; 100]).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Changed, "{error}");
        // removed
        let object = open(&cloud.at("x"));
        cloud.objects().remove("x");
        let error = object.read_at(2_000_000, &mut [0; 100]).unwrap_err();
        assert_eq!(error.kind, ErrorKind::NotFound, "{error}");
        assert!(
            error.to_string().contains("removed while it was read"),
            "{error}"
        );
    }
}

#[test]
fn small_and_empty_objects_are_read() {
    for cloud in both("small") {
        for length in [0, 1, 100] {
            folder(&cloud.place).put("x", &content(length)).unwrap();
            let object = open(&cloud.at("x"));
            assert_eq!((object.size(), object.is_whole()), (length as u64, true));
            assert_eq!(read(&object, 0, length), content(length));
        }
        let absent = Object::open(&Location::parse(&cloud.at("none")).unwrap());
        assert_eq!(absent.unwrap_err().kind, ErrorKind::NotFound);
    }
}

#[test]
fn large_files_arrive_in_parts_or_not_at_all() {
    for cloud in both("large") {
        let temporary = tempfile::NamedTempFile::new().unwrap();
        let bytes = content(40_000_000);
        std::fs::write(temporary.path(), &bytes).unwrap();
        let patient = Access {
            timeout: Duration::from_secs(60),
            ..access(&cloud)
        };
        connect(&cloud.place, patient);
        let folder = folder(&cloud.at("x"));
        let is_part = |request: &Request| is_put(request) && request.body.len() > 1 << 20;
        cloud.server.inject(1, is_part, Fault::Status(503));
        folder.put_file("whole.bin", temporary.path()).unwrap();
        assert!(cloud.objects().get("x/whole.bin").unwrap().bytes == bytes);
        // what came first is no object
        let is_last = |request: &Request| is_put(request) && request.body.len() < 10_000_000;
        cloud.server.inject(
            9,
            move |request| is_part(request) && is_last(request),
            Fault::Status(503),
        );
        let error = folder.put_file("torn.bin", temporary.path()).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Unavailable, "{error}");
        assert_eq!(cloud.objects().keys(), ["x/whole.bin"]);
    }
}

#[test]
fn of_several_writers_exactly_one_succeeds() {
    for cloud in both("race") {
        let place = cloud.at("records");
        let written = std::thread::scope(|scope| {
            let write = |writer: u8| {
                let place = &place;
                move || {
                    folder(place)
                        .put_if_absent("log.json", &[writer; 9])
                        .unwrap()
                }
            };
            let writers: Vec<_> = (0..8).map(|writer| scope.spawn(write(writer))).collect();
            let results = writers.into_iter().map(|writer| writer.join().unwrap());
            results.filter(|put| *put == Put::Written).count()
        });
        assert_eq!(written, 1, "{}", cloud.place);
    }
}

#[test]
fn a_write_whose_answer_was_lost_counts_as_written() {
    for cloud in both("lost") {
        let folder = folder(&cloud.place);
        cloud.server.inject(1, is_put, Fault::LoseAnswer);
        assert_eq!(folder.put_if_absent("a", b"same").unwrap(), Put::Written);
        // another writer was first
        cloud.server.inject(1, is_put, Fault::Status(503));
        let second = folder.put_if_absent("a", b"other").unwrap();
        assert_eq!(second, Put::AlreadyThere);
        assert_eq!(folder.get("a").unwrap(), b"same");
    }
}

#[test]
fn faults_that_pass_are_survived_and_counted() {
    for cloud in both("passing") {
        let folder = folder(&cloud.place);
        folder.put("a", &content(5000)).unwrap();
        for fault in [
            Fault::Status(503),
            Fault::Status(500),
            Fault::Status(429),
            Fault::Hang,
            Fault::Cut(100),
            Fault::StateMore(7),
            Fault::LoseAnswer,
            Fault::Garbage,
        ] {
            let before = folder.transfer();
            cloud.server.inject(2, |_| true, fault.clone());
            assert!(folder.get("a").unwrap() == content(5000), "{fault:?}");
            let requests = folder.transfer().requests - before.requests;
            assert_eq!(requests, 3, "{fault:?} of {}", cloud.place);
        }
    }
}

#[test]
fn faults_that_stay_are_typed_errors_without_secrets() {
    for cloud in both("staying") {
        let there = folder(&cloud.place);
        there.put("a", &content(5000)).unwrap();
        let all = |fault: Fault| -> ErrorKind {
            cloud.server.heal();
            cloud.server.inject(99, |_| true, fault);
            let place = Location::parse(&cloud.at("a")).unwrap();
            let errors = errors_of([
                &|| there.get("a").err(),
                &|| there.list("**").err(),
                &|| there.put("b", b"x").err(),
                &|| there.put_if_absent("b", b"x").err(),
                &|| Object::open(&place).err(),
            ]);
            for error in &errors {
                assert_eq!(error.kind, errors[0].kind, "{error}");
                let text = format!("{error} {error:?}");
                assert!(
                    text.contains(&cloud.place) && !text.contains(SECRET),
                    "{text}"
                );
            }
            errors[0].kind
        };
        assert_eq!(all(Fault::Status(503)), ErrorKind::Unavailable);
        assert_eq!(all(Fault::Status(403)), ErrorKind::PermissionDenied);
        assert_eq!(all(Fault::Status(400)), ErrorKind::Refused);
        assert_eq!(all(Fault::Hang), ErrorKind::TimedOut);
        cloud.server.heal();
        assert_eq!(cloud.objects().keys(), ["a"], "nothing was written");
    }
}

#[test]
fn wrong_credentials_and_absent_buckets_are_told() {
    for (name, expected) in [
        ("GOOGLE_BEARER_TOKEN", "401"),
        ("AZURE_STORAGE_SAS_TOKEN", "403"),
    ] {
        let cloud = match name.starts_with("GOOGLE") {
            true => Cloud::gcs("there"),
            false => Cloud::azure("there"),
        };
        let mut wrong = access(&cloud);
        let signature = "sv=2024-11-04&sig=wrong-but-no-less-secret";
        wrong.variables.push((name.into(), signature.into()));
        connect(&cloud.place, wrong);
        let error = folder(&cloud.place).get("a").unwrap_err();
        assert_eq!(error.kind, ErrorKind::PermissionDenied, "{error}");
        let text = error.to_string();
        assert!(
            text.contains(expected) && !text.contains("no-less-secret"),
            "{text}"
        );
        let scheme = &cloud.place[..2];
        connect(&format!("{scheme}://absent"), access(&cloud));
        let absent: Folder = folder(&format!("{scheme}://absent"));
        assert_eq!(absent.get("a").unwrap_err().kind, ErrorKind::NotFound);
    }
}
