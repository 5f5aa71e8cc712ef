//! Files that are read whole: their text and their hash.

mod hash;
mod text;

pub use hash::{Hash, hash, hash_file, hex, program_beside, running_file, sha256};
pub use text::read_text;
