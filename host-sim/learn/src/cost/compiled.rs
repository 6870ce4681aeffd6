//! Pieces of compiled code around the routines in assembly, and how often each is executed.
//!
//! The compiler unrolls and reorders, so their prices are means, found by least squares.

use model_core::rbf::{Format, Shape};

use super::pieces::Pieces;
use super::{Design, Gating, NetworkDesign};
use crate::infer::Exponential;

/// Inputs and outputs for which the compiler unrolls the loops of `f32-direct`.
const UNROLLED: (usize, usize) = (18, 18);

/// Pieces of decoding all rows of a frame of this `design`.
pub(super) fn of_frame(design: &Design, exponential: Exponential, gating: Gating) -> Pieces {
    let mut pieces = Pieces::default();
    let shape = design.shape;
    let of = if design.projection { "array" } else { "rows" };
    if gating == Gating::AtRest {
        pieces.add(format!("frame at rest, {of}"), 1);
        pieces.add(format!("row at rest, {of}"), shape.rows);
        return pieces;
    }
    if gating == Gating::Awake {
        pieces.add(format!("frame awake, {of}"), 1);
        pieces.add(format!("row awake, {of}"), shape.rows);
    }
    let readings = shape.rows * shape.inputs;
    let relative = design.relative_inputs;
    if design.projection {
        pieces.add("row of an array", shape.rows);
        pieces.add("expansion", usize::from(design.components.is_some()));
        pieces.add("array relative to the baseline", usize::from(relative));
        pieces.add(
            "reading of an array relative to the baseline",
            if relative { readings } else { 0 },
        );
    } else {
        pieces.add("frame", 1);
        pieces.add("row relative to the baseline", if relative { shape.rows } else { 0 });
        pieces.add("reading relative to the baseline", if relative { readings } else { 0 });
    }
    for network in design.row_networks() {
        if network.format == Format::F32Direct {
            direct(network, exponential, &mut pieces);
            pieces.add("frame of an array in f32-direct", usize::from(design.projection));
        } else {
            let of = if design.projection { "frame of an array" } else { "row" };
            pieces.add(format!("{of} in {}", network.format.name()), 1);
        }
    }
    pieces
}

/// A network with direct distances, from readings that are not scaled yet.
fn direct(network: &NetworkDesign, exponential: Exponential, pieces: &mut Pieces) {
    let Shape { inputs, centres, outputs } = network.shape;
    let mut add = |name: &str, times: usize| pieces.add(format!("f32-direct: {name}"), times);
    add("input scaled", inputs);
    add("output checked", outputs);
    let tail = network.affine_tail;
    if (inputs, outputs) == UNROLLED {
        add("18 inputs, 18 outputs: network", 1);
        add(&format!("18 inputs, 18 outputs: centre, {}", exponential.name()), centres);
        add("18 inputs, 18 outputs: tail", usize::from(tail));
        return;
    }
    add("network", 1);
    add(&format!("centre, {}", exponential.name()), centres);
    // The compiler takes four inputs and four outputs at a time.
    add("centre, four inputs", centres * (inputs / 4));
    add("centre, fewer than four inputs", if inputs < 4 { centres } else { 0 });
    if inputs % 4 > 0 {
        add(&format!("centre, {} inputs beyond fours", inputs % 4), centres);
    }
    add("centre, four outputs", centres * (outputs / 4));
    if outputs % 4 > 0 {
        add(&format!("centre, {} outputs beyond fours", outputs % 4), centres);
    }
    if tail {
        add("tail: input, four outputs", inputs * (outputs / 4));
        add(&format!("tail: input, {} outputs beyond fours", outputs % 4), inputs);
    }
}
