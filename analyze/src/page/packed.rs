//! Scripts and data that a page unpacks itself: gzip in base64, a third of their size.

use std::io::{self, Read, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use maud::{Markup, PreEscaped, html};
use serde::Serialize;

/// More thorough ones take half as long again for a twentieth of the size.
const LEVEL: Compression = Compression::fast();

/// Bytes of gzip as a script element with this id. base64 has no character that could end it.
pub(super) fn packed_script(id: &str, gzip: &[u8]) -> Markup {
    html! { script type="application/gzip" id=(id) { (PreEscaped(STANDARD.encode(gzip))) } }
}

/// Data of numbers, names and lists of them as a packed script element.
pub(super) fn packed_json(id: &str, data: &impl Serialize) -> Markup {
    // what holds only numbers and names can always be written
    packed_bytes(id, &serde_json::to_vec(data).unwrap_or_default())
}

/// Bytes as a packed script element.
pub(super) fn packed_bytes(id: &str, bytes: &[u8]) -> Markup {
    let mut gzip = GzEncoder::new(Vec::new(), LEVEL);
    let written = gzip.write_all(bytes).and_then(|()| gzip.finish());
    // memory does not fail
    packed_script(id, &written.unwrap_or_default())
}

/// The text behind bytes of gzip.
pub(super) fn unpack(gzip: &[u8]) -> io::Result<String> {
    let mut text = String::new();
    GzDecoder::new(gzip).read_to_string(&mut text)?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_comes_back() {
        let hostile = ["</script><!--", "\u{2028}"];
        let element = packed_json("data", &hostile).into_string();
        let (_, rest) = element.split_once('>').unwrap();
        let base64 = rest.strip_suffix("</script>").unwrap();
        let json = unpack(&STANDARD.decode(base64).unwrap()).unwrap();
        assert_eq!(serde_json::from_str::<Vec<String>>(&json).unwrap(), hostile);
    }
}
