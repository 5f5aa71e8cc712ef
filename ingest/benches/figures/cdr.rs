//! Encodes values as CDR, for messages made by benchmarks.

/// Appends a value after CDR padding to its size.
pub(crate) fn put<const N: usize>(cdr: &mut Vec<u8>, value: [u8; N]) {
    while !(cdr.len() - 4).is_multiple_of(N) {
        cdr.push(0);
    }
    cdr.extend(value);
}

pub(crate) fn put_text(cdr: &mut Vec<u8>, text: &str) {
    put(cdr, (text.len() as u32 + 1).to_le_bytes());
    cdr.extend(text.as_bytes());
    cdr.push(0);
}
