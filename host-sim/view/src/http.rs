//! As much of HTTP as a page needs, with a bound on everything: one request a connection, then it is closed.

use std::io::{Error, ErrorKind, Read, Result as IoResult, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Largest size of a request without its body.
const MOST_HEAD_BYTES: usize = 8192;
/// Largest size of a request's body.
const MOST_BODY_BYTES: usize = 1024;
/// Headers of every answer. What the page runs, draws and asks comes from here alone, and no other page may frame it.
const HEADERS: &str = "Connection: close\r\n\
    Cache-Control: no-store\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
    Cross-Origin-Opener-Policy: same-origin\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Referrer-Policy: no-referrer\r\n\
    X-Content-Type-Options: nosniff\r\n";

/// A connection that ends at a moment, however slow its other end is.
pub struct Timed<'stream> {
    stream: &'stream TcpStream,
    end: Instant,
}

impl<'stream> Timed<'stream> {
    /// `stream`, of which reading and writing fail after `time`.
    pub fn new(stream: &'stream TcpStream, time: Duration) -> Self {
        Self { stream, end: Instant::now() + time }
    }

    fn rest(&self) -> IoResult<Option<Duration>> {
        let rest = self.end.saturating_duration_since(Instant::now());
        if rest.is_zero() { Err(ErrorKind::TimedOut.into()) } else { Ok(Some(rest)) }
    }
}

impl Read for Timed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
        self.stream.set_read_timeout(self.rest()?)?;
        self.stream.read(buffer)
    }
}

impl Write for Timed<'_> {
    fn write(&mut self, buffer: &[u8]) -> IoResult<usize> {
        self.stream.set_write_timeout(self.rest()?)?;
        self.stream.write(buffer)
    }

    fn flush(&mut self) -> IoResult<()> {
        Ok(())
    }
}

/// A request that is not served: its status and the reason in words.
#[derive(Debug, PartialEq, Eq)]
pub struct Refusal {
    pub status: u16,
    pub words: String,
}

impl Refusal {
    pub fn new(status: u16, words: impl Into<String>) -> Self {
        Self { status, words: words.into() }
    }
}

impl From<Error> for Refusal {
    fn from(cause: Error) -> Self {
        match cause.kind() {
            ErrorKind::TimedOut | ErrorKind::WouldBlock => Self::new(408, "too slow"),
            _ => Self::new(400, "the request has no end"),
        }
    }
}

/// A request without its body.
#[derive(Debug, Default)]
pub struct Head {
    pub method: String,
    pub path: String,
    pub host: String,
    pub origin: Option<String>,
    query: String,
    length: Option<usize>,
    /// Bytes of the body that came with it.
    rest: Vec<u8>,
}

impl Head {
    /// Reads a request up to its body.
    pub fn read(source: &mut impl Read) -> Result<Self, Refusal> {
        let mut bytes = Vec::with_capacity(1024);
        let end = loop {
            if let Some(end) = bytes.windows(4).position(|window| window == b"\r\n\r\n") {
                break end;
            }
            if bytes.len() >= MOST_HEAD_BYTES {
                return Err(Refusal::new(431, "the request is too long"));
            }
            let mut piece = [0; 1024];
            let count = source.read(&mut piece)?;
            if count == 0 {
                return Err(Error::from(ErrorKind::UnexpectedEof).into());
            }
            bytes.extend_from_slice(&piece[..count]);
        };
        let text = std::str::from_utf8(&bytes[..end]);
        let text = text.map_err(|_| Refusal::new(400, "the request is not text"))?;
        Ok(Self { rest: bytes[end + 4..].to_vec(), ..Self::parse(text)? })
    }

    fn parse(text: &str) -> Result<Self, Refusal> {
        let wrong = || Refusal::new(400, "not a request of HTTP/1.1");
        let mut lines = text.split("\r\n");
        let mut words = lines.next().ok_or_else(wrong)?.split(' ');
        let (Some(method), Some(target), Some("HTTP/1.1" | "HTTP/1.0"), None) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            return Err(wrong());
        };
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let mut head = Self {
            method: method.to_owned(),
            path: path.to_owned(),
            query: query.to_owned(),
            ..Self::default()
        };
        let mut host = None;
        for line in lines {
            let (name, value) = line.split_once(':').ok_or_else(wrong)?;
            let value = value.trim();
            // Two of a kind would leave open which one counts.
            let is_first = match name.to_ascii_lowercase().as_str() {
                "host" => host.replace(value.to_owned()).is_none(),
                "origin" => head.origin.replace(value.to_owned()).is_none(),
                "content-length" => {
                    head.length.replace(value.parse().map_err(|_| wrong())?).is_none()
                }
                "transfer-encoding" => return Err(Refusal::new(411, "a body needs its length")),
                _ => true,
            };
            if !is_first {
                return Err(wrong());
            }
        }
        head.host = host.ok_or_else(wrong)?;
        Ok(head)
    }

    /// Parameter of the address, as it stands there.
    pub fn parameter(&self, name: &str) -> Option<&str> {
        self.query.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='))
    }

    /// Reads the body.
    pub fn body(&self, source: &mut impl Read) -> Result<Vec<u8>, Refusal> {
        let length = self.length.ok_or_else(|| Refusal::new(411, "a body needs its length"))?;
        if length > MOST_BODY_BYTES {
            return Err(Refusal::new(413, "the body is too long"));
        }
        let mut body = self.rest.clone();
        let came = body.len().min(length);
        body.resize(length, 0);
        source.read_exact(&mut body[came..])?;
        Ok(body)
    }
}

/// Answers a request in full.
pub fn answer(out: &mut impl Write, status: u16, kind: &str, body: &str) -> IoResult<()> {
    let reason = if status == 200 { "OK" } else { "Refused" };
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status} {reason}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{HEADERS}\r\n"
    );
    out.write_all(head.as_bytes())?;
    out.write_all(body.as_bytes())
}

/// Begins an answer that goes on until the connection is closed: server-sent events.
pub fn begin_events(out: &mut impl Write) -> IoResult<()> {
    let head = format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{HEADERS}\r\n");
    out.write_all(head.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(request: &str) -> u16 {
        Head::read(&mut request.as_bytes()).map_or_else(|refusal| refusal.status, |_| 200)
    }

    #[test]
    fn a_request_is_read_up_to_its_body_and_then_the_body() {
        let text = "POST /command?rate=5&token=abc HTTP/1.1\r\nhOsT: localhost:1\r\nContent-Length: 4\r\n\r\nbo";
        let mut source = text.as_bytes();
        let head = Head::read(&mut source).expect("a request");
        assert_eq!((head.method.as_str(), head.path.as_str()), ("POST", "/command"));
        assert_eq!((head.host.as_str(), head.parameter("token")), ("localhost:1", Some("abc")));
        assert_eq!(head.parameter("ken"), None);
        assert_eq!(head.body(&mut "dy and more".as_bytes()).expect("a body"), b"body");
    }

    #[test]
    fn what_is_too_long_or_no_request_is_refused() {
        assert_eq!(status(&format!("GET /{} HTTP/1.1\r\n", "a".repeat(100_000))), 431);
        assert_eq!(status("GET / HTTP/1.1\r\nHost: localhost"), 400);
        assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), 400);
        assert_eq!(status("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"), 400);
        assert_eq!(status("GET / HTTP/2\r\nHost: a\r\n\r\n"), 400);
        assert_eq!(status("GET / x HTTP/1.1\r\nHost: a\r\n\r\n"), 400);
        assert_eq!(status("POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"), 411);
        assert_eq!(status("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n"), 400);
        let long = "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999999\r\n\r\n";
        let head = Head::read(&mut long.as_bytes()).expect("a request");
        assert_eq!(head.body(&mut std::io::empty()).expect_err("too long").status, 413);
    }
}
