//! The tags of the tests.

use std::fs;
use std::path::Path;

/// First characters of a tag.
const MARK: &str = "// requirement: ";

/// A requirement that a test says it holds.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tag {
    /// The requirement.
    pub(super) id: String,
    /// Path of the file in the repository.
    pub(super) file: String,
    /// File and line of the tag.
    pub(super) place: String,
    /// Name of the test; `None` if the tag stands above no test.
    pub(super) test: Option<String>,
    /// Whether the test runs on request only.
    pub(super) is_ignored: bool,
}

/// The tags of all Rust files below a folder.
pub(super) fn below(root: &Path, folder: &Path, found: &mut Vec<Tag>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            if entry.file_name() != "target" {
                below(root, &path, found);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            let name = path.strip_prefix(root).expect("a file of the repository");
            let text = fs::read_to_string(&path).expect("a source file");
            found.extend(tags(&name.display().to_string(), &text));
        }
    }
}

/// The tags of a file.
pub(super) fn tags(file: &str, text: &str) -> Vec<Tag> {
    let mut found = Vec::new();
    let mut open: Vec<(String, usize)> = Vec::new();
    let (mut is_test, mut is_ignored) = (false, false);
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if let Some(ids) = line.strip_prefix(MARK) {
            open.extend(ids.split(',').map(|id| (id.trim().to_string(), number)));
        } else if line.starts_with("#[") {
            is_test |= line == "#[test]";
            is_ignored |= line.starts_with("#[ignore");
        } else if !line.starts_with("//") {
            let name = line
                .strip_prefix("fn ")
                .and_then(|rest| rest.split('(').next());
            for (id, at) in open.drain(..) {
                found.push(Tag {
                    id,
                    file: file.into(),
                    place: format!("{file}:{at}"),
                    test: name.filter(|_| is_test).map(ToString::to_string),
                    is_ignored,
                });
            }
            (is_test, is_ignored) = (false, false);
        }
    }
    found
}
