//! The ways to decode that are measured.

use core::marker::PhantomData;

use model_core::exp::ExpKernel;
use model_core::rbf::Network;
use model_core::{Decoder, Estimate, Frame};

/// Rows of the sensor, as of the paper's.
pub const ROWS: usize = 8;
/// Readings of a row.
pub const COLS: usize = 18;
/// Outputs of a row.
pub const OUTPUTS: usize = 18;

/// One way to decode. Every function is a call of what the firmware calls, and nothing besides.
pub trait Kernel {
    /// A decoder of frames.
    type Decoder<'a>;

    /// The decoder of `blob`; `None` if the blob is unsound or made for another kernel.
    fn load(blob: &[u8]) -> Option<Self::Decoder<'_>>;

    /// A row's outputs from scaled inputs, without the affine tail.
    fn infer(network: &Network<'_>, scaled: &[f32; COLS]) -> Option<[f32; OUTPUTS]>;

    /// A row's outputs from readings in ohm.
    fn infer_row(network: &Network<'_>, readings_ohm: &[f32; COLS]) -> Option<[f32; OUTPUTS]>;

    /// Every row's outputs from a frame.
    fn decode(
        decoder: &Self::Decoder<'_>,
        frame: &Frame<ROWS, COLS>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    );
}

/// Distances by differences, in f32, with one of the exponentials.
pub struct F32Direct<E>(PhantomData<E>);

impl<E: ExpKernel> Kernel for F32Direct<E> {
    type Decoder<'a> = Decoder<'a, ROWS, COLS, OUTPUTS, E>;

    fn load(blob: &[u8]) -> Option<Self::Decoder<'_>> {
        Decoder::load(blob).ok()
    }

    #[inline(never)]
    fn infer(network: &Network<'_>, scaled: &[f32; COLS]) -> Option<[f32; OUTPUTS]> {
        network.infer_scaled::<E, COLS, OUTPUTS>(scaled).ok()
    }

    #[inline(never)]
    fn infer_row(network: &Network<'_>, readings_ohm: &[f32; COLS]) -> Option<[f32; OUTPUTS]> {
        network.infer_array::<E, COLS, OUTPUTS>(readings_ohm).ok()
    }

    #[inline(never)]
    fn decode(
        decoder: &Self::Decoder<'_>,
        frame: &Frame<ROWS, COLS>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        decoder.decode_into(frame, estimate);
    }
}
