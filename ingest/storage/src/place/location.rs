//! The name of a place: a local path or a URL.

use std::fmt;
use std::path::{Path, PathBuf};

use object_store::path::Path as Key;
use url::Url;

use crate::error::{Error, ErrorKind};
use crate::key::key_of;
use crate::redact::redact_one;

use super::known::{Address, Kind, named, remember};

/// A local path, or an object or folder of a bucket or web server.
///
/// [`path`](Self::path) and `Display` show it without user name, password and query. [`Location::of`] finds the place
/// of such a path again within the same process, so that a program may hand paths around as before.
#[derive(Clone, PartialEq, Eq)]
pub struct Location(Place);

#[derive(Clone, PartialEq, Eq)]
enum Place {
    Local(PathBuf),
    Remote(Remote),
}

/// A place that is not local.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Remote {
    pub(crate) address: Address,
    /// The key within the bucket or server, without a leading slash.
    pub(crate) key: Key,
    /// Name that is shown, without secrets.
    name: PathBuf,
}

const EXPECTED: &str =
    "expected a path, or a URL with s3://, gs://, az://, https://, http:// or file://";

impl Location {
    /// The place that a user names.
    ///
    /// The key of a bucket is taken as it stands: `%20` is not a space. A URL of a web server is encoded.
    ///
    /// # Errors
    /// The text has a scheme that is not supported, or is not a valid URL.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let Some((scheme, rest)) = split_scheme(text) else {
            return Ok(Self::local(text));
        };
        let wrong = |detail: String| Error::new(redact_one(text), ErrorKind::NotAPlace, detail);
        match scheme.as_str() {
            "file" => {
                let path = Url::parse(text)
                    .ok()
                    .and_then(|url| url.to_file_path().ok());
                let path = path.ok_or_else(|| wrong("expected file:///path".into()))?;
                Ok(Self::local(path))
            }
            "s3" | "s3a" => bucket(Kind::S3, "s3", rest).map_err(wrong),
            "gs" => bucket(Kind::Gcs, "gs", rest).map_err(wrong),
            "az" | "abfs" | "abfss" => bucket(Kind::Azure, &scheme, rest).map_err(wrong),
            "http" | "https" => web(text).map_err(wrong),
            _ => Err(wrong(EXPECTED.into())),
        }
    }

    /// A local path.
    pub fn local(path: impl Into<PathBuf>) -> Self {
        Self(Place::Local(path.into()))
    }

    /// The place of a path that [`path`](Self::path) gave, or that a user named.
    ///
    /// # Errors
    /// See [`parse`](Self::parse).
    pub fn of(path: &Path) -> Result<Self, Error> {
        match path.to_str() {
            Some(text) if is_url(text) => Self::parse(named(text).as_deref().unwrap_or(text)),
            _ => Ok(Self::local(path)),
        }
    }

    /// Whether a path names a bucket or web server.
    pub fn is_remote_path(path: &Path) -> bool {
        path.to_str()
            .and_then(split_scheme)
            .is_some_and(|(scheme, _)| scheme != "file")
    }

    /// Whether a version's tag (ETag) of a file at this path is made of its bytes, so that files of one length and tag
    /// are equal under any name.
    ///
    /// In S3 it is the MD5 of the bytes, or of the MD5s of the parts they were sent in, with `-` and their number. A
    /// bucket that encrypts with a key of its own states as many digits, which no other upload has. Other servers count
    /// versions or state times.
    pub fn is_tag_of_bytes(path: &Path, e_tag: &str) -> bool {
        let scheme = path.to_str().and_then(split_scheme);
        let is_s3 = scheme.is_some_and(|(scheme, _)| matches!(scheme.as_str(), "s3" | "s3a"));
        let tag = e_tag.trim_matches('"');
        let (digest, parts) = tag.split_once('-').unwrap_or((tag, "1"));
        let is_digest = digest.len() == 32 && digest.bytes().all(|byte| byte.is_ascii_hexdigit());
        is_s3 && is_digest && !parts.is_empty() && parts.bytes().all(|byte| byte.is_ascii_digit())
    }

    /// The path by which the program and its messages name this place; without secrets.
    pub fn path(&self) -> &Path {
        match &self.0 {
            Place::Local(path) => path,
            Place::Remote(remote) => &remote.name,
        }
    }

    /// The local path; `None` in a bucket or on a web server.
    pub fn as_local(&self) -> Option<&Path> {
        match &self.0 {
            Place::Local(path) => Some(path),
            Place::Remote(_) => None,
        }
    }

    pub(crate) fn as_remote(&self) -> Option<&Remote> {
        match &self.0 {
            Place::Local(_) => None,
            Place::Remote(remote) => Some(remote),
        }
    }

    /// Whether the place is in a bucket or on a web server.
    pub fn is_remote(&self) -> bool {
        self.as_remote().is_some()
    }

    /// A place within this folder; `relative` is separated by `/`.
    ///
    /// # Errors
    /// `relative` leaves the folder, or is not a valid key.
    pub fn join(&self, relative: &str) -> Result<Self, Error> {
        let wrong = || {
            let detail = format!("expected a name within it, found \"{relative}\"");
            Error::new(self.to_string(), ErrorKind::NotAPlace, detail)
        };
        let parts = relative.split('/');
        if relative.is_empty() || parts.clone().any(|part| matches!(part, "" | "." | "..")) {
            return Err(wrong());
        }
        match &self.0 {
            Place::Local(path) => Ok(Self::local(path.join(relative))),
            Place::Remote(remote) => {
                let key = match remote.key.as_ref() {
                    "" => relative.to_owned(),
                    folder => format!("{folder}/{relative}"),
                };
                let key = Key::parse(key).map_err(|_| wrong())?;
                Ok(remote.at(key))
            }
        }
    }

    /// The text of a key within this folder that may be none that requests can name, as [`Folder::list_all`] gives them.
    ///
    /// [`Folder::list_all`]: crate::Folder::list_all
    pub fn full(&self, key: &str) -> String {
        format!("{}/{key}", self.shown())
    }

    /// The text that names the folder and every object in it.
    pub(crate) fn shown(&self) -> String {
        self.path().display().to_string()
    }
}

impl Remote {
    /// Another key of the same bucket or server.
    pub(crate) fn at(&self, key: Key) -> Location {
        remote(self.address.clone(), key)
    }

    pub(crate) fn shown(&self) -> String {
        self.name.display().to_string()
    }
}

impl fmt::Display for Location {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.path().display())
    }
}

impl fmt::Debug for Location {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Location({})", self.path().display())
    }
}

fn is_url(text: &str) -> bool {
    split_scheme(text).is_some()
}

/// The scheme in small letters and what follows `://`.
fn split_scheme(text: &str) -> Option<(String, &str)> {
    let (scheme, rest) = text.split_once("://")?;
    let is_scheme = scheme.len() > 1
        && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    is_scheme.then(|| (scheme.to_ascii_lowercase(), rest))
}

fn bucket(kind: Kind, scheme: &str, rest: &str) -> Result<Location, String> {
    let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
    let is_named = |c: char| c.is_ascii_alphanumeric() || "-_.@".contains(c);
    if bucket.is_empty() || !bucket.chars().all(is_named) {
        return Err(format!("expected the name of a bucket after {scheme}://"));
    }
    if key
        .split_once('?')
        .is_some_and(|(_, query)| query.contains('='))
    {
        return Err("expected no query: credentials come from the environment".into());
    }
    let key = key_of(key.trim_end_matches('/'))?;
    Ok(remote(Address::bucket(kind, scheme, bucket), key))
}

fn web(text: &str) -> Result<Location, String> {
    let url = Url::parse(text).map_err(|error| error.to_string())?;
    let path = url.path().trim_end_matches('/');
    let key = Key::from_url_path(path).map_err(|error| error.to_string())?;
    Ok(remote(Address::web(&url)?, key))
}

fn remote(address: Address, key: Key) -> Location {
    let name = match key.as_ref() {
        "" => address.shown().to_owned(),
        key if address.kind == Kind::Http => {
            let mut url = Url::parse(address.shown()).ok();
            if let Some(mut segments) = url.as_mut().and_then(|url| url.path_segments_mut().ok()) {
                segments.pop_if_empty().extend(key.split('/'));
            }
            url.map_or_else(|| format!("{}/{key}", address.shown()), String::from)
        }
        key => format!("{}/{key}", address.shown()),
    };
    let name = match address.secret_url(&key) {
        Some(full) => remember(name, full),
        None => name,
    };
    Location(Place::Remote(Remote {
        address,
        key,
        name: name.into(),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tags_of_s3_that_look_like_digests_are_of_the_bytes() {
        let digest = "0123456789abcdef0123456789ABCDEF";
        let of_bytes = |path: &str, tag: &str| Location::is_tag_of_bytes(Path::new(path), tag);
        for tag in [
            digest,
            &format!("\"{digest}\""),
            &format!("\"{digest}-12\""),
        ] {
            assert!(of_bytes("s3://logs/a.mcap", tag), "{tag}");
            for elsewhere in ["gs://logs/a", "az://logs/a", "https://host/a", "/logs/a"] {
                assert!(!of_bytes(elsewhere, tag), "{elsewhere}");
            }
        }
        for tag in [
            "",
            &digest[1..],
            &format!("W/\"{digest}\""),
            &format!("{digest}-"),
            &format!("{digest}-x"),
            &digest.replace('a', "g"),
        ] {
            assert!(!of_bytes("s3://logs/a.mcap", tag), "{tag}");
        }
    }
}
