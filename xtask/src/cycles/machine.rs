//! Running an image in QEMU, and counting the instructions of its regions.

use std::io::BufReader;
use std::path::Path;
use std::thread;
use std::time::Duration;

use super::code::Code;
use super::loops::Loop;
use super::regions::{Region, Regions, Watched};
use super::trace;
use super::untraced::{self, Untraced};
use crate::emulate::qemu::{QEMU, decode, machine, reader, table, wait};
use crate::process::Outcome;

/// Functions of the image that mark its regions (`firmware/qemu/src/bench/region.rs`).
const BEGIN: &str = "region_begin";
const END: &str = "region_end";

/// Symbols around the powers of two of `taxel_f32` (`model-core/src/cortex_m4/f32.s`).
const POWERS: [&str; 2] = ["taxel_f32_powers", "taxel_f32_powers_end"];

/// What the names of functions in assembly start with (`model-core/src/cortex_m4/*.s`).
const ASSEMBLY: [&str; 2] = ["taxel_", "f32_"];

/// Symbols around the slot in which the image expects a model.
const SLOT: [&str; 2] = ["_slot_a_start", "_slot_a_end"];

/// Time limit of a run; none takes more than half a minute.
const LIMIT: Duration = Duration::from_mins(5);

/// Result of running a program.
pub struct Run {
    /// Counts of the program's regions, in their order.
    pub counts: Vec<Region>,
    /// Loops that ran in the regions.
    pub loops: Vec<Loop>,
    pub log: String,
}

/// Runs the image in `elf`, whose code is `code`, with the blob `model` in its first slot.
pub fn run(elf: &Path, code: &Code, model: &Path) -> Outcome<Run> {
    let [start, end] = SLOT.map(|symbol| code.symbol(symbol));
    let (start, room) = (start?, end? - code.symbol(SLOT[0])?);
    let length = model.metadata().map_err(|cause| cause.to_string())?.len();
    if length > room.into() {
        return Err(format!("{length} bytes; the image's slot has room for {room}"));
    }
    let (begin, end) = (code.symbol(BEGIN)?, code.symbol(END)?);
    let in_assembly = |name: &str| ASSEMBLY.iter().any(|start| name.starts_with(start));
    let assembly = code.functions().filter(|(name, _)| in_assembly(name)).map(|(_, range)| range);
    let watched = Watched {
        exponential: code.symbol(POWERS[0])?..code.symbol(POWERS[1])?,
        assembly: assembly.filter(|range| !range.is_empty()).collect(),
    };
    let table = table(elf)?;

    let mut command = machine(elf);
    let untraced = Untraced::of(code, &untraced::FUNCTIONS);
    command.args(["-d", "exec,nochain,in_asm", "-dfilter", &untraced.ranges_of_others()]);
    // QEMU reads a comma as the end of an option unless it is doubled.
    let path = model.display().to_string().replace(',', ",,");
    command.arg("-device").arg(format!("loader,file={path},addr={start:#x},force-raw=on"));
    let mut child = command.spawn().map_err(|cause| format!("cannot start {QEMU}: {cause}"))?;
    let logged = reader(child.stdout.take());
    let trace = child.stderr.take();
    let (status, traced) = thread::scope(|scope| {
        let traced = scope.spawn(|| {
            let trace = trace.ok_or_else(|| format!("{QEMU} has no trace"))?;
            let regions = Regions::new(code, begin, end).watching(watched);
            let mut regions = regions.without(untraced);
            let complaints = trace::follow(BufReader::with_capacity(1 << 16, trace), &mut regions)?;
            let loops = regions.loops();
            Ok::<_, String>((complaints, regions.finish(), loops))
        });
        let status = wait(&mut child, LIMIT);
        (status, traced.join().unwrap_or_else(|_| Err("the trace's reader stopped".to_owned())))
    });
    let logged = logged.join().map_err(|_| format!("cannot read what {QEMU} writes"))?;
    let log = decode(&table, &logged);
    let (complaints, counts, loops) = traced?;
    eprint!("{complaints}");
    match status?.and_then(|status| status.code()) {
        Some(0) => Ok(Run { counts: counts?, loops, log }),
        Some(_) => Err(format!("the image failed; it logged\n{log}")),
        None => Err(format!(
            "the image did not end by itself within {} s; it logged\n{log}",
            LIMIT.as_secs()
        )),
    }
}
