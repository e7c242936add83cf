//! Serves the page and its socket to browsers.
//!
//! Listening on loopback is not enough: any page in the user's browser can reach it. So a request must call this server by
//! the number of its address, of any where it listens at all, as no name that is made to lead here does; come from the page that it names so, if it says where it comes from; and know the token that is in the
//! address which only the user was told. Everything that is read is bounded in size and time, and each connection has a
//! thread of its own, so that a slow or broken one holds up nobody.

use super::desk::{Desk, PageId, Ready};
use super::protocol::{Gaze, Wish};
use std::fmt::Write as _;
use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Message, Role, WebSocket, WebSocketConfig};

/// Connections at a time.
const MOST_CONNECTIONS: usize = 64;

/// Bytes of a request, and of a message of a page.
const MOST_BYTES: usize = 8192;

/// Headers of a request.
const MOST_HEADERS: usize = 64;

/// In which a request must have come, and in which a browser must take some of what it is sent.
const PATIENCE: Duration = Duration::from_secs(5);

/// How often is looked whether all is over.
const POLL: Duration = Duration::from_millis(50);

/// How long a page that was told all may take to hang up.
const FAREWELL: Duration = Duration::from_secs(1);

/// What there is to get, with its type.
const FILES: [(&str, &str, &str); 14] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_str!("page/style.css")),
    ("/app.js", "text/javascript; charset=utf-8", include_str!("page/app.js")),
    ("/state.js", "text/javascript; charset=utf-8", include_str!("page/state.js")),
    ("/words.js", "text/javascript; charset=utf-8", include_str!("page/words.js")),
    ("/link.js", "text/javascript; charset=utf-8", include_str!("page/link.js")),
    ("/view.js", "text/javascript; charset=utf-8", include_str!("page/view.js")),
    ("/panel.js", "text/javascript; charset=utf-8", include_str!("page/panel.js")),
    ("/hand.js", "text/javascript; charset=utf-8", include_str!("page/hand.js")),
    ("/controls.js", "text/javascript; charset=utf-8", include_str!("page/controls.js")),
    ("/draw.js", "text/javascript; charset=utf-8", include_str!("page/draw.js")),
    ("/shaders.js", "text/javascript; charset=utf-8", include_str!("page/shaders.js")),
    ("/shapes.js", "text/javascript; charset=utf-8", include_str!("page/shapes.js")),
    ("/frame.js", "text/javascript; charset=utf-8", include_str!("page/frame.js")),
];

/// A server, until it is dropped: then its port is free again.
#[derive(Debug)]
pub(crate) struct Server {
    address: SocketAddr,
    token: String,
    desk: Arc<Desk>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// What every connection must know.
#[derive(Clone, Debug)]
struct Door {
    /// What a browser may call this server.
    names: Names,
    token: Arc<str>,
    desk: Arc<Desk>,
    over: Arc<AtomicBool>,
    open: Arc<AtomicUsize>,
}

/// What a browser may call a server at an address. A page of another origin that has its own name lead here calls it by that.
#[derive(Clone, Copy, Debug)]
struct Names(SocketAddr);

impl Names {
    fn have(self, host: &str) -> bool {
        let Self(own) = self;
        let is_own = |address: SocketAddr| {
            address.port() == own.port() && (own.ip().is_unspecified() || address.ip() == own.ip())
        };
        let is_localhost = || {
            let local = own.ip().is_loopback() || own.ip().is_unspecified();
            local && host.strip_prefix("localhost:").is_some_and(|port| port == own.port().to_string())
        };
        host.parse().is_ok_and(is_own) || is_localhost()
    }
}

impl Server {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// If that cannot be done.
    pub(crate) fn start(address: IpAddr, port: u16, desk: Arc<Desk>) -> io::Result<Self> {
        let listener = TcpListener::bind((address, port))?;
        // So that the thread hears that all is over.
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let token = token()?;
        let over = Arc::new(AtomicBool::new(false));
        let door = Door {
            names: Names(address),
            token: token.as_str().into(),
            desk: Arc::clone(&desk),
            over: Arc::clone(&over),
            open: Arc::default(),
        };
        let thread = thread::Builder::new().name("viewer".to_owned()).spawn(move || accept(&listener, &door))?;
        Ok(Self { address, token, desk, over, thread: Some(thread) })
    }

    /// What to open in a browser.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.desk.end();
        self.over.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// 128 random bits.
fn token() -> io::Result<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Ok(bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

/// Gives each connection a thread, until all is over; then waits a little for them.
fn accept(listener: &TcpListener, door: &Door) {
    while !door.over.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((stream, _)) if door.open.load(Ordering::Relaxed) < MOST_CONNECTIONS => {
                door.open.fetch_add(1, Ordering::Relaxed);
                let guest = door.clone();
                let started = thread::Builder::new().name("viewer, page".to_owned()).spawn(move || {
                    // Whatever goes wrong with a browser is for nobody to know.
                    let _ = serve(stream, &guest);
                    guest.open.fetch_sub(1, Ordering::Relaxed);
                });
                if started.is_err() {
                    door.open.fetch_sub(1, Ordering::Relaxed);
                }
            }
            // One too many is hung up on.
            Ok(_) => {}
            Err(_) => thread::sleep(POLL),
        }
    }
    let asked = Instant::now();
    while door.open.load(Ordering::Relaxed) > 0 && asked.elapsed() < FAREWELL + 4 * POLL {
        thread::sleep(POLL / 10);
    }
}

/// A request, as far as it matters.
#[derive(Debug)]
struct Request {
    path: String,
    token: Option<String>,
    host: Option<String>,
    origin: Option<String>,
    /// The key of a browser that wants a socket.
    key: Option<String>,
}

/// One connection: a file, or a socket for as long as it lasts.
fn serve(mut stream: TcpStream, door: &Door) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let Some(request) = read_request(&mut stream)? else {
        return refuse(&mut stream, "400 Bad Request", "This is no request that Atoll understands.");
    };
    if !request.host.as_ref().is_some_and(|host| door.names.have(host)) {
        return refuse(
            &mut stream,
            "403 Forbidden",
            "This server has another name: call it by the number of its address.",
        );
    }
    let own = |origin: &String| origin.strip_prefix("http://") == request.host.as_deref();
    if !request.origin.as_ref().is_none_or(own) {
        return refuse(&mut stream, "403 Forbidden", "Only its own page may ask.");
    }
    let known = request.token.as_ref().is_some_and(|token| same(token.as_bytes(), door.token.as_bytes()));
    let secret = request.path == "/" || request.path == "/socket";
    if secret && !known {
        return refuse(&mut stream, "403 Forbidden", "Open the whole address that atoll has printed, with its token.");
    }
    if request.path == "/socket" {
        let Some(key) = request.key else {
            return refuse(&mut stream, "426 Upgrade Required", "Here is a socket.");
        };
        return match door.desk.open() {
            Some(page) => {
                let served = serve_page(stream, door, page, &key);
                door.desk.close(page);
                served
            }
            None => refuse(&mut stream, "503 Service Unavailable", "Too many pages look already: close one."),
        };
    }
    match FILES.iter().find(|(path, ..)| *path == request.path) {
        Some((_, kind, content)) => answer(&mut stream, "200 OK", kind, content),
        None => refuse(&mut stream, "404 Not Found", "There is no such page."),
    }
}

/// Reads the head of a request. None if it is none, or too long.
fn read_request(stream: &mut TcpStream) -> io::Result<Option<Request>> {
    let begun = Instant::now();
    let mut bytes = Vec::with_capacity(1024);
    let mut buffer = [0; 1024];
    loop {
        let left = PATIENCE.saturating_sub(begun.elapsed());
        if left.is_zero() || bytes.len() > MOST_BYTES {
            return Ok(None);
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut buffer)? {
            0 => return Ok(None),
            read => bytes.extend_from_slice(&buffer[..read]),
        }
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        match request.parse(&bytes) {
            // Nobody may say more before there is an answer.
            Ok(httparse::Status::Complete(length)) => {
                return Ok(understand(&request).filter(|_| length == bytes.len()));
            }
            Ok(httparse::Status::Partial) => {}
            Err(_) => return Ok(None),
        }
    }
}

/// None if it is not for a file or a socket, or says one thing twice.
fn understand(request: &httparse::Request<'_, '_>) -> Option<Request> {
    let header = |name: &str| -> Option<Option<String>> {
        let mut found = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
        let first = found.next().map(|header| std::str::from_utf8(header.value).map(str::to_owned));
        if found.next().is_some() { None } else { first.transpose().ok() }
    };
    if request.method != Some("GET") {
        return None;
    }
    let (path, query) = request.path?.split_once('?').unwrap_or((request.path?, ""));
    let token = query.split('&').find_map(|part| part.strip_prefix("token=")).map(str::to_owned);
    let socket = header("upgrade")?.is_some_and(|upgrade| upgrade.eq_ignore_ascii_case("websocket"));
    let key = header("sec-websocket-key")?.filter(|_| socket);
    Some(Request { path: path.to_owned(), token, host: header("host")?, origin: header("origin")?, key })
}

/// Whether two texts are the same, in a time that does not tell where they differ.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

fn refuse(stream: &mut TcpStream, status: &str, why: &str) -> io::Result<()> {
    answer(stream, status, "text/plain; charset=utf-8", &format!("{why}\n"))
}

fn answer(stream: &mut TcpStream, status: &str, kind: &str, content: &str) -> io::Result<()> {
    // Nothing from elsewhere, in no other page, and nothing kept.
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
         img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n",
        content.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(content.as_bytes())
}

/// A socket: one thread reads what the page wants, this one writes what is ready.
fn serve_page(mut stream: TcpStream, door: &Door, page: PageId, key: &str) -> io::Result<()> {
    let accept = derive_accept_key(key.as_bytes());
    let head =
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ";
    stream.write_all(format!("{head}{accept}\r\n\r\n").as_bytes())?;
    stream.set_read_timeout(None)?;
    let config = limits();
    let gone = Arc::new(AtomicBool::new(false));
    let reader = {
        let input = WebSocket::from_raw_socket(Deaf(stream.try_clone()?), Role::Server, Some(config));
        let (desk, gone) = (Arc::clone(&door.desk), Arc::clone(&gone));
        thread::Builder::new().name("viewer, wishes".to_owned()).spawn(move || {
            listen(input, &desk, page);
            gone.store(true, Ordering::Relaxed);
        })?
    };
    let mut output = WebSocket::from_raw_socket(stream.try_clone()?, Role::Server, Some(config));
    while !gone.load(Ordering::Relaxed) {
        let sent = match door.desk.next(page, POLL) {
            Ready::Texts(texts) => texts.into_iter().try_for_each(|text| output.send(Message::text(text))),
            Ready::Frame(frames) => frames.into_iter().try_for_each(|frame| output.send(Message::binary(frame))),
            Ready::Nothing => Ok(()),
            Ready::Closed => break,
        };
        if sent.is_err() {
            break;
        }
    }
    let _ = output.close(None).and_then(|()| output.flush());
    // To hang up on what the page still says would take from it what it has not read yet.
    let _ = stream.shutdown(std::net::Shutdown::Write);
    let asked = Instant::now();
    while !gone.load(Ordering::Relaxed) && asked.elapsed() < FAREWELL {
        thread::sleep(POLL / 10);
    }
    // Also wakes the reader.
    let _ = stream.shutdown(std::net::Shutdown::Both);
    let _ = reader.join();
    Ok(())
}

/// Hears what a page wants until it goes, or says what makes no sense.
fn listen(mut input: WebSocket<impl Read + Write>, desk: &Desk, page: PageId) {
    loop {
        match input.read() {
            Ok(Message::Text(text)) => match Wish::parse(&text) {
                Some(wish) => desk.hear(page, wish),
                None => return,
            },
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(_) | Err(_) => return,
        }
    }
}

/// Hears bytes as if a page had sent them, and says whether they are the head of a request, and what the page looks at then.
pub(super) fn overhear(bytes: &[u8]) -> (bool, Option<Gaze>) {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    let is_whole = matches!(request.parse(bytes), Ok(httparse::Status::Complete(_)));
    let is_request = is_whole && understand(&request).is_some();
    let desk = Desk::new(0.0);
    let page = desk.open().expect("it is the first");
    let sent = io::Cursor::new(bytes.to_vec());
    listen(WebSocket::from_raw_socket(sent, Role::Server, Some(limits())), &desk, page);
    (is_request, desk.due(0).first().map(|due| due.gaze))
}

/// What a page may send at a time.
fn limits() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(MOST_BYTES)).max_frame_size(Some(MOST_BYTES))
}

/// The half of a stream that is read. What the library would answer by itself is not sent: another thread writes, and two
/// at a time would mix up their words.
#[derive(Debug)]
struct Deaf(TcpStream);

impl Read for Deaf {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Write for Deaf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_is_called_by_its_address_and_by_no_name_that_leads_there() {
        let names = |address: &str| Names(address.parse().unwrap());
        let called = |address: &str, host: &str| names(address).have(host);
        assert!(called("127.0.0.1:8000", "127.0.0.1:8000") && called("127.0.0.1:8000", "localhost:8000"));
        assert!(called("192.0.2.2:8000", "192.0.2.2:8000") && !called("192.0.2.2:8000", "localhost:8000"));
        // At all addresses of the machine.
        for host in ["127.0.0.1:8000", "192.0.2.2:8000", "[2001:db8::1]:8000", "localhost:8000"] {
            assert!(called("0.0.0.0:8000", host) && called("[::]:8000", host), "{host}");
        }
        for host in ["atoll.example:8000", "localhost.example:8000", "127.0.0.1:80", "127.0.0.1", "localhost:80", ""] {
            assert!(!called("0.0.0.0:8000", host) && !called("127.0.0.1:8000", host), "{host}");
        }
    }
}
