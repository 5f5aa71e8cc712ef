//! Places and their bytes: local files and folders, buckets (`s3://`, `gs://`, `az://`) and web servers.
//!
//! A [`Location`] names a place. Its text never shows what was secret in a URL. A [`Folder`] lists, reads and writes
//! whole objects; [`Folder::put_if_absent`] writes an object exactly once, whoever else tries. An [`Object`] is one
//! file of a bucket, read by position: only what is asked for is transferred, and all of it is of one version.
//!
//! All calls block. They may be made from any thread.
//!
//! ```
//! use tipwatch_storage::{Folder, Location, Put};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let temporary = tempfile::tempdir()?;
//! # let place = temporary.path().to_str().unwrap();
//! let folder = Folder::open(&Location::parse(place)?)?; // or "s3://fleet/records"
//! assert_eq!(folder.put_if_absent("records/a.json", b"{}")?, Put::Written);
//! assert_eq!(folder.put_if_absent("records/a.json", b"[]")?, Put::AlreadyThere);
//! assert_eq!(folder.get("records/a.json")?, b"{}");
//! assert_eq!(folder.list("records/*.json")?[0].key, "records/a.json");
//! # Ok(())
//! # }
//! ```

mod arguments;
mod bucket;
mod counted;
mod error;
mod folder;
mod key;
mod listing;
mod object;
mod place;
mod ranges;
mod redact;
mod runtime;

pub use self::{
    arguments::{arguments, recorded_arguments, without_secrets},
    counted::Transfer,
    error::{Error, ErrorKind},
    folder::{Entry, Expanded, Folder, Found, Put, UNFINISHED, expand},
    object::Object,
    place::{Access, Location, connect, set_whole_reads, whole_reads},
    redact::redact,
};
