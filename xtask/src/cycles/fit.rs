//! Prices of pieces of code, from frames that were measured.

use std::collections::BTreeMap;

use taxel_learn::cost::{FramePieces, Price};

use super::equations::Equations;
use super::predicted::Frame;
use super::regions::Count;
use crate::process::Outcome;

/// Digits behind the point of prices that are means.
const MEAN_DIGITS: i32 = 3;

/// The prices that fit all `frames` best, in the order of their pieces' names.
///
/// Assembly executes exactly its pieces, so that its prices are whole instructions and cycles. Those of compiled code
/// are means. What a piece waits for flash depends on what was executed before it, and is a mean as well.
pub fn prices(frames: &[Frame]) -> Outcome<Vec<(String, Price)>> {
    let in_assembly = || frames.iter().filter(|frame| frame.assembly.instructions > 0);
    let equations = in_assembly().map(|frame| (vec![&frame.pieces.assembly], 1.0));
    let counted: Vec<_> = in_assembly().map(|frame| costs(frame.assembly)).collect();
    let exact = Equations::new(equations).least_squares(&counted)?;
    let exact: Vec<(&str, [f64; 2])> =
        exact.into_iter().map(|(name, price)| (name, price.map(f64::round))).collect();
    hold_exact(frames, &exact)?;

    // Errors of what follows count relative to the frame's instructions.
    let unit = |frame: &Frame| frame.whole.instructions as f64;
    let equations = frames.iter().map(|frame| (vec![&frame.pieces.compiled], unit(frame)));
    let counted: Vec<_> = frames.iter().map(|frame| costs(frame.compiled())).collect();
    let means = Equations::new(equations).least_squares(&counted)?;

    let equations = frames.iter().map(|frame| {
        let FramePieces { assembly, compiled } = &frame.pieces;
        (vec![assembly, compiled], unit(frame))
    });
    let waits = |frame: &Frame| (frame.whole.flash_cycles - frame.whole.cycles) as f64;
    let counted: Vec<f64> = frames.iter().map(waits).collect();
    // A piece waits no longer than it runs: a line of flash takes 5 cycles, and holds 4 to 8 instructions.
    let runs: BTreeMap<&str, f64> =
        exact.iter().chain(&means).map(|(name, [_, cycles])| (*name, *cycles)).collect();
    let waits = Equations::new(equations).bounded(&counted, |name| runs[name].max(0.0));

    let priced = exact.into_iter().chain(means).map(|(name, [instructions, cycles])| {
        let price = [instructions, cycles, cycles + waits[name]];
        (name.to_owned(), price.map(rounded))
    });
    Ok(priced.collect())
}

fn costs(count: Count) -> [f64; 2] {
    [count.instructions as f64, count.cycles as f64]
}

/// Fails with the frame whose assembly costs most beside what these prices predict, if one does.
fn hold_exact(frames: &[Frame], prices: &[(&str, [f64; 2])]) -> Outcome {
    let prices: BTreeMap<&str, [f64; 2]> = prices.iter().copied().collect();
    let beside = |frame: &Frame| {
        let counted = costs(frame.assembly);
        let predicted = |cost: usize| -> f64 {
            frame
                .pieces
                .assembly
                .iter()
                .map(|(name, times)| prices[name][cost] * times as f64)
                .sum()
        };
        [0, 1].map(|cost| predicted(cost) - counted[cost])
    };
    let worst = frames.iter().map(|frame| (beside(frame), frame));
    let size = |[instructions, cycles]: [f64; 2]| instructions.abs() + cycles.abs();
    match worst.max_by(|(a, _), (b, _)| size(*a).total_cmp(&size(*b))) {
        Some(([instructions, cycles], frame)) if size([instructions, cycles]) != 0.0 => {
            Err(format!(
                "{}: its assembly costs other than its pieces, by {instructions:+} instructions and {cycles:+} cycles; \
             does host-sim/learn/src/cost/routines.rs have the pieces that it executes?",
                frame.what()
            ))
        }
        _ => Ok(()),
    }
}

fn rounded(price: f64) -> f64 {
    let unit = 10_f64.powi(MEAN_DIGITS);
    // Not −0.
    (price * unit).round() / unit + 0.0
}
