//! What can go wrong with a device or an emulator, as values that a program can match.

use std::path::PathBuf;
use std::time::Duration;

use firmware::link::message::{ModelFault, Refusal};

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure to reach a device, to make it do something, or to start an emulator.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The line failed.
    #[error("the line to the device failed: {0}")]
    Line(#[from] std::io::Error),
    /// The other end closed the line.
    #[error("the device closed the line")]
    Closed,
    /// A serial port cannot be opened.
    #[error("{port}: {cause}; {known} (on Linux you may have to join the group dialout)")]
    Port {
        /// Name of the port.
        port: String,
        /// Why.
        cause: serialport::Error,
        /// The ports that there are.
        known: String,
    },
    /// A request is longer than any device takes.
    #[error("a request longer than {most_bytes} bytes")]
    RequestTooLong {
        /// Longest request.
        most_bytes: usize,
    },
    /// The device does not answer.
    #[error("the device does not answer ({attempts} attempts, {} ms each); check that it runs this project's firmware, and the speed of its line", timeout.as_millis())]
    NoAnswer {
        /// How often it was asked.
        attempts: u32,
        /// How long an answer was waited for.
        timeout: Duration,
    },
    /// The device stops answering or reporting in the middle of its work.
    #[error("{0}")]
    Silent(String),
    /// The device answers something that is no answer to the request.
    #[error("the device answers {request} with {answer}")]
    Unexpected {
        /// What it was asked for.
        request: String,
        /// What it said.
        answer: String,
    },
    /// The device refused a request.
    #[error("the device refused: {}", why(.0))]
    Refused(Refusal),
    /// The model that the device says it put in force is not in force.
    #[error("the device committed model {committed:08x}, but has {in_force} in force")]
    NotInForce {
        /// CRC-32 of the model that it committed.
        committed: u32,
        /// What it says is in force.
        in_force: String,
    },
    /// Device and model do not have the same shape.
    #[error(
        "the device is for {device:?} rows, columns and outputs a row, the model for {model:?}"
    )]
    ShapeMismatch {
        /// Rows, columns and outputs a row of the device.
        device: [usize; 3],
        /// Rows, columns and outputs a row of the model.
        model: [usize; 3],
    },
    /// The device decodes with an exponential that the host does not know.
    #[error("the device decodes with {0:?}, which this host does not know")]
    UnknownExponential(String),
    /// The image's readout has other parts than a world asks for.
    #[error(
        "the image's readout has not what readout.{field} says; set it to {only:?}, or leave it out"
    )]
    OtherReadout {
        /// The part.
        field: &'static str,
        /// What the image has.
        only: &'static str,
    },
    /// The emulator's program is missing.
    #[error("{}: there is no such program; on Debian: apt-get install qemu-system-arm", qemu.display())]
    NoQemu {
        /// The program, by name or path.
        qemu: PathBuf,
    },
    /// The emulator does not start.
    #[error("{}: the emulator does not start: {cause}", qemu.display())]
    NoStart {
        /// The program, by name or path.
        qemu: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The file of a mailbox cannot be made.
    #[error("cannot make the mailbox {}: {cause}", path.display())]
    Mailbox {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The image cannot be read.
    #[error("{}: {cause}; `cargo xtask firmware` builds it, below CARGO_TARGET_DIR if that is set", image.display())]
    NoImage {
        /// The image.
        image: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The image is no program.
    #[error("{}: it is no ELF file; the application's is `qemu-app`", image.display())]
    NotElf {
        /// The image.
        image: PathBuf,
    },
    /// The virtual board at the end of the readout's line failed.
    #[error(transparent)]
    Board(#[from] taxel_simulate::Error),
    /// A model for the check could not be trained.
    #[error(transparent)]
    Model(#[from] taxel_learn::Error),
    /// A setting cannot be used.
    #[error(transparent)]
    Setting(#[from] taxel_data::BadValue),
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] taxel_data::Error),
}

/// A refusal in words.
fn why(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Version(version) => format!("it speaks version {version} of the protocol"),
        Refusal::Unknown => "it does not know the request".into(),
        Refusal::FrameLength { expected } => format!("a frame of it has {expected} readings"),
        Refusal::Configuration(field) => format!("{field:?} of the configuration is out of range"),
        Refusal::Baseline => "it scans nothing, or another baseline was asked for".into(),
        Refusal::TooLarge { slot_bytes } => format!("a model may have {slot_bytes} bytes at most"),
        Refusal::NoUpload => "no upload has begun".into(),
        Refusal::OutOfPlace { received } => format!("it has {received} bytes of the upload so far"),
        Refusal::BadModel(ModelFault::Shape) => "the model is for a sensor of another shape".into(),
        Refusal::BadModel(fault) => {
            format!("the model is unsound ({fault:?}); `inspect` tells more")
        }
        Refusal::Flash => "its flash could not be written".into(),
    }
}
