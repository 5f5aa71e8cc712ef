//! Takes what is secret out of URLs in a text.

/// What stands for a secret.
const HIDDEN: &str = "[redacted]";

/// The text with user names and passwords, queries and fragments of all its URLs replaced.
pub fn redact(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("://") {
        let (before, after) = rest.split_at(at + 3);
        out.push_str(before);
        let is_end = |c: char| c.is_whitespace() || matches!(c, '"' | '\'' | '<' | '>' | '`');
        let (url, further) = after.split_at(after.find(is_end).unwrap_or(after.len()));
        redact_url(url, &mut out);
        rest = further;
    }
    out.push_str(rest);
    out
}

/// What follows `scheme://`.
fn redact_url(url: &str, out: &mut String) {
    let (address, secret) = match url.find(['?', '#']) {
        Some(at) => url.split_at(at),
        None => (url, ""),
    };
    let host_end = address.find('/').unwrap_or(address.len());
    let (host, path) = address.split_at(host_end);
    match host.rsplit_once('@') {
        // the container before the account of Azure is no secret: it has no password
        Some((user, host)) if user.contains(':') => {
            out.push_str(HIDDEN);
            out.push('@');
            out.push_str(host);
        }
        _ => out.push_str(host),
    }
    out.push_str(path);
    // a wildcard is no query
    if secret.contains('=') || secret.starts_with('#') {
        out.push_str(&secret[..1]);
        out.push_str(HIDDEN);
    } else {
        out.push_str(secret);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    proptest::proptest! {
        #[test]
        fn no_query_survives(secret in "[a-zA-Z0-9%+/]{8,40}", before in "\\PC{0,20}") {
            let text = format!("{before} https://host/path?sig={secret} end");
            let hidden = !redact(&text).contains(&format!("sig={secret}"));
            proptest::prop_assert!(hidden);
        }
    }
}
