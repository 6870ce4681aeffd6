//! What decoding costs on a Cortex-M4: exact instructions from QEMU, cycles by a model of the
//! processor. `docs/cycles.md` explains both, and has the figures that were accepted.

mod accepted;
mod budget;
mod code;
mod comparison;
mod cost;
mod figures;
mod machine;
mod models;
mod options;
mod regions;
mod table;
mod thumb;
mod trace;

use std::fs;
use std::path::Path;

use crate::emulate::qemu;
use crate::firmware::{BENCH, build_image};
use crate::process::{Outcome, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use accepted::Accepted;
use code::Code;
use figures::Figure;
use models::Blob;
pub use options::Options;

/// The image that is measured.
const IMAGE: &str = "qemu-bench";

/// Where the accepted figures are, and the tables that are made from them.
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
    let blobs = match options.model {
        Some(model) => models::of_file(Path::new(model), &directory)?,
        None => models::train(&directory)?,
    };
    let mut measured = Vec::new();
    for blob in &blobs {
        measured.extend(measure(&image, &code, blob)?);
    }
    let measured = chosen(in_order(measured), options)?;
    if options.json {
        print!("{}", table::json(&measured));
    } else {
        print!("{}", table::aligned(&measured));
    }
    if options.model.is_some() {
        let alike = blobs.iter().all(|blob| blob.rows_alike);
        return hold_model_to_accepted(&measured, alike, &toolchain.compiler()?, options.json);
    }
    let over_budget = budget::exceeded(&measured);
    if !over_budget.is_empty() {
        return Err(over_budget.join("; "));
    }
    if options.kernel.is_some() {
        return Ok(());
    }
    hold_to_accepted(&measured, &toolchain.compiler()?, options)
}

fn measure(image: &Path, code: &Code, blob: &Blob) -> Outcome<Vec<Figure>> {
    let path = &blob.path;
    eprintln!("measuring {}", path.display());
    let figures = machine::run(image, code, path)
        .and_then(|run| figures::of_run(&run.log, &run.counts, blob.affine))
        .map_err(|cause| format!("{}: {cause}", path.display()))?;
    if figures.is_empty() {
        return Err(format!("{}: no kernel of the image decodes it", path.display()));
    }
    Ok(figures)
}

/// Kernel by kernel as they came, and each K by K.
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

/// Those of the kernel that was asked for, or all.
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

/// Compares a model of one's own with the figures for `compiler`: what `host-sim trade` says that it costs.
fn hold_model_to_accepted(
    measured: &[Figure],
    rows_alike: bool,
    compiler: &str,
    json: bool,
) -> Outcome {
    if !rows_alike {
        eprintln!("its rows have different numbers of centres or formats: compared with nothing");
        return Ok(());
    }
    let data = fs::read_to_string(root().join(DATA)).map_err(|cause| format!("{DATA}: {cause}"))?;
    let accepted = Accepted::parse(&data).map_err(|cause| format!("{DATA}: {cause}"))?;
    let Some(accepted) = accepted.of(&accepted::in_csv(compiler)) else {
        eprintln!("{DATA} has no figures for {compiler}: compared with nothing");
        return Ok(());
    };
    let comparison = comparison::of_model(accepted, measured);
    if comparison.is_empty() {
        eprintln!("{DATA} has no figures for such a model: compared with nothing");
        return Ok(());
    }
    let table = comparison::table(&comparison);
    // With --json, objects alone stand on stdout.
    if json {
        eprint!("{table}");
    } else {
        print!("\n{table}");
    }
    let beyond = comparison::beyond(&comparison);
    if beyond.is_empty() {
        eprintln!("it costs what {DATA} says for {compiler}");
        return Ok(());
    }
    Err(format!("other than in {DATA} for {compiler}:\n  {}", beyond.join("\n  ")))
}

/// Compares with the figures for `compiler`, or writes them.
fn hold_to_accepted(measured: &[Figure], compiler: &str, options: &Options<'_>) -> Outcome {
    let of = |file: &str, cause: String| format!("{file}: {cause}");
    let read = |file: &str| {
        fs::read_to_string(root().join(file)).map_err(|cause| of(file, cause.to_string()))
    };
    let mut accepted = Accepted::parse(&read(DATA)?).map_err(|cause| of(DATA, cause))?;
    if options.accept {
        accepted.replace(compiler, measured);
        let document = read(DOCUMENT)?;
        let document = accepted.in_document(&document).map_err(|cause| of(DOCUMENT, cause))?;
        return [(DATA, accepted.data()), (DOCUMENT, document)].into_iter().try_for_each(
            |(file, text)| {
                fs::write(root().join(file), text).map_err(|cause| of(file, cause.to_string()))
            },
        );
    }
    let Some(accepted) = accepted.of(&accepted::in_csv(compiler)) else {
        eprintln!(
            "{DATA} has no figures for {compiler}: held to the budgets alone. To accept these, \
             cargo xtask cycles --accept"
        );
        return Ok(());
    };
    let differences = accepted::differences(accepted, measured);
    if differences.is_empty() {
        eprintln!("as accepted in {DATA} for {compiler}");
        Ok(())
    } else {
        Err(format!(
            "other than accepted in {DATA} for {compiler}:\n  {}\nif this is meant, cargo xtask \
             cycles --accept",
            differences.join("\n  ")
        ))
    }
}
