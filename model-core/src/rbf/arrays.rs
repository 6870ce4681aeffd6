//! Networks in arrays of fixed size, for programs that never change their model.
//!
//! Numbers are not checked: wrong ones give wrong outputs, but no panic. Sizes are part of the types, and those that
//! do not fit each other are errors of the compiler.
#![expect(unsafe_code, reason = "the assembly reads all words of a network one after the other")]

use super::fixed16::CENTRES_AT_ONCE;
use super::{Shape, fixed16, float32};

/// Network in [`f32`](super::Format::F32). `TAIL` is the number of inputs, or 0 without an affine tail.
///
/// With x the [scaled](crate::scale) readings, the outputs are A·x + Σ_k ω_k·exp(−d_k·‖x − c_k‖²) + b.
#[derive(Debug, Clone, PartialEq)]
pub struct F32<
    const INPUTS: usize,
    const CENTRES: usize,
    const OUTPUTS: usize,
    const TAIL: usize = INPUTS,
> {
    /// Smallest reading of each input in training, in the reading's unit.
    pub input_minimum: [f32; INPUTS],
    /// 1/(maximum − minimum) of each input; 0 for a channel that never changed.
    pub input_per_span: [f32; INPUTS],
    /// Centres c on scaled inputs.
    pub centres: [[f32; INPUTS]; CENTRES],
    /// Decay d = 1/(2σ²) of each centre, on scaled inputs.
    pub decay: [f32; CENTRES],
    /// Output weights ω of each centre, in the outputs' units.
    pub output_weights: [[f32; OUTPUTS]; CENTRES],
    /// Bias b in the outputs' units.
    pub bias: [f32; OUTPUTS],
    /// Affine tail A on scaled inputs, one array an input.
    pub affine: [[f32; OUTPUTS]; TAIL],
}

impl<const INPUTS: usize, const CENTRES: usize, const OUTPUTS: usize, const TAIL: usize>
    F32<INPUTS, CENTRES, OUTPUTS, TAIL>
{
    /// The network of these arrays.
    pub const fn network(&self) -> float32::Network<'_> {
        const { assert!(INPUTS > 0 && CENTRES > 0 && OUTPUTS > 0, "a dimension is zero") };
        const { assert!(TAIL == INPUTS || TAIL == 0, "the tail has other inputs") };
        let shape = Shape { inputs: INPUTS, centres: CENTRES, outputs: OUTPUTS };
        let parameters = float32::Parameters {
            input_minimum: &self.input_minimum,
            input_per_span: &self.input_per_span,
            centres: self.centres.as_flattened(),
            decay: &self.decay,
            output_weights: self.output_weights.as_flattened(),
            bias: &self.bias,
            affine: self.affine.as_flattened(),
        };
        float32::Network::of_arrays(shape, parameters)
    }
}

/// Network in [`fixed16`](super::Format::Fixed16), whose [page](super::fixed16) has the units. `TAIL` is the number of
/// outputs, or 0 without an affine tail.
///
/// Two inputs are a pair, and sixteen centres a group; what is missing of the last pair and group is 0.
#[derive(Debug, Clone, PartialEq)]
#[repr(C)]
pub struct Fixed16<
    const INPUTS: usize,
    const CENTRES: usize,
    const OUTPUTS: usize,
    const PAIRS: usize,
    const GROUPS: usize,
    const TAIL: usize = OUTPUTS,
> {
    /// Middle of each input's training range, in the reading's unit.
    pub input_midpoint: [f32; INPUTS],
    /// Number of units in one unit of the reading; 0 for a channel that never changed.
    pub input_per_unit: [f32; INPUTS],
    /// Decay g of all centres.
    pub decay: u32,
    /// Bias in units of the sums.
    pub bias: [i32; OUTPUTS],
    /// Value of one unit of a sum, in the outputs' units.
    pub output_scale: [f32; OUTPUTS],
    /// Affine tail, one array an output.
    pub affine: [[[i16; 2]; PAIRS]; TAIL],
    /// Centres, and their output weights.
    pub groups: [Group<PAIRS, OUTPUTS>; GROUPS],
}

/// Sixteen centres of a network in [`fixed16`](super::Format::Fixed16).
#[derive(Debug, Clone, PartialEq)]
#[repr(C)]
pub struct Group<const PAIRS: usize, const OUTPUTS: usize> {
    /// Exponent of each centre.
    pub exponents: [Exponent<PAIRS>; CENTRES_AT_ONCE],
    /// Output weights of pairs of centres, one array an output.
    pub weights: [[[i16; 2]; CENTRES_AT_ONCE / 2]; OUTPUTS],
}

/// Exponent b + a·x + g‖x‖² of a centre.
#[derive(Debug, Clone, PartialEq)]
#[repr(C)]
pub struct Exponent<const PAIRS: usize> {
    /// b.
    pub b: u32,
    /// a of pairs of inputs.
    pub a: [[i16; 2]; PAIRS],
}

impl<
    const INPUTS: usize,
    const CENTRES: usize,
    const OUTPUTS: usize,
    const PAIRS: usize,
    const GROUPS: usize,
    const TAIL: usize,
> Fixed16<INPUTS, CENTRES, OUTPUTS, PAIRS, GROUPS, TAIL>
{
    /// The network of these arrays.
    ///
    /// # Panics
    /// If a dimension is zero, or there are too many inputs.
    pub const fn network(&self) -> fixed16::Network<'_> {
        const { assert!(PAIRS == INPUTS.div_ceil(2), "there are other pairs than of the inputs") };
        const { assert!(GROUPS == CENTRES.div_ceil(CENTRES_AT_ONCE), "groups of other centres") };
        const { assert!(TAIL == OUTPUTS || TAIL == 0, "the tail has other outputs") };
        let shape = Shape { inputs: INPUTS, centres: CENTRES, outputs: OUTPUTS };
        match fixed16::Network::with_length_checked(shape, TAIL > 0, self.words()) {
            Ok(network) => network,
            Err(_) => panic!("a dimension is zero, or there are too many inputs"),
        }
    }

    /// All words, in the order of the [block](fixed16::Network::block).
    const fn words(&self) -> &[u32] {
        let this = core::ptr::from_ref(self).cast::<u32>();
        // SAFETY: the struct is aligned as its words are. In C's layout its fields, of four bytes or pairs of two,
        // follow each other without a gap, and every bit pattern is a word.
        unsafe { core::slice::from_raw_parts(this, size_of::<Self>() / size_of::<u32>()) }
    }
}
