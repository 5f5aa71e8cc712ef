//! Reading from a bucket gives the content of the file, for few bytes and requests.

use mcap::Compression;
use tipwatch_tests::data;

use super::image_log::image_log;
use super::{messages, open, serve, upload};

/// Joint states of a log that is nine tenths images cost less than 5 % of its bytes.
#[test]
fn val_joint_states_of_a_log_of_images_cost_less_than_5_percent() {
    let server = serve("images");
    let bytes = image_log(&data("tiny_lift.mcap"), Some(Compression::Zstd));
    upload("images", "shift/log.mcap", &bytes);
    server.take_seen();
    let log = open("s3://images/shift/log.mcap").unwrap();
    assert_eq!(server.take_seen().len(), 1, "the summary costs one request");
    let (found, losses) = messages(&log, "/joint_states").unwrap();
    assert!(
        losses.is_empty() && found.len() > 100,
        "{} {losses:?}",
        found.len()
    );
    let [transfer] = &log.transfers()[..] else {
        panic!("one file")
    };
    assert_eq!(transfer.requests as usize, 1 + server.take_seen().len());
    assert_eq!(transfer.file_bytes, bytes.len() as u64);
    let share = transfer.bytes as f64 / transfer.file_bytes as f64;
    println!("{transfer:?}: {:.2} %", 100.0 * share);
    assert!(share < 0.05, "{share}");
    // again: everything is here
    let again = messages(&log, "/joint_states").unwrap();
    assert_eq!((again.0.len(), server.take_seen().len()), (found.len(), 0));
    // the same messages as in the small log
    let small = open(data("tiny_lift.mcap").to_str().unwrap()).unwrap();
    assert!(messages(&small, "/joint_states").unwrap().0 == found);
}

#[test]
fn every_message_is_that_of_the_local_file() {
    let _server = serve("same");
    for (name, compression) in [("zstd.mcap", Some(Compression::Zstd)), ("plain.mcap", None)] {
        let bytes = image_log(&data("tiny_lift.mcap"), compression);
        let local = tempfile::tempdir().unwrap().keep().join(name);
        std::fs::write(&local, &bytes).unwrap();
        upload("same", name, &bytes);
        let here = open(local.to_str().unwrap()).unwrap();
        for prefix in ["/joint_states", "/imu", "/lidar", "/", "/none"] {
            let there = open(&format!("s3://same/{name}")).unwrap();
            assert_eq!(there.topics().len(), here.topics().len());
            assert_eq!(there.span_ns(), here.span_ns());
            let (expected, found) = (
                messages(&here, prefix).unwrap(),
                messages(&there, prefix).unwrap(),
            );
            assert!(expected.0 == found.0, "{name} {prefix}");
            // whether chunks have checksums is seen in those that are read
            if prefix != "/none" {
                assert_eq!(expected.1.integrity, found.1.integrity, "{name} {prefix}");
            }
            assert!(found.1.is_empty());
        }
        std::fs::remove_dir_all(local.parent().unwrap()).unwrap();
    }
}
