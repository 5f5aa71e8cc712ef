//! The Python package of the tree, built for tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A folder from which Python imports `tipwatch`: for `PYTHONPATH`. Built once per process.
///
/// # Panics
/// The package cannot be built.
#[must_use]
pub fn python_package() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        // the whole workspace with its tests: less would have its dependencies built anew, with fewer features
        let arguments = ["build", "--workspace", "--lib", "--bins", "--tests"];
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(arguments).args(["--locked", "--quiet"]);
        // what cargo tells this test of its package would have build scripts run anew, here and in the next build
        for (name, _) in std::env::vars_os() {
            let is_of_package =
                |name: &str| name.starts_with("CARGO_MANIFEST_") || name.starts_with("CARGO_PKG_");
            if name.to_str().is_some_and(is_of_package) {
                cargo.env_remove(name);
            }
        }
        let status = cargo.current_dir(&root).status().expect("cargo");
        assert!(status.success(), "cargo {arguments:?}: {status}");
        // target/debug/deps/tests-0123456789abcdef
        let test = std::env::current_exe().expect("the test's file");
        let built = test.ancestors().nth(2).expect("the folder of the build");
        let folder = built.join("python-package");
        let package = folder.join("tipwatch");
        copy(&root.join("analyze/python/tipwatch"), &package);
        let library = built.join(format!("lib_tipwatch{}", std::env::consts::DLL_SUFFIX));
        let module = package.join("_tipwatch.abi3.so");
        // another process may have it loaded: replaced, not written over
        let next = package.join(format!("_tipwatch.{}.next", std::process::id()));
        fs::copy(&library, &next).unwrap_or_else(|e| panic!("{}: {e}", library.display()));
        fs::rename(&next, &module).expect("the module");
        folder
    })
}

/// Copies the files of a folder tree.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("the package") {
        let path = entry.expect("a file").path();
        let name = path.file_name().expect("a name");
        if path.is_file() {
            fs::copy(&path, to.join(name)).expect("a copy");
        } else if name != "__pycache__" {
            copy(&path, &to.join(name));
        }
    }
}
