//! The ways to decode that are measured.

use core::marker::PhantomData;

use model_core::blob::Model;
use model_core::exp::ExpKernel;
use model_core::rbf::{Format, Network};
use model_core::{Decoder, Estimate, Frame, RowStatus};

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

    /// The decoder of `model`, whose networks have `format`; `None` if it is made for another kernel.
    fn of<'a>(model: &Model<'a>, format: Format) -> Option<Self::Decoder<'a>>;

    /// A row's outputs from scaled inputs, which are used up.
    fn infer(network: &Network<'_>, scaled: &mut [f32; COLS], outputs: &mut [f32; OUTPUTS]);

    /// A row's outputs from readings in ohm.
    fn infer_row(
        network: &Network<'_>,
        readings_ohm: &[f32; COLS],
        scaled: &mut [f32; COLS],
        outputs: &mut [f32; OUTPUTS],
    );

    /// Every row's outputs from a frame.
    fn decode(
        decoder: &Self::Decoder<'_>,
        frame: &Frame<ROWS, COLS>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    );
}

/// The decoder of `model`; `None` if it is for another sensor.
#[inline(never)] // what it is put together from leaves the stack again
pub fn decoder<'a>(model: &Model<'a>) -> Option<Decoder<'a, ROWS, COLS, OUTPUTS>> {
    Decoder::of(*model).ok()
}

/// A format of networks, with one of the exponentials where it has a choice.
pub struct Formatted<F, E>(PhantomData<(F, E)>);

/// Which format.
pub trait Which {
    /// This one.
    const FORMAT: Format;
}

/// [`Format::F32Direct`]
pub struct F32Direct;
/// [`Format::F32`]
pub struct F32;
/// [`Format::Fixed16`]
pub struct Fixed16;

impl Which for F32Direct {
    const FORMAT: Format = Format::F32Direct;
}

impl Which for F32 {
    const FORMAT: Format = Format::F32;
}

impl Which for Fixed16 {
    const FORMAT: Format = Format::Fixed16;
}

impl<F: Which, E: ExpKernel> Kernel for Formatted<F, E> {
    type Decoder<'a> = Decoder<'a, ROWS, COLS, OUTPUTS>;

    fn of<'a>(model: &Model<'a>, format: Format) -> Option<Self::Decoder<'a>> {
        if format == F::FORMAT { decoder(model) } else { None }
    }

    #[inline(never)]
    fn infer(network: &Network<'_>, scaled: &mut [f32; COLS], outputs: &mut [f32; OUTPUTS]) {
        let _ = network.infer_scaled_with::<E>(scaled, outputs);
    }

    #[inline(never)]
    fn infer_row(
        network: &Network<'_>,
        readings_ohm: &[f32; COLS],
        scaled: &mut [f32; COLS],
        outputs: &mut [f32; OUTPUTS],
    ) {
        let _ = network.infer_with::<E>(readings_ohm, scaled, outputs);
    }

    #[inline(never)]
    fn decode(
        decoder: &Self::Decoder<'_>,
        frame: &Frame<ROWS, COLS>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        decoder.decode_with::<E>(frame, None, estimate);
    }
}

/// The compiled twin of a format's assembly.
pub struct Portable<F>(PhantomData<F>);

impl<F: Which> Kernel for Portable<F> {
    type Decoder<'a> = Model<'a>;

    fn of<'a>(model: &Model<'a>, format: Format) -> Option<Self::Decoder<'a>> {
        (format == F::FORMAT && format != Format::F32Direct).then_some(*model)
    }

    #[inline(never)]
    fn infer(network: &Network<'_>, scaled: &mut [f32; COLS], outputs: &mut [f32; OUTPUTS]) {
        match network {
            Network::F32Direct(_) => (),
            Network::F32(network) => network.infer_scaled_portably(scaled, outputs),
            Network::Fixed16(network) => network.infer_scaled_portably(scaled, outputs),
        }
    }

    #[inline(never)]
    fn infer_row(
        network: &Network<'_>,
        readings_ohm: &[f32; COLS],
        scaled: &mut [f32; COLS],
        outputs: &mut [f32; OUTPUTS],
    ) {
        let _ = network.scale(readings_ohm, scaled);
        Self::infer(network, scaled, outputs);
    }

    #[inline(never)]
    fn decode(
        model: &Self::Decoder<'_>,
        frame: &Frame<ROWS, COLS>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        let mut scaled = [0.0; COLS];
        let rows = frame.row_column_resistance_ohm.iter().zip(&mut estimate.outputs);
        for (row, (readings, outputs)) in rows.enumerate() {
            let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
            if let Some(network) = network {
                Self::infer_row(&network, readings, &mut scaled, outputs);
            }
        }
        estimate.status = [RowStatus::Decoded; ROWS];
    }
}
