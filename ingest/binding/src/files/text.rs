//! Reads text files of people: machine files, URDFs, policies, lists.

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

/// Far above any such file; a URDF with thousands of links takes a few megabytes.
const LIMIT_BYTES: u64 = 64 << 20;

/// The text of a file of at most 64 MiB: nothing else is read into memory as a whole. It is UTF-8, or an XML file
/// that declares another common encoding.
///
/// # Errors
/// The file cannot be read, is larger, or is not such a text.
pub fn read_text(path: &Path) -> Result<String, Error> {
    let mut bytes = Vec::new();
    // devices and pipes do not state their length
    File::open(path)?
        .take(LIMIT_BYTES + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LIMIT_BYTES {
        let message = format!("expected a text of at most {LIMIT_BYTES} bytes, found more");
        return Err(Error::new(ErrorKind::FileTooLarge, message));
    }
    text_of(bytes).map_err(|message| Error::new(ErrorKind::InvalidData, message))
}

fn text_of(bytes: Vec<u8>) -> Result<String, String> {
    let units =
        |from: fn([u8; 2]) -> u16| bytes[2..].chunks_exact(2).map(move |p| from([p[0], p[1]]));
    let utf16 = match bytes.get(..2) {
        Some([0xff, 0xfe]) => Some(String::from_utf16(
            &units(u16::from_le_bytes).collect::<Vec<_>>(),
        )),
        Some([0xfe, 0xff]) => Some(String::from_utf16(
            &units(u16::from_be_bytes).collect::<Vec<_>>(),
        )),
        _ => None,
    };
    if let Some(Ok(text)) = utf16 {
        return Ok(text);
    }
    String::from_utf8(bytes).or_else(|error| {
        let at = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        if is_latin(bytes) {
            return Ok(bytes.iter().map(|&byte| char::from(byte)).collect());
        }
        let line = bytes[..at].iter().filter(|&&byte| byte == b'\n').count() + 1;
        Err(format!(
            "expected a text in UTF-8, found the byte {:#04x} in line {line}; save the file as UTF-8",
            bytes[at]
        ))
    })
}

/// Whether an XML file declares that each byte is a character.
fn is_latin(bytes: &[u8]) -> bool {
    let end = bytes.windows(2).position(|pair| pair == b"?>");
    let declaration = String::from_utf8_lossy(&bytes[..end.unwrap_or(0)]).to_ascii_lowercase();
    let names = [
        "iso-8859-1",
        "iso-8859-15",
        "latin1",
        "latin-1",
        "windows-1252",
    ];
    declaration.trim_start().starts_with("<?xml")
        && names.iter().any(|name| declaration.contains(name))
}

#[cfg(test)]
mod tests {
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

    #[test]
    fn encodings_of_xml_are_read_and_other_bytes_told() {
        let latin = b"<?xml version='1.0' encoding='ISO-8859-1'?><robot name='Gr\xf6be'/>";
        assert!(text_of(latin.to_vec()).unwrap().contains("Gr\u{f6}be"));
        let units = "<robot/>".encode_utf16().flat_map(u16::to_le_bytes);
        let utf16: Vec<u8> = [0xff, 0xfe].into_iter().chain(units).collect();
        assert_eq!(text_of(utf16).unwrap(), "<robot/>");
        let error = text_of(b"name = 'a'\nx = '\xf6'".to_vec()).unwrap_err();
        assert!(error.contains("0xf6 in line 2"), "{error}");
        for bytes in [&b"\xff"[..], b"\xff\xfe\x00", b"\xfe\xff\xd8\x00", b""] {
            let _ = text_of(bytes.to_vec());
        }
    }
}
