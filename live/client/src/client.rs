//! A client: a process's access to all services, of one thread.

use std::time::Duration;

use tipwatch_live::node::{LiveNode, ServiceAddress};
use tipwatch_live::wire::contract::{EachService, contract_number, each_service};
use tipwatch_live::wire::topics::{SAMPLES_SUFFIX, SESSION_SUFFIX, Topic};

use crate::failure::{Failure, Kind};
use crate::service::{Ends, Service};

/// Name of the process in the shared memory.
const ROLE: &str = "tipwatch-client";

/// An open client.
pub struct Client {
    // the ends stand before the node that made them, because fields are dropped in this order
    services: Vec<Box<dyn Service>>,
    node: LiveNode,
}

impl Client {
    pub(crate) fn open(contract: u64, address: &ServiceAddress) -> Result<Self, Failure> {
        let own = contract_number();
        if contract != own {
            let text = format!(
                "expected a program compiled with the header of this library (TIPWATCH_CONTRACT {own}), found another \
                 ({contract}): compile it again"
            );
            return Err(Failure::new(Kind::Argument, text));
        }
        let mut closed = Closed(Vec::new());
        each_service(&mut closed);
        Ok(Self {
            node: LiveNode::in_foreign_program(address, ROLE)?,
            services: closed.0,
        })
    }

    pub(crate) fn send(&mut self, suffix: &str, message: &[u8]) -> Result<(), Failure> {
        // a monitor that reads of a session takes a service of samples without a writer for a machine that is gone
        if suffix == SESSION_SUFFIX {
            let (service, node) = self.service(SAMPLES_SUFFIX)?;
            service.open_writer(node)?;
        }
        let (service, node) = self.service(suffix)?;
        service.send(node, message)?;
        for service in &self.services {
            service.deliver_history()?;
        }
        Ok(())
    }

    pub(crate) fn notify(&mut self, suffix: &str) -> Result<(), Failure> {
        let (service, node) = self.service(suffix)?;
        service.notify(node)
    }

    pub(crate) fn receive(
        &mut self,
        suffix: &str,
        size: usize,
        take: &mut dyn FnMut(&[u8]),
    ) -> Result<bool, Failure> {
        let (service, node) = self.service(suffix)?;
        service.receive(node, size, take)
    }

    pub(crate) fn wait(&mut self, suffix: &str, longest: Duration) -> Result<(), Failure> {
        let (service, node) = self.service(suffix)?;
        service.wait(node, longest)
    }

    fn service(&mut self, suffix: &str) -> Result<(&mut dyn Service, &LiveNode), Failure> {
        let mut services = self.services.iter_mut();
        match services.find(|service| service.suffix() == suffix) {
            Some(service) => Ok((service.as_mut(), &self.node)),
            None => Err(Failure::new(
                Kind::Service,
                format!(
                    "expected the suffix of a service, like {SAMPLES_SUFFIX}, found {suffix:?}"
                ),
            )),
        }
    }
}

/// All services, without an open end.
struct Closed(Vec<Box<dyn Service>>);

impl EachService for Closed {
    fn service<T: Topic>(&mut self, _message: &'static str) {
        self.0.push(Box::new(Ends::<T>::closed()));
    }
}
