//! What `host-sim` predicts of any model, beside what is counted: the prices in `firmware/prices.csv` are fitted to many
//! random designs, and judged by others.

use std::fs;
use std::path::Path;

use nalgebra::DMatrix;
use rayon::prelude::*;
use taxel_learn::ModelBlob;
use taxel_learn::cost::{Cost, Design, Price, Prices, Terms, filter_terms, terms};

use super::designs;
use super::figures::Measured;
use super::image::Image;
use super::trace::Count;
use crate::process::{Outcome, root};

/// File of the prices.
const FILE: &str = "firmware/prices.csv";

/// Numbers of designs that prices are fitted to: telling and usual ones.
const TO_FIT: [usize; 2] = [600, 150];

/// Number of designs that judge them.
const TO_JUDGE: usize = 40;

/// Largest error in per cent of instructions, of cycles, and of cycles from flash, of all but one in twenty frames. How
/// long code waits for flash depends on what was executed before it.
pub const MOST_PERCENT: [f64; 3] = [5.0, 5.0, 10.0];

/// Scope of the filter in time. Its cost depends on no model, so that it is priced, and not among the accepted figures.
pub const FILTER: &str = "filter";

/// How many singular values below the largest one tell nothing about a price.
const LEAST_SINGULAR: f64 = 1e-9;

/// A frame, or its filter in time, that was counted, and what its cost is told from.
pub struct Frame {
    pub kernel: String,
    pub scope: String,
    terms: Terms,
    pub count: Count,
}

/// The frames of a run with a model of this `design`.
pub fn frames(design: &Design, measured: &[Measured]) -> Vec<Frame> {
    let frame = |Measured { kernel, scope, region }: &Measured| {
        match scope.strip_prefix("array-").unwrap_or(scope) {
            "frame" => {}
            FILTER => {
                let (kernel, scope, count) = (kernel.clone(), scope.clone(), region.whole);
                return Some(Frame { kernel, scope, terms: filter_terms(design.shape), count });
            }
            _ => return None,
        }
        // Compiled twins are no code of the firmware.
        if kernel.ends_with("-portable") {
            return None;
        }
        let (kernel, scope, count) = (kernel.clone(), scope.clone(), region.whole);
        Some(Frame { kernel, scope, terms: terms(design), count })
    };
    measured.iter().filter_map(frame).collect()
}

/// Counts frames of all designs, whose blobs are written into `directory` meanwhile.
fn frames_of_all(designs: &[Design], image: &Image, directory: &Path) -> Outcome<Vec<Frame>> {
    fs::create_dir_all(directory).map_err(|cause| cause.to_string())?;
    let one = |(index, design): (usize, &Design)| {
        let path = directory.join(format!("design-{index}.bin"));
        fs::write(&path, designs::blob(design)?).map_err(|cause| cause.to_string())?;
        let measured = image.run(&path);
        let _ = fs::remove_file(&path);
        Ok(frames(design, &measured?))
    };
    let frames: Vec<_> = designs.par_iter().enumerate().map(one).collect::<Outcome<_>>()?;
    Ok(frames.into_iter().flatten().collect())
}

/// Counts frames of many random designs, and writes the prices that fit them best.
///
/// # Errors
/// A run fails.
pub fn fit(image: &Image, directory: &Path, compiler: &str) -> Outcome {
    let [telling, usual] = TO_FIT;
    let telling = designs::random(telling, designs::TELLING, 1);
    let designs = [telling, designs::random(usual, designs::USUAL, 2)].concat();
    eprintln!("counting {} designs for {FILE}", designs.len());
    let frames = frames_of_all(&designs, image, directory)?;
    let terms_of = |it: &Frame| (it.terms.clone(), it.count.all());
    let text =
        Prices::text(compiler, &least_squares(&frames.iter().map(terms_of).collect::<Vec<_>>())?);
    fs::write(root().join(FILE), text).map_err(|cause| format!("{FILE}: {cause}"))
}

/// The prices with the least squares of errors relative to the frames' cycles, in the order of their terms' names.
fn least_squares(frames: &[(Terms, [u64; 3])]) -> Outcome<Vec<(String, Price)>> {
    let mut names: Vec<&String> = frames.iter().flat_map(|(terms, _)| terms.keys()).collect();
    names.sort_unstable();
    names.dedup();
    let unit = |frame: usize| frames[frame].1[1] as f64;
    let mut matrix = DMatrix::from_fn(frames.len(), names.len(), |frame, term| {
        frames[frame].0.get(names[term]).map_or(0.0, |times| *times as f64 / unit(frame))
    });
    // Each column gets length 1, so that terms that are rare count as well.
    let lengths: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    for (mut column, length) in matrix.column_iter_mut().zip(&lengths) {
        column.unscale_mut(*length);
    }
    let counted =
        DMatrix::from_fn(frames.len(), 3, |frame, cost| frames[frame].1[cost] as f64 / unit(frame));
    let decomposed = matrix.svd(true, true);
    let solved = decomposed.solve(&counted, LEAST_SINGULAR * decomposed.singular_values.max())?;
    let price = |term: usize| [0, 1, 2].map(|cost| solved[(term, cost)] / lengths[term]);
    Ok(names.iter().enumerate().map(|(term, name)| ((*name).clone(), price(term))).collect())
}

/// Counts other designs than those that the prices were fitted to, and says how well they are predicted.
///
/// # Errors
/// A run fails, or more than one frame in twenty is predicted wrong.
pub fn judge(image: &Image, directory: &Path, compiler: &str) -> Outcome<String> {
    let designs = designs::random(TO_JUDGE, designs::USUAL, 3);
    let frames = frames_of_all(&designs, image, directory)?;
    let predicted = predicted(&frames)?;
    let errors = [0, 1, 2].map(|cost| {
        let of_one = |(frame, predicted): (&Frame, &Cost)| {
            100.0 * (all(predicted)[cost] as f64 / frame.count.all()[cost] as f64 - 1.0).abs()
        };
        let mut errors: Vec<f64> = frames.iter().zip(&predicted).map(of_one).collect();
        errors.sort_by(f64::total_cmp);
        let at = |part: f64| errors[((errors.len() - 1) as f64 * part) as usize];
        [at(0.5), at(0.95), at(1.0)]
    });
    let said = |name: &str, [median, most, worst]: [f64; 3]| {
        format!("{name} to {median:.1} % (median), {most:.1} % (95 % of them), {worst:.1} % (all)")
    };
    let said = format!(
        "{FILE} predicts {} frames of {} random designs: {}; {}; {}",
        frames.len(),
        designs.len(),
        said("instructions", errors[0]),
        said("cycles", errors[1]),
        said("cycles from flash", errors[2]),
    );
    // Another compiler's code stands elsewhere in flash.
    let compared = if prices()?.compiler == compiler { 3 } else { 2 };
    let mut judged = errors.iter().zip(MOST_PERCENT).take(compared);
    if judged.all(|([_, most, _], allowed)| *most <= allowed) { Ok(said) } else { Err(said) }
}

/// The prices: not those that were compiled in, since [`fit`] may have replaced them.
fn prices() -> Outcome<Prices> {
    let text = fs::read_to_string(root().join(FILE)).map_err(|cause| format!("{FILE}: {cause}"))?;
    Prices::parse(&text).map_err(|cause| cause.to_string())
}

/// What the prices tell of each of `frames`, with all weights in RAM, as the image that counts has them.
///
/// # Errors
/// The list of prices is not sound.
pub fn predicted(frames: &[Frame]) -> Outcome<Vec<Cost>> {
    let prices = prices()?;
    let cost = |frame: &Frame| prices.of(&frame.terms).map_err(|cause| cause.to_string());
    frames.iter().map(cost).collect()
}

fn all(cost: &Cost) -> [u64; 3] {
    [cost.instructions, cost.cycles, cost.flash_cycles]
}

/// Counts frames of a user's own model, and prints them beside what is predicted: a table, or a list of JSON objects.
///
/// # Errors
/// The file is no model, or the run fails.
pub fn compare(path: &Path, image: &Image, json: bool) -> Outcome {
    let blob = ModelBlob::read(path).map_err(|cause| cause.to_string())?;
    let measured = image.run(path)?;
    let frames = frames(&Design::new(&blob), &measured);
    let predicted = predicted(&frames)?;
    let lines = frames.iter().zip(&predicted).map(|(frame, predicted)| {
        let (Frame { kernel, scope, count, .. }, [a, b, c]) = (frame, all(predicted));
        let Count { instructions, cycles, flash_cycles } = count;
        if json {
            serde_json::json!({
                "kernel": kernel, "scope": scope,
                "instructions": instructions, "predicted_instructions": a,
                "cycles": cycles, "predicted_cycles": b,
                "flash_cycles": flash_cycles, "predicted_flash_cycles": c,
            })
            .to_string()
        } else {
            let name = format!("{kernel} {scope}");
            format!("{name:34} | {instructions:>12} {a:>9} | {cycles:>9} {b:>9} | {flash_cycles:>10} {c:>9}")
        }
    });
    // What a confidence takes is not predicted.
    let confidence = measured.iter().filter(|it| it.scope == "confidence").map(|it| {
        let [instructions, cycles, flash_cycles] = it.region.whole.all();
        if json {
            serde_json::json!({
                "kernel": it.kernel, "scope": it.scope, "instructions": instructions,
                "cycles": cycles, "flash_cycles": flash_cycles,
            })
            .to_string()
        } else {
            let name = format!("{} {}", it.kernel, it.scope);
            format!("{name:34} | {instructions:>12} {0:>9} | {cycles:>9} {0:>9} | {flash_cycles:>10} {0:>9}", "–")
        }
    });
    let lines: Vec<String> = lines.chain(confidence).collect();
    if json {
        println!("[{}]", lines.join(",\n "));
    } else {
        println!(
            "kernel and scope                   | instructions predicted |    cycles predicted | from flash predicted\n{}",
            lines.join("\n")
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prices_are_found_again_even_where_some_always_come_together() {
        let terms = |a: usize, b: usize| {
            Terms::from([("a".to_owned(), a), ("b".to_owned(), b), ("c".to_owned(), b)])
        };
        let cost = |a: usize, b: usize| [3 * a + 5 * b, 7 * a + 9 * b, 8 * a].map(|it| it as u64);
        let sizes = [(1, 1), (2, 1), (3, 7), (40, 2)];
        let frames = sizes.map(|(a, b)| (terms(a, b), cost(a, b)));
        let found = least_squares(&frames).unwrap();
        let price = |term: usize| found[term].1.map(|cost| (cost * 1e6).round() / 1e6);
        assert_eq!(
            [price(0), price(1), price(2)],
            [[3.0, 7.0, 8.0], [2.5, 4.5, 0.0], [2.5, 4.5, 0.0]]
        );
    }
}
