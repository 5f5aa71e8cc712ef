//! The functions that `tipwatch_client_library.h` declares. What they promise is written there.
#![allow(
    unsafe_code,
    reason = "what C passes are pointers, and C finds functions by names without mangling"
)]

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::thread::ThreadId;
use std::time::Duration;

use tipwatch_live::node::ServiceAddress;
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::topics::DEFAULT_SERVICE;

use crate::client::Client;
use crate::failure::{Failure, Kind};

/// The longest wait: who asks for more waits again.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// What C knows as `struct tipwatch_client`.
pub struct Handle {
    /// Ends of a service stay in the thread that opened them. Other threads read nothing but this.
    thread: ThreadId,
    opened: RefCell<Opened>,
}

struct Opened {
    /// `None` after a panic: nobody knows in which state it left the client.
    client: Option<Client>,
    /// Why the last call failed.
    failure: CString,
}

/// Joins the shared memory.
///
/// # Safety
/// `service` and `prefix` are null or end with a zero byte; `error` is null or has room for `error_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_open(
    contract: u64,
    service: *const c_char,
    prefix: *const c_char,
    error: *mut c_char,
    error_size: usize,
) -> *mut Handle {
    let opened = caught(|| {
        // SAFETY: as the caller promises.
        let (service, prefix) = unsafe { (text(service)?, text(prefix)?) };
        let address = ServiceAddress {
            service: service.unwrap_or(DEFAULT_SERVICE).into(),
            prefix: prefix.map(Into::into),
        };
        Client::open(contract, &address)
    });
    match opened {
        Ok(client) => Box::into_raw(Box::new(Handle {
            thread: std::thread::current().id(),
            opened: RefCell::new(Opened {
                client: Some(client),
                failure: CString::default(),
            }),
        })),
        Err(failure) => {
            // SAFETY: as the caller promises.
            unsafe { say(&failure.text, error, error_size) };
            ptr::null_mut()
        }
    }
}

/// Leaves the shared memory.
///
/// # Safety
/// `client` is null or open. It is closed afterwards, unless this fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_close(client: *mut Handle) -> c_int {
    if client.is_null() {
        return 0;
    }
    // SAFETY: it is open, and only its own thread goes on.
    let close = || match unsafe { is_own(client)? } {
        true => {
            // SAFETY: it came from a box, and nobody uses it any more.
            drop(unsafe { Box::from_raw(client) });
            Ok(())
        }
        false => Err(Failure::new(Kind::Thread, "")),
    };
    caught(close).map_or_else(|failure| failure.kind as c_int, |()| 0)
}

/// Why the last call with this client failed.
///
/// # Safety
/// `client` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_error(client: *const Handle) -> *const c_char {
    let said = caught(|| {
        // SAFETY: as the caller promises.
        let is_own = !client.is_null() && unsafe { is_own(client)? };
        // SAFETY: it is open, and this is its thread.
        Ok(is_own.then(|| unsafe { (*client).opened.borrow().failure.as_ptr() }))
    });
    let other = c"expected an open client, and the thread that opened it";
    said.ok().flatten().unwrap_or(other.as_ptr())
}

/// Publishes a message.
///
/// # Safety
/// `context` is null or an open client, `service` null or ends with a zero byte, and `message` null or of `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_send(
    context: *mut c_void,
    service: *const c_char,
    message: *const c_void,
    size: usize,
) -> c_int {
    let send = |client: &mut Client| {
        // SAFETY: as the caller promises.
        let (service, message) = unsafe { (suffix(service)?, bytes(message, size)?) };
        client.send(service, message).map(|()| 0)
    };
    // SAFETY: as the caller promises.
    unsafe { with_client(context, send) }
}

/// Notifies the event service of this name.
///
/// # Safety
/// `context` is null or an open client, and `service` null or ends with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_notify(
    context: *mut c_void,
    service: *const c_char,
) -> c_int {
    let notify = |client: &mut Client| {
        // SAFETY: as the caller promises.
        let service = unsafe { suffix(service)? };
        client.notify(service).map(|()| 0)
    };
    // SAFETY: as the caller promises.
    unsafe { with_client(context, notify) }
}

/// Copies the next message that waits: 1 if there was one, 0 if none waits.
///
/// # Safety
/// `context` is null or an open client, `service` null or ends with a zero byte, and `message` null or has room for `size`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_receive(
    context: *mut c_void,
    service: *const c_char,
    message: *mut c_void,
    size: usize,
) -> c_int {
    let receive = |client: &mut Client| {
        // SAFETY: as the caller promises.
        let service = unsafe { suffix(service)? };
        if message.is_null() {
            return Err(null("message"));
        }
        let mut take = |bytes: &[u8]| {
            // SAFETY: the caller has room for as many bytes, which was compared, and they are not those of the message.
            unsafe { ptr::copy_nonoverlapping(bytes.as_ptr(), message.cast(), bytes.len()) };
        };
        client.receive(service, size, &mut take).map(c_int::from)
    };
    // SAFETY: as the caller promises.
    unsafe { with_client(context, receive) }
}

/// Waits for a notification of the event service, but no longer than this (ns).
///
/// # Safety
/// `context` is null or an open client, and `service` null or ends with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tipwatch_client_wait(
    context: *mut c_void,
    service: *const c_char,
    longest_ns: i64,
) -> c_int {
    let wait = |client: &mut Client| {
        // SAFETY: as the caller promises.
        let service = unsafe { suffix(service)? };
        let longest = Duration::from_nanos(longest_ns.try_into().unwrap_or(0));
        client.wait(service, longest.min(MAX_WAIT)).map(|()| 0)
    };
    // SAFETY: as the caller promises.
    unsafe { with_client(context, wait) }
}

/// CLOCK_MONOTONIC (ns). Every thread may ask, with any context.
#[unsafe(no_mangle)]
pub extern "C" fn tipwatch_client_now_ns(_context: *mut c_void) -> i64 {
    monotonic_ns()
}

/// Calls with the client of a context; what the call returns, or the number of its failure, whose text the client keeps.
///
/// # Safety
/// `context` is null or an open client.
unsafe fn with_client(
    context: *mut c_void,
    call: impl FnOnce(&mut Client) -> Result<c_int, Failure>,
) -> c_int {
    let handle: *const Handle = context.cast_const().cast();
    // SAFETY: as the caller promises.
    match caught(|| Ok(!handle.is_null() && unsafe { is_own(handle)? })) {
        Ok(true) => {}
        Ok(false) if handle.is_null() => return Kind::Argument as c_int,
        Ok(false) => return Kind::Thread as c_int,
        Err(failure) => return failure.kind as c_int,
    }
    // SAFETY: it is open, and this is its thread.
    let mut opened = unsafe { (*handle).opened.borrow_mut() };
    let result = match &mut opened.client {
        Some(client) => caught(|| call(client)),
        None => Err(mistake(&())),
    };
    let failure = match result {
        Ok(number) => return number,
        Err(failure) => failure,
    };
    if failure.kind == Kind::Mistake {
        // not dropped either: that could panic again
        std::mem::forget(opened.client.take());
    }
    opened.failure = without_zeros(&failure.text);
    failure.kind as c_int
}

/// Whether this is the thread that opened the client.
///
/// # Safety
/// `client` is open.
unsafe fn is_own(client: *const Handle) -> Result<bool, Failure> {
    // SAFETY: it is open, and nobody writes this field.
    Ok(unsafe { (*client).thread } == std::thread::current().id())
}

/// The result of a call, in which a panic is a failure: it must not cross into C.
fn caught<R>(call: impl FnOnce() -> Result<R, Failure>) -> Result<R, Failure> {
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|panic| Err(mistake(panic.as_ref())))
}

fn mistake(panic: &(dyn Any + Send)) -> Failure {
    let words = panic.downcast_ref::<&str>().copied();
    let words = words.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    Failure::new(
        Kind::Mistake,
        format!(
            "this is a mistake in the library: close the client{}{}",
            if words.is_some() { ": " } else { "" },
            words.unwrap_or_default()
        ),
    )
}

fn null(argument: &str) -> Failure {
    Failure::new(
        Kind::Argument,
        format!("{argument}: expected a pointer, found null"),
    )
}

/// A text; `None` for null.
///
/// # Safety
/// `text` is null, or ends with a zero byte and outlives the result.
unsafe fn text<'a>(text: *const c_char) -> Result<Option<&'a str>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: as the caller promises.
    let text = unsafe { CStr::from_ptr(text) };
    let utf8 = text.to_str();
    utf8.map(Some)
        .map_err(|_| Failure::new(Kind::Argument, format!("{text:?}: expected UTF-8")))
}

/// The suffix of a service.
///
/// # Safety
/// As of [`text`].
unsafe fn suffix<'a>(service: *const c_char) -> Result<&'a str, Failure> {
    // SAFETY: as the caller promises.
    unsafe { text(service) }?.ok_or_else(|| null("service"))
}

/// The bytes of a message.
///
/// # Safety
/// `message` is null, or of `size` bytes and outlives the result.
unsafe fn bytes<'a>(message: *const c_void, size: usize) -> Result<&'a [u8], Failure> {
    if message.is_null() {
        return Err(null("message"));
    }
    // SAFETY: as the caller promises.
    Ok(unsafe { std::slice::from_raw_parts(message.cast(), size) })
}

/// Writes a text with its zero byte, cut to fit.
///
/// # Safety
/// `to` is null or has room for `size` bytes.
unsafe fn say(text: &str, to: *mut c_char, size: usize) {
    if to.is_null() || size == 0 {
        return;
    }
    let text = without_zeros(text);
    let length = text.to_string_lossy().floor_char_boundary(size - 1);
    // SAFETY: no more than `size` bytes are written, and no more than the text has are read.
    unsafe {
        ptr::copy_nonoverlapping(text.as_ptr(), to, length);
        *to.add(length) = 0;
    }
}

fn without_zeros(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_failure_and_closes_the_client_for_all_but_closing() {
        let handle = Box::into_raw(Box::new(Handle {
            thread: std::thread::current().id(),
            opened: RefCell::new(Opened {
                client: None,
                failure: CString::default(),
            }),
        }));
        let failure = caught(|| -> Result<(), Failure> { panic!("{}", "a word") }).unwrap_err();
        assert_eq!(failure.kind, Kind::Mistake);
        assert!(failure.text.ends_with(": a word"), "{}", failure.text);
        // SAFETY: it was made above, and is closed once.
        unsafe {
            let sent = tipwatch_client_notify(handle.cast(), c"/samples".as_ptr());
            assert_eq!(sent, Kind::Mistake as c_int);
            assert!(!CStr::from_ptr(tipwatch_client_error(handle)).is_empty());
            assert_eq!(tipwatch_client_close(handle), 0);
        }
    }
}
