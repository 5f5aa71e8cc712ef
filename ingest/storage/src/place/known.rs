//! The buckets and servers of this process: their addresses, how they are reached, and what of their URLs is secret.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use object_store::aws::AmazonS3Builder;
use object_store::azure::MicrosoftAzureBuilder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::http::HttpBuilder;
use object_store::path::Path as Key;
use object_store::{ClientOptions, ObjectStore, RetryConfig};
use url::Url;

use crate::counted::Connector;
use crate::error::{Error, ErrorKind};
use crate::redact::{hide, hide_query, hide_variables};

use super::access::Access;

const LONGEST_CONNECT: Duration = Duration::from_secs(10);

/// The kind of store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    S3,
    Gcs,
    Azure,
    Http,
}

/// A bucket or server.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct Address {
    pub(crate) kind: Kind,
    /// "s3://bucket" or "https://host:port".
    shown: String,
    /// User name and password, then the query of a web server's URL.
    secrets: Option<(String, String)>,
}

impl Address {
    pub(crate) fn bucket(kind: Kind, scheme: &str, name: &str) -> Self {
        Self {
            kind,
            shown: format!("{scheme}://{name}"),
            secrets: None,
        }
    }

    pub(crate) fn web(url: &Url) -> Result<Self, String> {
        let host = url.host_str().ok_or("expected the name of a host")?;
        let port = url.port().map_or(String::new(), |port| format!(":{port}"));
        let user = match (url.username(), url.password()) {
            ("", None) => String::new(),
            (user, None) => format!("{user}@"),
            (user, Some(password)) => format!("{user}:{password}@"),
        };
        let query = url
            .query()
            .map_or(String::new(), |query| format!("?{query}"));
        let is_secret = !user.is_empty() || !query.is_empty();
        url.password().into_iter().for_each(hide);
        url.query().into_iter().for_each(hide_query);
        Ok(Self {
            kind: Kind::Http,
            shown: format!("{}://{host}{port}", url.scheme()),
            secrets: is_secret.then_some((user, query)),
        })
    }

    pub(crate) fn shown(&self) -> &str {
        &self.shown
    }

    fn name(&self) -> &str {
        self.shown.split_once("://").map_or("", |(_, name)| name)
    }

    fn with_secrets(&self, path: &str) -> String {
        let none = (String::new(), String::new());
        let (user, query) = self.secrets.as_ref().unwrap_or(&none);
        let (scheme, host) = self.shown.split_once("://").unwrap_or(("", ""));
        format!("{scheme}://{user}{host}{path}{query}")
    }

    /// Returns the URL of a key with its secrets; `None` if the place has none.
    pub(crate) fn secret_url(&self, key: &Key) -> Option<String> {
        self.secrets.as_ref()?;
        let mut url = Url::parse(&self.shown).ok()?;
        url.path_segments_mut()
            .ok()?
            .pop_if_empty()
            .extend(key.as_ref().split('/'));
        Some(self.with_secrets(url.path()))
    }
}

/// A bucket or server that can be reached.
pub(crate) struct Root {
    pub(crate) kind: Kind,
    pub(crate) store: Arc<dyn ObjectStore>,
    pub(crate) access: Access,
}

#[derive(Default)]
struct Known {
    roots: HashMap<Address, Arc<Root>>,
    access: HashMap<String, Access>,
    /// Full URLs by the names that are shown for them.
    secrets: HashMap<String, String>,
}

fn known() -> MutexGuard<'static, Known> {
    static KNOWN: OnceLock<Mutex<Known>> = OnceLock::new();
    let known = KNOWN.get_or_init(Mutex::default);
    // every entry is complete on its own
    known.lock().unwrap_or_else(PoisonError::into_inner)
}

/// States how a bucket or server ("s3://bucket", "https://host") is reached from now on, instead of by the
/// environment alone.
pub fn connect(address: &str, access: Access) {
    let address = address.trim_end_matches('/').to_owned();
    let mut known = known();
    known.roots.retain(|root, _| root.shown != address);
    known.access.insert(address, access);
}

/// Keeps a URL with secrets under the name that is shown for it; returns that name. Different URLs have different
/// names.
pub(crate) fn remember(name: String, full: String) -> String {
    let secrets = &mut known().secrets;
    let mut candidate = name.clone();
    let mut number = 2;
    while secrets.get(&candidate).is_some_and(|other| *other != full) {
        candidate = format!("{name}#{number}");
        number += 1;
    }
    secrets.insert(candidate.clone(), full);
    candidate
}

/// The URL that is shown under this name.
pub(crate) fn named(name: &str) -> Option<String> {
    known().secrets.get(name).cloned()
}

static WHOLE_READS: AtomicBool = AtomicBool::new(false);

/// Allows or forbids this process to transfer files of buckets and servers as a whole where their format has no
/// index. Forbidden at first, unless the environment has `TIPWATCH_FETCH_WHOLE=1`.
pub fn set_whole_reads(allowed: bool) {
    WHOLE_READS.store(allowed, Ordering::Relaxed);
}

/// Whether files without an index may be transferred as a whole.
pub fn whole_reads() -> bool {
    WHOLE_READS.load(Ordering::Relaxed)
        || std::env::var_os("TIPWATCH_FETCH_WHOLE").is_some_and(|value| value == "1")
}

/// The store at an address; connections are kept for the life of the process.
pub(crate) fn root(address: &Address) -> Result<Arc<Root>, Error> {
    if let Some(root) = known().roots.get(address) {
        return Ok(Arc::clone(root));
    }
    let access = known().access.get(&address.shown).cloned();
    let access = access.unwrap_or_default();
    let store = store(address, &access).map_err(|error| {
        let detail = format!("cannot be reached as configured: {error}");
        Error::new(address.shown(), ErrorKind::Refused, detail)
    })?;
    let root = Arc::new(Root {
        kind: address.kind,
        store,
        access,
    });
    known().roots.insert(address.clone(), Arc::clone(&root));
    Ok(root)
}

fn store(address: &Address, access: &Access) -> object_store::Result<Arc<dyn ObjectStore>> {
    // Fails only if another part of the process has chosen already.
    let _ = rustls::crypto::ring::default_provider().install_default();
    // The attempts are made above the store, where they are counted.
    let once = RetryConfig {
        max_retries: 0,
        ..RetryConfig::default()
    };
    let options = |allow_http: bool| {
        ClientOptions::new()
            .with_timeout(access.timeout)
            .with_connect_timeout(access.timeout.min(LONGEST_CONNECT))
            .with_allow_http(allow_http)
    };
    // Buckets are reached without encryption only if their address says so.
    let is_plain = |variables: &[(String, String)]| {
        let names = ["ENDPOINT", "BASE_URL"];
        variables.iter().any(|(name, value)| {
            names.iter().any(|part| name.contains(part)) && value.starts_with("http://")
        })
    };
    macro_rules! configured {
        ($builder:expr, $prefix:literal) => {{
            let variables = access.variables_of($prefix);
            hide_variables(&variables);
            let builder = $builder
                .with_client_options(options(is_plain(&variables)))
                .with_retry(once)
                .with_http_connector(Connector);
            variables
                .into_iter()
                .fold(builder, |builder, (name, value)| {
                    match name.to_ascii_lowercase().parse() {
                        Ok(key) => builder.with_config(key, value),
                        Err(_) => builder,
                    }
                })
        }};
    }
    Ok(match address.kind {
        Kind::S3 => {
            let builder = configured!(AmazonS3Builder::new(), "AWS_");
            Arc::new(builder.with_bucket_name(address.name()).build()?)
        }
        Kind::Gcs => {
            let builder = configured!(GoogleCloudStorageBuilder::new(), "GOOGLE_");
            Arc::new(builder.with_bucket_name(address.name()).build()?)
        }
        Kind::Azure => {
            let builder = configured!(MicrosoftAzureBuilder::new(), "AZURE_");
            Arc::new(builder.with_url(format!("{}/", address.shown)).build()?)
        }
        Kind::Http => Arc::new(
            HttpBuilder::new()
                .with_url(address.with_secrets("/"))
                .with_client_options(options(true))
                .with_retry(once)
                .with_http_connector(Connector)
                .build()?,
        ),
    })
}
