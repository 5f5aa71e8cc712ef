//! As much of the REST API of Azure Blob Storage as programs of one container use, with a shared access signature:
//! <https://learn.microsoft.com/rest/api/storageservices/blob-service-rest-api>.

use super::objects::{Objects, Tells, all_between, escaped, served};
use super::wire::{Reply, Request, SECRET, Service, decoded};

#[derive(Default)]
pub(crate) struct Azure {
    pub(crate) container: String,
    pub(crate) objects: Objects,
}

impl Service for Azure {
    fn answer(&self, request: &Request) -> Reply {
        if request.asks("sig") != Some(SECRET) {
            return Reply::error(403, "AuthenticationFailed");
        }
        let (container, key) = request.path.split_once('/').unwrap_or((&request.path, ""));
        if container != self.container {
            return Reply::error(404, "ContainerNotFound");
        }
        match (request.method.as_str(), request.asks("comp")) {
            ("GET", Some("list")) => self.list(request),
            ("POST", Some("batch")) => self.batch(request),
            ("GET" | "HEAD", None) => match self.objects.get(key) {
                // it knows no suffixes
                Some(stored) => served(
                    &stored,
                    request,
                    Tells {
                        suffixes: false,
                        ..Tells::ALL
                    },
                ),
                None => Reply::error(404, "BlobNotFound"),
            },
            ("PUT", comp) => self.put(request, key, comp),
            _ => Reply::error(405, "UnsupportedHttpVerb"),
        }
    }
}

impl Azure {
    fn list(&self, request: &Request) -> Reply {
        assert_eq!(request.asks("restype"), Some("container"));
        let prefix = request.asks("prefix").unwrap_or("");
        let page = self
            .objects
            .list(prefix, request.asks("delimiter"), request.asks("marker"));
        let mut text =
            String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?><EnumerationResults><Blobs>");
        for (key, stored) in &page.objects {
            text.push_str(&format!(
                "<Blob><Name>{}</Name><Properties><Last-Modified>{}</Last-Modified><Etag>{}</Etag>\
                 <Content-Length>{}</Content-Length><Content-Type>application/octet-stream</Content-Type>\
                 </Properties></Blob>",
                escaped(key),
                stored.modified_text(),
                stored.e_tag(),
                stored.bytes.len()
            ));
        }
        for folder in &page.folders {
            text.push_str(&format!(
                "<BlobPrefix><Name>{}</Name></BlobPrefix>",
                escaped(folder)
            ));
        }
        text.push_str("</Blobs><NextMarker>");
        text.push_str(&escaped(page.next.as_deref().unwrap_or("")));
        Reply::new(200).body((text + "</NextMarker></EnumerationResults>").as_bytes())
    }

    fn put(&self, request: &Request, key: &str, comp: Option<&str>) -> Reply {
        let stored = match comp {
            Some("block") => {
                let id = request.asks("blockid").unwrap();
                self.objects.put_part(key, id, &request.body);
                return Reply::new(201);
            }
            Some("blocklist") => {
                let text = String::from_utf8_lossy(&request.body).into_owned();
                let order = all_between(&text, "<Uncommitted>", "</Uncommitted>");
                let order: Vec<String> = order.into_iter().map(String::from).collect();
                self.objects
                    .join(key, key, &order)
                    .ok_or("InvalidBlockList")
            }
            None => {
                assert_eq!(request.header("x-ms-blob-type"), Some("BlockBlob"));
                let must_be_new = request.header("if-none-match") == Some("*");
                let put = self.objects.put(key, &request.body, must_be_new);
                put.ok_or("BlobAlreadyExists")
            }
            Some(_) => return Reply::error(400, "InvalidQueryParameterValue"),
        };
        match stored {
            Ok(stored) => (Reply::new(201).header("etag", stored.e_tag()))
                .header("last-modified", stored.modified_text()),
            Err(code) => Reply::error(409, code),
        }
    }

    /// Removes several objects: a request in parts, each of which is a request.
    fn batch(&self, request: &Request) -> Reply {
        let text = String::from_utf8_lossy(&request.body).into_owned();
        let ids = all_between(&text, "Content-ID: ", "\r\n");
        let paths = all_between(&text, "DELETE /", " HTTP/1.1");
        assert!(ids.len() == paths.len() && !ids.is_empty(), "{text}");
        let mut answer = String::new();
        for (id, path) in ids.iter().zip(paths) {
            let path = path.split('?').next().unwrap_or(path);
            let key = decoded(path.split_once('/').unwrap().1);
            let status = match self.objects.remove(&key) {
                true => "202 Accepted",
                false => "404 BlobNotFound",
            };
            answer.push_str(&format!(
                "--answers\r\nContent-Type: application/http\r\nContent-ID: {id}\r\n\r\nHTTP/1.1 {status}\r\n\
                 x-ms-version: 2018-11-09\r\n\r\n\r\n"
            ));
        }
        (Reply::new(202).body((answer + "--answers--\r\n").as_bytes()))
            .header("content-type", "multipart/mixed; boundary=answers")
    }
}
