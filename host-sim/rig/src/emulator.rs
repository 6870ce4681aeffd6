//! Emulated device: the firmware's image in QEMU's mps2-an386, a Cortex-M4F, with its link
//! connected.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::device::Wire;
use crate::error::{Error, Result};
use crate::mailbox::{FILE_BYTES, Mailbox};

/// QEMU's program, which PATH finds.
const QEMU: &str = "qemu-system-arm";
/// Address at which the image expects its first model slot.
const SLOT_ADDRESS: u32 = 0x0020_0000;
/// Longest time that QEMU may take to start.
const START: Duration = Duration::from_secs(20);

/// Options of the emulator.
#[derive(Debug, Clone)]
pub struct Options {
    /// Path of the image, an ELF file.
    pub image: PathBuf,
    /// Path of a blob that lies in the first slot from the start.
    pub model: Option<PathBuf>,
    /// Path for the image's log, in defmt's encoding; no log if not given.
    pub log: Option<PathBuf>,
    /// Path for the file of a mailbox while the emulator runs; without it the link is on the first UART.
    pub mailbox: Option<PathBuf>,
}

impl Options {
    /// Checks that [`Emulator::start`] can find an image, before long work.
    ///
    /// # Errors
    /// [`Error::Data`] for an image that cannot be read, or is no program.
    pub fn check(&self) -> Result<()> {
        let image = self.image.display();
        let unfit = |says: String| Err(Error::unfit_for("image", format!("{image}: {says}")));
        let not_elf = || unfit("it is no ELF file; the application's is `qemu-app`".into());
        // A named pipe would be waited for.
        if self.image.exists() && !self.image.is_file() {
            return not_elf();
        }
        let mut magic = [0; 4];
        let opened = File::open(&self.image).and_then(|mut file| file.read_exact(&mut magic));
        match opened {
            Ok(()) if magic == *b"\x7FELF" => Ok(()),
            Ok(()) => not_elf(),
            Err(cause) => unfit(format!(
                "{cause}; `cargo xtask firmware` builds it, below CARGO_TARGET_DIR if that is set"
            )),
        }
    }
}

/// Line that carries the link.
#[derive(Debug)]
pub enum Link {
    /// Mailbox in shared memory.
    Mailbox {
        /// Mailbox that carries the bytes.
        mailbox: Mailbox,
        /// First UART, which is silent, and closed when the emulator ends.
        uart: TcpStream,
    },
    /// First UART.
    Uart(TcpStream),
}

impl Read for Link {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Mailbox { mailbox, uart } => match mailbox.read(bytes) {
                Err(cause) if cause.kind() == ErrorKind::TimedOut && is_closed(uart) => Ok(0),
                outcome => outcome,
            },
            Self::Uart(uart) => uart.read(bytes),
        }
    }
}

impl Write for Link {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Mailbox { mailbox, uart } => match mailbox.write(bytes) {
                Err(cause) if cause.kind() == ErrorKind::TimedOut && is_closed(uart) => {
                    Err(ErrorKind::BrokenPipe.into())
                }
                outcome => outcome,
            },
            Self::Uart(uart) => uart.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Mailbox { mailbox, .. } => mailbox.flush(),
            Self::Uart(uart) => uart.flush(),
        }
    }
}

impl Wire for Link {
    fn set_read_timeout(&mut self, timeout: Duration) -> io::Result<()> {
        match self {
            Self::Mailbox { mailbox, .. } => mailbox.set_read_timeout(timeout),
            Self::Uart(uart) => Wire::set_read_timeout(uart, timeout),
        }
    }
}

/// Whether the other end of a non-blocking socket is closed.
fn is_closed(stream: &TcpStream) -> bool {
    match stream.peek(&mut [0]) {
        Ok(count) => count == 0,
        Err(cause) => cause.kind() != ErrorKind::WouldBlock,
    }
}

/// Running emulator; it ends when this value is dropped.
#[derive(Debug)]
pub struct Emulator {
    child: Child,
    _shared: Option<SharedFile>,
}

/// File of a mailbox, removed when this value is dropped.
#[derive(Debug)]
struct SharedFile(PathBuf);

impl Drop for SharedFile {
    fn drop(&mut self) {
        // The file may have been removed already.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Emulator {
    /// Starts QEMU and connects to the image's link.
    ///
    /// # Errors
    /// [`Error::Data`] if a file is missing or wrong, if that of the mailbox cannot be made, or if QEMU does not start.
    pub fn start(options: &Options) -> Result<(Self, Link)> {
        options.check()?;
        let failed = |cause: std::io::Error| {
            Error::failed(format!("{QEMU}: the emulator does not start: {cause}"))
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let mut command = Command::new(QEMU);
        let mailbox = options.mailbox.as_deref().map(create_mailbox).transpose()?;
        let shared = options.mailbox.clone().map(SharedFile);
        command.args(machine(options.mailbox.as_deref()));
        command.args(["-cpu", "cortex-m4", "-display", "none"]);
        command.args(["-monitor", "none", "-semihosting-config", "enable=on,target=native"]);
        command.args(["-serial", &format!("tcp:127.0.0.1:{port},nodelay=on")]);
        if let Some(model) = &options.model {
            let path = escaped(model);
            let place = format!("loader,file={path},addr={SLOT_ADDRESS:#x},force-raw=on");
            command.arg("-device").arg(place);
        }
        command.arg("-kernel").arg(&options.image).stdin(Stdio::null()).stdout(
            match &options.log {
                Some(path) => {
                    let file = File::create(path);
                    file.map_err(|cause| taxel_data::Error::write(path, cause))?.into()
                }
                None => Stdio::null(),
            },
        );
        let child = command.spawn().map_err(|cause| {
            if cause.kind() == ErrorKind::NotFound {
                let says = "there is no such program; on Debian: apt-get install qemu-system-arm";
                return Error::unfit_for("qemu", format!("{QEMU}: {says}"));
            }
            failed(cause)
        })?;
        let mut emulator = Self { child, _shared: shared };
        let uart = accept(&listener, &mut emulator.child).map_err(failed)?;
        let link = match mailbox {
            Some(mailbox) => {
                uart.set_nonblocking(true).map_err(failed)?;
                Link::Mailbox { mailbox, uart }
            }
            None => Link::Uart(uart),
        };
        Ok((emulator, link))
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // QEMU may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn create_mailbox(path: &Path) -> Result<Mailbox> {
    Mailbox::create(path).map_err(|cause| {
        Error::failed(format!("cannot make the mailbox {}: {cause}", path.display()))
    })
}

/// Arguments that choose the machine, with its PSRAM in the file at `mailbox` if that is given.
fn machine(mailbox: Option<&Path>) -> Vec<String> {
    let Some(path) = mailbox else { return ["-M", "mps2-an386"].map(String::from).to_vec() };
    let file = format!("mem-path={},share=on", escaped(path));
    let memory = format!("memory-backend-file,id=psram,size={FILE_BYTES},{file}");
    ["-M", "mps2-an386,memory-backend=psram", "-object", &memory].map(String::from).to_vec()
}

/// Path as QEMU's options need it: a comma would end an option unless it is doubled.
fn escaped(path: &Path) -> String {
    path.display().to_string().replace(',', ",,")
}

fn accept(listener: &TcpListener, child: &mut Child) -> std::io::Result<TcpStream> {
    listener.set_nonblocking(true)?;
    let deadline = Instant::now() + START;
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(cause) if cause.kind() == ErrorKind::WouldBlock => {}
            Err(cause) => return Err(cause),
        }
        if let Some(status) = child.try_wait()? {
            return Err(std::io::Error::other(format!("it ended with {status}")));
        }
        if Instant::now() > deadline {
            return Err(std::io::Error::other("QEMU does not connect"));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}
