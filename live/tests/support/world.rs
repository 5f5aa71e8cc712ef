//! Isolated worlds in shared memory, and the data of the tests.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use tipwatch_live::node::{LiveNode, ServiceAddress};

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data");

pub fn data(name: &str) -> PathBuf {
    Path::new(DATA).join(name)
}

/// An isolated world in shared memory.
pub struct World {
    pub prefix: String,
    /// Removed with this.
    pub state: tempfile::TempDir,
    /// The folder for latched alarms.
    pub state_folder: PathBuf,
}

impl World {
    pub fn new(test: &str) -> Self {
        let state = tempfile::tempdir().unwrap();
        // two tests may have one name
        static WORLDS: AtomicUsize = AtomicUsize::new(0);
        let world = WORLDS.fetch_add(1, Ordering::Relaxed);
        Self {
            prefix: format!("tw{}_{world}{test}_", std::process::id()),
            state_folder: state.path().into(),
            state,
        }
    }

    pub fn address(&self) -> ServiceAddress {
        ServiceAddress {
            service: "tipwatch".into(),
            prefix: Some(self.prefix.clone()),
        }
    }

    pub fn join(&self) -> LiveNode {
        LiveNode::new(&self.address(), "test").unwrap()
    }
}

impl Drop for World {
    fn drop(&mut self) {
        // files of killed processes, and one small file per prefix
        let folders = ["/dev/shm", "/tmp/iceoryx2"];
        let listed = folders.map(std::fs::read_dir).into_iter().flatten();
        for entry in listed.flatten().flatten() {
            if entry
                .file_name()
                .to_string_lossy()
                .starts_with(&self.prefix)
            {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}
