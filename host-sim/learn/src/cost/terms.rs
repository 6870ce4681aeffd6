//! What the cost of a frame is a linear formula of: how often its code does what, by the sizes of a model.
//!
//! The routines in assembly (`model-core/src/cortex_m4/*.s`) branch by sizes alone, so that most terms are what their
//! loops go through. What compiled code costs around them, and what is rare, is told by few terms: a frame comes out to
//! a per cent or two.

use std::collections::BTreeMap;

use taxel_core::blob::ModelShape;
use taxel_core::rbf::{Format, Shape};

use super::{Design, NetworkDesign};

/// Inputs and outputs for which there is code of its own.
const EIGHTEEN: usize = 18;

/// Names of terms, and how often each counts.
pub type Terms = BTreeMap<String, usize>;

/// The terms of one frame of a model of this `design`.
#[must_use]
pub fn terms(design: &Design) -> Terms {
    let mut sum = Sum::default();
    let ModelShape { rows, inputs, .. } = design.shape;
    let one = design.projection;
    let kind = if one { "array" } else { "rows" };
    let relative = usize::from(design.relative_inputs);
    let relatively =
        [("", relative * if one { 1 } else { rows }), ("reading", relative * rows * inputs)];
    sum.add(kind, [("", 1), ("row", rows)]);
    sum.add(&format!("{kind} relative to the baseline"), relatively);
    if one {
        project(rows * inputs, design.features(), &mut sum);
    }
    for network in design.row_networks() {
        sum.add(&format!("{kind} in {}", network.format.name()), [("", 1)]);
        match network.format {
            Format::Fixed16 => fixed16(network, &mut sum),
            Format::F32 => f32(network, &mut sum),
        }
    }
    sum.0
}

/// The terms of the filter in time of one frame with estimates of this `shape`, all of whose rows are decoded.
#[must_use]
pub fn filter_terms(ModelShape { rows, outputs, .. }: ModelShape) -> Terms {
    let mut sum = Sum::default();
    sum.add("filter", [("", 1), ("row", rows), ("output", rows * outputs)]);
    sum.0
}

#[derive(Default)]
struct Sum(Terms);

impl Sum {
    /// Adds `terms` of `part`. A term without a name is the part itself.
    fn add<const N: usize>(&mut self, part: &str, terms: [(&str, usize); N]) {
        for (name, times) in terms.into_iter().filter(|(_, times)| *times > 0) {
            let name = if name.is_empty() { part.to_owned() } else { format!("{part}: {name}") };
            *self.0.entry(name).or_default() += times;
        }
    }
}

/// `taxel_project`: so many readings to so many features.
fn project(readings: usize, features: usize, sum: &mut Sum) {
    sum.add("projection", [("", 1), ("group", groups(features).count()), ("output", features)]);
    sums(readings, features, sum);
}

/// `projection_sums`: so many lines of weights, summed two at a time in groups of outputs.
fn sums(lines: usize, outputs: usize, sum: &mut Sum) {
    let pairs = lines / 2;
    for width in groups(outputs) {
        let (name, beyond) = match width {
            EIGHTEEN if outputs == EIGHTEEN => ("18 outputs, no others", 0),
            EIGHTEEN => ("18 outputs", 0),
            6 => ("6 outputs", 0),
            few => ("fewer outputs", pairs * few),
        };
        sum.add("two lines", [(name, pairs), ("one of fewer outputs", beyond)]);
    }
    if lines % 2 == 1 {
        sum.add("odd line", [("group", groups(outputs).count()), ("output", outputs)]);
    }
}

/// Numbers of outputs that `projection_sums` takes at once, as `projection_width` chooses them: 18, else 6, else those that are left.
fn groups(outputs: usize) -> impl Iterator<Item = usize> {
    let (eighteens, left) = (outputs / EIGHTEEN, outputs % EIGHTEEN);
    let sixes = left / 6;
    let last = Some(left % 6).filter(|last| *last > 0);
    [EIGHTEEN].repeat(eighteens).into_iter().chain([6].repeat(sixes)).chain(last)
}

/// `taxel_fixed16`, from readings that are not scaled yet. It takes centres by sixteens in batches of 256, inputs by
/// pairs or eights, and outputs in groups of 18.
fn fixed16(network: &NetworkDesign, sum: &mut Sum) {
    let Shape { inputs, centres, outputs } = network.shape;
    let (sixteens, more_batches) = (centres.div_ceil(16), centres.div_ceil(256) - 1);
    let tail = usize::from(network.affine_tail);
    if inputs == EIGHTEEN && outputs <= EIGHTEEN {
        let all = outputs == EIGHTEEN;
        sum.add(
            "fixed16, 18 inputs",
            [
                ("", 1),
                ("batch more", more_batches),
                ("16 centres", sixteens),
                ("16 centres, output", sixteens * outputs),
                ("output of fewer than 18", if all { 0 } else { outputs }),
                ("18 outputs, one batch", usize::from(all && more_batches == 0)),
                ("tail", tail),
                ("tail, output", tail * outputs),
            ],
        );
        return;
    }
    let (groups, eights) = (outputs.div_ceil(EIGHTEEN), inputs.div_ceil(8));
    let pairs = inputs.div_ceil(2);
    let (kind, taken) = if inputs > EIGHTEEN {
        ("fixed16, more than 18 inputs", eights)
    } else {
        ("fixed16, up to 17 inputs", pairs)
    };
    sum.add(
        kind,
        [
            ("", 1),
            ("inputs", taken),
            ("batch more", more_batches),
            ("batch more, inputs", more_batches * taken),
            ("16 centres", sixteens),
            ("16 centres, inputs", sixteens * taken),
        ],
    );
    sum.add(
        "fixed16",
        [
            ("6 inputs", inputs / 6),
            ("input beyond sixes", inputs % 6),
            ("inputs beyond sixes", usize::from(!inputs.is_multiple_of(6))),
            ("group", groups),
            ("output", outputs),
            ("output beyond eighteens", outputs % EIGHTEEN),
            ("batch more, group", more_batches * groups),
            ("16 centres, group", sixteens * groups),
            ("16 centres, output", sixteens * outputs),
        ],
    );
    let of_tail = [("", tail), ("group", tail * groups), ("output", tail * outputs)];
    if pairs == 9 {
        sum.add("fixed16, tail of 9 pairs", of_tail);
    } else {
        sum.add("fixed16, tail", of_tail);
        sum.add("fixed16, tail", [("output, 8 inputs", tail * outputs * eights)]);
    }
}

/// A network in f32, from readings that are not scaled yet. The compiler takes four inputs and four
/// outputs at a time, and unrolls the loops of 18 inputs and outputs.
fn f32(network: &NetworkDesign, sum: &mut Sum) {
    let Shape { inputs, centres, outputs } = network.shape;
    let tail = usize::from(network.affine_tail);
    if (inputs, outputs) == (EIGHTEEN, EIGHTEEN) {
        let kind = "f32, 18 inputs, 18 outputs";
        sum.add(kind, [("", 1), ("centre", centres), ("tail", tail)]);
        return;
    }
    sum.add(
        "f32",
        [
            ("", 1),
            ("input", inputs),
            ("output", outputs),
            ("centre", centres),
            ("centre, 4 inputs", centres * (inputs / 4)),
            ("centre, input beyond fours", centres * (inputs % 4)),
            ("centre of inputs beyond fours", centres * usize::from(!inputs.is_multiple_of(4))),
            ("centre of fewer than 4 inputs", centres * usize::from(inputs < 4)),
            ("centre, 4 outputs", centres * (outputs / 4)),
            ("centre, output beyond fours", centres * (outputs % 4)),
            ("tail, input", tail * inputs),
            ("tail, input, 4 outputs", tail * inputs * (outputs / 4)),
            ("tail, input, output beyond fours", tail * inputs * (outputs % 4)),
        ],
    );
}

#[cfg(test)]
mod tests {
    use super::groups;

    #[test]
    fn outputs_are_taken_in_groups_of_18_then_6_then_the_rest() {
        let widths = |outputs| groups(outputs).collect::<Vec<_>>();
        assert_eq!([widths(18), widths(12), widths(5)], [vec![18], vec![6, 6], vec![5]]);
        assert_eq!(widths(43), [18, 18, 6, 1]);
    }
}
