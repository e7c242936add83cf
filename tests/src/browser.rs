//! A real browser, headless, driven over its debugging protocol: <https://chromedevtools.github.io/devtools-protocol/>.

use crate::program::LIMIT;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

/// What Chromium is called.
const NAMES: [&str; 5] = ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "chrome"];

/// Between two looks at whether something has become true.
const POLL: Duration = Duration::from_millis(20);

/// A browser with one page.
#[derive(Debug)]
pub struct Browser {
    child: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    next: u64,
    /// What went wrong in the page: exceptions, errors in the console.
    pub errors: Vec<String>,
    /// Every address the page has asked for.
    pub requests: Vec<String>,
    _profile: TempDir,
}

/// Where the browser is: the file that `ATOLL_BROWSER` names, or one of the usual names. None if there is none, which is said.
pub fn find() -> Option<PathBuf> {
    let named = std::env::var_os("ATOLL_BROWSER").filter(|name| !name.is_empty()).map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let usual = || {
        std::env::split_paths(&path).flat_map(|folder| NAMES.map(|name| folder.join(name))).find(|file| file.is_file())
    };
    let found = named.or_else(usual);
    if found.is_none() {
        eprintln!("LEFT OUT: there is no browser (Debian: chromium-headless-shell)");
    }
    found
}

impl Browser {
    /// Starts it with an empty page of that many pixels.
    ///
    /// # Panics
    /// If it does not start.
    pub fn start(program: &Path, [width, height]: [u32; 2]) -> Self {
        let profile = tempfile::tempdir().expect("a temporary folder can be had");
        let mut child = Command::new(program)
            .args(["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader"])
            .args(["--enable-unsafe-swiftshader", "--remote-debugging-port=0", "--no-first-run", "--hide-scrollbars"])
            .arg(format!("--window-size={width},{height}"))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}", program.display()));
        let mut lines = BufReader::new(child.stderr.take().expect("it is piped")).lines();
        let url = loop {
            let line = lines.next().expect("the browser says where it listens").expect("it can be read");
            if let Some(url) = line.strip_prefix("DevTools listening on ") {
                break url.to_owned();
            }
        };
        // Whatever else it says is read, so that it is not held up.
        thread::spawn(move || lines.for_each(drop));
        let address = url.strip_prefix("ws://").and_then(|rest| rest.split('/').next()).expect("an address");
        let stream = TcpStream::connect(address).expect("it listens");
        stream.set_read_timeout(Some(LIMIT)).expect("time limits can be set");
        let config = WebSocketConfig::default().max_message_size(None).max_frame_size(None);
        let (socket, _) =
            tungstenite::client::client_with_config(url.as_str(), stream, Some(config)).expect("it takes a socket");
        let mut browser = Self {
            child,
            socket,
            session: String::new(),
            next: 1,
            errors: Vec::new(),
            requests: Vec::new(),
            _profile: profile,
        };
        let target =
            browser.call("Target.createTarget", json!({ "url": "about:blank", "width": width, "height": height }));
        let target = json!({ "targetId": target["targetId"], "flatten": true });
        browser.session =
            browser.call("Target.attachToTarget", target)["sessionId"].as_str().expect("a session").to_owned();
        for domain in ["Runtime", "Log", "Network", "Page"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser
    }

    /// Asks the browser to do something, and returns what it answers.
    ///
    /// # Panics
    /// If it refuses.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        let id = self.next;
        self.next += 1;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(message.to_string())).expect("the browser listens");
        loop {
            let Message::Text(text) = self.socket.read().expect("the browser answers") else { continue };
            let message: Value = serde_json::from_str(&text).expect("it speaks JSON");
            if message["id"] == json!(id) {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].clone();
            }
            self.hear(&message);
        }
    }

    fn hear(&mut self, event: &Value) {
        let about = &event["params"];
        match event["method"].as_str().unwrap_or_default() {
            "Runtime.exceptionThrown" => self.errors.push(about["exceptionDetails"].to_string()),
            "Runtime.consoleAPICalled" if about["type"] == "error" => self.errors.push(about["args"].to_string()),
            "Log.entryAdded" if about["entry"]["level"] == "error" => self.errors.push(about["entry"].to_string()),
            "Network.requestWillBeSent" => self.requests.extend(about["request"]["url"].as_str().map(str::to_owned)),
            "Network.webSocketCreated" => self.requests.extend(about["url"].as_str().map(str::to_owned)),
            _ => {}
        }
    }

    /// Opens an address and waits until it is there.
    pub fn open(&mut self, url: &str) {
        self.call("Page.navigate", json!({ "url": url }));
        self.wait_for("document.readyState === 'complete'");
    }

    /// The value of an expression.
    ///
    /// # Panics
    /// If it throws.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let asked = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    ///
    /// # Panics
    /// If it is not within [`LIMIT`].
    pub fn wait_for(&mut self, expression: &str) {
        let deadline = Instant::now() + LIMIT;
        while self.evaluate(expression) != json!(true) {
            assert!(Instant::now() < deadline, "never so: {expression}; errors {:?}", self.errors);
            thread::sleep(POLL);
        }
    }

    /// Clicks at a place of the page.
    pub fn click(&mut self, [x, y]: [f64; 2]) {
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// Presses at a place of the page, waits until an expression is true, and lets go at another place.
    ///
    /// # Panics
    /// As [`wait_for`](Self::wait_for).
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2], holds: &str) {
        let tell = |browser: &mut Self, kind: &str, [x, y]: [f64; 2]| {
            let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 });
            browser.call("Input.dispatchMouseEvent", event);
        };
        tell(self, "mousePressed", from);
        self.wait_for(holds);
        for part in 1..=4 {
            let at = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * f64::from(part) / 4.0);
            tell(self, "mouseMoved", at);
        }
        tell(self, "mouseReleased", to);
    }

    /// Turns the wheel at a place of the page, so many pixels downwards.
    pub fn wheel(&mut self, [x, y]: [f64; 2], down: f64) {
        let event = json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": down });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Presses a key, by the name that pages know it by.
    pub fn press(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key }));
        }
    }

    /// Writes a picture of the page, a PNG, to where `ATOLL_SCREENSHOTS` says; if it says nothing, none.
    pub fn screenshot(&mut self, name: &str) {
        if let Some(folder) = std::env::var_os("ATOLL_SCREENSHOTS") {
            let picture = self.call("Page.captureScreenshot", json!({ "format": "png" }));
            let text = picture["data"].as_str().expect("a picture");
            let bytes = data_encoding::BASE64.decode(text.as_bytes()).expect("it is base64");
            std::fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).expect("the folder is there");
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Debian's is a script that starts it, and each has processes of its own: all that are of its group.
        let all = format!("kill -KILL -{}", self.child.id());
        let _ = Command::new("sh").args(["-c", &all]).stderr(Stdio::null()).status();
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
