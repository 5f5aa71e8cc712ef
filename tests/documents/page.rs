//! A page of the documents, cut into the parts that can be checked.

use std::fs;
use std::path::{Path, PathBuf};

/// The repository.
pub(super) fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// A Markdown file.
#[derive(Debug)]
pub(super) struct Page {
    /// Its path in the repository.
    pub(super) name: String,
    /// Its text.
    pub(super) text: String,
}

/// A part of the page that the tests check, in the order of the page.
#[derive(Debug)]
pub(super) enum Part {
    /// Shell commands of a comment `<!-- setup: ... -->`: they create files that a reader would have already.
    Setup(String),
    /// Python of a comment `<!-- check: ... -->`: conditions that must hold after the block before the comment.
    Check(String),
    /// A fenced block.
    Block(Block),
}

/// A fenced block.
#[derive(Debug)]
pub(super) struct Block {
    /// Number of the line of its opening fence, from 1.
    pub(super) line: usize,
    /// First word of its info string.
    pub(super) language: String,
    /// The rest of its info string.
    pub(super) kind: String,
    /// Its text.
    pub(super) text: String,
}

impl Block {
    /// Returns the reason for which the block is not run; `None` for a block to run.
    pub(super) fn not_run(&self) -> Option<&str> {
        self.kind.strip_prefix("(not run: ")?.strip_suffix(')')
    }
}

impl Page {
    pub(super) fn read(name: &str) -> Self {
        let text = fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let name = name.into();
        Self { name, text }
    }

    /// Every page of the documents.
    pub(super) fn all() -> Vec<Self> {
        let mut pages: Vec<_> = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
            .map(Self::read)
            .into();
        pages.extend(book_files().iter().map(|name| Self::read(name)));
        pages
    }

    pub(super) fn parts(&self) -> Vec<Part> {
        let mut parts = Vec::new();
        let mut block: Option<Block> = None;
        for (line, text) in (1..).zip(self.text.lines()) {
            let fence = text.strip_prefix("```");
            match (&mut block, fence) {
                (Some(open), None) => {
                    open.text.push_str(text);
                    open.text.push('\n');
                }
                (Some(_), Some(_)) => parts.extend(block.take().map(Part::Block)),
                (None, Some(info)) => {
                    let (language, kind) = info.split_once(' ').unwrap_or((info, ""));
                    block = Some(Block {
                        line,
                        language: language.into(),
                        kind: kind.into(),
                        text: String::new(),
                    });
                }
                (None, None) => parts.extend(comment(text)),
            }
        }
        assert!(block.is_none(), "{}: a block has no end", self.name);
        parts
    }

    pub(super) fn blocks(&self) -> Vec<Block> {
        let parts = self.parts().into_iter();
        parts
            .filter_map(|part| match part {
                Part::Block(block) => Some(block),
                _ => None,
            })
            .collect()
    }

    /// The text outside fenced blocks and comments.
    pub(super) fn prose(&self) -> String {
        let mut is_inside = false;
        let lines = self.text.lines().filter(|line| {
            let is_fence = line.starts_with("```");
            is_inside ^= is_fence;
            !is_inside && !is_fence && !line.starts_with("<!--")
        });
        lines.flat_map(|line| [line, "\n"]).collect()
    }
}

fn comment(line: &str) -> Option<Part> {
    let text = line.strip_prefix("<!-- ")?.strip_suffix(" -->")?;
    match text.split_once(": ")? {
        ("setup", commands) => Some(Part::Setup(commands.into())),
        ("check", python) => Some(Part::Check(python.into())),
        _ => None,
    }
}

/// Paths in the repository of the book's pages, its summary among them.
pub(super) fn book_files() -> Vec<String> {
    let mut found: Vec<_> = files_below(&root().join("book/src"))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .map(|path| {
            let path = path.strip_prefix(root()).expect("a path in the repository");
            path.display().to_string()
        })
        .collect();
    found.sort();
    found
}

/// All files below a folder, hidden ones and build results left out.
pub(super) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries.flatten() {
        let name = entry.file_name();
        if name.as_encoded_bytes().starts_with(b".") || name == "target" {
            continue;
        }
        match entry.path() {
            path if path.is_dir() => found.extend(files_below(&path)),
            path => found.push(path),
        }
    }
    found
}

/// Whether the tests write their results into the documents instead of comparing them.
pub(super) fn is_blessing() -> bool {
    std::env::var_os("TIPWATCH_BLESS").is_some()
}
