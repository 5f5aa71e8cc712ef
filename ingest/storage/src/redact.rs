//! Takes what is secret out of a text: parts of URLs, and the credentials that this process has met.
//!
//! Every error of this crate passes here when it is made, and every program passes its messages here once more before
//! they leave it: a URL may also come from a manifest or a machine file.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// Text that replaces a secret.
const HIDDEN: &str = "[redacted]";
/// Shorter words may stand in a message for another reason.
const SHORTEST_PASSWORD: usize = 4;
/// Shortest query, or value of a query, that is hidden in other texts: most of them are no secrets.
const SHORTEST_VALUE: usize = 16;

/// The text with user names and passwords, queries and fragments of all its URLs replaced; so is whatever this
/// process has met as a secret: of URLs that were opened, and of the environment by which buckets are reached.
///
/// Wildcards in the keys of buckets stay. A text that was redacted stays the same.
///
/// ```
/// let text = "https://me:pw@host/a.mcap?X-Amz-Signature=abc failed";
/// assert_eq!(tipwatch_storage::redact(text), "https://[redacted]@host/a.mcap?[redacted] failed");
/// ```
pub fn redact(text: &str) -> String {
    let mut text = text.to_owned();
    for secret in secrets().iter() {
        if text.contains(&secret.0) {
            text = text.replace(&secret.0, HIDDEN);
        }
    }
    let mut out = String::with_capacity(text.len());
    let mut rest = text.as_str();
    while let Some(at) = rest.find("://") {
        let is_scheme = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
        let before = &rest[..at];
        let scheme = &before[before.trim_end_matches(is_scheme).len()..];
        out.push_str(before);
        out.push_str("://");
        let after = &rest[at + 3..];
        let is_end = |c: char| c.is_whitespace() || matches!(c, '"' | '\'' | '<' | '>' | '`');
        let (url, further) = after.split_at(after.find(is_end).unwrap_or(after.len()));
        redact_url(scheme, url, &mut out);
        rest = further;
    }
    out.push_str(rest);
    out
}

/// Redacts a text that is one URL, or was meant as one: it may contain spaces and quotes.
pub(crate) fn redact_one(text: &str) -> String {
    match text.split_once("://") {
        Some((scheme, url)) => {
            let mut out = format!("{scheme}://");
            redact_url(scheme, url, &mut out);
            redact(&out)
        }
        None => redact(text),
    }
}

/// Appends a URL without its secrets; `url` is the part behind `scheme://`.
fn redact_url(scheme: &str, url: &str, out: &mut String) {
    let is_any = |schemes: &[&str]| schemes.iter().any(|one| one.eq_ignore_ascii_case(scheme));
    let is_bucket = is_any(&["s3", "s3a", "gs", "az", "abfs", "abfss", "file"]);
    let (address, secret) = match url.find(['?', '#']) {
        Some(at) => url.split_at(at),
        None => (url, ""),
    };
    let host_end = address.find('/').unwrap_or(address.len());
    let (host, path) = address.split_at(host_end);
    match host.rsplit_once('@') {
        // the container before the account of Azure is no secret: it has no password
        Some((user, _)) if is_bucket && !user.contains(':') => out.push_str(address),
        Some((_, host)) => {
            out.push_str(HIDDEN);
            out.push('@');
            out.push_str(host);
            out.push_str(path);
        }
        // a password with a slash or a question mark in it: what follows the colon is no port, or no path follows
        None if has_no_port(host)
            || (host.ends_with(':') && url.contains('@'))
            || (host.contains(':') && first_folder(path).contains('@')) =>
        {
            out.push_str(HIDDEN);
            if let Some((_, rest)) = path.rsplit_once('@') {
                out.push('@');
                out.push_str(rest);
            }
        }
        None => out.push_str(address),
    }
    let Some(sign) = secret.chars().next() else {
        return;
    };
    // a wildcard is no query, and a number tells apart URLs that differ in what is hidden
    let is_wildcard =
        is_bucket && sign == '?' && !host.contains(':') && !secret.contains(['=', '@']);
    let is_number = sign == '#' && secret[1..].chars().all(|c| c.is_ascii_digit());
    if is_wildcard || is_number {
        out.push_str(secret);
    } else {
        out.push(sign);
        out.push_str(HIDDEN);
    }
}

fn first_folder(path: &str) -> &str {
    let mut folders = path.split('/').filter(|name| !name.is_empty());
    folders.next().unwrap_or("")
}

/// Whether the colon of a host is followed by something else than a port.
fn has_no_port(host: &str) -> bool {
    let after = match host.strip_prefix('[') {
        // an address of IPv6
        Some(address) => address.split_once(']').map_or("", |(_, after)| after),
        None => host,
    };
    let port = after.split_once(':').map_or("", |(_, port)| port);
    // punctuation after a URL in a sentence
    let port = port.trim_end_matches([':', ',', '.', ';', ')', ']']);
    !port.chars().all(|c| c.is_ascii_digit())
}

/// A secret; the longest are first, since one may be part of another.
#[derive(PartialEq, Eq)]
struct Secret(String);

impl Ord for Secret {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let length = other.0.len().cmp(&self.0.len());
        length.then_with(|| self.0.cmp(&other.0))
    }
}

impl PartialOrd for Secret {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

fn secrets() -> MutexGuard<'static, BTreeSet<Secret>> {
    static SECRETS: OnceLock<Mutex<BTreeSet<Secret>>> = OnceLock::new();
    let secrets = SECRETS.get_or_init(Mutex::default);
    // every entry is complete on its own
    secrets.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hides a password from now on, wherever it stands in a text.
pub(crate) fn hide(password: &str) {
    if password.len() >= SHORTEST_PASSWORD && !HIDDEN.contains(password) {
        secrets().insert(Secret(password.to_owned()));
    }
}

/// Hides a query from now on, and its longer values, as they stand and decoded.
pub(crate) fn hide_query(query: &str) {
    if query.len() >= SHORTEST_VALUE {
        hide(query);
    }
    for (_, decoded) in url::form_urlencoded::parse(query.as_bytes()) {
        if decoded.len() >= SHORTEST_VALUE {
            hide(&decoded);
        }
    }
    let values = query.split('&').filter_map(|pair| pair.split_once('='));
    for (_, value) in values.filter(|(_, value)| value.len() >= SHORTEST_VALUE) {
        hide(value);
    }
}

/// Hides the values of variables whose names mark them as secret.
pub(crate) fn hide_variables(variables: &[(String, String)]) {
    let is_secret = |name: &str| {
        let parts = ["SECRET", "TOKEN", "PASSWORD", "SAS", "SIGNATURE", "_KEY"];
        parts.iter().any(|part| name.to_ascii_uppercase().contains(part))
            // the names of files, and of keys that are no secrets
            && !name.ends_with("_ID")
            && !name.ends_with("_FILE")
            && !name.ends_with("_PATH")
    };
    for (_, value) in variables.iter().filter(|(name, _)| is_secret(name)) {
        let value = value.trim_start_matches('?');
        if value.len() >= 8 {
            hide(value);
            hide_query(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn secrets_of_urls_are_hidden_and_nothing_else() {
        let text = "GET https://me:pw@host/a/b.mcap?X-Amz-Signature=abc&x=1 failed; see az://logs@store/x \
                    and s3://b/2026-??/*.mcap";
        let shown = redact(text);
        assert_eq!(
            shown,
            "GET https://[redacted]@host/a/b.mcap?[redacted] failed; see az://logs@store/x \
             and s3://b/2026-??/*.mcap"
        );
    }

    #[test]
    fn unusual_forms_of_secrets_are_hidden() {
        for (text, expected) in [
            ("https://token@host/x", "https://[redacted]@host/x"),
            ("https://host/x?token", "https://host/x?[redacted]"),
            ("https://host/x#token", "https://host/x#[redacted]"),
            ("https://me:p/w@host/x", "https://[redacted]@host/x"),
            ("https://me:p?w@host/x", "https://[redacted]?[redacted]"),
            ("https://me:1/2@host/x", "https://[redacted]@host/x"),
            ("https://me:1//2@host/x", "https://[redacted]@host/x"),
            ("https://me://p/w@host/x", "https://[redacted]@host/x"),
            ("https://me:/p?w@host/x", "https://[redacted]?[redacted]"),
            ("s3://me:?p?w@bucket/x", "s3://[redacted]?[redacted]"),
            ("HTTPS://me:pw@host/x", "HTTPS://[redacted]@host/x"),
            ("ftp://me:pw@host/x", "ftp://[redacted]@host/x"),
            ("s3://key:pw@bucket/x", "s3://[redacted]@bucket/x"),
            ("s3://b/k?X-Amz-Signature=x", "s3://b/k?[redacted]"),
            // no secrets
            ("http://host:80/x: not found", "http://host:80/x: not found"),
            ("http://host:80/x/a@b.mcap", "http://host:80/x/a@b.mcap"),
            ("http://[::1]:80/x", "http://[::1]:80/x"),
            ("https://host/x#2", "https://host/x#2"),
            ("http://host:", "http://host:"),
        ] {
            assert_eq!(redact(text), expected);
            assert_eq!(redact(expected), expected);
        }
        assert_eq!(
            redact_one("ftp://me:p w@host/a'b c?sig=d e"),
            "ftp://[redacted]@host/a'b c?[redacted]"
        );
    }

    #[test]
    fn secrets_that_were_met_are_hidden_wherever_they_stand() {
        hide_query("X-Amz-Signature=0123456789abcdef%2Fwith&expires=60");
        hide_variables(&[
            ("AWS_SECRET_ACCESS_KEY".into(), "k3y-of-the-fleet".into()),
            ("AWS_ACCESS_KEY_ID".into(), "who-has-the-key".into()),
            (
                "AZURE_STORAGE_SAS_TOKEN".into(),
                "?sv=1&sig=of-the-storage-account".into(),
            ),
        ]);
        for (text, expected) in [
            ("said 0123456789abcdef%2Fwith", "said [redacted]"),
            ("said 0123456789abcdef/with now", "said [redacted] now"),
            (
                "no k3y-of-the-fleet for who-has-the-key",
                "no [redacted] for who-has-the-key",
            ),
            ("said of-the-storage-account", "said [redacted]"),
            ("expires in 60 s", "expires in 60 s"),
        ] {
            assert_eq!(redact(text), expected);
        }
    }

    proptest! {
        #[test]
        fn no_query_survives(secret in "[a-zA-Z0-9%+/]{8,40}", before in "\\PC{0,20}") {
            let text = format!("{before} https://host/path?sig={secret} end");
            let hidden = !redact(&text).contains(&format!("sig={secret}"));
            prop_assert!(hidden);
        }

        // one that begins with digits and a slash may be a port and a path
        #[test]
        fn no_password_survives_in_a_url(password in "[a-zA-Z%+/?#'! ][a-zA-Z0-9%+/?#'! ]{8,40}q", scheme in "https?|ftp|s3") {
            let text = format!("{scheme}://me:{password}@host/path");
            prop_assert!(!redact_one(&text).contains(&password), "{}", redact_one(&text));
        }

        #[test]
        fn redacting_twice_changes_nothing(text in "(\\PC|://|[?#@:/]){0,40}") {
            let once = redact(&text);
            prop_assert_eq!(redact(&once), once);
        }
    }
}
