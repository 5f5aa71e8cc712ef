//! The files of `data` made anew by python-can, cantools and asammdf.

use std::{env, fs, process::Command};

use crate::support::{data, data_folder, frames};

/// Set `TIPWATCH_PYTHON` to a Python that has `data/requirements.txt` installed.
#[test]
#[ignore = "needs Python with python-can, cantools and asammdf"]
fn fixtures_made_anew_hold_the_same_frames() {
    let python = env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
    let folder = env::temp_dir().join(format!("tipwatch-can-{}", std::process::id()));
    let status = Command::new(python)
        .arg(data_folder().join("make_fixtures.py"))
        .arg(&folder)
        .status();
    assert!(status.unwrap().success());
    for name in ["frames.txt", "decoded.csv", "machine.log"] {
        assert_eq!(fs::read(folder.join(name)).unwrap(), data(name), "{name}");
    }
    for name in [
        "mixed.log",
        "mixed.asc",
        "mixed.blf",
        "mixed.mf4",
        "mixed_plain.mf4",
        "mixed_transposed.mf4",
    ] {
        // the files themselves hold the time of their making
        let (found, lost) = frames(&fs::read(folder.join(name)).unwrap());
        assert_eq!(lost, [""; 0]);
        let (expected, _) = frames(&data(name));
        let of = |frames: Vec<(String, tipwatch_can::Frame)>| {
            frames
                .into_iter()
                .map(|(channel, frame)| (channel, frame.id, frame.data().to_vec()))
                .collect::<Vec<_>>()
        };
        assert_eq!(of(found), of(expected), "{name}");
    }
    fs::remove_dir_all(folder).unwrap();
}
