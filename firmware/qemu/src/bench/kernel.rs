//! The kernels that are measured: number formats, each with an exponential or in portable Rust.

use core::marker::PhantomData;

use model_core::blob::Model;
use model_core::exp::ExpKernel;
use model_core::rbf::{Format, Network};
use model_core::{Decoder, Estimate, Gate, RowStatus};

/// Number of rows, as in the paper's sensor.
pub const ROWS: usize = 8;
/// Number of readings a row.
pub const COLS: usize = 18;
/// Number of outputs a row.
pub const OUTPUTS: usize = 18;

/// Readings in Ω, row after row.
pub type Frame = [[f32; COLS]; ROWS];

/// Outputs and status of all rows.
#[derive(Clone, Copy)]
pub struct Decoded {
    pub outputs: [[f32; OUTPUTS]; ROWS],
    pub status: [RowStatus; ROWS],
}

impl Decoded {
    pub const NOTHING: Self =
        Self { outputs: [[f32::NAN; OUTPUTS]; ROWS], status: [RowStatus::MissingReading; ROWS] };

    /// Decodes `frame` as the firmware does.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the firmware's call alone is measured")]
    pub fn decode<E: ExpKernel>(
        &mut self,
        decoder: &Decoder<'_, ROWS>,
        frame: &Frame,
        gate: Option<Gate<'_>>,
        scratch: &mut [f32],
    ) {
        let outputs = self.outputs.as_flattened_mut();
        let mut estimate = Estimate { outputs, status: &mut self.status };
        let frame = model_core::Frame { gate, ..frame.as_flattened().into() };
        let _ = decoder.decode_with::<E>(frame, scratch, &mut estimate);
    }
}

/// Number of floats of working space for any model.
pub const SCRATCH: usize = 2 * COLS;

/// One way to decode: a number format, with an exponential or in portable Rust. Every function only calls
/// what the firmware calls.
pub trait Kernel {
    /// The decoder of frames.
    type Decoder<'a>;

    /// The decoder of `model`, whose networks have `format`; `None` if this kernel is for another format.
    fn of<'a>(model: &Model<'a>, format: Format) -> Option<Self::Decoder<'a>>;

    /// Infers a row's outputs from scaled inputs, which are overwritten.
    fn infer(network: &Network<'_>, scaled: &mut [f32; COLS], outputs: &mut [f32; OUTPUTS]);

    /// Infers a row's outputs from readings in Ω.
    fn infer_row(
        network: &Network<'_>,
        readings_ohm: &[f32; COLS],
        scaled: &mut [f32; COLS],
        outputs: &mut [f32; OUTPUTS],
    );

    /// Decodes a frame to the outputs of every row.
    fn decode(decoder: &Self::Decoder<'_>, frame: &Frame, outcome: &mut Decoded);
}

/// The decoder of `model`; `None` if the model is for another sensor.
#[inline(never)] // frees the stack that building the decoder needs
pub fn decoder<'a>(model: &Model<'a>) -> Option<Decoder<'a, ROWS>> {
    Decoder::of(*model).ok()
}

/// The number format `F`, with the exponential `E` if the format has a choice.
pub struct Formatted<F, E>(PhantomData<(F, E)>);

/// A type that names a number format.
pub trait Which {
    /// The number format that the type names.
    const FORMAT: Format;
}

/// The type that names [`Format::F32Direct`].
pub struct F32Direct;
/// The type that names [`Format::F32`].
pub struct F32;
/// The type that names [`Format::Fixed16`].
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
    type Decoder<'a> = Decoder<'a, ROWS>;

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
    fn decode(decoder: &Self::Decoder<'_>, frame: &Frame, outcome: &mut Decoded) {
        outcome.decode::<E>(decoder, frame, None, &mut [0.0; SCRATCH]);
    }
}

/// The number format `F` in portable Rust: the compiled twin of its assembly routine.
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
    fn decode(model: &Self::Decoder<'_>, frame: &Frame, outcome: &mut Decoded) {
        let mut scaled = [0.0; COLS];
        let rows = frame.iter().zip(&mut outcome.outputs);
        for (row, (readings, outputs)) in rows.enumerate() {
            let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
            if let Some(network) = network {
                Self::infer_row(&network, readings, &mut scaled, outputs);
            }
        }
        outcome.status = [RowStatus::Decoded; ROWS];
    }
}
