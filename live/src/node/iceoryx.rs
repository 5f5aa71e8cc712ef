//! Parts of iceoryx2 that all ports share: the service type and its errors.

use std::fmt::Debug;

use anyhow::anyhow;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

pub(super) type Service<T> = PortFactory<ipc::Service, T, ()>;

/// iceoryx2's errors are plain enumerations without a source.
pub(super) fn cause(error: impl Debug) -> anyhow::Error {
    anyhow!("iceoryx2: {error:?}")
}
