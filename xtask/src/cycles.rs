//! Cost of decoding on a Cortex-M4: exact instructions from QEMU, and cycles by a model of the processor.
//!
//! A *kernel*, as in the column of `firmware/cycles.csv`, is one way to decode: a number format, with another
//! exponential than the default if its name ends with one, or its compiled twin (portable Rust instead of
//! assembly) if it ends with `-portable`. `docs/cycles.md` explains all this, and has the accepted figures.

mod designs;
pub mod models;

mod flash;
mod instruction;
pub mod trace;

mod figures;
mod image;

mod fit;
mod table;

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::emulate::qemu;
use crate::images::{BENCH, build_image};
use crate::process::{Outcome, read, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use figures::{Accepted, Figure};
use image::Image;

/// Name of the image that is measured.
const IMAGE: &str = "qemu-bench";

/// Files of the accepted figures, and of the tables that are made from them behind a heading.
const DATA: &str = "firmware/cycles.csv";
const DOCUMENT: &str = "docs/cycles.md";
const HEADING: &str = "## Figures\n";

/// What to do besides comparing with budgets and accepted figures.
#[derive(clap::Args)]
pub struct Options {
    /// Print a list of objects to stdout, and nothing else.
    #[arg(long)]
    json: bool,
    /// Write firmware/cycles.csv and the tables of docs/cycles.md instead of comparing.
    #[arg(long)]
    accept: bool,
    /// Fit firmware/prices.csv anew, from which `host-sim` predicts any model's cost, to 750 random models.
    #[arg(long, conflicts_with = "accept")]
    fit: bool,
    /// Count frames of this model, of any shape, and print what is predicted beside.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["accept", "fit"])]
    model: Option<PathBuf>,
    /// Show this kernel only, and compare it with its budget only.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["accept", "fit", "model"])]
    kernel: Option<String>,
}

/// Measures, prints, and compares with budgets and accepted figures.
pub fn run(options: &Options) -> Outcome {
    if let Some(model) = options.model.as_ref().filter(|model| !model.is_file()) {
        return Err(format!("--model {}: there is no such file", model.display()));
    }
    qemu::present()?;
    let toolchain = Toolchain::find()?;
    build_image(&toolchain, BENCH)?;
    let image = Image::read(elf(IMAGE))?;
    let (directory, compiler) = (target_dir().join("cycles"), toolchain.compiler()?);
    if options.fit {
        fit::fit(&image, &directory, &compiler)?;
        eprintln!("{}", fit::judge(&image, &directory, &compiler)?);
        return Ok(());
    }
    if let Some(model) = &options.model {
        return fit::compare(model, &image, options.json);
    }
    let measured = measure(&image, &directory, options.kernel.as_deref())?;
    print!("{}", if options.json { table::json(&measured) } else { table::markdown(&measured) });
    let over_budget = figures::over_budget(&measured);
    if !over_budget.is_empty() {
        return Err(over_budget.join("; "));
    }
    if options.kernel.is_some() {
        return Ok(());
    }
    if options.accept {
        let accepted = Accepted { compiler, figures: measured };
        let document = in_document(&read(DOCUMENT)?, &accepted)?;
        for (file, text) in [(DATA, accepted.data()), (DOCUMENT, document)] {
            fs::write(root().join(file), text).map_err(|cause| format!("{file}: {cause}"))?;
        }
        return Ok(());
    }
    let accepted = Accepted::parse(&read(DATA)?).map_err(|cause| format!("{DATA}: {cause}"))?;
    if accepted.compiler != compiler {
        eprintln!(
            "{DATA} is exact for {} alone; the compiler in use is {compiler}",
            accepted.compiler
        );
    }
    let differences = accepted.differences(&compiler, &measured);
    if !differences.is_empty() {
        let differences = differences.join("\n  ");
        return Err(format!(
            "other than accepted in {DATA}:\n  {differences}\nif this is meant, cargo xtask cycles --accept"
        ));
    }
    eprintln!("as accepted in {DATA}");
    let judged = fit::judge(&image, &directory, &compiler);
    let advice =
        |said| format!("{said}\nif the code was changed on purpose, cargo xtask cycles --fit");
    // With --json, stdout has the objects only.
    eprintln!("{}", judged.map_err(advice)?);
    Ok(())
}

/// Measures the models whose cost is accepted: those of a `kernel`, or all. Figures come sorted by kernel, in the order
/// of their first appearance, and then by K.
fn measure(image: &Image, directory: &Path, kernel: Option<&str>) -> Outcome<Vec<Figure>> {
    let models = models::train(directory, |_| true)?;
    // Images are measured on all cores at once, since QEMU runs an image on one.
    let figures = models.par_iter().map(|model| {
        let mut measured = image.run(&model.path)?;
        measured.retain(|it| it.scope != fit::FILTER);
        Ok(Figure::of_run(measured, model.centres as u64, model.affine))
    });
    let mut figures = figures.collect::<Outcome<Vec<_>>>()?.concat();
    let mut kernels: Vec<String> = figures.iter().map(|figure| figure.kernel.clone()).collect();
    let mut seen = std::collections::HashSet::new();
    kernels.retain(|kernel| seen.insert(kernel.clone()));
    if let Some(kernel) = kernel {
        figures.retain(|figure| figure.kernel == kernel);
        if figures.is_empty() {
            return Err(format!("--kernel {kernel}: measured were {}", kernels.join(", ")));
        }
    }
    let place = |figure: &Figure| kernels.iter().position(|kernel| *kernel == figure.kernel);
    figures.sort_by_key(|figure| (place(figure), figure.centres));
    Ok(figures)
}

/// The `document` with the tables of `accepted` figures at its end.
fn in_document(document: &str, accepted: &Accepted) -> Outcome<String> {
    let start = document.find(HEADING).ok_or(format!("{DOCUMENT} lacks {}", HEADING.trim()))?;
    let head = &document[..start + HEADING.len()];
    Ok(format!("{head}\n### {}\n\n{}", accepted.compiler, table::markdown(&accepted.figures)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_of_the_document_are_those_of_the_data() {
        let [data, document] = [DATA, DOCUMENT].map(|file| read(file).unwrap());
        let accepted = Accepted::parse(&data).unwrap();
        assert_eq!(accepted.data(), data);
        assert!(
            in_document(&document, &accepted).unwrap() == document,
            "{DOCUMENT} has other figures than {DATA}: cargo xtask cycles --accept"
        );
    }
}
