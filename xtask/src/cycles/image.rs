//! The image whose regions are counted: its symbols, and its runs in QEMU.

use std::fs;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use object::{Object, ObjectSymbol};

use super::trace::{self, Marks};
use crate::emulate::qemu::{QEMU, decode, machine, reader, wait};
use crate::process::Outcome;

/// Time limit of a run; none takes more than half a minute.
const LIMIT: Duration = Duration::from_mins(5);

/// Regions that begin every run, and their instructions: an empty one, and a loop that was counted by hand.
const CALIBRATION: [(&str, u64); 2] = [("empty", 0), ("loop", 2001)];

/// An image whose regions are counted.
pub struct Image {
    elf: PathBuf,
    marks: Marks,
    /// First addresses of the slots in which the image expects a model and a frame.
    slots: [u32; 2],
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
        // The lowest bit of a function's address only marks Thumb code.
        let address = |name: &str| {
            let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
            let found = found.map(|symbol| symbol.address() as u32 & !1);
            found.ok_or_else(|| failed(&format!("no symbol {name}")))
        };
        let marks = Marks { begin: address("region_begin")?, end: address("region_end")? };
        let slots = [address("_slot_a_start")?, address("_slot_b_start")?];
        Ok(Self { elf, marks, slots })
    }

    /// Runs the image with the files `model` and `frame` in its slots. Returns the instructions of each region by its
    /// name.
    ///
    /// # Errors
    /// The image does not run to its end, or the image fails; then its log.
    pub fn run(&self, model: &Path, frame: &Path) -> Outcome<Vec<(String, u64)>> {
        let mut command = machine(&self.elf);
        command.args(["-d", "exec,nochain,in_asm"]);
        for (file, start) in [model, frame].into_iter().zip(self.slots) {
            // QEMU reads a comma as the end of an option unless it is doubled.
            let file = file.display().to_string().replace(',', ",,");
            command.arg("-device").arg(format!("loader,file={file},addr={start:#x},force-raw=on"));
        }
        let mut child = command.spawn().map_err(|cause| format!("cannot start {QEMU}: {cause}"))?;
        let logged = reader(child.stdout.take());
        let trace = child.stderr.take().ok_or_else(|| format!("{QEMU} has no trace"))?;
        let (status, traced) = thread::scope(|scope| {
            let trace = BufReader::with_capacity(1 << 16, trace);
            let traced = scope.spawn(|| trace::count(trace, self.marks));
            let status = wait(&mut child, LIMIT);
            (status, traced.join().unwrap_or_else(|_| Err("the trace's reader stopped".into())))
        });
        let logged = logged.join().map_err(|_| format!("cannot read what {QEMU} writes"))?;
        let log = decode(&logged, &self.elf)?;
        let (counts, complaints) = traced?;
        eprint!("{complaints}");
        match status?.and_then(|status| status.code()) {
            Some(0) => named(&log, &counts),
            Some(_) => Err(format!("{}: the image failed; it logged\n{log}", model.display())),
            None => Err(format!("no end within {} s; it logged\n{log}", LIMIT.as_secs())),
        }
    }
}

/// Joins `counts` with the regions' names in the `log`. The call at the end of each is taken off.
fn named(log: &str, counts: &[u64]) -> Outcome<Vec<(String, u64)>> {
    let names = log.lines().filter_map(|line| line.strip_prefix("INFO region "));
    let names: Vec<&str> = names.collect();
    let less = |(name, count): (&&str, &u64)| ((*name).to_owned(), count.saturating_sub(1));
    let mut regions: Vec<(String, u64)> = names.iter().zip(counts).map(less).collect();
    let known = CALIBRATION.map(|(name, count)| (name.to_owned(), count));
    if names.len() != counts.len() || !regions.starts_with(&known) {
        return Err(format!("{} regions were counted wrong: {regions:?}\n{log}", counts.len()));
    }
    Ok(regions.split_off(known.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_named_and_the_call_at_their_end_is_taken_off() {
        let log = "INFO region empty\nINFO region loop\nINFO other\nINFO region frame\n";
        assert_eq!(named(log, &[1, 2002, 11]), Ok(vec![("frame".to_owned(), 10)]));
        for wrong in [&[1, 2003, 11][..], &[2, 2002, 11], &[1, 2002], &[1, 2002, 11, 21]] {
            assert!(named(log, wrong).is_err(), "{wrong:?}");
        }
    }
}
