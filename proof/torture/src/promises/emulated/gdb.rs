//! QEMU's debugger stub: stops the emulated processor, and reads and writes its memory.

use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest time that an answer may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// Time without an answer after which none is expected any more.
const QUIET: Duration = Duration::from_millis(100);

/// Connection to the stub.
pub struct Gdb(UnixStream);

impl Gdb {
    /// Connects to the stub at `path`, which stops the processor.
    pub fn connect(path: &Path) -> io::Result<Self> {
        let start = Instant::now();
        let stream = loop {
            match UnixStream::connect(path) {
                Ok(stream) => break stream,
                Err(cause) if start.elapsed() > PATIENCE => return Err(cause),
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        stream.set_read_timeout(Some(QUIET))?;
        let mut gdb = Self(stream);
        gdb.send("?")?;
        // The stub may tell twice that the processor stands still.
        while gdb.answer().is_ok() {}
        gdb.0.set_read_timeout(Some(PATIENCE))?;
        Ok(gdb)
    }

    /// Lets the processor run on.
    pub fn run(&mut self) -> io::Result<()> {
        self.send("c")
    }

    /// Stops the processor.
    pub fn stop(&mut self) -> io::Result<()> {
        self.0.write_all(&[3])?;
        self.answer().map(drop)
    }

    /// Flips bit number `bit` of the byte at `address`.
    pub fn flip(&mut self, address: u32, bit: u32) -> io::Result<()> {
        let byte = self.ask(&format!("m{address:x},1"))?;
        let byte = u8::from_str_radix(&byte, 16).map_err(|_| unexpected(&byte))?;
        let answer = self.ask(&format!("M{address:x},1:{:02x}", byte ^ (1 << bit)))?;
        if answer == "OK" { Ok(()) } else { Err(unexpected(&answer)) }
    }

    /// The word at `address`.
    pub fn word(&mut self, address: u32) -> io::Result<u32> {
        let word = self.ask(&format!("m{address:x},4"))?;
        u32::from_str_radix(&word, 16).map(u32::swap_bytes).map_err(|_| unexpected(&word))
    }

    /// Resets the machine, as the reset button does.
    pub fn reset(&mut self) -> io::Result<()> {
        let mut answer = self.ask("qRcmd,73797374656d5f7265736574")?; // `system_reset` in hexadecimal
        while answer.starts_with('O') && answer != "OK" {
            answer = self.answer()?; // what the command prints
        }
        if answer == "OK" { Ok(()) } else { Err(unexpected(&answer)) }
    }

    fn ask(&mut self, command: &str) -> io::Result<String> {
        self.send(command)?;
        self.answer()
    }

    fn send(&mut self, command: &str) -> io::Result<()> {
        let sum = command.bytes().fold(0_u8, u8::wrapping_add);
        self.0.write_all(format!("${command}#{sum:02x}").as_bytes())
    }

    /// The text of the next packet.
    fn answer(&mut self) -> io::Result<String> {
        while self.byte()? != b'$' {}
        let mut text = String::new();
        loop {
            match self.byte()? {
                b'#' => break,
                byte => text.push(char::from(byte)),
            }
        }
        let _sum = [self.byte()?, self.byte()?];
        self.0.write_all(b"+")?;
        Ok(text)
    }

    fn byte(&mut self) -> io::Result<u8> {
        let mut byte = [0];
        self.0.read_exact(&mut byte)?;
        Ok(byte[0])
    }
}

fn unexpected(answer: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, format!("its debugger stub answers {answer:?}"))
}
