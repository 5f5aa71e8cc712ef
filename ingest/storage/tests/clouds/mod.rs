//! Object storage of Google and Azure and web servers, in the test's own process, with faults on request.

#![allow(dead_code, reason = "two test programs use it, each in part")]
#![allow(
    clippy::unwrap_used,
    reason = "a server that cannot run fails the test"
)]

mod azure;
mod gcs;
mod objects;
mod web;
mod wire;

use std::sync::Arc;

use self::azure::Azure;
use self::gcs::Gcs;
pub(crate) use self::objects::{Objects, Tells};
use self::web::Web;
pub(crate) use self::wire::{Fault, Request, SECRET, WireServer};

/// A server with one bucket, and how clients reach it.
pub(crate) struct Cloud {
    pub(crate) server: WireServer,
    /// The bucket's URL.
    pub(crate) place: String,
    pub(crate) variables: Vec<(String, String)>,
    service: Backend,
}

enum Backend {
    Gcs(Arc<Gcs>),
    Azure(Arc<Azure>),
    Web(Arc<Web>),
}

impl Cloud {
    pub(crate) fn gcs(bucket: &str) -> Self {
        let service = Arc::new(Gcs {
            bucket: bucket.into(),
            ..Gcs::default()
        });
        let server = WireServer::start(service.clone());
        Self {
            place: format!("gs://{bucket}"),
            variables: vec![
                (
                    "GOOGLE_BASE_URL".into(),
                    format!("http://{}", server.address),
                ),
                ("GOOGLE_BEARER_TOKEN".into(), SECRET.into()),
            ],
            server,
            service: Backend::Gcs(service),
        }
    }

    pub(crate) fn azure(container: &str) -> Self {
        let service = Arc::new(Azure {
            container: container.into(),
            ..Azure::default()
        });
        let server = WireServer::start(service.clone());
        let signature = format!("sv=2024-11-04&sp=rwdl&sig={SECRET}");
        Self {
            place: format!("az://{container}"),
            variables: vec![
                ("AZURE_STORAGE_ACCOUNT_NAME".into(), "store".into()),
                (
                    "AZURE_STORAGE_ENDPOINT".into(),
                    format!("http://{}", server.address),
                ),
                ("AZURE_STORAGE_SAS_TOKEN".into(), signature),
            ],
            server,
            service: Backend::Azure(service),
        }
    }

    pub(crate) fn web(tells: Tells) -> Self {
        let service = Arc::new(Web {
            objects: Objects::default(),
            tells,
        });
        let server = WireServer::start(service.clone());
        Self {
            place: format!("http://{}", server.address),
            variables: Vec::new(),
            server,
            service: Backend::Web(service),
        }
    }

    /// Returns the objects in the bucket, read without a client.
    pub(crate) fn objects(&self) -> &Objects {
        match &self.service {
            Backend::Gcs(gcs) => &gcs.objects,
            Backend::Azure(azure) => &azure.objects,
            Backend::Web(web) => &web.objects,
        }
    }

    /// Writes objects from another thread.
    pub(crate) fn replacer(&self) -> impl Fn(&str, &[u8]) + Send + Sync + 'static {
        let service = match &self.service {
            Backend::Gcs(gcs) => Backend::Gcs(Arc::clone(gcs)),
            Backend::Azure(azure) => Backend::Azure(Arc::clone(azure)),
            Backend::Web(web) => Backend::Web(Arc::clone(web)),
        };
        move |key, bytes| {
            let objects = match &service {
                Backend::Gcs(gcs) => &gcs.objects,
                Backend::Azure(azure) => &azure.objects,
                Backend::Web(web) => &web.objects,
            };
            objects.put(key, bytes, false);
        }
    }

    pub(crate) fn at(&self, key: &str) -> String {
        format!("{}/{key}", self.place)
    }
}
