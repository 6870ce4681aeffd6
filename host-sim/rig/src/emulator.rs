//! Emulated device: the firmware's image in QEMU's mps2-an386, a Cortex-M4F, with its link
//! connected.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::device::Wire;
use crate::error::{Error, Result};
use crate::mailbox::{FILE_BYTES, Mailbox};

/// QEMU's program, which PATH finds.
const QEMU: &str = "qemu-system-arm";
/// Address at which the image expects its first model slot.
const SLOT_ADDRESS: u32 = 0x0020_0000;

/// Options of the emulator.
#[derive(Debug, Clone)]
pub struct Options {
    /// Path of the image, an ELF file.
    pub image: PathBuf,
    /// Path of a blob that lies in the first slot from the start.
    pub model: Option<PathBuf>,
    /// Path for the image's log, in defmt's encoding; no log if not given.
    pub log: Option<PathBuf>,
    /// Path for a new file, which holds the mailbox that carries the link.
    pub mailbox: PathBuf,
}

impl Options {
    /// Checks that [`Emulator::start`] can find an image, before long work.
    ///
    /// # Errors
    /// [`Error::Data`] for an image that cannot be read, or is no program.
    pub fn check(&self) -> Result<()> {
        let image = self.image.display();
        let unfit = |says: String| Err(Error::unfit_for("image", format!("{image}: {says}")));
        let not_elf = || unfit("it is not an ELF file; the application's is `qemu-app`".into());
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
                "{cause}; `cargo xtask firmware qemu-app` builds it, below CARGO_TARGET_DIR if that is set"
            )),
        }
    }
}

/// Running emulator, and its link; it ends when this value is dropped.
#[derive(Debug)]
pub struct Emulator {
    child: Child,
    mailbox: Mailbox,
}

impl Emulator {
    /// Starts QEMU with a mailbox for the image's link.
    ///
    /// # Errors
    /// [`Error::Data`] if a file is missing or wrong, if that of the mailbox cannot be made, or if QEMU does not start.
    pub fn start(options: &Options) -> Result<Self> {
        options.check()?;
        let mailbox = Mailbox::create(&options.mailbox).map_err(|cause| {
            let path = options.mailbox.display();
            Error::failed(format!("cannot make the mailbox {path}: {cause}"))
        })?;
        let mut command = Command::new(QEMU);
        command.args(["-M", "mps2-an386,memory-backend=psram", "-object"]);
        let file = format!("mem-path={},share=on", escaped(&options.mailbox));
        command.arg(format!("memory-backend-file,id=psram,size={FILE_BYTES},{file}"));
        command.args(["-cpu", "cortex-m4", "-display", "none", "-serial", "none"]);
        command.args(["-monitor", "none", "-semihosting-config", "enable=on,target=native"]);
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
            Error::failed(format!("{QEMU}: the emulator does not start: {cause}"))
        })?;
        Ok(Self { child, mailbox })
    }

    /// Outcome of a transfer; one that timed out because QEMU has ended says so.
    fn unless_ended(&mut self, outcome: io::Result<usize>) -> io::Result<usize> {
        if outcome.as_ref().is_err_and(|cause| cause.kind() == ErrorKind::TimedOut)
            && let Some(status) = self.child.try_wait()?
        {
            return Err(io::Error::other(format!("{QEMU}: the emulator ended with {status}")));
        }
        outcome
    }
}

impl Read for Emulator {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let outcome = self.mailbox.read(bytes);
        self.unless_ended(outcome)
    }
}

impl Write for Emulator {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let outcome = self.mailbox.write(bytes);
        self.unless_ended(outcome)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.mailbox.flush()
    }
}

impl Wire for Emulator {
    fn set_read_timeout(&mut self, timeout: Duration) -> io::Result<()> {
        self.mailbox.set_read_timeout(timeout)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // QEMU may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Path as QEMU's options need it: a comma would end an option unless it is doubled.
fn escaped(path: &Path) -> String {
    path.display().to_string().replace(',', ",,")
}
