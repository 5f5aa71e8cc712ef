//! The requirements of the book.

use std::fs;
use std::path::Path;

/// A row of a table whose first cell is an identifier.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Requirement {
    /// `TW-KIND-NUMBER`.
    pub(super) id: String,
    /// Path of its page below `book/src`.
    pub(super) page: String,
    /// Its second cell.
    pub(super) subject: String,
    /// All cells.
    pub(super) text: String,
}

impl Requirement {
    /// The part between the dashes.
    pub(super) fn kind(&self) -> &str {
        self.id.split('-').nth(1).unwrap_or_default()
    }

    /// Its page, seen from the folder `reference`.
    pub(super) fn link(&self) -> String {
        match self.page.strip_prefix("reference/") {
            Some(page) => page.into(),
            None => format!("../{}", self.page),
        }
    }
}

/// All requirements of the pages in a folder, by identifier.
pub(super) fn register(book: &Path) -> Vec<Requirement> {
    let mut found = Vec::new();
    let mut folders = vec![book.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                let text = fs::read_to_string(&path).expect("a page");
                let name = path.strip_prefix(book).expect("a page of the book");
                found.extend(of_page(&name.display().to_string(), &text));
            }
        }
    }
    found.sort();
    found
}

/// The requirements of a page.
pub(super) fn of_page(page: &str, text: &str) -> Vec<Requirement> {
    let rows = text.lines().filter_map(|line| line.strip_prefix("| TW-"));
    rows.map(|row| {
        let mut cells = row.split(" | ");
        let id = format!("TW-{}", cells.next().unwrap_or_default().trim());
        let subject = cells.next().unwrap_or_default();
        let subject = subject.trim_end_matches(['|', ' ']).to_string();
        Requirement {
            id,
            page: page.into(),
            subject,
            text: row.into(),
        }
    })
    .collect()
}
