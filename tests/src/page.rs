//! What `atoll view` and `atoll run --view` serve, and a page of it that no browser draws.

use crate::program::{Ended, LIMIT, Running};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

/// A program that serves a page.
#[derive(Debug)]
pub struct Served {
    running: Running,
    /// What it tells to open.
    pub url: String,
}

impl Served {
    /// Starts it, and waits until it tells where the page is.
    pub fn start(command: &mut Command) -> Self {
        let mut running = Running::start(command);
        let line = running.line("atoll: open http://");
        let url = line.trim().strip_prefix("atoll: open ").expect("it starts so").to_owned();
        Self { running, url }
    }

    /// Address and port.
    pub fn address(&self) -> &str {
        self.url["http://".len()..].split('/').next().expect("there is an address")
    }

    /// What a page must know.
    pub fn token(&self) -> &str {
        self.url.rsplit('=').next().expect("there is a token")
    }

    /// Asks it to stop.
    #[cfg(unix)]
    pub fn interrupt(&self) {
        self.running.signal("INT");
    }

    /// Waits for it to end.
    pub fn end(self) -> Ended {
        self.running.end()
    }
}

/// A page: it takes frames and draws nothing.
#[derive(Debug)]
pub struct Page {
    socket: WebSocket<TcpStream>,
    /// Frames it was given.
    pub frames: usize,
}

/// What a page is told.
#[derive(Clone, PartialEq, Debug)]
pub enum Heard {
    /// In words.
    Said(Value),
    /// As a picture: its number, its step, and all of it.
    Frame(u32, u32, Vec<u8>),
}

impl Page {
    /// Opens one.
    ///
    /// # Panics
    /// If it is refused.
    pub fn open(served: &Served) -> Self {
        let stream = TcpStream::connect(served.address()).expect("it listens");
        stream.set_read_timeout(Some(LIMIT)).expect("time limits can be set");
        let config = WebSocketConfig::default().max_message_size(None).max_frame_size(None);
        let url = format!("ws://{}/socket?token={}", served.address(), served.token());
        let (socket, _) = tungstenite::client::client_with_config(url, stream, Some(config)).expect("it takes a page");
        Self { socket, frames: 0 }
    }

    /// Says what it wants. Whether anybody listens is not told.
    pub fn wish(&mut self, wish: &Value) {
        let _ = self.socket.send(Message::text(wish.to_string()));
    }

    /// Looks at a rectangle, as so many pixels.
    pub fn look(&mut self, view: [f64; 4], size: [u32; 2], color: &str) {
        self.wish(&json!({ "do": "look", "view": view, "size": size, "color": color }));
    }

    /// What it is told next; nothing any more once it is hung up on.
    pub fn hear(&mut self) -> Option<Heard> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    return Some(Heard::Said(serde_json::from_str(&text).expect("it speaks JSON")));
                }
                Ok(Message::Binary(bytes)) => {
                    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
                    assert_eq!(&bytes[..4], b"ATOL");
                    self.frames += 1;
                    return Some(Heard::Frame(word(8), word(12), bytes.to_vec()));
                }
                Ok(_) => {}
                Err(_) => return None,
            }
        }
    }

    /// What it is told first of all.
    ///
    /// # Panics
    /// If it is told something else.
    pub fn hello(&mut self) -> Value {
        match self.hear() {
            Some(Heard::Said(hello)) if hello["type"] == "hello" => hello,
            other => panic!("{other:?}"),
        }
    }

    /// The next frame, acknowledged: its step and all of it. None if no more come.
    pub fn frame(&mut self) -> Option<(u32, Vec<u8>)> {
        loop {
            if let Heard::Frame(number, step, bytes) = self.hear()? {
                self.wish(&json!({ "do": "ack", "frame": number }));
                return Some((step, bytes));
            }
        }
    }

    /// Looks in every way, pauses, steps, plays, picks and zooms until it is hung up on, or for so long.
    pub fn fidget(&mut self, domain: [f64; 4], most: Duration) {
        let [x0, y0, x1, y1] = domain;
        let (begun, mut round) = (Instant::now(), 0_u32);
        let colors = ["kind", "speed", "spin", "tile", "rank", "contacts", "asleep"];
        while begun.elapsed() < most {
            let part = 0.5_f64.powi((round % 9) as i32);
            let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
            let half = [0.5 * (x1 - x0) * part, 0.5 * (y1 - y0) * part];
            let size = [320 + 16 * (round % 5), 240];
            self.look([x - half[0], y - half[1], x + half[0], y + half[1]], size, colors[(round % 7) as usize]);
            if self.frame().is_none() {
                return;
            }
            match round % 11 {
                3 => self.wish(&json!({ "do": "pause" })),
                4 => self.wish(&json!({ "do": "step", "by": 1 })),
                5 => self.wish(&json!({ "do": "play" })),
                6 => self.wish(&json!({ "do": "pick", "source": 0, "at": [x, y] })),
                8 => self.wish(&json!({ "do": "speed", "times": 3 })),
                9 => self.wish(&json!({ "do": "speed", "times": 0 })),
                10 => self.wish(&json!({ "do": "drop" })),
                _ => {}
            }
            round += 1;
        }
        // Whatever was wished last, time goes on as fast as it can; and that was heard, if something else is shown after it.
        self.wish(&json!({ "do": "speed", "times": 0 }));
        self.wish(&json!({ "do": "play" }));
        for size in [[160, 120], [176, 120]] {
            self.look(domain, size, "kind");
            if self.frame().is_none() {
                return;
            }
        }
    }
}
