//! Lists of a bucket's keys: keys that no request can name are taken out of an answer, because one of them makes the client
//! refuse all the others.

use std::ops::Range;

use crate::key::key_of;

/// An element of an answer, with the inner element that holds the key.
struct Kind {
    begin: &'static str,
    end: &'static str,
    key_begin: &'static str,
    key_end: &'static str,
    is_object: bool,
}

/// S3 and Google, then Azure; objects and folders.
const KINDS: [Kind; 4] = [
    Kind {
        begin: "<Contents>",
        end: "</Contents>",
        key_begin: "<Key>",
        key_end: "</Key>",
        is_object: true,
    },
    Kind {
        begin: "<CommonPrefixes>",
        end: "</CommonPrefixes>",
        key_begin: "<Prefix>",
        key_end: "</Prefix>",
        is_object: false,
    },
    Kind {
        begin: "<Blob>",
        end: "</Blob>",
        key_begin: "<Name>",
        key_end: "</Name>",
        is_object: true,
    },
    Kind {
        begin: "<BlobPrefix>",
        end: "</BlobPrefix>",
        key_begin: "<Name>",
        key_end: "</Name>",
        is_object: false,
    },
];

/// The answer without objects that only mark a folder, and without objects and folders that no request can name, and the keys of these
/// objects.
pub(crate) fn without_unnameable(answer: &str) -> (String, Vec<String>) {
    let mut unnameable = Vec::new();
    let mut answer = answer.to_owned();
    for kind in &KINDS {
        let mut kept = String::with_capacity(answer.len());
        let mut rest = answer.as_str();
        while let Some(element) = between(rest, kind.begin, kind.end) {
            let key = between(&rest[element.clone()], kind.key_begin, kind.key_end)
                .map(|key| unescaped(&rest[element.start + key.start..element.start + key.end]));
            // an object whose key ends so marks a folder
            let is_nameable = |key: &String| key_of(key.strip_suffix('/').unwrap_or(key)).is_ok();
            let end = element.end + kind.end.len();
            // by the name without it, which a request would have, there is nothing
            let marks_folder = |key: &String| kind.is_object && key.ends_with('/');
            match key.filter(|key| !is_nameable(key) || marks_folder(key)) {
                Some(key) => {
                    kept.push_str(&rest[..element.start - kind.begin.len()]);
                    unnameable.extend(Some(key).filter(|key| kind.is_object && !is_nameable(key)));
                }
                None => kept.push_str(&rest[..end]),
            }
            rest = &rest[end..];
        }
        kept.push_str(rest);
        answer = kept;
    }
    (answer, unnameable)
}

/// Returns the range between the first `begin` mark and the `end` mark that follows it.
fn between(text: &str, begin: &str, end: &str) -> Option<Range<usize>> {
    let start = text.find(begin)? + begin.len();
    let length = text[start..].find(end)?;
    Some(start..start + length)
}

/// Replaces the entities in a text of XML by their characters.
fn unescaped(text: &str) -> String {
    let mut meant = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('&') {
        meant.push_str(before);
        let known = after
            .split_once(';')
            .and_then(|(name, next)| Some((character(name)?, next)));
        let (found, next) = known.unwrap_or(('&', after));
        meant.push(found);
        rest = next;
    }
    meant.push_str(rest);
    meant
}

/// Returns the character of an entity of XML.
fn character(name: &str) -> Option<char> {
    Some(match name {
        "amp" => '&',
        "lt" => '<',
        "gt" => '>',
        "quot" => '"',
        "apos" => '\'',
        _ => {
            let number = name.strip_prefix('#')?;
            let code = match number.strip_prefix('x') {
                Some(digits) => u32::from_str_radix(digits, 16),
                None => number.parse(),
            };
            char::from_u32(code.ok()?)?
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_that_no_request_can_name_are_taken_out_and_told() {
        let object = |key: &str| format!("<Contents><Key>{key}</Key><Size>7</Size></Contents>");
        let folder = |key: &str| format!("<CommonPrefixes><Prefix>{key}</Prefix></CommonPrefixes>");
        let good = ["a/b.mcap", "a b/%2F.mcap", "t&amp;c/1.mcap", "ö.mcap"].map(object);
        let bad = [
            "a//b.mcap",
            "/b.mcap",
            "a/./b.mcap",
            "../b",
            "x&#10;y&amp;",
            "a//",
        ]
        .map(object);
        let markers = ["a/", "x.mcap/"].map(object).concat();
        let mixed = good.iter().zip(&bad).map(|(good, bad)| good.clone() + bad);
        let mixed: String = mixed.chain(bad[4..].to_vec()).chain([markers]).collect();
        let (good_folder, bad_folder) = (folder("a/"), folder("a//"));
        let answer =
            format!("<ListBucketResult>{mixed}{bad_folder}{good_folder}</ListBucketResult>");
        let (kept, unnameable) = without_unnameable(&answer);
        let good = good.concat();
        assert_eq!(
            kept,
            format!("<ListBucketResult>{good}{good_folder}</ListBucketResult>")
        );
        assert_eq!(
            unnameable,
            ["a//b.mcap", "/b.mcap", "a/./b.mcap", "../b", "x\ny&", "a//"]
        );
        assert_eq!(without_unnameable(&kept), (kept, Vec::new()));
    }

    #[test]
    fn an_answer_of_azure_and_one_that_was_cut() {
        let blob = |key: &str| format!("<Blob><Name>{key}</Name><Properties/></Blob>");
        let (good, bad) = (blob("a/b"), blob("a//b"));
        let (kept, unnameable) = without_unnameable(&format!("<Blobs>{bad}{good}</Blobs>"));
        assert_eq!(kept, format!("<Blobs>{good}</Blobs>"));
        assert_eq!(unnameable, ["a//b"]);
        for end in 0..bad.len() {
            assert_eq!(without_unnameable(&bad[..end]).1, [""; 0]);
        }
    }
}
