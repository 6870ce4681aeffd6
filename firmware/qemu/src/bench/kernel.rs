//! The kernels of one row that are measured: number formats, each with an exponential or in portable Rust.

use core::marker::PhantomData;

use taxel_core::blob::Model;
use taxel_core::exp::ExpKernel;
use taxel_core::rbf::{Format, Network};

/// Number of readings a row, as in the paper's sensor.
pub const COLS: usize = 18;
/// Number of outputs a row.
pub const OUTPUTS: usize = 18;

/// One way to infer a row: a number format, with an exponential or in portable Rust. Every function only calls
/// what the firmware calls.
pub trait Kernel {
    /// The number format that this kernel is for.
    const FORMAT: Format;

    /// Infers a row's outputs from scaled inputs, which are overwritten.
    fn infer(network: &Network<'_>, scaled: &mut [f32; COLS], outputs: &mut [f32; OUTPUTS]);

    /// Infers a row's outputs from readings in Ω.
    fn infer_row(
        network: &Network<'_>,
        readings_ohm: &[f32; COLS],
        scaled: &mut [f32; COLS],
        outputs: &mut [f32; OUTPUTS],
    );
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
    const FORMAT: Format = F::FORMAT;

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
}

/// The number format `F` in portable Rust: the compiled twin of its assembly routine.
pub struct Portable<F>(PhantomData<F>);

impl<F: Which> Kernel for Portable<F> {
    const FORMAT: Format = F::FORMAT;

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
}

impl<F: Which> Portable<F> {
    /// Decodes a frame, row after row. It finds each row's network in the blob anew.
    #[inline(never)]
    pub fn decode(model: &Model<'_>, frame: &[[f32; COLS]], outputs: &mut [[f32; OUTPUTS]]) {
        let mut scaled = [0.0; COLS];
        for (row, (readings, outputs)) in frame.iter().zip(outputs).enumerate() {
            let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
            if let Some(network) = network {
                Self::infer_row(&network, readings, &mut scaled, outputs);
            }
        }
    }
}
