//! The files of `data` made anew by python-can, cantools and asammdf.

use std::{env, fs, path::PathBuf, process::Command};

use crate::{
    support::{data, data_folder, frames},
    values::check_generated,
};

/// Returns a folder with the output of a script of `data`.
fn made(script: &str, arguments: &[String]) -> PathBuf {
    let python = env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
    let folder = env::temp_dir().join(format!("tipwatch-can-{}-{script}", std::process::id()));
    let status = Command::new(python)
        .arg(data_folder().join(script))
        .arg(&folder)
        .args(arguments)
        .status();
    assert!(status.unwrap().success());
    folder
}

#[test]
#[ignore = "needs Python with asammdf"]
fn mf4_layouts_made_anew_are_the_same() {
    let folder = made("make_mf4.py", &[]);
    for name in [
        "layouts.txt",
        "layout_virtual_bus.mf4",
        "layout_variable_mixed.mf4",
    ] {
        assert_eq!(fs::read(folder.join(name)).unwrap(), data(name), "{name}");
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
#[ignore = "needs Python with cantools"]
fn many_generated_dbc_files_are_read_as_cantools_reads_them() {
    let seeds: Vec<String> = (1..=40).map(|seed| seed.to_string()).collect();
    let folder = made("make_generated.py", &seeds);
    for seed in &seeds {
        check_generated(|name| fs::read(folder.join(name)).unwrap(), seed);
    }
    fs::remove_dir_all(folder).unwrap();
}

/// Set `TIPWATCH_PYTHON` to a Python that has `data/requirements.txt` installed.
#[test]
#[ignore = "needs Python with python-can, cantools and asammdf"]
fn fixtures_made_anew_hold_the_same_frames() {
    let folder = made("make_fixtures.py", &[]);
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
