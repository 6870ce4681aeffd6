//! Cost of decoding on a Cortex-M4: instructions counted exactly in QEMU, beside those that `taxel` predicts.
//!
//! `docs/cycles.md` explains all this.

mod models;
pub mod trace;
mod image;

use std::fs;

use rayon::prelude::*;
use taxel_learn::cost::{Cost, Design};

use crate::emulate::qemu;
use crate::images::{BENCH, BENCH_TRACK, build_image};
use crate::process::{Outcome, read, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use image::Image;
use models::Files;
use models::train_tracked;
pub use models::{Model, train_all};

/// Names of the images that are measured.
const IMAGE: &str = "qemu-bench";
const TRACK_IMAGE: &str = "qemu-bench-track";

/// File of the accepted figures.
const DATA: &str = "firmware/cycles.csv";

/// First line of the accepted figures.
const HEAD: &str = "compiler,model,scope,instructions,predicted";

/// Scope of decoding a frame by a network.
const FRAME: &str = "frame";

/// Scope of the filter in time of a frame's estimate.
const FILTER: &str = "filter";

/// Scope of following a contact, a frame each millisecond; what a board does besides with such a frame is not predicted.
const FOLLOW: &str = "follow";

/// Most per cent by which a prediction may be off.
const PREDICTED_PERCENT: u64 = 10;
/// Most per cent by which instructions may exceed those accepted for another compiler, which makes other code. Fewer are
/// no fault.
const OTHER_COMPILER_PERCENT: u64 = 5;

/// What to do besides comparing with accepted figures.
#[derive(clap::Args)]
pub struct Options {
    /// Write firmware/cycles.csv instead of comparing.
    #[arg(long)]
    accept: bool,
}

/// Instructions of one scope of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Figure {
    model: String,
    /// What is counted.
    scope: String,
    instructions: u64,
    predicted: u64,
}

/// Counts, prints, and compares with predictions and accepted figures.
pub fn run(options: &Options) -> Outcome {
    qemu::present()?;
    let toolchain = Toolchain::find()?;
    build_image(&toolchain, BENCH)?;
    build_image(&toolchain, BENCH_TRACK)?;
    let images = [Image::read(elf(IMAGE))?, Image::read(elf(TRACK_IMAGE))?];
    let compiler = toolchain.compiler()?;
    let directory = target_dir().join("cycles");
    fs::create_dir_all(&directory).map_err(|cause| cause.to_string())?;
    let mut measured = vec![];
    for (image, models) in images.iter().zip([train_all()?, train_tracked()?]) {
        let measure = |model: &Model| measure(model, image, &model.write(&directory)?);
        let figures: Vec<_> = models.par_iter().map(measure).collect::<Outcome<_>>()?;
        measured.extend(figures.concat());
    }
    print!("{}", markdown(&measured));
    let mut faults: Vec<String> = measured.iter().filter_map(off).collect();
    if options.accept {
        let written = fs::write(root().join(DATA), data(&compiler, &measured));
        written.map_err(|cause| format!("{DATA}: {cause}"))?;
    } else {
        let (accepted_by, accepted) = parse(&read(DATA)?)?;
        faults.extend(differences(&accepted, &measured, accepted_by == compiler));
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n")) }
}

/// Counts the scopes of a model.
fn measure(model: &Model, image: &Image, files: &Files) -> Outcome<Vec<Figure>> {
    let design = Design::new(&model.blob);
    let nothing = Cost { instructions: 0, cycles: 0 };
    let figure = |(scope, instructions): (String, u64)| {
        let tracker = model.blob.parse().tracker();
        let predicted = match scope.as_str() {
            FILTER => Cost::of_filter(design.shape),
            FRAME => Cost::of_frame(&design),
            FOLLOW => tracker.map_or(nothing, |it| Cost::of_tracker(it.sizes())),
            _ => Cost { instructions, ..nothing },
        };
        Figure { model: model.name(), scope, instructions, predicted: predicted.instructions }
    };
    Ok(image.run(&files.model, &files.frame)?.into_iter().map(figure).collect())
}

/// What is wrong with a figure's prediction.
fn off(Figure { model, scope, instructions, predicted }: &Figure) -> Option<String> {
    let percent = 100.0 * (*predicted as f64 / *instructions as f64 - 1.0);
    (predicted.abs_diff(*instructions) * 100 > PREDICTED_PERCENT * instructions).then(|| {
        format!(
            "{model}, {scope}: {instructions} instructions, and {predicted} predicted ({percent:+.1} %): change the \
             constants in host-sim/learn/src/cost.rs"
        )
    })
}

/// Figures that differ from the accepted ones by more than they may.
fn differences(accepted: &[Figure], measured: &[Figure], same_compiler: bool) -> Vec<String> {
    let key = |figure: &Figure| (figure.model.clone(), figure.scope.clone());
    let find = |all: &[Figure], one: &Figure| all.iter().find(|it| key(it) == key(one)).cloned();
    let advice = "if this is meant, cargo xtask cycles --accept";
    let of_one = |now: &Figure| {
        let name = format!("{}, {}", now.model, now.scope);
        let Some(then) = find(accepted, now) else {
            return Some(format!("{name}: not accepted yet; {advice}"));
        };
        let most = then.instructions * (100 + OTHER_COMPILER_PERCENT) / 100;
        let differs = if same_compiler {
            now.instructions != then.instructions
        } else {
            now.instructions > most
        };
        let (now, then) = (now.instructions, then.instructions);
        differs.then(|| format!("{name}: {now} instructions, accepted are {then}; {advice}"))
    };
    let gone = accepted.iter().filter(|it| find(measured, it).is_none());
    let gone = gone.map(|it| format!("{}, {}: accepted, but not measured", it.model, it.scope));
    measured.iter().filter_map(of_one).chain(gone).collect()
}

/// Parses the accepted figures: their compiler, and themselves.
fn parse(data: &str) -> Outcome<(String, Vec<Figure>)> {
    let rest = data.strip_prefix(HEAD).ok_or(format!("{DATA}: the first line is not {HEAD}"))?;
    let mut compiler = String::new();
    let mut figures = Vec::new();
    for line in rest.lines().skip(1) {
        let wrong = || format!("{DATA}: not understood: {line}");
        let [by, model, scope, instructions, predicted] = line.split(',').collect::<Vec<_>>()[..]
        else {
            return Err(wrong());
        };
        compiler = by.replace(';', ",");
        figures.push(Figure {
            model: model.to_owned(),
            scope: scope.to_owned(),
            instructions: instructions.parse().map_err(|_| wrong())?,
            predicted: predicted.parse().map_err(|_| wrong())?,
        });
    }
    Ok((compiler, figures))
}

/// Contents of the file of accepted figures.
fn data(compiler: &str, figures: &[Figure]) -> String {
    // No comma may stand in a field.
    let compiler = compiler.replace(',', ";");
    let line = |Figure { model, scope, instructions, predicted }: &Figure| {
        format!("{compiler},{model},{scope},{instructions},{predicted}\n")
    };
    format!("{HEAD}\n{}", figures.iter().map(line).collect::<String>())
}

/// Table of frames in Markdown.
fn markdown(figures: &[Figure]) -> String {
    let line = |Figure { model, scope, instructions, predicted }: &Figure| {
        format!("| {model} | {scope} | {instructions} | {predicted} |\n")
    };
    let head = "| model | what | instructions | predicted |\n|---|---|--:|--:|\n";
    let frames = figures.iter().filter(|figure| figure.scope != FILTER);
    head.to_owned() + &frames.map(line).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_accepted_figures_are_written_as_they_were_read() {
        let text = read(DATA).unwrap();
        let (compiler, figures) = parse(&text).unwrap();
        assert_eq!(data(&compiler, &figures), text);
    }

    #[test]
    fn figures_must_be_equal_only_for_the_same_compiler() {
        let figure = |scope: &str, instructions, predicted| Figure {
            model: "f32 K = 16".into(),
            scope: scope.into(),
            instructions,
            predicted,
        };
        let accepted = [figure("frame", 1000, 0)];
        let said = |instructions, same| {
            differences(&accepted, &[figure("frame", instructions, 0)], same).concat()
        };
        assert_eq!((said(1000, true), said(1050, false), said(1, false)), Default::default());
        assert!(said(999, true).contains("999 instructions, accepted are 1000"));
        assert!(said(1051, false).contains("1051 instructions"));
        let other = differences(&accepted, &[figure("filter", 1, 0)], true);
        assert!(other[0].contains("not accepted yet") && other[1].ends_with("not measured"));
        assert!([900, 1100].iter().all(|it| off(&figure("frame", 1000, *it)).is_none()));
        assert!([899, 1101].iter().all(|it| off(&figure("frame", 1000, *it)).is_some()));
    }
}
