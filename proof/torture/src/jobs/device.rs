//! A device behind a pseudo-terminal, which answers as much as a recording needs.

use std::io::{ErrorKind, Read, Result, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use firmware::link::message::{Configuration, Identity, KeyState, Memory, Report, Request};
use firmware::link::receive::{Received, Receiver};
use firmware::link::{cobs, packet};
use model_core::blob::Floats;
use serialport::{SerialPort, TTYPort};

/// Wires of the device.
const ROWS: u8 = 2;
const COLUMNS: u8 = 3;

/// Time of a frame.
const FRAME: Duration = Duration::from_millis(1);

/// Device in a thread, which ends with this value.
pub struct Device {
    port: String,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Device {
    /// Starts a device.
    ///
    /// # Errors
    /// There is no pseudo-terminal, in words.
    pub fn start() -> std::result::Result<Self, String> {
        let told = |cause: serialport::Error| format!("no pseudo-terminal: {cause}");
        let (mut far, near) = TTYPort::pair().map_err(told)?;
        far.set_timeout(FRAME).map_err(told)?;
        let port = near.name().ok_or("the pseudo-terminal has no name")?;
        let is_over = Arc::new(AtomicBool::new(false));
        let seen = is_over.clone();
        let thread = thread::spawn(move || {
            // As long as this end is open, programs may come and go.
            let _near = near;
            Line { far, is_over: seen, scans: None }.run();
        });
        Ok(Self { port, is_over, thread: Some(thread) })
    }

    /// Name of its serial port.
    pub fn port(&self) -> &str {
        &self.port
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

struct Line {
    far: TTYPort,
    is_over: Arc<AtomicBool>,
    /// Number of the last frame, while it scans.
    scans: Option<u32>,
}

impl Line {
    fn run(&mut self) {
        let mut receiver = Receiver::new([0; 1024]);
        while !self.is_over.load(Ordering::Relaxed) {
            let mut byte = [0];
            match self.far.read(&mut byte) {
                Ok(1) => {
                    if let Some(Received::Frame(bytes)) = receiver.push(byte[0])
                        && let Ok(request) = packet::decode::<Request<'_>>(bytes)
                    {
                        self.answer(request.number, &request.body);
                    }
                }
                // Nothing came for the time of a frame.
                Err(cause) if cause.kind() == ErrorKind::TimedOut => self.scan(),
                _ => thread::sleep(FRAME),
            }
        }
    }

    fn answer(&mut self, number: u16, request: &Request<'_>) {
        let identity = Identity {
            board: "torture",
            firmware: "0",
            rows: ROWS,
            columns: COLUMNS,
            outputs: 1,
            kernel: "polynomial",
            model: None,
            model_name: "",
            slot_bytes: 1000,
            chunk_bytes: 64,
            memory: Memory::default(),
            key: KeyState::None,
            highest_version: None,
        };
        let configuration = match request {
            Request::Identify => return self.send(number, &Report::Identity(identity)),
            Request::Configure { configuration, .. } => {
                self.scans = (configuration.frame_period_us > 0).then_some(0);
                *configuration
            }
            Request::Resume => {
                self.scans = None;
                Configuration::DEFAULT
            }
            _ => Configuration::DEFAULT,
        };
        self.send(number, &Report::Configuration { configuration, lease_left_ms: 1 });
    }

    /// Sends the next frame, which is the same whoever asks.
    fn scan(&mut self) {
        let Some(frame) = self.scans.map(|last| last + 1) else { return };
        self.scans = Some(frame);
        let reading = |wire: u8| 50.0 + frame as f32 + f32::from(wire) / 8.0;
        let readings: Vec<f32> = (0..ROWS * COLUMNS).map(reading).collect();
        let (start_us, readings_ohm) = (u64::from(frame) * 1000, Floats::of(&readings));
        self.send(packet::UNASKED, &Report::Readings { frame, start_us, readings_ohm });
    }

    fn send(&mut self, number: u16, report: &Report<'_>) {
        let mut buffer = [0; 1024];
        let mut bytes = Vec::new();
        let Some(packet) = packet::encode(number, report, &mut buffer) else { return };
        cobs::encode(packet, |byte| {
            bytes.push(byte);
            true
        });
        // What nobody reads is lost, as on a wire.
        let _: Result<()> = self.far.write_all(&bytes);
    }
}
