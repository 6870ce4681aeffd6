//! Pieces of the routines in assembly (`model-core/src/cortex_m4/*.s`), and how often each is executed.
//!
//! The routines branch by counts alone, never by readings or weights. So their instructions are exactly the sum of
//! these pieces. Names of pieces are keys of the price list; a count of 0 takes nothing.

use model_core::blob::ModelShape;
use model_core::rbf::{Format, Shape};

use super::pieces::Pieces;
use super::{Design, Gating, NetworkDesign};

/// Centres that `taxel_fixed16` takes at once, and in one batch.
const FIXED16_AT_ONCE: usize = 16;
const FIXED16_BATCH: usize = 256;

/// Centres that `taxel_f32` takes at once, and how many times that in one batch.
const F32_AT_ONCE: usize = 4;
const F32_BATCH: usize = 32;

/// Outputs that both routines keep in registers; inputs as well.
const EIGHTEEN: usize = 18;

/// Pieces of decoding all rows of a frame of this `design`.
pub(super) fn of_frame(design: &Design, gating: Gating) -> Pieces {
    let mut pieces = Pieces::default();
    gate(design, gating, &mut pieces);
    if gating == Gating::AtRest {
        return pieces;
    }
    if design.projection {
        let readings = design.shape.rows * design.shape.inputs;
        project(readings, design.features(), &mut pieces);
    }
    if let Some(components) = design.components {
        // The projection's routine expands.
        project(components, design.shape.rows * design.shape.outputs, &mut pieces);
    }
    for network in design.row_networks() {
        match network.format {
            Format::Fixed16 => fixed16(network, &mut pieces),
            Format::F32 => f32(network, &mut pieces),
            Format::F32Direct => (),
        }
    }
    pieces
}

/// `taxel_fixed16`, from readings that are not scaled yet.
fn fixed16(network: &NetworkDesign, pieces: &mut Pieces) {
    let Shape { inputs, centres, outputs } = network.shape;
    let (pairs, sixteens) = (inputs.div_ceil(2), centres.div_ceil(FIXED16_AT_ONCE));
    let more_batches = centres.div_ceil(FIXED16_BATCH) - 1;
    let tail = network.affine_tail;
    let mut add = |name: &str, times: usize| pieces.add(format!("fixed16: {name}"), times);
    if inputs == EIGHTEEN && outputs <= EIGHTEEN {
        let few = outputs < EIGHTEEN || more_batches > 0;
        add(
            match (few, tail) {
                (false, false) => "18 inputs, 18 outputs",
                (false, true) => "18 inputs, 18 outputs, tail",
                (true, false) => "18 inputs",
                (true, true) => "18 inputs, tail",
            },
            1,
        );
        if few {
            add("18 inputs: a batch more", more_batches);
            add("18 inputs: 18 results", usize::from(outputs == EIGHTEEN));
            add("a result", if outputs == EIGHTEEN { 0 } else { outputs });
            add("18 inputs: an output's tail", if tail { outputs } else { 0 });
        }
        add("18 inputs: sixteen centres", sixteens);
        add("sixteen centres, an output", sixteens * outputs);
        return;
    }
    let (groups_of_18, last) = (outputs / EIGHTEEN, outputs % EIGHTEEN);
    let groups = groups_of_18 + usize::from(last > 0);
    add("six inputs", inputs / 6);
    add("fewer than six inputs", usize::from(inputs < 6));
    if inputs % 6 > 0 {
        add(&format!("{} inputs beyond sixes", inputs % 6), 1);
    }
    add("more than 63 inputs", usize::from(inputs > 63));
    let streams = inputs > EIGHTEEN;
    // Four or eight pairs come first, then eight at a time.
    let (first, eights_more) = if pairs.div_ceil(4) % 2 == 1 {
        ("four", pairs.div_ceil(4) / 2)
    } else {
        ("eight", pairs.div_ceil(4) / 2 - 1)
    };
    let kind =
        if streams { format!("{first} pairs, then eights") } else { format!("{pairs} pairs") };
    add(&kind, 1);
    add(&format!("{kind}: a batch more"), more_batches);
    add(&format!("{kind}: sixteen centres"), sixteens);
    if streams {
        add("a batch, eight pairs more", (1 + more_batches) * eights_more);
        add("sixteen centres, eight pairs more", sixteens * eights_more);
    }
    match (tail, pairs) {
        (false, _) => (),
        (true, 9) => {
            add("tail of nine pairs", 1);
            add("tail of nine pairs: a group", groups);
            add("tail of nine pairs: an output", outputs);
        }
        (true, _) => {
            add(if streams { "tail of inputs that stream by" } else { "tail" }, 1);
            add("tail: 18 outputs", groups_of_18);
            add("tail: the last outputs", usize::from(last > 0));
            add("tail: an output", outputs);
            add("tail: an output, four pairs", outputs * pairs.div_ceil(4));
        }
    }
    add("several groups", usize::from(groups > 1));
    add("several groups: a batch more", if groups > 1 { more_batches } else { 0 });
    add("18 outputs", groups_of_18);
    add("the last outputs", usize::from(last > 0));
    add("a result", last);
    add("18 outputs: a batch more", more_batches * groups_of_18);
    add("the last outputs: a batch more", if last > 0 { more_batches } else { 0 });
    add("an output kept for a batch more", more_batches * last);
    add("sixteen centres, a group", sixteens * groups);
    add("sixteen centres, an output", sixteens * outputs);
}

/// `taxel_f32`, from readings that are not scaled yet.
fn f32(network: &NetworkDesign, pieces: &mut Pieces) {
    let Shape { inputs, centres, outputs } = network.shape;
    let fours = centres.div_ceil(F32_AT_ONCE);
    let more_batches = fours.div_ceil(F32_BATCH) - 1;
    let tail = network.affine_tail;
    let mut add = |name: &str, times: usize| pieces.add(format!("f32: {name}"), times);
    if inputs == EIGHTEEN && outputs == EIGHTEEN && more_batches == 0 {
        add(if tail { "18 inputs, 18 outputs, tail" } else { "18 inputs, 18 outputs" }, 1);
        add("18 inputs: four centres", fours);
        pieces.add("sums of 18, together: four lines", fours);
        return;
    }
    if inputs == EIGHTEEN {
        add("18 inputs", 1);
        add("18 inputs: a batch more", more_batches);
        add("18 inputs: four centres", fours);
    } else {
        add("four inputs", inputs / 4);
        add("fewer than four inputs", usize::from(inputs < 4));
        if inputs % 4 > 0 {
            add(&format!("{} inputs beyond fours", inputs % 4), 1);
        }
        let streams = inputs > 16;
        let kind = if streams {
            "inputs that stream by".to_owned()
        } else {
            format!("up to {} inputs", inputs.next_multiple_of(4))
        };
        add(&kind, 1);
        add(&format!("{kind}: a batch more"), more_batches);
        add(&format!("{kind}: four centres"), fours);
        let last = if streams { inputs - 4 * ((inputs - 1) / 4) } else { inputs };
        add("an input to a register", last * (1 + more_batches));
        if streams {
            let streamed = (inputs - 1) / 4;
            add("four centres, four inputs that stream by", fours * streamed);
            add("four centres, a pass over those", fours * streamed.div_ceil(4));
        }
    }
    for group in Group::all(outputs) {
        let name = group.name();
        if !group.is_usual() {
            pieces.add(format!("f32: a group, {name}"), 1);
            pieces.add(format!("f32: a group, {name}: a batch more"), more_batches);
        }
        group.sums(2 * fours, group.together, pieces);
        if tail {
            let odd = inputs % 2 == 1;
            pieces.add(format!("f32: a group's tail, {name}, {}", parity(odd)), 1);
            group.sums(inputs / 2, group.together && !odd, pieces);
        }
    }
}

fn parity(odd: bool) -> &'static str {
    if odd { "odd" } else { "even" }
}

/// `taxel_project`: so many readings to so many features.
fn project(readings: usize, features: usize, pieces: &mut Pieces) {
    let odd = readings % 2 == 1;
    // An odd number of readings has an odd last group, whose piece then holds this.
    pieces.add("projection: even readings", usize::from(!odd));
    for group in Group::all(features) {
        if !group.is_usual() || odd {
            pieces.add(format!("projection: a group, {}, {}", group.name(), parity(odd)), 1);
        }
        group.sums(readings / 2, group.together && !odd, pieces);
    }
}

/// `taxel_give_rest`, once for all rows. An array's ends with the first row that is awake.
fn gate(design: &Design, gating: Gating, pieces: &mut Pieces) {
    let ModelShape { rows, inputs, outputs } = design.shape;
    let (at_rest, awake) = match gating {
        Gating::Ungated => return,
        Gating::AtRest => (rows, 0),
        Gating::Awake if design.projection => (rows - 1, 1),
        Gating::Awake => (0, rows),
    };
    let mut add = |name: &str, times: usize| pieces.add(format!("gate: {name}"), times);
    add(
        if gating == Gating::Awake && design.projection { "of an array awake" } else { "start" },
        1,
    );
    let (eighteens, beyond) = (inputs / EIGHTEEN, inputs % EIGHTEEN);
    add("18 readings", rows * eighteens);
    add("a reading beyond eighteens", rows * beyond);
    add("fewer than 18 readings", if eighteens == 0 { rows } else { 0 });
    // A row that is awake ends with its last reading.
    add("a row at rest", at_rest);
    add("a row at rest, readings beyond eighteens", if beyond > 0 { at_rest } else { 0 });
    let (all_eighteen, others) = if beyond == 0 { (awake, 0) } else { (0, awake) };
    if !design.projection {
        add("a row awake, eighteens alone", all_eighteen);
        add("a row awake", others);
    } else if others > 0 {
        add("an array's row awake beyond eighteens", others);
    }
    if outputs == EIGHTEEN {
        add("18 outputs at rest", at_rest);
    } else {
        add("four outputs at rest", at_rest * (outputs / 4));
        add("fewer than four outputs at rest", if outputs < 4 { at_rest } else { 0 });
        add("outputs at rest beyond fours", if outputs % 4 > 0 { at_rest } else { 0 });
        add("an output at rest beyond fours", at_rest * (outputs % 4));
    }
}

/// Outputs that `f32_sums` takes at once, as `f32_width` chooses them: 18, else 6, else those that are left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Group {
    width: usize,
    /// Whether there are more outputs behind 6.
    more: bool,
    /// Whether these are all outputs, so that lines of weights follow each other without gaps.
    together: bool,
}

impl Group {
    /// The groups of so many `outputs`.
    fn all(outputs: usize) -> Vec<Self> {
        let mut groups = Vec::new();
        let mut left = outputs;
        while left > 0 {
            let width = match left {
                EIGHTEEN.. => EIGHTEEN,
                7.. => 6,
                few => few,
            };
            let more = left > width && width > 5;
            // Fewer than four outputs have no loop of their own for this.
            groups.push(Self { width, more, together: width == outputs && width > 3 });
            left -= width;
        }
        groups
    }

    /// Whether the group's own code is counted with the routine's start: one kind of last group has to be, since
    /// every routine has a last group.
    fn is_usual(self) -> bool {
        self.width == EIGHTEEN && self.together
    }

    fn name(self) -> String {
        let more = if self.more { " of more" } else { "" };
        format!("{}{more}{}", self.width, if self.together { " together" } else { "" })
    }

    /// The loop over pairs of lines.
    fn sums(self, pairs: usize, together: bool, pieces: &mut Pieces) {
        if together && self.width == EIGHTEEN {
            // Four lines at once.
            pieces.add("sums of 18, together: four lines", pairs / 2);
            pieces.add("sums of 18, together: the two lines beyond fours", pairs % 2);
            return;
        }
        let how = if together { "together" } else { "apart" };
        pieces.add(format!("sums of {}, {how}: two lines", self.width), pairs);
    }
}

#[cfg(test)]
mod tests {
    use super::Group;

    #[test]
    fn outputs_are_taken_in_groups_of_18_then_6_then_the_rest() {
        let widths = |outputs| -> Vec<usize> {
            Group::all(outputs).iter().map(|group| group.width).collect()
        };
        assert_eq!(widths(18), [18]);
        assert_eq!(widths(43), [18, 18, 6, 1]);
        assert_eq!(widths(12), [6, 6]);
        assert_eq!(widths(5), [5]);
        let together: Vec<bool> =
            [3, 4, 6, 7, 18, 19].map(|outputs| Group::all(outputs)[0].together).to_vec();
        assert_eq!(together, [false, true, true, false, true, false]);
    }
}
