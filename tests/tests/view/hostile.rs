//! Whoever asks without being meant to, or asks for what makes no sense, is refused or hung up on, and the run knows nothing of it.

use crate::unseen::domain;
use atoll_tests::page::{Page, Served};
use atoll_tests::program::{self, run_to_summary};
use serde_json::json;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};
use tempfile::tempdir;

const RUN: [&str; 7] = ["run", "configs/quickstart.toml", "--bodies", "3000", "--tiles", "4x4", "--quiet"];

/// So many that all of this happens before they are made.
const STEPS: &str = if cfg!(debug_assertions) { "400" } else { "8000" };

/// Sends a text and returns the first line that comes back.
fn ask(served: &Served, text: &str) -> String {
    let mut stream = TcpStream::connect(served.address()).unwrap();
    stream.set_read_timeout(Some(program::LIMIT)).unwrap();
    stream.write_all(text.as_bytes()).unwrap();
    let mut answer = Vec::new();
    // Being hung up on is an answer as well.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).lines().next().unwrap_or_default().to_owned()
}

fn request(path: &str, headers: &[(&str, &str)]) -> String {
    let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    format!("GET {path} HTTP/1.1\r\n{headers}\r\n")
}

#[test]
fn who_does_not_know_the_token_or_comes_from_elsewhere_is_refused() {
    let served = Served::start(program::command().args(["view", "configs/quickstart.toml", "--bodies", "400"]));
    let (own, token) = (served.address(), served.token());
    let port = own.rsplit(':').next().unwrap();
    let [local, page] = [format!("localhost:{port}"), format!("/?token={token}")];
    let [origin, socket] = [format!("http://{own}"), format!("/socket?token={token}")];
    let upgrade =
        [("Upgrade", "websocket"), ("Connection", "Upgrade"), ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==")];
    let with = |host: &str, more: &[(&str, &str)], path: &str| {
        let headers: Vec<_> = [("Host", host)].into_iter().chain(upgrade).chain(more.iter().copied()).collect();
        ask(&served, &request(path, &headers))
    };
    for (host, path, expected) in [
        (own, page.as_str(), "200 OK"),
        (&local, &page, "200 OK"),
        (own, "/app.js", "200 OK"),
        (own, "/", "403 Forbidden"),
        (own, "/?token=", "403 Forbidden"),
        (own, &page[..page.len() - 1], "403 Forbidden"),
        (own, &page.replace(&token[..1], "x"), "403 Forbidden"),
        (own, "/../../etc/passwd", "404 Not Found"),
        (own, "/page/app.js", "404 Not Found"),
        ("127.0.0.1", &page, "403 Forbidden"),
        ("127.0.0.1.example.org", &page, "403 Forbidden"),
        (&format!("example.org:{port}"), &page, "403 Forbidden"),
        (&format!("127.0.0.1:{port}.example.org"), &page, "403 Forbidden"),
        ("", &page, "403 Forbidden"),
    ] {
        assert_eq!(ask(&served, &request(path, &[("Host", host)])), format!("HTTP/1.1 {expected}"), "{host} {path}");
    }
    for origin in ["http://example.org", "null", "https://127.0.0.1", "http://127.0.0.1", "file://", ""] {
        assert_eq!(with(own, &[("Origin", origin)], &socket), "HTTP/1.1 403 Forbidden", "{origin}");
    }
    assert_eq!(with(own, &[("Origin", &origin)], "/socket?token=0"), "HTTP/1.1 403 Forbidden");
    assert_eq!(with(own, &[("Origin", &origin), ("Host", own)], &socket), "HTTP/1.1 400 Bad Request");
    assert_eq!(ask(&served, &request(&socket, &[("Host", own)])), "HTTP/1.1 426 Upgrade Required");
    for text in ["\r\n\r\n", "POST / HTTP/1.1\r\n\r\n", "\u{0}\u{1}\u{2}\r\n\r\n", &"x".repeat(100_000)] {
        assert!(["HTTP/1.1 400 Bad Request", ""].contains(&ask(&served, text).as_str()), "{}", &text[..2]);
    }
    let begun = Instant::now();
    served.interrupt();
    // Nobody has ever looked, so nothing was run.
    assert_eq!(served.end().code, Some(130));
    assert!(begun.elapsed() < Duration::from_secs(10), "nobody is waited for");
}

/// A socket of a page, and nothing of what a page knows.
fn bare_socket(served: &Served) -> TcpStream {
    let mut stream = TcpStream::connect(served.address()).unwrap();
    let path = format!("/socket?token={}", served.token());
    let headers = [
        ("Host", served.address()),
        ("Upgrade", "websocket"),
        ("Connection", "Upgrade"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    stream.set_read_timeout(Some(program::LIMIT)).unwrap();
    stream.write_all(request(&path, &headers).as_bytes()).unwrap();
    let mut answer = Vec::new();
    while !answer.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        answer.extend(byte);
    }
    assert!(answer.starts_with(b"HTTP/1.1 101 "), "{}", String::from_utf8_lossy(&answer));
    stream
}

/// The head of a message of a client, of so many bytes, masked with zeros.
fn head(kind: u8, length: u64) -> Vec<u8> {
    [&[0x80 | kind, 0xFF][..], &length.to_be_bytes(), &[0; 4]].concat()
}

/// Whether a stream comes to its end.
fn is_hung_up_on(mut stream: TcpStream) -> bool {
    stream.set_read_timeout(Some(program::LIMIT)).unwrap();
    let mut buffer = [0; 65_536];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return true,
            Ok(_) => {}
            Err(error) => return error.kind() == std::io::ErrorKind::ConnectionReset,
        }
    }
}

#[test]
fn a_run_is_unharmed_by_whoever_means_ill() {
    let folder = tempdir().unwrap();
    let alone = run_to_summary(
        program::command().args(RUN).args(["--ranks", "2", "--steps", STEPS]),
        &folder.path().join("a.json"),
    );
    let json = folder.path().join("b.json");
    let mut command = program::command();
    let served =
        Served::start(command.args(RUN).args(["--ranks", "2", "--steps", STEPS, "--view", "--json"]).arg(&json));
    // Time stands still meanwhile, so that all of this is for the same run.
    let mut page = Page::open(&served);
    let hello = page.hello();
    page.wish(&json!({ "do": "pause" }));
    page.look(domain(&hello), [640, 480], "speed");
    page.frame().unwrap();
    // What cannot be done is told and left out, whatever is wrong with it.
    let lines = [
        "{\"remove\": 99999999}",
        "{\"add\": {\"x\": 1e10,\n\"y\": 0}}",
        "{\"remve\": 4}",
        "{\"until\": 9}",
        "",
        "\n\u{1b}[2J",
    ];
    for line in lines {
        page.wish(&json!({ "do": "command", "line": line }));
    }

    // Says that a gigabyte comes, and begins to send it.
    let mut greedy = bare_socket(&served);
    greedy.write_all(&head(1, 1 << 30)).unwrap();
    let sent = (0..64).try_for_each(|_| greedy.write_all(&[b' '; 16_384]));
    assert!(sent.is_err() || is_hung_up_on(greedy), "a gigabyte is listened to");
    for bytes in [
        vec![0xFF; 64],
        [&head(2, 8)[..], &[7; 8]].concat(),
        [&head(1, 4)[..], b"what"].concat(),
        [&head(1, 2)[..], b"{}"].concat(),
        [&head(1, 2)[..], &[0xC3, 0x28]].concat(),
        [&head(9, 200)[..], &[0; 200]].concat(),
    ] {
        let mut stream = bare_socket(&served);
        let _ = stream.write_all(&bytes);
        assert!(is_hung_up_on(stream), "{bytes:?}");
    }
    // In the middle of a frame.
    let mut broken = bare_socket(&served);
    broken.write_all(&head(1, 100)[..7]).unwrap();
    broken.shutdown(Shutdown::Write).unwrap();
    assert!(is_hung_up_on(broken));

    // Those who never ask, and those who look and never read.
    let deaf: Vec<_> = (0..4).map(|_| bare_socket(&served)).collect();
    let idle: Vec<_> = (0..100).filter_map(|_| TcpStream::connect(served.address()).ok()).collect();
    page.wish(&json!({ "do": "play" }));
    page.fidget(domain(&hello), Duration::from_millis(500));
    drop(page);
    let ended = served.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.stderr.matches("; left out").count(), lines.len(), "{ended}");
    assert!(ended.stderr.contains(": add, x = 1e10: must be within"), "{ended}");
    drop((idle, deaf));
    let watched = program::summary(&json);
    for key in ["state_hash", "contact_hash", "steps"] {
        assert_eq!(watched[key], alone[key], "{key}");
    }
}

/// One that looks at all of it and reads nothing is given a frame, and no more; others go on being given theirs.
#[test]
fn who_never_reads_holds_up_nobody() {
    let mut command = program::command();
    let served = Served::start(command.args(RUN).args(["--ranks", "2", "--view", "--steps", "4000000000"]));
    let mut page = Page::open(&served);
    let mut deaf: Vec<_> = (0..3).map(|_| Page::open(&served)).collect();
    let domain = domain(&page.hello());
    let [x0, y0, x1, y1] = domain;
    // Large frames.
    deaf.iter_mut().for_each(|deaf| deaf.look([x0, y0, x1, y1], [2048, 2048], "kind"));
    page.look(domain, [64, 64], "kind");
    let begun = Instant::now();
    while page.frames < 60 {
        page.frame().unwrap();
        // One asks for more and more without having drawn anything.
        deaf[0].look([x0, y0, x1 + page.frames as f64, y1], [2048, 2048], "kind");
    }
    // They were not given up for as long as somebody waits for a browser that is busy.
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
    served.interrupt();
    assert_eq!(served.end().code, Some(130));
}
