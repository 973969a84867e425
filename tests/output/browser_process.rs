//! Browsers that stay open: each shows one page after another, told so by DevTools messages.
//!
//! A browser reads messages from one pipe and answers on another one, each a line of JSON that ends
//! with a zero byte (<https://chromedevtools.github.io/devtools-protocol/>). It ends with its pipe.

use super::browser::Shown;
use base64::prelude::{BASE64_STANDARD as STANDARD, Engine as _};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// A page is to answer within this.
const PATIENCE: Duration = Duration::from_secs(120);
/// So long a page has its scripts and their animations run, ms of its own time.
const BUDGET: u32 = 500;

/// Browsers that wait for a page.
static WAITING: Mutex<Vec<Browser>> = Mutex::new(Vec::new());
static STARTED: AtomicUsize = AtomicUsize::new(0);

pub(crate) struct Browser {
    child: Child,
    flags: Vec<String>,
    to: File,
    from: Receiver<Value>,
    messages: u64,
    console: Vec<String>,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let group = format!("-{}", self.child.id());
        let _ = Command::new("kill").args(["-9", "--", &group]).stderr(Stdio::null()).status();
        let _ = self.child.wait();
    }
}

impl Browser {
    /// One with these options that waits, or a new one.
    pub(crate) fn taken(program: &str, flags: &[&str]) -> Self {
        let mut waiting = WAITING.lock().unwrap();
        if let Some(place) = waiting.iter().position(|own| own.flags == flags) {
            return waiting.swap_remove(place);
        }
        drop(waiting);
        Self::start(program, flags)
    }

    /// Waits for the next page.
    pub(crate) fn give_back(self) {
        WAITING.lock().unwrap().push(self);
    }

    fn start(program: &str, flags: &[&str]) -> Self {
        use std::os::unix::process::CommandExt;
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let name = format!("browser-{}-{number}", std::process::id());
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&folder).unwrap();
        let pipes = ["to", "from"].map(|name| folder.join(name));
        assert!(Command::new("mkfifo").args(&pipes).status().unwrap().success());
        let mut command = Command::new("sh");
        command.args(["-c", "exec \"$@\" 3<\"$TO\" 4>\"$FROM\"", "sh", program]);
        command.env("TO", &pipes[0]).env("FROM", &pipes[1]);
        command.args([
            "--headless=new",
            "--no-sandbox",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--hide-scrollbars",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--remote-debugging-pipe",
        ]);
        command.args(flags).arg(format!("--user-data-dir={}", folder.join("user").display()));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let child = command.spawn().unwrap();
        let to = File::options().write(true).open(&pipes[0]).unwrap();
        let reader = BufReader::new(File::open(&pipes[1]).unwrap());
        let (send, from) = channel();
        std::thread::spawn(move || {
            for message in reader.split(0) {
                let Ok(message) = message else { return };
                let message = serde_json::from_slice(&message).unwrap();
                if send.send(message).is_err() {
                    return;
                }
            }
        });
        let flags = flags.iter().map(|&flag| flag.to_owned()).collect();
        Self { child, flags, to, from, messages: 0, console: Vec::new() }
    }

    /// A page in a window of this size; `None`: the browser does not answer.
    pub(crate) fn show(&mut self, address: &str, size: [u32; 2]) -> Option<Shown> {
        self.console.clear();
        let tab = self.ask(None, "Target.createTarget", json!({ "url": "about:blank" }))?;
        let target = json!({ "targetId": tab["targetId"], "flatten": true });
        let session = self.ask(None, "Target.attachToTarget", target)?;
        let session = session["sessionId"].as_str().unwrap().to_owned();
        let page = Some(session.as_str());
        for part in ["Page.enable", "Runtime.enable", "Log.enable"] {
            self.ask(page, part, json!({}))?;
        }
        let [width, height] = size;
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.ask(page, "Emulation.setDeviceMetricsOverride", metrics)?;
        self.ask(page, "Page.navigate", json!({ "url": address }))?;
        self.await_event("Page.loadEventFired")?;
        let time = json!({ "policy": "pauseIfNetworkFetchesPending", "budget": BUDGET });
        self.ask(page, "Emulation.setVirtualTimePolicy", time)?;
        self.await_event("Emulation.virtualTimeBudgetExpired")?;
        let text = json!({ "expression": "document.documentElement.outerHTML" });
        let document = self.ask(page, "Runtime.evaluate", text)?;
        let picture = self.ask(page, "Page.captureScreenshot", json!({ "format": "png" }))?;
        self.ask(None, "Target.closeTarget", json!({ "targetId": tab["targetId"] }))?;
        let bytes = STANDARD.decode(picture["data"].as_str().unwrap()).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!(info.bit_depth, png::BitDepth::Eight);
        assert_eq!([info.width, info.height], size);
        assert_eq!(info.color_type, png::ColorType::Rgb);
        Some(Shown {
            document: document["result"]["value"].as_str().unwrap().to_owned(),
            console: std::mem::take(&mut self.console),
            pixels,
            width: info.width as usize,
        })
    }

    /// The answer to a message, of the browser or of a page.
    fn ask(&mut self, page: Option<&str>, method: &str, parameters: Value) -> Option<Value> {
        self.messages += 1;
        let id = self.messages;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if let Some(page) = page {
            message["sessionId"] = page.into();
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.to.write_all(&bytes).ok()?;
        let mut answer = self.await_message(|message| message["id"] == id)?;
        assert!(answer.get("error").is_none(), "{method}: {answer}");
        Some(answer["result"].take())
    }

    fn await_event(&mut self, method: &str) -> Option<()> {
        self.await_message(|message| message["method"] == method).map(drop)
    }

    /// The next message that is asked for; what the console says on the way is kept.
    fn await_message(&mut self, is_it: impl Fn(&Value) -> bool) -> Option<Value> {
        let begun = Instant::now();
        loop {
            let left = PATIENCE.saturating_sub(begun.elapsed());
            let message = match self.from.recv_timeout(left) {
                Ok(message) => message,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return None,
            };
            let said = ["Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"];
            if said.iter().any(|method| message["method"] == **method) {
                self.console.push(message["params"].to_string());
            }
            if is_it(&message) {
                return Some(message);
            }
        }
    }
}
