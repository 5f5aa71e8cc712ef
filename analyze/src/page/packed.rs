//! Scripts and data that a page unpacks itself: gzip in base64, a third of their size.

use std::io::{self, BufWriter, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderStringWriter;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;

/// More thorough ones take half as long again for a twentieth of the size.
const LEVEL: Compression = Compression::fast();

/// Appends data of numbers, names and lists of them, as a packed script element.
pub(super) fn packed_json(page: &mut String, id: &'static str, data: &impl Serialize) {
    packed_json_at(page, id, data, LEVEL);
}

/// Appends data of numbers, names and lists of them as a packed script element, as small as it gets in reasonable time.
pub(super) fn small_json(page: &mut String, id: &'static str, data: &impl Serialize) {
    packed_json_at(page, id, data, Compression::default());
}

fn packed_json_at(page: &mut String, id: &'static str, data: &impl Serialize, level: Compression) {
    script(page, id, |base64| {
        let mut json = BufWriter::new(GzEncoder::new(base64, level));
        // what holds only numbers and names can always be written
        serde_json::to_writer(&mut json, data)?;
        json.into_inner()?.finish().map(drop)
    });
}

/// Appends bytes as a packed script element.
pub(super) fn packed_bytes(page: &mut String, id: &'static str, bytes: &[u8]) {
    packed_bytes_at(page, id, bytes, LEVEL);
}

/// Appends bytes as a packed script element, as small as they get in reasonable time.
pub(super) fn small_bytes(page: &mut String, id: &'static str, bytes: &[u8]) {
    packed_bytes_at(page, id, bytes, Compression::default());
}

fn packed_bytes_at(page: &mut String, id: &'static str, bytes: &[u8], level: Compression) {
    script(page, id, |base64| {
        let mut gzip = GzEncoder::new(base64, level);
        gzip.write_all(bytes)?;
        gzip.finish().map(drop)
    });
}

/// base64 has no character that could end the element. It is written into the page itself, of which such elements are
/// the largest part.
fn script(
    page: &mut String,
    id: &'static str,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) {
    page.push_str(&format!("<script type=\"application/gzip\" id=\"{id}\">"));
    let mut base64 = EncoderStringWriter::from_consumer(&mut *page, &STANDARD);
    // memory does not fail
    let _ = write(&mut base64);
    base64.into_inner();
    page.push_str("</script>");
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use base64::Engine;
    use flate2::read::GzDecoder;

    use super::*;

    #[test]
    fn what_is_packed_comes_back() {
        let hostile = ["</script><!--", "\u{2028}"];
        let mut element = String::new();
        packed_json(&mut element, "data", &hostile);
        let (_, rest) = element.split_once('>').unwrap();
        let base64 = rest.strip_suffix("</script>").unwrap();
        let gzip = STANDARD.decode(base64).unwrap();
        let mut json = String::new();
        GzDecoder::new(&gzip[..]).read_to_string(&mut json).unwrap();
        assert_eq!(serde_json::from_str::<Vec<String>>(&json).unwrap(), hostile);
    }
}
