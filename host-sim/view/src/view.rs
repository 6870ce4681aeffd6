//! The view as its feeder sees it.

use std::io::{Error, ErrorKind, Result};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver};
use std::thread::{self, JoinHandle};

use crate::command::Command;
use crate::guard;
use crate::message::{Frame, Layout, Status};
use crate::server::{MOST_COMMANDS, Server};
use crate::shared::Shared;

/// A page in the browser that shows what it is given, until it is dropped.
///
/// What gives it something only stores it: the newest wins, nothing waits for a browser, and memory does not grow. Only pages of this
/// machine with the address's token are served, at most five at a time.
pub struct View {
    shared: Arc<Shared>,
    socket: SocketAddr,
    token: String,
    accepting: Option<JoinHandle<()>>,
}

impl View {
    /// Starts a view on `port` of 127.0.0.1, or on any free port if it is 0, and returns what its pages ask for.
    ///
    /// A given `token` lets pages find the view again after a restart; without it, a new one is drawn.
    ///
    /// # Errors
    /// If the port is taken, `token` has fewer than 16 characters or others than letters and digits, or the system gives no
    /// threads or random bytes.
    pub fn start(port: u16, token: Option<&str>) -> Result<(Self, Receiver<Command>)> {
        let token = token.map_or_else(guard::random_token, |token| Ok(token.to_owned()))?;
        if !guard::is_token(&token) {
            let rule = "a token needs 16 or more letters and digits";
            return Err(Error::new(ErrorKind::InvalidInput, rule));
        }
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let socket = listener.local_addr()?;
        let (sender, commands) = mpsc::sync_channel(MOST_COMMANDS);
        let shared = Arc::new(Shared::new());
        let server = Arc::new(Server::new(shared.clone(), token.clone(), sender));
        let printer = shared.clone();
        thread::Builder::new().name("view".into()).spawn(move || printer.print())?;
        let mut view = Self { shared, socket, token, accepting: None };
        let accept = move || server.run(&listener);
        view.accepting = Some(thread::Builder::new().name("view".into()).spawn(accept)?);
        Ok((view, commands))
    }

    /// Address of the page, with its token.
    pub fn address(&self) -> String {
        format!("http://{}/?token={}", self.socket, self.token)
    }

    /// Shows a sensor. Baseline and frame of the one before are forgotten.
    pub fn set_layout(&self, layout: Layout) {
        self.shared.set_layout(layout);
    }

    /// Sets the readings of the unloaded sensor, in the order and the units of the layout.
    pub fn set_baseline(&self, baseline: Vec<f32>) {
        self.shared.set_baseline(baseline);
    }

    /// Shows a frame, at most 60 a second; those between are dropped.
    pub fn show(&self, frame: Frame) {
        self.shared.show(frame);
    }

    /// Shows how the source is.
    pub fn set_status(&self, status: Status) {
        self.shared.set_status(status);
    }
}

impl Drop for View {
    fn drop(&mut self) {
        self.shared.close();
        // Wakes the thread that accepts; the port is free once it has ended.
        if let Some(accepting) = self.accepting.take()
            && TcpStream::connect(self.socket).is_ok()
        {
            let _ = accepting.join();
        }
    }
}
