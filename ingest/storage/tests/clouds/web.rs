//! Web servers of several abilities.

use super::objects::{Objects, Tells, served};
use super::wire::{Reply, Request, Service};

pub(crate) struct Web {
    pub(crate) objects: Objects,
    pub(crate) tells: Tells,
}

impl Service for Web {
    fn answer(&self, request: &Request) -> Reply {
        match request.method.as_str() {
            "GET" | "HEAD" => match self.objects.get(&request.path) {
                Some(stored) => served(&stored, request, self.tells),
                None => Reply::error(404, "NotFound"),
            },
            "PUT" => {
                self.objects.put(&request.path, &request.body, false);
                Reply::new(201)
            }
            _ => Reply::error(405, "MethodNotAllowed"),
        }
    }
}
