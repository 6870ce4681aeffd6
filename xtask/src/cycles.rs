//! What decoding costs on a Cortex-M4: exact instructions from QEMU, cycles by a model of the
//! processor. `docs/cycles.md` explains both, and holds the figures that were accepted.

mod accepted;
mod budget;
mod code;
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
use crate::firmware::{QEMU, build_image};
use crate::process::{Outcome, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use code::Code;
use figures::Figures;
pub use options::Options;

/// The image that is measured.
const IMAGE: &str = "qemu-bench";

/// Where the accepted figures are.
const DOCUMENT: &str = "docs/cycles.md";

/// Measures, prints, and compares with budgets and accepted figures.
pub fn run(options: &Options<'_>) -> Outcome {
    if let Some(model) = options.model.filter(|model| !Path::new(model).is_file()) {
        return Err(format!("--model {model}: there is no such file"));
    }
    qemu::present()?;
    let toolchain = Toolchain::find()?;
    build_image(&toolchain, QEMU)?;
    let image = elf(IMAGE);
    let code = Code::read(&image)?;
    if let Some(model) = options.model {
        let figures = chosen(measure(&image, &code, Path::new(model))?, options)?;
        print(&figures, options);
        return Ok(());
    }

    let mut measured = Vec::new();
    for model in models::write(&target_dir().join("cycles"))? {
        measured.extend(measure(&image, &code, &model)?);
    }
    // Kernel by kernel, each in the order of K.
    let mut order: Vec<String> = Vec::new();
    for figures in &measured {
        if !order.contains(&figures.kernel) {
            order.push(figures.kernel.clone());
        }
    }
    measured.sort_by_key(|figures| order.iter().position(|kernel| *kernel == figures.kernel));
    let everything = options.kernel.is_none();
    let measured = chosen(measured, options)?;
    print(&measured, options);
    let over_budget = budget::exceeded(&measured);
    if !over_budget.is_empty() {
        return Err(over_budget.join("; "));
    }
    if everything { hold_to_accepted(&measured, &toolchain.compiler()?, options) } else { Ok(()) }
}

fn measure(image: &Path, code: &Code, model: &Path) -> Outcome<Vec<Figures>> {
    eprintln!("measuring {}", model.display());
    let figures = machine::run(image, code, model)
        .and_then(|run| figures::of_run(&run.log, &run.counts))
        .map_err(|cause| format!("{}: {cause}", model.display()))?;
    if figures.is_empty() {
        return Err(format!("{}: no kernel of the image decodes it", model.display()));
    }
    Ok(figures)
}

/// Those of the kernel that was asked for, or all.
fn chosen(figures: Vec<Figures>, options: &Options<'_>) -> Outcome<Vec<Figures>> {
    let Some(kernel) = options.kernel else { return Ok(figures) };
    let (chosen, others): (Vec<_>, Vec<_>) =
        figures.into_iter().partition(|figures| figures.kernel == kernel);
    if chosen.is_empty() {
        let mut others: Vec<_> = others.into_iter().map(|figures| figures.kernel).collect();
        others.dedup();
        return Err(format!("--kernel {kernel}: measured were {}", others.join(", ")));
    }
    Ok(chosen)
}

fn print(figures: &[Figures], options: &Options<'_>) {
    if options.json {
        print!("{}", table::json(figures));
    } else {
        print!("{}", table::aligned(figures));
    }
}

/// Compares with the figures for `compiler`, or writes them.
fn hold_to_accepted(measured: &[Figures], compiler: &str, options: &Options<'_>) -> Outcome {
    let path = root().join(DOCUMENT);
    let document = fs::read_to_string(&path).map_err(|cause| format!("{DOCUMENT}: {cause}"))?;
    if options.accept {
        let document = accepted::write(&document, compiler, measured);
        return fs::write(&path, document).map_err(|cause| format!("{DOCUMENT}: {cause}"));
    }
    let accepted =
        accepted::read(&document, compiler).map_err(|cause| format!("{DOCUMENT}: {cause}"))?;
    let Some(accepted) = accepted else {
        eprintln!(
            "{DOCUMENT} has no figures for {compiler}: held to the budgets alone. To accept these, \
             cargo xtask cycles --accept"
        );
        return Ok(());
    };
    let differences = accepted::differences(&accepted, measured);
    if differences.is_empty() {
        eprintln!("as accepted in {DOCUMENT} for {compiler}");
        Ok(())
    } else {
        Err(format!(
            "other than accepted in {DOCUMENT} for {compiler}:\n  {}\nif this is meant, cargo xtask \
             cycles --accept",
            differences.join("\n  ")
        ))
    }
}
