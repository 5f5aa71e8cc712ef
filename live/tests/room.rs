//! A full shared memory is an error that names what is needed, not a signal.

use std::path::Path;
use std::process::{Command, Stdio};

use tipwatch_live::node::NoRoom;
use tipwatch_live::wire::topics::WireVerdict;

use crate::header;
use crate::support::{Ended, World, data};

const PROGRAM: &str = env!("CARGO_BIN_EXE_tipwatch-live");

/// Runs a program with a shared memory of its own of this size; `None` where that is not allowed.
fn within(size: &str, world: &World, program: &str, arguments: &[&str]) -> Option<Ended> {
    let mount = format!("mount -t tmpfs -o size={size} tmpfs /dev/shm");
    let unshare = || {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c"]);
        command
    };
    let tried = unshare().arg(&mount).stderr(Stdio::null()).status();
    if !tried.is_ok_and(|status| status.success()) {
        println!("not tested: no memory of its own can be mounted here");
        return None;
    }
    let mut command = unshare();
    command.arg(format!("{mount} && exec \"$0\" \"$@\""));
    command.arg(program);
    Some(world.start_by(command, arguments).end())
}

#[test]
fn every_program_says_that_there_is_no_room() {
    let world = World::new("full");
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (log, machine) = (text(&log), text(&machine));
    let state = text(&world.state_folder);
    let recording = text(&world.state_folder.join("recording"));
    for command in [
        &["monitor", "--machine", &machine, "--state", &state][..],
        &["replay", &log, "--machine", &machine],
        &["record", &recording, "--machine", &machine],
        &["acknowledge"],
    ] {
        // nothing, some for what comes first
        for size in ["64k", "320k"] {
            let Some(ended) = within(size, &world, PROGRAM, command) else {
                return;
            };
            // a program that a signal has killed has no code
            let code = ended.status.code();
            let is_refused = code == Some(1) && ended.err.contains("free shared memory");
            let has_room = size != "64k" && !command.contains(&"--machine");
            assert!(
                is_refused || has_room && code.is_some(),
                "{command:?} {size}: {code:?} {}",
                ended.err
            );
        }
    }
}

#[test]
fn what_is_needed_and_free_is_told_as_numbers() {
    let world = World::new("numbers");
    let node = world.join();
    let writer = node.sender::<WireVerdict>(1, 1).unwrap();
    // a second one is refused for another reason, and not for want of room
    let error = node.sender::<WireVerdict>(2, 1).unwrap_err();
    assert!(error.downcast_ref::<NoRoom>().is_none(), "{error:#}");
    // its memory is there: a queue of messages, of the places of twelve
    let ending = format!("_{}.data", writer.id());
    let files = std::fs::read_dir("/dev/shm").unwrap().flatten();
    let mut memory = files.filter(|file| file.file_name().to_string_lossy().ends_with(&ending));
    let found = memory.next().unwrap().metadata().unwrap();
    let taken = std::os::unix::fs::MetadataExt::blocks(&found) * 512;
    let queue = size_of::<WireVerdict>() as u64 * 2048;
    assert!(
        (queue..found.len() / 4).contains(&taken),
        "{taken} of {}",
        found.len()
    );
}

#[test]
fn the_library_for_c_says_that_there_is_no_room() {
    let world = World::new("fullc");
    let (_folder, client) = header::linked("examples/client.c", header::C);
    let (machine, urdf) = (data("tiny.toml"), data("tiny.urdf"));
    let arguments = [machine.to_str().unwrap(), urdf.to_str().unwrap(), "1"];
    if let Some(ended) = within("64k", &world, client.to_str().unwrap(), &arguments) {
        assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
        assert!(ended.err.contains("free shared memory"), "{}", ended.err);
    }
}
