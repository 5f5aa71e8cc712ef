//! Build settings of the programs.

use std::path::Path;

use toml::Table;

fn manifest(folder: &str) -> Table {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = root.join(folder).join("Cargo.toml");
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

/// Cargo links a program with all its symbols if a profile has a section for its package, whatever the profile says of
/// stripping. They are a fifth of the file, which every run hashes.
#[test]
fn programs_are_stripped() {
    let release = &manifest(".")["profile"]["release"];
    assert_eq!(release["strip"].as_bool(), Some(true));
    for folder in ["analyze", "live"] {
        let package = &manifest(folder)["package"]["name"];
        let section = release["package"].get(package.as_str().unwrap());
        assert!(section.is_none(), "{package}: {section:?}");
    }
}
