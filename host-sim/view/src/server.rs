//! The server: a thread that accepts, and one for each connection, of which there are few.
//!
//! What is bounded, and by what: each connection's time and bytes ([`http`]), connections without a complete request
//! ([`Lobby`]), viewers, and commands that wait.

use std::collections::VecDeque;
use std::io::{Result as IoResult, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use crate::command::{Action, Command};
use crate::guard;
use crate::http::{self, Head, Refusal, Timed};
use crate::shared::{LEAST_INTERVAL, Seen, Shared};

/// Largest number of viewers. A browser has six connections to a host: one stays free for commands.
pub const MOST_VIEWERS: usize = 5;
/// Largest number of commands that wait for an answer.
pub const MOST_COMMANDS: usize = 8;
/// Largest number of connections that are neither viewers nor commands.
const MOST_WAITING: usize = 32;
/// Longest time that a request may take to arrive, and an answer to be taken.
const REQUEST: Duration = Duration::from_secs(3);
/// Longest time that a viewer may take to take an event.
const EVENT: Duration = Duration::from_secs(5);
/// Longest time that a source may take to answer a command.
const ANSWER: Duration = Duration::from_secs(15);
/// Time between attempts to accept while this process has no room for another connection.
const NO_ROOM: Duration = Duration::from_millis(50);

const TEXT: &str = "text/plain; charset=utf-8";
const JSON: &str = "application/json";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

const PAGE: &str = include_str!("../page/index.html");
/// Files of the page: path, type, content.
const FILES: [(&str, &str, &str); 5] = [
    ("/icon.svg", "image/svg+xml", include_str!("../page/icon.svg")),
    ("/uplot.css", STYLE, include_str!("../page/uplot/uPlot.min.css")),
    ("/uplot.js", SCRIPT, include_str!("../page/uplot/uPlot.iife.min.js")),
    ("/page.css", STYLE, include_str!("../page/page.css")),
    (
        "/page.js",
        SCRIPT,
        concat!(
            "\"use strict\";\n",
            include_str!("../page/colour.js"),
            include_str!("../page/sheet.js"),
            include_str!("../page/matrix.js"),
            include_str!("../page/traces.js"),
            include_str!("../page/page.js"),
        ),
    ),
];

/// Connections whose requests have not been answered, oldest first. One too many pushes out the oldest: slow ones make room for those
/// that ask and go.
#[derive(Default)]
struct Lobby {
    waiting: Mutex<VecDeque<(u64, TcpStream)>>,
}

impl Lobby {
    fn lock(&self) -> MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn enter(&self, number: u64, stream: TcpStream) {
        let mut waiting = self.lock();
        waiting.push_back((number, stream));
        if waiting.len() > MOST_WAITING
            && let Some((_, oldest)) = waiting.pop_front()
        {
            let _ = oldest.shutdown(Shutdown::Both);
        }
    }

    fn leave(&self, number: u64) {
        self.lock().retain(|&(other, _)| other != number);
    }
}

/// What the threads of connections share.
pub struct Server {
    shared: Arc<Shared>,
    token: String,
    commands: SyncSender<Command>,
    lobby: Lobby,
    asking: AtomicUsize,
}

impl Server {
    pub fn new(shared: Arc<Shared>, token: String, commands: SyncSender<Command>) -> Self {
        Self { shared, token, commands, lobby: Lobby::default(), asking: AtomicUsize::new(0) }
    }

    /// Accepts connections until the view is closed and one more comes.
    pub fn run(self: &Arc<Self>, listener: &TcpListener) {
        for number in 0.. {
            let accepted = listener.accept();
            if self.shared.is_closed() {
                return;
            }
            let Ok((stream, copy)) =
                accepted.and_then(|(stream, _)| stream.try_clone().map(|copy| (stream, copy)))
            else {
                thread::sleep(NO_ROOM);
                continue;
            };
            self.lobby.enter(number, copy);
            let server = self.clone();
            let work = move || {
                // Whether the other end took its answer is its own affair.
                let _ = server.serve(&stream, number);
                server.lobby.leave(number);
            };
            if thread::Builder::new().name("view".into()).spawn(work).is_err() {
                self.lobby.leave(number);
            }
        }
    }

    fn serve(&self, stream: &TcpStream, number: u64) -> IoResult<()> {
        stream.set_nodelay(true)?;
        let mut timed = Timed::new(stream, REQUEST);
        let result = Head::read(&mut timed).and_then(|head| {
            guard::check(&head, &self.token)?;
            Ok(head)
        });
        let result = result.and_then(|head| match (head.method.as_str(), head.path.as_str()) {
            ("GET", "/events") => self.send_events(stream, number, &head),
            ("GET", path) => self.send_file(stream, path),
            ("POST", "/command") => self.command(stream, number, &head.body(&mut timed)?),
            _ => Err(Refusal::new(405, "GET, or POST to /command")),
        });
        match result {
            Ok(written) => written,
            Err(Refusal { status, words }) => {
                http::answer(&mut Timed::new(stream, REQUEST), status, TEXT, &words)
            }
        }
    }

    fn send_file(&self, stream: &TcpStream, path: &str) -> Result<IoResult<()>, Refusal> {
        let mut out = Timed::new(stream, REQUEST);
        if path == "/" {
            let page = PAGE.replace("TOKEN", &self.token);
            return Ok(http::answer(&mut out, 200, "text/html; charset=utf-8", &page));
        }
        let (_, kind, content) = FILES
            .iter()
            .find(|(name, ..)| *name == path)
            .ok_or_else(|| Refusal::new(404, "there is no such page"))?;
        Ok(http::answer(&mut out, 200, kind, content))
    }

    /// Sends events until the view is closed or the viewer takes them no longer.
    fn send_events(
        &self,
        stream: &TcpStream,
        number: u64,
        head: &Head,
    ) -> Result<IoResult<()>, Refusal> {
        let Some(_place) = self.shared.place(MOST_VIEWERS) else {
            let words = format!("{MOST_VIEWERS} pages show this view already: close one");
            return Err(Refusal::new(503, words));
        };
        self.lobby.leave(number);
        let rate = head.parameter("rate").and_then(|rate| rate.parse::<u32>().ok());
        // Without a rate, whatever is printed is sent.
        let interval =
            rate.map_or(LEAST_INTERVAL / 2, |rate| Duration::from_secs(1) / rate.clamp(1, 60));
        let mut seen = Seen::nothing(interval);
        let mut write = || -> IoResult<()> {
            http::begin_events(&mut Timed::new(stream, EVENT))?;
            while let Some(texts) = self.shared.news(&mut seen) {
                let mut out = Timed::new(stream, EVENT);
                texts.iter().try_for_each(|text| out.write_all(text.as_bytes()))?;
            }
            Ok(())
        };
        Ok(write())
    }

    fn command(
        &self,
        stream: &TcpStream,
        number: u64,
        body: &[u8],
    ) -> Result<IoResult<()>, Refusal> {
        let action = Action::parse(body).map_err(|words| Refusal::new(400, words))?;
        self.lobby.leave(number);
        let result = self.ask(action);
        let (status, name, words) = match &result {
            Ok(words) => (200, "message", words),
            Err(words) => (409, "error", words),
        };
        let json = serde_json::json!({ name: words }).to_string();
        Ok(http::answer(&mut Timed::new(stream, REQUEST), status, JSON, &json))
    }

    /// Hands a command to the source, and waits for its answer.
    fn ask(&self, action: Action) -> Result<String, String> {
        if self.asking.fetch_add(1, Ordering::Relaxed) >= MOST_COMMANDS {
            self.asking.fetch_sub(1, Ordering::Relaxed);
            return Err("the program is still busy with the previous request".into());
        }
        let (command, answer) = Command::new(action);
        let result = match self.commands.try_send(command) {
            Ok(()) => answer.recv_timeout(ANSWER).unwrap_or_else(|cause| match cause {
                RecvTimeoutError::Timeout => {
                    Err(format!("no answer within {} s", ANSWER.as_secs()))
                }
                RecvTimeoutError::Disconnected => Err("the program did not answer".into()),
            }),
            Err(_) => Err("the program accepts no commands now".into()),
        };
        self.asking.fetch_sub(1, Ordering::Relaxed);
        result
    }
}
