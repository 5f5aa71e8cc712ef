//! The places that a pattern names.

use crate::error::Error;
use crate::place::Location;

use super::any::Folder;
use super::pattern::{has_wildcard, split};

/// A place found by a pattern.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The object.
    pub location: Location,
    /// Its length (bytes).
    pub bytes: u64,
    /// The tag of its version, if the server states one.
    pub e_tag: Option<String>,
}

/// Objects that match a URL with wildcards.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Expanded {
    /// The objects, by name.
    pub found: Vec<Found>,
    /// Keys of the matching objects that no request can name, see [`Folder::list_all`].
    pub unnameable: Vec<String>,
}

/// Lists the objects of a bucket or server that a URL with wildcards names ("s3://logs/2026-*/**/*.mcap"); `None` if the text has
/// no wildcard or is local.
///
/// # Errors
/// The bucket or server cannot be listed.
pub fn expand(text: &str) -> Result<Option<Expanded>, Error> {
    let Some((scheme, rest)) = text.split_once("://") else {
        return Ok(None);
    };
    let rest = match scheme.starts_with("http") {
        // the rest of a web server's URL is its query
        true => rest.split('?').next().unwrap_or(rest),
        false => rest,
    };
    if scheme == "file" || !has_wildcard(rest) {
        return Ok(None);
    }
    let (folder, pattern) = split(rest);
    let folder = Folder::open(&Location::parse(&format!("{scheme}://{folder}"))?)?;
    let (found, unnameable) = folder.list_all(pattern)?;
    let found = found.into_iter().map(|entry| {
        Ok(Found {
            location: folder.location().join(&entry.key)?,
            bytes: entry.bytes,
            e_tag: entry.e_tag,
        })
    });
    let found = found.collect::<Result<_, Error>>()?;
    let unnameable = unnameable.iter().map(|key| folder.location().full(key));
    Ok(Some(Expanded {
        found,
        unnameable: unnameable.collect(),
    }))
}
