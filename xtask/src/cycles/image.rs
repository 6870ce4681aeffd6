//! The image that is measured: its symbols, and its runs in QEMU.

use std::fs;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use object::{Object, ObjectSymbol};

use super::figures::{self, Measured};
use super::trace::{self, Marks};
use crate::emulate::qemu::{QEMU, decode, machine, reader, wait};
use crate::process::Outcome;

/// Time limit of a run; none takes more than half a minute.
const LIMIT: Duration = Duration::from_mins(5);

/// An image whose regions are counted.
pub struct Image {
    elf: PathBuf,
    marks: Marks,
    /// First address of the slot in which the image expects a model, and the one behind it.
    slot: [u32; 2],
    /// Addresses to be traced, for QEMU's `-dfilter`. A search for readings is left out, which is most of a run.
    traced: String,
}

impl Image {
    /// Reads the symbols of the ELF file at `elf`.
    ///
    /// # Errors
    /// The file cannot be read, or lacks a symbol.
    pub fn read(elf: PathBuf) -> Outcome<Self> {
        let failed = |cause: &dyn ToString| format!("{}: {}", elf.display(), cause.to_string());
        let bytes = fs::read(&elf).map_err(|cause| failed(&cause))?;
        let file = object::File::parse(&*bytes).map_err(|cause| failed(&cause))?;
        let find = |is_meant: &dyn Fn(&str) -> bool| {
            file.symbols().find(|symbol| symbol.name().is_ok_and(is_meant))
        };
        // The lowest bit of a function's address only marks Thumb code.
        let address = |name: &str| {
            let found = find(&|other| other == name).map(|symbol| symbol.address() as u32 & !1);
            found.ok_or_else(|| failed(&format!("no symbol {name}")))
        };
        let marks = Marks {
            begin: address("region_begin")?,
            end: address("region_end")?,
            exponential: 0..0,
        };
        let slot = [address("_slot_a_start")?, address("_slot_a_end")?];
        let left_out = find(&|name| name.contains("6inputs8approach"));
        let left_out = left_out.map_or(0..0, |symbol| {
            let start = symbol.address() as u32 & !1;
            start..start + symbol.size() as u32
        });
        let traced = match left_out.start.checked_sub(1) {
            Some(last) => format!("0x0..{last:#x},{:#x}..{:#x}", left_out.end, u32::MAX),
            None => format!("0x0..{:#x}", u32::MAX),
        };
        Ok(Self { elf, marks, slot, traced })
    }

    /// Runs the image with the blob `model` in its slot, and returns what it measured.
    ///
    /// # Errors
    /// The image does not run to its end, an instruction has no known cost, or the image fails; then its log.
    pub fn run(&self, model: &Path) -> Outcome<Vec<Measured>> {
        self.measure(model).map_err(|cause| format!("{}: {cause}", model.display()))
    }

    fn measure(&self, model: &Path) -> Outcome<Vec<Measured>> {
        let [start, end] = self.slot;
        let (length, room) = (model.metadata().map_err(|it| it.to_string())?.len(), end - start);
        if length > room.into() {
            return Err(format!("{length} bytes; the image's slot has room for {room}"));
        }
        let mut command = machine(&self.elf);
        command.args(["-d", "exec,nochain,in_asm", "-dfilter", &self.traced]);
        // QEMU reads a comma as the end of an option unless it is doubled.
        let path = model.display().to_string().replace(',', ",,");
        command.arg("-device").arg(format!("loader,file={path},addr={start:#x},force-raw=on"));
        let mut child = command.spawn().map_err(|cause| format!("cannot start {QEMU}: {cause}"))?;
        let logged = reader(child.stdout.take());
        let trace = child.stderr.take().ok_or_else(|| format!("{QEMU} has no trace"))?;
        let (status, traced) = thread::scope(|scope| {
            let trace = BufReader::with_capacity(1 << 16, trace);
            let traced = scope.spawn(|| trace::count(trace, self.marks.clone()));
            let status = wait(&mut child, LIMIT);
            (status, traced.join().unwrap_or_else(|_| Err("the trace's reader stopped".into())))
        });
        let logged = logged.join().map_err(|_| format!("cannot read what {QEMU} writes"))?;
        let log = decode(&logged, &self.elf)?;
        let (counts, complaints) = traced?;
        eprint!("{complaints}");
        match status?.and_then(|status| status.code()) {
            Some(0) => figures::measured(&log, &counts),
            Some(_) => Err(format!("the image failed; it logged\n{log}")),
            None => Err(format!("no end within {} s; it logged\n{log}", LIMIT.as_secs())),
        }
    }
}
