//! A small HTTP server on threads of its own. It writes its answers byte by byte, so that they may be wrong.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use url::Url;

/// Credentials that no output of a client may contain.
pub(crate) const SECRET: &str = "do-not-show-this-either";

/// A request that came.
#[derive(Debug, Clone, Default)]
pub(crate) struct Request {
    pub(crate) method: String,
    /// The path, decoded, without the first slash.
    pub(crate) path: String,
    pub(crate) query: Vec<(String, String)>,
    /// Names in small letters.
    pub(crate) headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

impl Request {
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let found = self.headers.iter().find(|(other, _)| other == name);
        found.map(|(_, value)| value.as_str())
    }

    pub(crate) fn asks(&self, name: &str) -> Option<&str> {
        let found = self.query.iter().find(|(other, _)| other == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// An answer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

impl Reply {
    pub(crate) fn new(status: u16) -> Self {
        Self {
            status,
            ..Self::default()
        }
    }

    /// An error as all these services write it, with a word that nobody should repeat.
    pub(crate) fn error(status: u16, code: &str) -> Self {
        let text = format!("<Error><Code>{code}</Code><Message>{SECRET}</Message></Error>");
        Self::new(status).body(text.as_bytes())
    }

    pub(crate) fn body(mut self, body: &[u8]) -> Self {
        self.body = body.to_vec();
        self
    }

    pub(crate) fn header(mut self, name: &str, value: impl ToString) -> Self {
        self.headers.push((name.to_owned(), value.to_string()));
        self
    }
}

/// A server that answers requests correctly.
pub(crate) trait Service: Send + Sync + 'static {
    fn answer(&self, request: &Request) -> Reply;
}

/// Fault that the server shows instead of an answer.
#[derive(Debug, Clone)]
pub(crate) enum Fault {
    /// Answers with this status.
    Status(u16),
    /// Never answers.
    Hang,
    /// Does the request and closes the connection without an answer.
    LoseAnswer,
    /// Sends so many bytes of the content and closes the connection.
    Cut(usize),
    /// States a length that is so many bytes too small, and sends all.
    StateLess(usize),
    /// States a length that is so many bytes too large, sends what there is and closes the connection.
    StateMore(usize),
    /// States another range than the requested one.
    OtherRange,
    /// Sends the content in chunks, without its length.
    Chunked,
    /// Sends something that is no HTTP.
    Garbage,
}

type Condition = Box<dyn Fn(&Request) -> bool + Send>;

#[derive(Default)]
struct State {
    seen: Vec<Request>,
    rules: Vec<(usize, Condition, Fault)>,
}

/// The server. It takes no further connections once the value is gone.
pub(crate) struct WireServer {
    pub(crate) address: SocketAddr,
    state: Arc<Mutex<State>>,
    is_over: Arc<AtomicBool>,
}

impl WireServer {
    pub(crate) fn start(service: Arc<dyn Service>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let state = Arc::new(Mutex::new(State::default()));
        let is_over = Arc::new(AtomicBool::new(false));
        let (own, over) = (Arc::clone(&state), Arc::clone(&is_over));
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                if over.load(Ordering::Relaxed) {
                    break;
                }
                let (service, state) = (Arc::clone(&service), Arc::clone(&own));
                std::thread::spawn(move || {
                    // a client that closes the connection is part of the tests
                    let _ = serve(&stream, &*service, &state);
                });
            }
        });
        Self {
            address,
            state,
            is_over,
        }
    }

    /// The next `count` requests that meet a condition fail.
    pub(crate) fn inject(
        &self,
        count: usize,
        when: impl Fn(&Request) -> bool + Send + 'static,
        fault: Fault,
    ) {
        let rule: (usize, Condition, Fault) = (count, Box::new(when), fault);
        self.state.lock().unwrap().rules.push(rule);
    }

    /// No further faults.
    pub(crate) fn heal(&self) {
        self.state.lock().unwrap().rules.clear();
    }

    /// The requests since the last call.
    pub(crate) fn take_seen(&self) -> Vec<Request> {
        std::mem::take(&mut self.state.lock().unwrap().seen)
    }
}

impl Drop for WireServer {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        // wakes the thread that waits for connections
        let _ = TcpStream::connect(self.address);
    }
}

/// Answers the requests of one connection.
fn serve(stream: &TcpStream, service: &dyn Service, state: &Mutex<State>) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    while let Some(request) = read(&mut reader)? {
        let fault = {
            let mut state = state.lock().unwrap();
            state.seen.push(request.clone());
            let mut rules = state.rules.iter_mut();
            let rule = rules.find(|(left, when, _)| *left > 0 && when(&request));
            rule.map(|(left, _, fault)| {
                *left -= 1;
                fault.clone()
            })
        };
        let mut out = stream;
        let is_head = request.method == "HEAD";
        let reply = match fault {
            Some(Fault::Status(status)) => Reply::error(status, "Injected"),
            Some(Fault::Hang) => {
                std::thread::sleep(std::time::Duration::from_secs(3600));
                return Ok(());
            }
            Some(Fault::Garbage) => return out.write_all(b"SSH-2.0-no-http\r\n\r\n"),
            _ => service.answer(&request),
        };
        let length = reply.body.len();
        let body = if is_head { &[][..] } else { &reply.body[..] };
        match fault {
            Some(Fault::LoseAnswer) => return Ok(()),
            Some(Fault::Cut(count)) => {
                out.write_all(head(&reply, Some(length)).as_bytes())?;
                return out.write_all(&body[..count.min(body.len())]);
            }
            Some(Fault::StateLess(count)) => {
                out.write_all(head(&reply, Some(length.saturating_sub(count))).as_bytes())?;
                return out.write_all(body);
            }
            Some(Fault::StateMore(count)) => {
                out.write_all(head(&reply, Some(length + count)).as_bytes())?;
                return out.write_all(body);
            }
            Some(Fault::OtherRange) => {
                let mut reply = reply.clone();
                reply.headers.retain(|(name, _)| name != "content-range");
                let reply = reply.header("content-range", format!("bytes 1-{length}/99999999"));
                out.write_all(head(&reply, Some(length)).as_bytes())?;
                out.write_all(body)?;
            }
            Some(Fault::Chunked) => {
                let reply = reply.clone().header("transfer-encoding", "chunked");
                out.write_all(head(&reply, None).as_bytes())?;
                out.write_all(format!("{length:x}\r\n").as_bytes())?;
                out.write_all(body)?;
                out.write_all(b"\r\n0\r\n\r\n")?;
            }
            _ => {
                out.write_all(head(&reply, Some(length)).as_bytes())?;
                out.write_all(body)?;
            }
        }
    }
    Ok(())
}

fn head(reply: &Reply, length: Option<usize>) -> String {
    let mut text = format!("HTTP/1.1 {} Said\r\n", reply.status);
    for (name, value) in &reply.headers {
        text.push_str(&format!("{name}: {value}\r\n"));
    }
    if let Some(length) = length {
        text.push_str(&format!("content-length: {length}\r\n"));
    }
    text + "\r\n"
}

/// Reads a request; `None` at the end of the connection.
fn read(reader: &mut BufReader<TcpStream>) -> std::io::Result<Option<Request>> {
    let mut line = String::new();
    if reader.read_line(&mut line)? == 0 {
        return Ok(None);
    }
    let mut words = line.split_whitespace();
    let (method, target) = (words.next().unwrap_or(""), words.next().unwrap_or("/"));
    let url = Url::parse(&format!("http://host{target}")).unwrap();
    let mut request = Request {
        method: method.to_owned(),
        path: decoded(url.path().trim_start_matches('/')),
        query: url.query_pairs().into_owned().collect(),
        ..Request::default()
    };
    loop {
        let mut line = String::new();
        reader.read_line(&mut line)?;
        let Some((name, value)) = line.trim_end().split_once(':') else {
            break;
        };
        let name = name.to_ascii_lowercase();
        request.headers.push((name, value.trim().to_owned()));
    }
    let length = request.header("content-length").map_or("0", |text| text);
    request.body = vec![0; length.parse().unwrap()];
    reader.read_exact(&mut request.body)?;
    Ok(Some(request))
}

/// A path without percent signs.
pub(crate) fn decoded(path: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = path.as_bytes();
    while let Some((&next, after)) = rest.split_first() {
        let digits = after.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        let byte = digits.and_then(|two| u8::from_str_radix(two, 16).ok());
        let (byte, behind) = match byte.filter(|_| next == b'%') {
            Some(byte) => (byte, &after[2..]),
            None => (next, after),
        };
        bytes.push(byte);
        rest = behind;
    }
    String::from_utf8(bytes).unwrap()
}
