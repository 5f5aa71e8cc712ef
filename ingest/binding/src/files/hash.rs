//! SHA-256 of bytes and of files.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use ring::digest::{Context, Digest, SHA256, digest};

/// A SHA-256.
pub type Hash = [u8; 32];

/// SHA-256 of bytes.
#[must_use]
pub fn hash(bytes: &[u8]) -> Hash {
    array(&digest(&SHA256, bytes))
}

/// SHA-256 of bytes as hexadecimal text.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hex(&hash(bytes))
}

/// SHA-256 of a file, and its length (bytes).
///
/// # Errors
/// The file cannot be read.
pub fn hash_file(path: &Path) -> io::Result<(Hash, u64)> {
    let mut file = File::open(path)?;
    let (mut context, mut block, mut bytes) = (Context::new(&SHA256), vec![0; 1 << 18], 0);
    loop {
        match file.read(&mut block) {
            Ok(0) => return Ok((array(&context.finish()), bytes)),
            Ok(count) => {
                context.update(&block[..count]);
                bytes += count as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// The file that runs, even if it was replaced since the start.
///
/// # Errors
/// The system does not tell it.
pub fn running_file() -> io::Result<PathBuf> {
    let linux = Path::new("/proc/self/exe");
    match linux.exists() {
        true => Ok(linux.into()),
        false => std::env::current_exe(),
    }
}

/// A program of ours: the file beside the one that runs, or else its name, which the system looks for in the search path.
#[must_use]
pub fn program_beside(name: &str) -> PathBuf {
    let own = std::env::current_exe().ok();
    let beside = own.and_then(|own| own.parent().map(|folder| folder.join(name)));
    beside
        .filter(|path| path.is_file())
        .unwrap_or_else(|| name.into())
}

/// Bytes as hexadecimal text.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn array(digest: &Digest) -> Hash {
    let mut hash = [0; 32];
    hash.copy_from_slice(digest.as_ref());
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    // requirement: TW-EVIDENCE-01
    #[test]
    fn val_abc_has_the_hash_of_the_standard() {
        // FIPS 180-2, appendix B.1
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        std::fs::write(&path, b"abc").unwrap();
        let (hash, bytes) = hash_file(&path).unwrap();
        assert_eq!((hex(&hash).as_str(), bytes), (expected, 3));
    }
}
