//! Parts of iceoryx2 that all ports share: the service type, its opening and its errors.

use std::fmt::Debug;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

pub(super) type Service<T> = PortFactory<ipc::Service, T, ()>;

/// Longest wait for a service that other programs make or remove: programs that start at one time on a busy computer.
/// iceoryx2 itself gives up after a second.
const IN_FLUX_LIMIT: Duration = Duration::from_secs(10);

/// Opens a service, again while others make or remove it.
///
/// # Errors
/// The last error.
pub(super) fn opened<S, E: Debug>(
    open: impl Fn() -> Result<S, E>,
    is_in_flux: impl Fn(&E) -> bool,
) -> Result<S, E> {
    let start = Instant::now();
    loop {
        match open() {
            Err(error) if is_in_flux(&error) && start.elapsed() < IN_FLUX_LIMIT => {
                std::thread::sleep(IN_FLUX_LIMIT / 1000);
            }
            service => return service,
        }
    }
}

/// iceoryx2's errors are plain enumerations without a source.
pub(super) fn cause(error: impl Debug) -> anyhow::Error {
    anyhow!("iceoryx2: {error:?}")
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn a_service_is_opened_again_only_while_it_is_in_flux() {
        for ends in [Ok(()), Err("denied")] {
            let tries = Cell::new(0);
            let open = || {
                tries.set(tries.get() + 1);
                if tries.get() < 3 {
                    Err("in flux")
                } else {
                    ends
                }
            };
            assert_eq!(opened(open, |error| *error == "in flux"), ends);
            assert_eq!(tries.get(), 3);
        }
    }
}
