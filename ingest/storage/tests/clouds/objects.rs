//! Objects in memory, as the services of the tests keep them.

use std::collections::BTreeMap;
use std::sync::Mutex;

use jiff::Timestamp;

use super::wire::{Reply, Request};

/// Objects of a page of a listing: few, so that there are several.
const PAGE: usize = 2;

/// An object.
#[derive(Debug, Clone)]
pub(crate) struct Stored {
    pub(crate) bytes: Vec<u8>,
    /// Counts all writes.
    pub(crate) generation: i64,
}

impl Stored {
    pub(crate) fn e_tag(&self) -> String {
        format!("\"0x8D{:08}\"", self.generation)
    }

    pub(crate) fn modified(&self) -> Timestamp {
        Timestamp::from_second(1_780_000_000 + self.generation).unwrap()
    }

    /// Returns the time in the form of HTTP headers.
    pub(crate) fn modified_text(&self) -> String {
        self.modified()
            .strftime("%a, %d %b %Y %H:%M:%S GMT")
            .to_string()
    }
}

/// Statements of a server about a version of an object, and the kinds of ranges it serves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tells {
    pub(crate) e_tag: bool,
    pub(crate) modified: bool,
    pub(crate) ranges: bool,
    pub(crate) suffixes: bool,
}

impl Tells {
    pub(crate) const ALL: Self = Self {
        e_tag: true,
        modified: true,
        ranges: true,
        suffixes: true,
    };
}

#[derive(Default)]
struct State {
    stored: BTreeMap<String, Stored>,
    writes: i64,
    /// Parts of unfinished objects, by upload and name of the part.
    parts: BTreeMap<(String, String), Vec<u8>>,
}

/// The objects of one bucket.
#[derive(Default)]
pub(crate) struct Objects(Mutex<State>);

/// Objects and folders of a listing, and where the next page begins.
pub(crate) struct Page {
    pub(crate) objects: Vec<(String, Stored)>,
    pub(crate) folders: Vec<String>,
    pub(crate) next: Option<String>,
}

impl Objects {
    pub(crate) fn get(&self, key: &str) -> Option<Stored> {
        self.0.lock().unwrap().stored.get(key).cloned()
    }

    /// Writes an object; `None` if it `must_be_new` and exists already.
    pub(crate) fn put(&self, key: &str, bytes: &[u8], must_be_new: bool) -> Option<Stored> {
        let mut state = self.0.lock().unwrap();
        if must_be_new && state.stored.contains_key(key) {
            return None;
        }
        state.writes += 1;
        let stored = Stored {
            bytes: bytes.to_vec(),
            generation: state.writes,
        };
        state.stored.insert(key.to_owned(), stored.clone());
        Some(stored)
    }

    pub(crate) fn remove(&self, key: &str) -> bool {
        self.0.lock().unwrap().stored.remove(key).is_some()
    }

    pub(crate) fn keys(&self) -> Vec<String> {
        self.0.lock().unwrap().stored.keys().cloned().collect()
    }

    pub(crate) fn put_part(&self, upload: &str, part: &str, bytes: &[u8]) {
        let mut state = self.0.lock().unwrap();
        let name = (upload.to_owned(), part.to_owned());
        state.parts.insert(name, bytes.to_vec());
    }

    /// Parts in the order of their names, or in a given one, as one object; `None` if one is missing.
    pub(crate) fn join(&self, key: &str, upload: &str, order: &[String]) -> Option<Stored> {
        let whole = {
            let mut state = self.0.lock().unwrap();
            let part = |name: &String| state.parts.get(&(upload.to_owned(), name.clone())).cloned();
            let whole: Vec<Vec<u8>> = order.iter().map(part).collect::<Option<_>>()?;
            state.parts.retain(|(other, _), _| other != upload);
            whole.concat()
        };
        self.put(key, &whole, false)
    }

    /// Returns a page of the objects whose keys begin with `prefix`, after a key.
    pub(crate) fn list(&self, prefix: &str, delimiter: Option<&str>, after: Option<&str>) -> Page {
        let state = self.0.lock().unwrap();
        let mut page = Page {
            objects: Vec::new(),
            folders: Vec::new(),
            next: None,
        };
        for (key, stored) in state
            .stored
            .iter()
            .filter(|(key, _)| key.starts_with(prefix))
        {
            if after.is_some_and(|after| key.as_str() <= after) {
                continue;
            }
            let rest = &key[prefix.len()..];
            let folder = delimiter.and_then(|sign| rest.split_once(sign));
            let folder = folder.map(|(name, _)| format!("{prefix}{name}/"));
            if folder
                .as_ref()
                .is_some_and(|folder| page.folders.contains(folder))
            {
                continue;
            }
            if page.objects.len() + page.folders.len() == PAGE {
                // the last key that is on this page
                page.next = state
                    .stored
                    .range(..key.clone())
                    .next_back()
                    .map(|(k, _)| k.clone());
                break;
            }
            match folder {
                Some(folder) => page.folders.push(folder),
                None => page.objects.push((key.clone(), stored.clone())),
            }
        }
        page
    }
}

/// Returns an object, or the requested part of it.
pub(crate) fn served(stored: &Stored, request: &Request, tells: Tells) -> Reply {
    if request
        .header("if-match")
        .is_some_and(|tag| tells.e_tag && tag != stored.e_tag())
    {
        return Reply::error(412, "ConditionNotMet");
    }
    let size = stored.bytes.len();
    let range = request.header("range").filter(|_| tells.ranges);
    let range = range.and_then(|text| text.strip_prefix("bytes=")?.split_once('-'));
    let mut reply = match range {
        None => Reply::new(200).body(&stored.bytes),
        Some(("", _)) if !tells.suffixes => return Reply::error(400, "InvalidHeaderValue"),
        Some((start, end)) => {
            let (start, end) = match start {
                "" => (size.saturating_sub(end.parse().unwrap()), size),
                start => {
                    let end = end.parse::<usize>().map_or(size, |last| last + 1);
                    (start.parse().unwrap(), end.min(size))
                }
            };
            if start >= size {
                return Reply::error(416, "InvalidRange")
                    .header("content-range", format!("bytes */{size}"));
            }
            let shown = format!("bytes {start}-{}/{size}", end - 1);
            Reply::new(206)
                .body(&stored.bytes[start..end])
                .header("content-range", shown)
        }
    };
    if tells.e_tag {
        reply = reply.header("etag", stored.e_tag());
    }
    if tells.modified {
        reply = reply.header("last-modified", stored.modified_text());
    }
    reply
}

/// A text within XML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Returns the texts between each pair of marks.
pub(crate) fn all_between<'t>(text: &'t str, start: &str, end: &str) -> Vec<&'t str> {
    let parts = text.split(start).skip(1);
    parts
        .filter_map(|part| part.split_once(end).map(|(found, _)| found))
        .collect()
}
