//! The mounting of the IMU: from transforms in the log, and found wrong.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::report;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::{MountSource, Note, NoteKind};

use super::support::data;

/// Position in `[imu]` of `tiny.toml` (m).
const IMU_IN_BASE: [f64; 3] = [0.1, 0.0, 0.05];

/// `tiny.toml` with another `[imu]`, or none.
fn analysed(log: &Path, imu: &str) -> Analysis {
    let text = fs::read_to_string(data("tiny.toml")).unwrap();
    let (before, rest) = text.split_once("[imu]").unwrap();
    let after = &rest[rest.find("[wheels").unwrap()..];
    let file = MachineFile::from_text(&data("tiny.toml"), &format!("{before}{imu}{after}"));
    analyse(log, &file.unwrap(), Options::default(), &mut |_| {}).unwrap()
}

fn text(bytes: &mut Vec<u8>, text: &str) {
    while !(bytes.len() - 4).is_multiple_of(4) {
        bytes.push(0);
    }
    bytes.extend((text.len() as u32 + 1).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.push(0);
}

/// One transform in CDR.
fn transform(parent: &str, child: &str, xyz: [f64; 3]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend([0; 8]);
    text(&mut bytes, parent);
    text(&mut bytes, child);
    while !(bytes.len() - 4).is_multiple_of(8) {
        bytes.push(0);
    }
    let values = [xyz[0], xyz[1], xyz[2], 0.0, 0.0, 0.0, 1.0];
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// `tiny.mcap` with a `/tf_static` that places the frame of its IMU.
fn with_transform(folder: &Path, parent: &str, child: &str) -> PathBuf {
    let path = folder.join("with_tf.mcap");
    let bytes = fs::read(data("tiny.mcap")).unwrap();
    let mut writer = mcap::Writer::new(File::create(&path).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    let schema = mcap::Schema {
        id: 900,
        name: "tf2_msgs/msg/TFMessage".into(),
        encoding: "ros2msg".into(),
        data: Cow::Borrowed(b""),
    };
    let channel = mcap::Channel {
        id: 900,
        topic: "/tf_static".into(),
        schema: Some(Arc::new(schema)),
        message_encoding: "cdr".into(),
        metadata: BTreeMap::new(),
    };
    let message = mcap::Message {
        channel: Arc::new(channel),
        sequence: 0,
        log_time: 1,
        publish_time: 1,
        data: Cow::Owned(transform(parent, child, IMU_IN_BASE)),
    };
    writer.write(&message).unwrap();
    writer.finish().unwrap();
    path
}

fn loads(analysis: &Analysis) -> Vec<&[f64]> {
    let column = |wheel| analysis.rows.whole().outcomes.column(Quantity::Load(wheel));
    (0..4).map(column).collect()
}

fn fault(analysis: &Analysis) -> Option<&Note> {
    analysis
        .notes
        .iter()
        .find(|note| note.kind == NoteKind::InputFault)
}

#[test]
fn transforms_in_the_log_define_an_unstated_mounting() {
    let stated = analysed(
        &data("tiny.mcap"),
        "[imu]\nlink = \"base_link\"\nxyz = [0.1, 0.0, 0.05]\n",
    );
    for [parent, child] in [["/base_link", "/imu_link"], ["base_link", "imu_link"]] {
        let folder = TempDir::new().unwrap();
        let log = with_transform(folder.path(), parent, child);
        let found = analysed(&log, "");
        let source = &found.machine.imu().source;
        assert!(
            matches!(source, MountSource::StaticTransform { .. }),
            "{source}"
        );
        assert!(found.provenance.imu_mounting.contains("/tf_static"));
        assert_eq!(loads(&stated), loads(&found));
        assert_eq!(fault(&found), None);
        let elsewhere = analysed(&log, "[imu]\nxyz = [0.1, 0.0, 0.25]\n");
        let is_noted = elsewhere.notes.iter().any(|note| note.contains("200.0 mm"));
        assert!(is_noted, "{:?}", elsewhere.notes);
    }
}

#[test]
fn a_wrong_imu_mounting_is_reported_but_not_corrected() {
    let right = analysed(&data("tiny.mcap"), "[imu]\n");
    assert_eq!(fault(&right), None);
    assert_eq!(report::doubts(&right), [""; 0]);
    // on its side, on its back, nose up
    for (rpy, explained) in [
        ("[1.5707963, 0.0, 0.0]", "-x (backward)"),
        ("[0.0, 1.5707963, 0.0]", "-y (right)"),
        ("[3.1415927, 0.0, 0.0]", "180 degrees"),
    ] {
        let turned = analysed(&data("tiny.mcap"), &format!("[imu]\nrpy = {rpy}\n"));
        let messages = fault(&turned).expect("a fault");
        assert!(
            messages.contains(explained) && messages.contains("Nothing was corrected"),
            "{messages}"
        );
        assert!(turned.notes[0].kind == NoteKind::InputFault);
        assert_eq!(report::doubts(&turned), [messages.to_string()]);
        // the loads follow the wrong mounting in the machine file
        assert_ne!(
            loads(&right)[0][20].to_bits(),
            loads(&turned)[0][20].to_bits()
        );
    }
}
