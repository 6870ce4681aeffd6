//! Instructions of the C code on a Cortex-M4F, counted in QEMU, beside what Taxel's own routines take.

use std::fs;
use std::io::BufReader;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::Duration;

use object::{Object, ObjectSymbol};
use taxel_learn::cost::{Cost, Design};

use super::build::{ARM, Build, machine, object_for_m0_plus};
use super::frames;
use super::models::Model;
use crate::cycles::trace::{self, Marks};
use crate::emulate::qemu::{reader, wait};
use crate::process::{Outcome, two_at_a_time};

/// Frames that are counted, and the time limit of a run.
const COUNTED: usize = 3;
const LIMIT: Duration = Duration::from_mins(5);

/// Most instructions of fixed16 in C for one of the assembly's.
const MOST_OF_FIXED16: f64 = 2.0;

/// Cost of the C code of a model.
struct Measured {
    instructions: u64,
    /// Bytes of code and of constants.
    flash: [u64; 2],
    /// Bytes of code on a Cortex-M0+, without the compiler's routines for floats.
    m0_plus_code: u64,
}

/// Prints what a frame of each model costs, as the way of `build` compiles it.
pub fn print(models: &[Model], folder: &Path, build: &Build) -> Outcome {
    let measured =
        two_at_a_time(models, |model| measure(model, &folder.join(model.name()), build))?;
    println!("\nA frame on a Cortex-M4F, by {}:\n", build.name());
    println!(
        "| model | instructions in C | of the firmware | times | code | on a Cortex-M0+ | constants |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|");
    let mut failed = Vec::new();
    for (model, measured) in models.iter().zip(measured) {
        let Measured { instructions, flash: [code, constants], m0_plus_code } = measured?;
        let own = Cost::of_frame(&Design::new(&model.blob)).instructions;
        let times = instructions as f64 / own as f64;
        println!(
            "| {} | {instructions} | {own} | {times:.2} | {code} | {m0_plus_code} | {constants} |",
            model.name()
        );
        if model.format == taxel_core::rbf::Format::Fixed16 && times > MOST_OF_FIXED16 {
            failed.push(format!("{}: {times:.2} times the instructions", model.name()));
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

fn measure(model: &Model, folder: &Path, build: &Build) -> Outcome<Measured> {
    let program = build.program(folder)?;
    let path = folder.join("counted.bin");
    frames::write(model, COUNTED, false, &path)?;
    let mut command = machine(&program, &path);
    command.args(["-d", "exec,nochain,in_asm"]);
    let marks = marks(&program)?;
    let mut child = command.spawn().map_err(|cause| format!("cannot start QEMU: {cause}"))?;
    let said = reader(child.stdout.take());
    let trace = child.stderr.take().ok_or("QEMU has no trace")?;
    let counted = thread::scope(|scope| {
        let trace = BufReader::with_capacity(1 << 16, trace);
        let counted = scope.spawn(|| trace::count(trace, marks));
        let status = wait(&mut child, LIMIT);
        let counted = counted.join().unwrap_or_else(|_| Err("the trace's reader stopped".into()));
        status.and_then(|status| match status {
            Some(status) if status.success() => counted,
            _ => Err(String::from_utf8_lossy(&said.join().unwrap_or_default()).into_owned()),
        })
    });
    let (regions, _) = counted.map_err(|cause| format!("{}: {cause}", model.name()))?;
    // Without the call at the end.
    let instructions = regions.last().ok_or("no frame was counted")? - 1;
    let flash = sizes(&program.with_file_name("model.o"))?;
    let [m0_plus_code, _] = sizes(&object_for_m0_plus(folder)?)?;
    Ok(Measured { instructions, flash, m0_plus_code })
}

fn marks(program: &Path) -> Outcome<Marks> {
    let failed = |cause: &dyn ToString| format!("{}: {}", program.display(), cause.to_string());
    let bytes = fs::read(program).map_err(|cause| failed(&cause))?;
    let file = object::File::parse(&*bytes).map_err(|cause| failed(&cause))?;
    let address = |name: &str| {
        let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
        found.map(|it| it.address() as u32 & !1).ok_or_else(|| failed(&format!("no {name}")))
    };
    Ok(Marks { begin: address("region_begin")?, end: address("region_end")? })
}

/// Bytes of code and of constants in an object, but for the self-test, which a linker leaves out if nobody calls it.
fn sizes(object: &Path) -> Outcome<[u64; 2]> {
    let program = ARM.replace("gcc", "nm");
    let output = Command::new(&program).args(["--print-size", "--radix=d"]).arg(object).output();
    let output = output.map_err(|cause| format!("{program}: {cause}"))?;
    let mut sizes = [0; 2];
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [_, size, kind, name] = fields[..] else { continue };
        let size: u64 = size.parse().unwrap_or(0);
        match kind {
            _ if name.contains("test") => {}
            "t" | "T" => sizes[0] += size,
            "r" | "R" => sizes[1] += size,
            _ => {}
        }
    }
    Ok(sizes)
}
