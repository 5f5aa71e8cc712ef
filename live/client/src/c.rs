//! The functions that `tipwatch_client_library.h` declares. What they promise is written there.
#![allow(
    unsafe_code,
    reason = "what C passes are pointers, and C finds functions by names without mangling"
)]

use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::time::Duration;

use tipwatch_live::node::ServiceAddress;
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::topics::DEFAULT_SERVICE;

use crate::client::Client;
use crate::failure::{Failure, Kind};

/// The longest wait: who asks for more waits again.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Handle of a client: `struct tipwatch_client` in C. Its address points to nothing: it is a number that is given once, so that
/// the handle of a closed client, or of none, is recognised.
#[repr(C)]
pub struct Handle {
    nothing: [u8; 0],
}

struct Opened {
    /// The process that has opened it: a fork copies the client, and has no part in the shared memory.
    process: u32,
    /// `None` after a panic: nobody knows in which state it left the client.
    client: Option<Client>,
    /// Error text of the last call that failed; empty before.
    failure: CString,
}

impl Opened {
    fn new(client: Option<Client>) -> Self {
        Self {
            process: std::process::id(),
            client,
            failure: CString::default(),
        }
    }
}

/// The clients that are open in any thread, by their numbers.
static NUMBERS: Numbers = Numbers::none();

/// Numbers of clients. In the child of a fork another thread may hold the lock for good: nothing waits for it. A client that is not
/// listed works all the same; without the list, nobody can tell a closed client from one of another thread.
struct Numbers {
    last: AtomicUsize,
    open: Mutex<Vec<usize>>,
}

/// Number of tries before the list counts as held for good.
const TRIES: usize = 1000;

impl Numbers {
    const fn none() -> Self {
        Self {
            last: AtomicUsize::new(0),
            open: Mutex::new(Vec::new()),
        }
    }

    /// Returns the number of a client that is open from now on.
    fn begin(&self) -> usize {
        let number = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(mut open) = self.open() {
            open.push(number);
        }
        number
    }

    /// A client is closed.
    fn end(&self, number: usize) {
        if let Some(mut open) = self.open() {
            open.retain(|open| *open != number);
        }
    }

    /// Whether a client may be open.
    fn may_be_open(&self, number: usize) -> bool {
        self.open().is_none_or(|open| open.contains(&number))
    }

    /// The open clients, unless another thread holds the list: for a moment, or, in the child of a fork, for good.
    fn open(&self) -> Option<MutexGuard<'_, Vec<usize>>> {
        (0..TRIES).find_map(|_| match self.open.try_lock() {
            Ok(open) => Some(open),
            Err(TryLockError::Poisoned(open)) => Some(open.into_inner()),
            Err(TryLockError::WouldBlock) => {
                std::thread::yield_now();
                None
            }
        })
    }
}

thread_local! {
    /// The clients of this thread, in which the ends of their services stay. One that is not closed stays open when the thread ends.
    ///
    /// Nothing is dropped when the thread ends: the main thread's would be before the handlers of `atexit` and the destructors of
    /// C++, which may still close a client.
    static CLIENTS: ManuallyDrop<RefCell<Clients>> = const { ManuallyDrop::new(RefCell::new(BTreeMap::new())) };
}

type Clients = BTreeMap<usize, ManuallyDrop<Opened>>;

fn with_clients<R>(call: impl FnOnce(&mut Clients) -> R) -> R {
    CLIENTS.with(|clients| call(&mut clients.borrow_mut()))
}

/// The address of a client of this thread that is open from now on.
fn opened(opened: Opened) -> *mut Handle {
    let number = NUMBERS.begin();
    with_clients(|clients| clients.insert(number, ManuallyDrop::new(opened)));
    ptr::without_provenance_mut(number)
}

/// The client of this number, if this process and this thread have opened it.
fn own(clients: &mut Clients, number: usize) -> Result<&mut Opened, Failure> {
    match clients.get_mut(&number) {
        Some(opened) if opened.process == std::process::id() => Ok(opened),
        Some(_) => Err(Failure::new(Kind::Thread, "")),
        None => Err(no_client(number)),
    }
}

/// Returns the failure of a call with a handle that is no open client of this thread: null, of another thread, or closed.
fn no_client(number: usize) -> Failure {
    let kind = match number {
        0 => Kind::Argument,
        _ if NUMBERS.may_be_open(number) => Kind::Thread,
        _ => Kind::Closed,
    };
    Failure::new(kind, "")
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
    let client = caught(|| {
        // SAFETY: as the caller promises.
        let (service, prefix) = unsafe { (text(service)?, text(prefix)?) };
        if service == Some("") {
            let text = "service: expected a name, or null for the default, found an empty text";
            return Err(Failure::new(Kind::Argument, text));
        }
        let address = ServiceAddress {
            service: service.unwrap_or(DEFAULT_SERVICE).into(),
            prefix: prefix.map(Into::into),
        };
        Client::open(contract, &address)
    });
    match client {
        Ok(client) => opened(Opened::new(Some(client))),
        Err(failure) => {
            // SAFETY: as the caller promises.
            unsafe { say(&failure.text, error, error_size) };
            ptr::null_mut()
        }
    }
}

/// Leaves the shared memory.
#[unsafe(no_mangle)]
pub extern "C" fn tipwatch_client_close(client: *mut Handle) -> c_int {
    if client.is_null() {
        return 0;
    }
    let close = || {
        let number = client.addr();
        let found = with_clients(|clients| {
            own(clients, number)?;
            let found = clients.remove(&number);
            if clients.is_empty() {
                // frees its memory, which does not end with the thread
                *clients = Clients::new();
            }
            found.ok_or_else(|| no_client(number))
        })?;
        NUMBERS.end(number);
        drop(ManuallyDrop::into_inner(found));
        Ok(())
    };
    caught(close).map_or_else(|failure| failure.kind as c_int, |()| 0)
}

/// Returns the error text of the last call with this client that failed; empty before.
#[unsafe(no_mangle)]
pub extern "C" fn tipwatch_client_error(client: *const Handle) -> *const c_char {
    let said = caught(|| {
        with_clients(|clients| own(clients, client.addr()).map(|opened| opened.failure.as_ptr()))
    });
    let other = c"expected an open client, and the thread and the process that opened it";
    said.unwrap_or(other.as_ptr())
}

/// Publishes a message.
///
/// # Safety
/// `service` is null or ends with a zero byte, and `message` is null or of `size` bytes.
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
    with_client(context, send)
}

/// Notifies the event service of this name.
///
/// # Safety
/// `service` is null or ends with a zero byte.
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
    with_client(context, notify)
}

/// Copies the next message that waits: 1 if there was one, 0 if none waits.
///
/// # Safety
/// `service` is null or ends with a zero byte, and `message` is null or has room for `size` bytes.
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
    with_client(context, receive)
}

/// Waits for a notification of the event service, but no longer than this (ns).
///
/// # Safety
/// `service` is null or ends with a zero byte.
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
    with_client(context, wait)
}

/// CLOCK_MONOTONIC (ns). Every thread may ask, with any context.
#[unsafe(no_mangle)]
pub extern "C" fn tipwatch_client_now_ns(_context: *mut c_void) -> i64 {
    monotonic_ns()
}

/// Calls with the client of a context; what the call returns, or the number of its failure, whose text the client keeps.
fn with_client(
    context: *mut c_void,
    call: impl FnOnce(&mut Client) -> Result<c_int, Failure>,
) -> c_int {
    let number = context.addr();
    let called = caught(|| {
        with_clients(|clients| {
            let opened = own(clients, number)?;
            Ok(called(opened, call))
        })
    });
    called.unwrap_or_else(|failure| failure.kind as c_int)
}

fn called(opened: &mut Opened, call: impl FnOnce(&mut Client) -> Result<c_int, Failure>) -> c_int {
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
        let handle = opened(Opened::new(None));
        let failure = caught(|| -> Result<(), Failure> { panic!("{}", "a word") }).unwrap_err();
        assert_eq!(failure.kind, Kind::Mistake);
        assert!(failure.text.ends_with(": a word"), "{}", failure.text);
        // SAFETY: the name of the service and the text end with a zero byte.
        unsafe {
            let sent = tipwatch_client_notify(handle.cast(), c"/samples".as_ptr());
            assert_eq!(sent, Kind::Mistake as c_int);
            assert!(!CStr::from_ptr(tipwatch_client_error(handle)).is_empty());
        }
        assert_eq!(tipwatch_client_close(handle), 0);
    }

    /// As in the child of a fork, whose parent's other thread held the list: that thread does not exist there.
    #[test]
    fn nothing_waits_for_a_list_of_clients_that_is_held_for_good() {
        let numbers = Numbers::none();
        let first = numbers.begin();
        let held = numbers.open.lock().unwrap();
        let second = numbers.begin();
        assert_ne!(first, second);
        assert!(numbers.may_be_open(first) && numbers.may_be_open(second));
        numbers.end(first);
        drop(held);
        // it was not listed as closed
        assert!(numbers.may_be_open(first) && !numbers.may_be_open(second));
        numbers.end(first);
        assert!(!numbers.may_be_open(first));
    }

    #[test]
    fn a_client_that_is_closed_or_was_never_open_is_an_error_in_every_thread() {
        let open = || opened(Opened::new(None));
        let (closed, other) = (open(), open());
        assert_eq!(tipwatch_client_close(closed), 0);
        let never = ptr::without_provenance_mut::<Handle>(usize::MAX);
        let check = |handle: *mut Handle, expected: Kind| {
            assert_eq!(tipwatch_client_close(handle), expected as c_int);
            // SAFETY: the name of the service and the text end with a zero byte.
            unsafe {
                let sent = tipwatch_client_notify(handle.cast(), c"/samples".as_ptr());
                assert_eq!(sent, expected as c_int);
                assert!(!CStr::from_ptr(tipwatch_client_error(handle)).is_empty());
            }
        };
        let [closed, other, never] = [closed, other, never].map(<*mut Handle>::addr);
        let all = || {
            check(ptr::without_provenance_mut(closed), Kind::Closed);
            check(ptr::without_provenance_mut(never), Kind::Closed);
        };
        all();
        let thread = std::thread::spawn(move || {
            check(ptr::without_provenance_mut(closed), Kind::Closed);
            check(ptr::without_provenance_mut(other), Kind::Thread);
        });
        thread.join().unwrap();
        let next = open();
        assert_ne!(next.addr(), closed, "no number is given twice");
        all();
        assert_eq!(tipwatch_client_close(next), 0);
        assert_eq!(tipwatch_client_close(ptr::without_provenance_mut(other)), 0);
    }
}
