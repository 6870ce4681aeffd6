//! A device in QEMU that decodes what it is given, with a debugger.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use taxel_rig::device::Device;
use taxel_rig::emulator::{Emulator, Link, Options};

use super::gdb::Gdb;

/// Bytes of a slot of the emulator's image.
const SLOT_BYTES: usize = 128 * 1024;
/// Rows of the emulator's image.
pub const ROWS: usize = 8;
/// Longest time that a device takes to start.
const START: Duration = Duration::from_secs(5);

/// What a device starts with. Its files are removed at the end.
pub struct Setup {
    options: Options,
    socket: PathBuf,
}

impl Setup {
    /// The emulator's `image`, and the model `blob`.
    pub fn new(image: &Path, blob: &[u8]) -> Result<Self, String> {
        let place = std::env::temp_dir().join(format!("taxel-torture-{}", std::process::id()));
        let slot = place.with_extension("slot");
        let mut bytes = blob.to_vec();
        bytes.resize(SLOT_BYTES, 0xFF);
        std::fs::write(&slot, bytes).map_err(|cause| format!("{}: {cause}", slot.display()))?;
        let options = Options {
            qemu: "qemu-system-arm".into(),
            image: image.to_owned(),
            model: Some(slot),
            log: None,
            mailbox: Some(place.with_extension("mailbox")),
        };
        Ok(Self { options, socket: place.with_extension("gdb") })
    }
}

impl Drop for Setup {
    fn drop(&mut self) {
        // The emulator removes the mailbox's file. Files that are gone already are no loss.
        self.options.model.iter().chain([&self.socket]).for_each(|file| {
            let _ = std::fs::remove_file(file);
        });
    }
}

/// A device that runs.
pub struct Running {
    // Dropped first, so that QEMU ends.
    _emulator: Emulator,
    pub gdb: Gdb,
    pub device: Device<Link>,
}

impl Running {
    /// Starts a device.
    pub fn start(setup: &Setup) -> Result<Self, String> {
        let _ = std::fs::remove_file(&setup.socket); // of an emulator before this one
        let stub = format!("unix:{},server=on,wait=off", setup.socket.display());
        let started = Emulator::start_with(&setup.options, &["-gdb", &stub]);
        let (emulator, link) = started.map_err(|cause| cause.to_string())?;
        let mut gdb = Gdb::connect(&setup.socket)
            .map_err(|cause| format!("QEMU's debugger stub: {cause}"))?;
        gdb.run().map_err(|cause| cause.to_string())?;
        let device = Device::new(link).map_err(|cause| cause.to_string())?;
        Ok(Self { _emulator: emulator, gdb, device })
    }

    /// Whether the device answers within the time that a start takes.
    pub fn answers(&mut self) -> bool {
        let start = Instant::now();
        while self.device.identify().is_err() {
            if start.elapsed() > START {
                return false;
            }
        }
        true
    }
}
