//! Cost of decoding on a Cortex-M4: exact instructions from QEMU, and cycles by a model of the processor.
//!
//! A *kernel*, as in the column of `firmware/cycles.csv`, is one way to decode: a number format, with another
//! exponential than the default if its name ends with one, or its compiled twin (portable Rust instead of
//! assembly) if it ends with `-portable`. `docs/cycles.md` explains all this, and has the accepted figures.

mod designs;
mod models;

mod flash;
mod instruction;
mod trace;

mod figures;
mod image;

mod fit;
mod table;

use std::fs;
use std::path::Path;

use rayon::prelude::*;
use taxel_learn::cost::Design;

use crate::emulate::qemu;
use crate::firmware::{BENCH, build_image};
use crate::process::{Outcome, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use figures::{Accepted, Figure};
use image::Image;
pub use trace::Count as Counted;

/// Name of the image that is measured.
const IMAGE: &str = "qemu-bench";

/// Files of the accepted figures, and of the tables that are made from them behind a heading.
const DATA: &str = "firmware/cycles.csv";
const DOCUMENT: &str = "docs/cycles.md";
const HEADING: &str = "## Figures\n";

/// Options from the command line.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// Whether to print JSON, and nothing else, to stdout.
    pub json: bool,
    /// Whether to write the accepted figures instead of comparing with them.
    pub accept: bool,
    /// Whether to fit the prices of `host-sim`'s predictions instead.
    pub fit: bool,
    /// Blob to measure, and to show beside what is predicted of it.
    pub model: Option<&'a str>,
    /// The only kernel to show, which is compared with its budget only.
    pub kernel: Option<&'a str>,
}

impl<'a> Options<'a> {
    /// Parses the options of the command line.
    ///
    /// # Errors
    /// The option that is unknown or lacks its value, or options that exclude each other.
    pub fn parse(arguments: &[&'a str]) -> Result<Self, String> {
        let mut options = Self::default();
        let mut arguments = arguments.iter().copied();
        while let Some(argument) = arguments.next() {
            let mut value = |what: &str| {
                arguments.next().ok_or_else(|| format!("`{argument}` needs {what} behind it"))
            };
            match argument {
                "--json" => options.json = true,
                "--accept" => options.accept = true,
                "--fit" => options.fit = true,
                "--model" => options.model = Some(value("a file")?),
                "--kernel" => options.kernel = Some(value("a name")?),
                _ => return Err(format!("unknown option `{argument}`")),
            }
        }
        let chosen = [
            ("--accept", options.accept),
            ("--fit", options.fit),
            ("--model", options.model.is_some()),
            ("--kernel", options.kernel.is_some()),
        ];
        let chosen: Vec<&str> =
            chosen.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect();
        match chosen[..] {
            [one, other, ..] => Err(format!("`{one}` and `{other}` exclude each other")),
            _ => Ok(options),
        }
    }
}

/// Measures, prints, and compares with budgets and accepted figures.
pub fn run(options: &Options<'_>) -> Outcome {
    if let Some(model) = options.model.filter(|model| !Path::new(model).is_file()) {
        return Err(format!("--model {model}: there is no such file"));
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
    if let Some(model) = options.model {
        return fit::compare(Path::new(model), &image, options.json);
    }
    let measured = measure(&image, &directory, options.kernel)?;
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
    let models = models::train(directory)?;
    // Images are measured on all cores at once, since QEMU runs an image on one.
    let figures = models.par_iter().map(|model| {
        let measured = image.run(&model.path)?;
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

/// Predicted and counted cost of a frame of the model at `path`, which has this `design`, without a gate and with all
/// weights in RAM.
///
/// # Errors
/// The run fails, or the prediction is off by more than a few per cent.
pub fn frame_of(design: &Design, path: &Path) -> Outcome<[Counted; 2]> {
    let frames = fit::frames(design, &Image::read(elf(IMAGE))?.run(path)?);
    let predicted = fit::predicted(&frames)?;
    let (frame, predicted) =
        frames.first().zip(predicted.first()).ok_or("no frame was measured")?;
    let (instructions, cycles) = (predicted.instructions, predicted.cycles);
    let predicted = Counted { instructions, cycles, flash_cycles: predicted.flash_cycles };
    let counted = frame.count;
    let off = predicted.cycles.abs_diff(counted.cycles) as f64 / counted.cycles as f64;
    if 100.0 * off > fit::MOST_PERCENT[1] {
        return Err(format!(
            "{}: {predicted:?} was predicted, {counted:?} counted",
            path.display()
        ));
    }
    Ok([predicted, counted])
}

/// The `document` with the tables of `accepted` figures at its end.
fn in_document(document: &str, accepted: &Accepted) -> Outcome<String> {
    let start = document.find(HEADING).ok_or(format!("{DOCUMENT} lacks {}", HEADING.trim()))?;
    let head = &document[..start + HEADING.len()];
    Ok(format!("{head}\n### {}\n\n{}", accepted.compiler, table::markdown(&accepted.figures)))
}

fn read(file: &str) -> Outcome<String> {
    fs::read_to_string(root().join(file)).map_err(|cause| format!("{file}: {cause}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_in_any_order_and_what_makes_no_sense_is_named() {
        let model = Options { json: true, model: Some("a.bin"), ..Options::default() };
        assert_eq!(Options::parse(&["--model", "a.bin", "--json"]), Ok(model));
        for (arguments, named) in [
            (&["--json", "--jsn"][..], "`--jsn`"),
            (&["a.bin"], "`a.bin`"),
            (&["--model"], "`--model`"),
            (&["--kernel", "f32", "--accept"], "`--accept` and `--kernel`"),
        ] {
            let message = Options::parse(arguments).unwrap_err();
            assert!(message.contains(named), "{message}");
        }
    }

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
