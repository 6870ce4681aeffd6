//! Cost of decoding on a Cortex-M4: exact instructions from QEMU, and cycles by a model of the processor.
//!
//! A *kernel*, as in the column of `firmware/cycles.csv`, is one way to decode: a number format, with another
//! exponential than the default if its name ends with one, or its compiled twin (portable Rust instead of
//! assembly) if it ends with `-portable`. `docs/cycles.md` explains all this, and has the accepted figures.

mod options;

mod training;

mod models;
mod synthetic;

mod designs;

mod thumb;

mod code;
mod cost;
mod flash;
mod untraced;

mod loops;

mod regions;

mod figures;
mod trace;

mod budget;
mod machine;
mod table;

mod shapes;
mod ranks;
mod confidence;
mod equations;
mod predicted;
mod fit;

mod accepted;

mod prices;

use std::fs;
use std::path::Path;

use rayon::prelude::*;
use taxel_learn::ModelBlob;
use taxel_learn::cost::Design;

use crate::emulate::qemu;
use crate::firmware::{BENCH, build_image};
use crate::process::{Outcome, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use accepted::{Accepted, Excess, Reference};
use code::Code;
use figures::{Figure, Scope};
use loops::Loop;
use models::Blob;
pub use options::Options;
use options::Table;
pub use regions::Count as Counted;

/// Name of the image that is measured.
const IMAGE: &str = "qemu-bench";

/// Files of the accepted figures, and of the tables that are made from them.
const DATA: &str = "firmware/cycles.csv";
const DOCUMENT: &str = "docs/cycles.md";

/// Measures, prints, and compares with budgets and accepted figures.
pub fn run(options: &Options<'_>) -> Outcome {
    if let Some(model) = options.model.filter(|model| !Path::new(model).is_file()) {
        return Err(format!("--model {model}: there is no such file"));
    }
    qemu::present()?;
    let toolchain = Toolchain::find()?;
    build_image(&toolchain, BENCH)?;
    let image = elf(IMAGE);
    let code = Code::read(&image)?;
    let directory = target_dir().join("cycles");
    match options.table {
        Some(Table::Shapes) => {
            let measured = shapes::measure(&image, &code, &directory)?;
            print!("{}", shapes::markdown(&measured));
            return shapes::held(&measured);
        }
        Some(Table::Ranks) => {
            let measured = ranks::measure(&image, &code, &directory)?;
            print!("{}", ranks::markdown(&measured));
            return ranks::held(&measured);
        }
        Some(Table::Confidence) => {
            let measured = confidence::measure(&image, &code, &directory)?;
            print!("{}", confidence::markdown(&measured));
            return confidence::held(&measured);
        }
        None => (),
    }
    if let Some(model) = options.model {
        return measure_model(Path::new(model), &image, &code, &toolchain.compiler()?, options);
    }
    let blobs = models::train(&directory, options.kernel)?;
    // Images are measured on all cores at once, since QEMU runs an image on one.
    let measured: Vec<(Vec<Figure>, Vec<Loop>)> =
        blobs.par_iter().map(|blob| measure(&image, &code, blob)).collect::<Outcome<_>>()?;
    let (measured, loops): (Vec<_>, Vec<_>) = measured.into_iter().unzip();
    let (measured, loops) = (chosen(in_order(measured.concat()), options)?, loops.concat());
    if options.json {
        print!("{}", table::json(&measured));
    } else {
        print!("{}", table::aligned(&measured));
    }
    let over_budget = budget::exceeded(&measured);
    if !over_budget.is_empty() {
        return Err(over_budget.join("; "));
    }
    if options.kernel.is_some() {
        return Ok(());
    }
    shapes::held(&shapes::measure(&image, &code, &directory)?)?;
    ranks::held(&ranks::measure(&image, &code, &directory)?)?;
    confidence::held(&confidence::measure(&image, &code, &directory)?)?;
    let compiler = toolchain.compiler()?;
    if options.accept {
        prices::accept(&image, &code, &directory, &compiler)?;
    }
    hold_to_accepted(&measured, &compiler, options)?;
    let (checked, others) = prices::check(&image, &code, &directory, &compiler)?;
    // With --json, stdout has the objects only.
    eprintln!("{checked}");
    eprint!("{}", loops::largest(&code, &[loops, others].concat())?);
    Ok(())
}

fn measure(image: &Path, code: &Code, blob: &Blob) -> Outcome<(Vec<Figure>, Vec<Loop>)> {
    let path = &blob.path;
    eprintln!("measuring {}", path.display());
    let (figures, loops) = machine::run(image, code, path)
        .and_then(|run| Ok((figures::of_run(&run.log, &run.counts, blob.affine)?, run.loops)))
        .map_err(|cause| format!("{}: {cause}", path.display()))?;
    if figures.is_empty() {
        return Err(format!("{}: no kernel of the image decodes it", path.display()));
    }
    Ok((figures, loops))
}

/// Sorts figures by kernel, in the order of their first appearance, and then by K.
fn in_order(mut figures: Vec<Figure>) -> Vec<Figure> {
    let mut order: Vec<String> = Vec::new();
    for figure in &figures {
        if !order.contains(&figure.kernel) {
            order.push(figure.kernel.clone());
        }
    }
    let place = |figure: &Figure| order.iter().position(|kernel| *kernel == figure.kernel);
    figures.sort_by_key(|figure| (place(figure), figure.centres));
    figures
}

/// The figures of the kernel that was asked for, or all.
fn chosen(figures: Vec<Figure>, options: &Options<'_>) -> Outcome<Vec<Figure>> {
    let Some(kernel) = options.kernel else { return Ok(figures) };
    let (chosen, others): (Vec<_>, Vec<_>) =
        figures.into_iter().partition(|figure| figure.kernel == kernel);
    if chosen.is_empty() {
        let mut others: Vec<_> = others.into_iter().map(|figure| figure.kernel).collect();
        others.dedup();
        return Err(format!("--kernel {kernel}: measured were {}", others.join(", ")));
    }
    Ok(chosen)
}

/// Measures frames of a user's own model, and prints what they cost beside what is predicted of them.
fn measure_model(
    path: &Path,
    image: &Path,
    code: &Code,
    compiler: &str,
    options: &Options<'_>,
) -> Outcome {
    let blob = ModelBlob::read(path).map_err(|cause| cause.to_string())?;
    let design = Design::of(&blob);
    let (mut frames, _) = predicted::measure(&design, path, image, code)?;
    if frames.iter().all(|frame| matches!(frame.scope, Scope::Frame | Scope::ArrayFrame)) {
        eprintln!(
            "note: no frame behind a gate was measured: a gate compares relative to readings at rest, and needs a \
             training range that reaches above 0 in every input"
        );
    }
    if let Some(kernel) = options.kernel {
        frames.retain(|frame| frame.kernel == kernel);
        if frames.is_empty() {
            return Err(format!("--kernel {kernel}: the model is not made for it"));
        }
    }
    prices::compare_model(&frames, compiler, options.json)
}

/// Predicted and counted cost of a frame of the model at `path`, which has this `design`, without a gate and with all
/// weights in RAM.
pub fn frame_of(design: &Design, path: &Path) -> Outcome<[Counted; 2]> {
    let image = elf(IMAGE);
    let code = Code::read(&image)?;
    let (frames, _) = predicted::measure(design, path, &image, &code)?;
    let predicted = prices::predicted(&frames, &Toolchain::find()?.compiler()?)?;
    let first = predicted.first().zip(frames.first()).ok_or("no frame was measured")?;
    Ok([*first.0, first.1.whole])
}

/// Compares figures with the accepted ones, or writes them as accepted.
fn hold_to_accepted(measured: &[Figure], compiler: &str, options: &Options<'_>) -> Outcome {
    let of = |file: &str, cause: String| format!("{file}: {cause}");
    let mut accepted = Accepted::parse(&read(DATA)?).map_err(|cause| of(DATA, cause))?;
    if options.accept {
        accepted.replace(compiler, measured);
        let document = read(DOCUMENT)?;
        let document = accepted.in_document(&document).map_err(|cause| of(DOCUMENT, cause))?;
        for (file, text) in [(DATA, accepted.data()), (DOCUMENT, document)] {
            fs::write(root().join(file), text).map_err(|cause| of(file, cause.to_string()))?;
        }
        return Ok(());
    }
    let Some(reference) = accepted.reference(compiler) else {
        eprintln!(
            "{DATA} has no figures: held to the budgets alone. To accept these, cargo xtask cycles \
             --accept"
        );
        return Ok(());
    };
    say_if_others(&reference, compiler, measured);
    let differences = accepted::differences(&reference, measured);
    if differences.is_empty() {
        let exactly = if reference.is_own { "as accepted" } else { "within what was accepted" };
        eprintln!("{exactly} in {DATA} for {}", reference.compiler);
        Ok(())
    } else {
        Err(format!(
            "other than accepted in {DATA} for {}:\n  {}\nif this is meant, cargo xtask \
             cycles --accept",
            reference.compiler,
            differences.join("\n  ")
        ))
    }
}

/// Prints how figures are compared for a compiler that has no accepted ones.
fn say_if_others(reference: &Reference<'_>, compiler: &str, measured: &[Figure]) {
    if reference.is_own {
        return;
    }
    let others = &reference.compiler;
    eprintln!("{DATA} is exact for {others} alone; the compiler in use is {compiler}");
    for excess in [accepted::EXCESS, accepted::FLASH_EXCESS] {
        let [least, most] = accepted::range_percent(reference, measured, &excess);
        let Excess { what, percent, .. } = excess;
        eprintln!(
            "its {what} differ by {least:+.1} % to {most:+.1} %, at most +{percent} % is allowed"
        );
    }
}

fn read(file: &str) -> Outcome<String> {
    fs::read_to_string(root().join(file)).map_err(|cause| format!("{file}: {cause}"))
}
