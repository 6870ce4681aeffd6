//! The device's image in QEMU's mps2-an386, a Cortex-M4F, with its serial line here.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// Where the image expects its first model slot.
const SLOT_ADDRESS: u32 = 0x0020_0000;
/// How long QEMU may take to start.
const START: Duration = Duration::from_secs(20);

/// How to start the emulator.
#[derive(Debug, Clone)]
pub struct Options {
    /// The program, by name or path.
    pub qemu: PathBuf,
    /// The image, an ELF file.
    pub image: PathBuf,
    /// A blob to lie in the first slot from the start.
    pub model: Option<PathBuf>,
    /// Where the image's log goes, as defmt writes it; nowhere if not given.
    pub log: Option<PathBuf>,
}

impl Options {
    /// Fails early where [`Emulator::start`] could not start.
    ///
    /// # Errors
    /// [`Error::Usage`]: the image is not there.
    pub fn check(&self) -> Result<()> {
        if self.image.is_file() {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "--image {}: there is no such file; build it with `cargo xtask firmware`",
            self.image.display()
        )))
    }
}

/// A running emulator; it ends with this value.
#[derive(Debug)]
pub struct Emulator {
    child: Child,
}

impl Emulator {
    /// Starts QEMU and connects to the image's first serial line.
    ///
    /// # Errors
    /// [`Error::Usage`] if QEMU or the image is missing, [`Error::Failed`] if it does not start.
    pub fn start(options: &Options) -> Result<(Self, TcpStream)> {
        options.check()?;
        let failed = |cause: &dyn std::fmt::Display| {
            Error::Failed(format!("the emulator does not start: {cause}"))
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(|c| failed(&c))?;
        let port = listener.local_addr().map_err(|c| failed(&c))?.port();
        let mut command = Command::new(&options.qemu);
        command.args(["-M", "mps2-an386", "-cpu", "cortex-m4", "-display", "none"]);
        command.args(["-monitor", "none", "-semihosting-config", "enable=on,target=native"]);
        command.arg("-serial").arg(format!("tcp:127.0.0.1:{port},nodelay=on"));
        if let Some(model) = &options.model {
            let path = escaped(model);
            let place = format!("loader,file={path},addr={SLOT_ADDRESS:#x},force-raw=on");
            command.arg("-device").arg(place);
        }
        command.arg("-kernel").arg(&options.image).stdin(Stdio::null()).stdout(
            match &options.log {
                Some(path) => {
                    let file = std::fs::File::create(path);
                    file.map_err(|cause| Error::write(path, cause))?.into()
                }
                None => Stdio::null(),
            },
        );
        let mut child = command.spawn().map_err(|cause| {
            if cause.kind() == ErrorKind::NotFound {
                let qemu = options.qemu.display();
                return Error::Usage(format!(
                    "--qemu {qemu}: there is no such program; on Debian: apt-get install qemu-system-arm"
                ));
            }
            failed(&cause)
        })?;
        match accept(&listener, &mut child) {
            Ok(stream) => Ok((Self { child }, stream)),
            Err(cause) => {
                let _ = child.kill();
                let _ = child.wait();
                Err(failed(&cause))
            }
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// QEMU reads a comma as the end of an option unless it is doubled.
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
            return Err(std::io::Error::other(format!("QEMU ended with {status}")));
        }
        if Instant::now() > deadline {
            return Err(std::io::Error::other("QEMU does not connect"));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}
