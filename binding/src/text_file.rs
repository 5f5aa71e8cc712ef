//! Reads text files of people: machine files, URDFs, policies, lists.

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

/// Far above any such file; a URDF with thousands of links takes a few megabytes.
const LIMIT_BYTES: u64 = 64 << 20;

/// The text of a file of at most 64 MiB: nothing else is read into memory as a whole.
///
/// # Errors
/// The file cannot be read, is larger, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, Error> {
    let mut text = String::new();
    // devices and pipes do not state their length
    let read = File::open(path)?
        .take(LIMIT_BYTES + 1)
        .read_to_string(&mut text);
    if text.len() as u64 > LIMIT_BYTES || matches!(read, Ok(bytes) if bytes as u64 > LIMIT_BYTES) {
        let message = format!("expected a text of at most {LIMIT_BYTES} bytes, found more");
        return Err(Error::new(ErrorKind::FileTooLarge, message));
    }
    read.map(|_| text)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn an_endless_file_is_refused() {
        let error = read_text(Path::new("/dev/zero")).unwrap_err();
        assert!(
            error.to_string().contains("at most 67108864 bytes"),
            "{error}"
        );
    }
}
