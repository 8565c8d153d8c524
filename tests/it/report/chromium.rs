//! A headless browser over its debugging pipe: JSON on two pipes, no port, no further crate.

#![expect(clippy::unwrap_used, reason = "a browser that does not answer fails the test")]
#![expect(clippy::disallowed_methods, reason = "the browser has the real clock")]

use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Longest that one thing may take.
const PATIENCE: Duration = Duration::from_mins(1);
/// Programs that are tried.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// A running browser.
pub(crate) struct Browser {
    child: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    /// What happened that nobody has asked about yet.
    events: Vec<Value>,
    next: u64,
    _profile: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The browser to use; `None`, with a word to whoever reads the log, if there is none.
fn program() -> Option<String> {
    if let Ok(named) = std::env::var("UPDRAFT_BROWSER") {
        return Some(named);
    }
    let works = |name: &&&str| {
        let mut command = Command::new(**name);
        command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    let found = NAMES.iter().find(works).map(|name| (*name).to_owned());
    if found.is_none() {
        // Written directly: the harness swallows what a passing test prints.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no browser for tests/it/report/browser.rs; install chromium, or name one in \
             UPDRAFT_BROWSER"
        );
    }
    found
}

impl Browser {
    /// Starts it; `None` where there is none.
    pub(crate) fn start() -> Option<Self> {
        let program = program()?;
        let profile = tempfile::tempdir().unwrap();
        // The browser reads commands from descriptor 3 and answers on 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1", &program])
            .args([
                "--headless=new",
                "--remote-debugging-pipe",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--hide-scrollbars",
                "--no-first-run",
                "--disable-background-networking",
                "--disable-component-update",
                "--force-color-profile=srgb",
                // Whatever asks for a name gets none: no test depends on a network.
                "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("failed to start {program}: {error}"));
        let to = child.stdin.take().unwrap();
        let mut from = BufReader::new(child.stdout.take().unwrap());
        let (send, receive) = channel();
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while from.read_until(0, &mut message).is_ok_and(|read| read > 0) {
                message.pop();
                let Ok(value) = serde_json::from_slice(&message) else { break };
                if send.send(value).is_err() {
                    break;
                }
                message.clear();
            }
        });
        let events = Vec::new();
        Some(Self { child, to, from: receive, events, next: 1, _profile: profile })
    }

    /// Sends a command and waits for its answer.
    fn call(&mut self, session: Option<&str>, method: &str, parameters: &Value) -> Value {
        let id = self.next;
        self.next += 1;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if let Some(session) = session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = serde_json::to_vec(&message).unwrap();
        bytes.push(0);
        self.to.write_all(&bytes).expect("the browser listens");
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let answer = self
                .from
                .recv_timeout(left)
                .unwrap_or_else(|error| panic!("no answer to {method}: {error}"));
            if answer["id"] == json!(id) {
                assert!(answer.get("error").is_none(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// Opens a page in a window of this size and waits until it has loaded.
    pub(crate) fn open(&mut self, address: &str, [width, height]: [u32; 2]) -> Tab<'_> {
        let blank = json!({ "url": "about:blank" });
        let target = self.call(None, "Target.createTarget", &blank)["targetId"].clone();
        let attach = json!({ "targetId": target, "flatten": true });
        let session = self.call(None, "Target.attachToTarget", &attach)["sessionId"]
            .as_str()
            .unwrap()
            .to_owned();
        let mut tab = Tab { browser: self, session, address: address.to_owned() };
        for domain in ["Page", "Runtime", "Log", "Network"] {
            tab.call(&format!("{domain}.enable"), &json!({}));
        }
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        tab.call("Emulation.setDeviceMetricsOverride", &metrics);
        tab.call("Page.navigate", &json!({ "url": address }));
        tab.wait_for("location.href !== 'about:blank' && document.readyState === 'complete'");
        tab
    }
}

/// The server of a page that one has served, with its port and a slash.
fn origin(address: &str) -> Option<String> {
    let rest = address.strip_prefix("http://")?;
    Some(format!("http://{}/", rest.split('/').next()?))
}

/// A key.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Key {
    Right,
    Down,
    Home,
    PageDown,
    End,
    Plus,
    Space,
    Enter,
    Tab,
    Escape,
}

/// An open page.
pub(crate) struct Tab<'a> {
    browser: &'a mut Browser,
    session: String,
    address: String,
}

impl Tab<'_> {
    fn call(&mut self, method: &str, parameters: &Value) -> Value {
        let session = self.session.clone();
        self.browser.call(Some(&session), method, parameters)
    }

    /// The value of an expression.
    fn value(&mut self, expression: &str) -> Value {
        let ask = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", &ask);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Runs a statement.
    pub(crate) fn run(&mut self, statement: &str) {
        self.value(statement);
    }

    /// A number.
    pub(crate) fn number(&mut self, expression: &str) -> f64 {
        self.value(expression).as_f64().unwrap_or_else(|| panic!("{expression} is no number"))
    }

    /// A text.
    pub(crate) fn text(&mut self, expression: &str) -> String {
        let value = self.value(expression);
        value.as_str().unwrap_or_else(|| panic!("{expression} is no text: {value}")).to_owned()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait_for(&mut self, expression: &str) {
        let until = Instant::now() + PATIENCE;
        while self.value(expression) != json!(true) {
            assert!(Instant::now() < until, "never true: {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Lets the page live for a while.
    pub(crate) fn sleep_ms(&mut self, ms: u64) {
        self.value(&format!("new Promise((done) => setTimeout(done, {ms}))"));
    }

    /// Where an element is in the window: x, y, width, height.
    pub(crate) fn place(&mut self, selector: &str) -> [f64; 4] {
        let selector = json!(selector);
        let value = self.value(&format!(
            "(() => {{ const r = document.querySelector({selector}).getBoundingClientRect(); \
             return [r.x, r.y, r.width, r.height]; }})()"
        ));
        std::array::from_fn(|i| value[i].as_f64().unwrap())
    }

    /// A real click at a place in the window.
    pub(crate) fn click(&mut self, [x, y]: [f64; 2]) {
        for kind in ["mouseMoved", "mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", &event);
        }
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], clicks: u32) {
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": clicks });
        self.call("Input.dispatchMouseEvent", &event);
    }

    /// Presses the button at a place, and lets it go at another.
    pub(crate) fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.mouse("mouseMoved", from, 0);
        self.mouse("mousePressed", from, 1);
        for step in 1..=10 {
            let share = f64::from(step) / 10.0;
            let at = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            self.mouse("mouseMoved", at, 0);
        }
        self.mouse("mouseReleased", to, 1);
    }

    /// A double click.
    pub(crate) fn double_click(&mut self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
        for clicks in [1, 2] {
            self.mouse("mousePressed", at, clicks);
            self.mouse("mouseReleased", at, clicks);
        }
    }

    /// Turns the wheel at a place.
    pub(crate) fn wheel(&mut self, [x, y]: [f64; 2], down: f64) {
        let event = json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": down });
        self.call("Input.dispatchMouseEvent", &event);
        self.sleep_ms(50);
    }

    /// A real click in the middle of an element, brought into view first. A page may still scroll smoothly to what was
    /// clicked before: the click waits until the element stands still and is what lies below the pointer.
    pub(crate) fn click_on(&mut self, selector: &str) {
        let quoted = json!(selector);
        let at = self.value(&format!(
            "(async () => {{ \
               const one = document.querySelector({quoted}); \
               let last = [NaN, NaN]; \
               for (let look = 0; look < 60; look++) {{ \
                 one.scrollIntoView({{ block: 'center', behavior: 'instant' }}); \
                 await new Promise((done) => setTimeout(done, 25)); \
                 const r = one.getBoundingClientRect(); \
                 const at = [r.x + r.width / 2, r.y + r.height / 2]; \
                 const below = document.elementFromPoint(...at); \
                 const still = at[0] === last[0] && at[1] === last[1]; \
                 if (still && below && one.contains(below)) return at; \
                 last = at; \
               }} \
               return last; \
             }})()"
        ));
        self.click(std::array::from_fn(|i| at[i].as_f64().unwrap()));
    }

    /// Presses a key where the focus is.
    pub(crate) fn press(&mut self, key: Key) {
        let (name, code, text, number) = match key {
            Key::Right => ("ArrowRight", "ArrowRight", "", 39),
            Key::Down => ("ArrowDown", "ArrowDown", "", 40),
            Key::End => ("End", "End", "", 35),
            Key::Plus => ("+", "Equal", "+", 187),
            Key::Home => ("Home", "Home", "", 36),
            Key::PageDown => ("PageDown", "PageDown", "", 34),
            Key::Space => (" ", "Space", " ", 32),
            Key::Enter => ("Enter", "Enter", "\r", 13),
            Key::Tab => ("Tab", "Tab", "", 9),
            Key::Escape => ("Escape", "Escape", "", 27),
        };
        for kind in ["keyDown", "keyUp"] {
            let mut event = json!({
                "type": kind, "key": name, "code": code,
                "windowsVirtualKeyCode": number, "nativeVirtualKeyCode": number,
            });
            if kind == "keyDown" && !text.is_empty() {
                event["text"] = json!(text);
            }
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// Presses a key on an element.
    pub(crate) fn press_on(&mut self, selector: &str, key: Key) {
        let selector = json!(selector);
        self.run(&format!("document.querySelector({selector}).focus()"));
        self.press(key);
    }

    /// Asks for dark colours, as a reader's system settings may.
    pub(crate) fn dark(&mut self) {
        let feature = json!({ "name": "prefers-color-scheme", "value": "dark" });
        self.call("Emulation.setEmulatedMedia", &json!({ "features": [feature] }));
    }

    /// Shows the page as on paper.
    pub(crate) fn print_media(&mut self) {
        self.call("Emulation.setEmulatedMedia", &json!({ "media": "print" }));
    }

    /// Asks for less motion, as a reader's system settings may.
    pub(crate) fn less_motion(&mut self) {
        let feature = json!({ "name": "prefers-reduced-motion", "value": "reduce" });
        self.call("Emulation.setEmulatedMedia", &json!({ "features": [feature] }));
    }

    /// Keeps what the window shows.
    pub(crate) fn screenshot(&mut self, path: &Path) {
        self.capture(path, &json!({ "format": "png" }));
    }

    /// Keeps the whole page.
    pub(crate) fn whole_page(&mut self, path: &Path) {
        let width = self.number("document.documentElement.clientWidth");
        let height = self.number("Math.min(16000, document.documentElement.scrollHeight)");
        let clip = json!({ "x": 0, "y": 0, "width": width, "height": height, "scale": 1 });
        let how = json!({ "format": "png", "captureBeyondViewport": true, "clip": clip });
        self.capture(path, &how);
    }

    fn capture(&mut self, path: &Path, how: &Value) {
        let answer = self.call("Page.captureScreenshot", how);
        let bytes = STANDARD.decode(answer["data"].as_str().unwrap()).unwrap();
        File::create(path).unwrap().write_all(&bytes).unwrap();
    }

    /// Looks back: errors and words in the console, exceptions, and whatever was fetched but the page
    /// itself.
    pub(crate) fn troubles(&mut self) -> Vec<String> {
        // An answer to a question comes after all that happened before it.
        self.value("1");
        let session = json!(self.session);
        let address = &self.address;
        let trouble = |event: Value| {
            let parameters = &event["params"];
            match event["method"].as_str()? {
                "Runtime.exceptionThrown" => Some(format!("exception: {parameters}")),
                "Runtime.consoleAPICalled" => Some(format!("in the console: {parameters}")),
                "Log.entryAdded" => Some(format!("in the log: {parameters}")),
                "Network.requestWillBeSent" => {
                    let url = parameters["request"]["url"].as_str().unwrap_or("");
                    let site = origin(address).filter(|site| url.starts_with(site.as_str()));
                    // Files of data lie beside the page.
                    let data =
                        address.rsplit_once('/').map(|(folder, _)| format!("{folder}/data/"));
                    let beside =
                        data.is_some_and(|data| url.starts_with("file:") && url.starts_with(&data));
                    let own =
                        beside || url.starts_with("data:") || url == address || site.is_some();
                    (!own).then(|| format!("fetched {url}"))
                }
                _ => None,
            }
        };
        let own = self.browser.events.drain(..).filter(|event| event["sessionId"] == session);
        own.filter_map(trouble).collect()
    }

    /// Nothing of it happened.
    pub(crate) fn finish(mut self) {
        let troubles = self.troubles();
        assert!(troubles.is_empty(), "{troubles:#?}");
    }
}
