//! The ways to infer a row that are measured: a number format as the firmware calls it, or in portable Rust.

use taxel_core::blob::Model;
use taxel_core::rbf::{Network, fixed16};

/// Number of readings a row, as in the paper's sensor.
pub const COLS: usize = 18;
/// Number of outputs a row.
pub const OUTPUTS: usize = 18;

/// Infers a row's outputs from scaled inputs, which are overwritten, as the firmware does.
#[inline(never)]
pub fn infer(network: &Network<'_>, scaled: &mut [f32], outputs: &mut [f32]) {
    let _ = network.infer_scaled(scaled, outputs);
}

/// Infers a row's outputs from readings in Ω, as the firmware does.
#[inline(never)]
pub fn infer_row(
    network: &Network<'_>,
    readings_ohm: &[f32; COLS],
    scaled: &mut [f32; COLS],
    outputs: &mut [f32; OUTPUTS],
) {
    let _ = network.infer(readings_ohm, scaled, outputs);
}

/// Infers a row's outputs from scaled inputs by the compiled twin of the assembly.
#[inline(never)]
pub fn infer_portably(
    network: &fixed16::Network<'_>,
    scaled: &mut [f32; COLS],
    outputs: &mut [f32; OUTPUTS],
) {
    network.infer_scaled_portably(scaled, outputs);
}

/// Infers a row's outputs from readings in Ω by the compiled twin.
#[inline(never)]
pub fn infer_row_portably(
    network: &fixed16::Network<'_>,
    readings_ohm: &[f32; COLS],
    scaled: &mut [f32; COLS],
    outputs: &mut [f32; OUTPUTS],
) {
    let _ = Network::from(*network).scale(readings_ohm, scaled);
    infer_portably(network, scaled, outputs);
}

/// Decodes a frame by the compiled twin, row after row. It finds each row's network in the blob anew.
#[inline(never)]
pub fn decode_portably(model: &Model<'_>, frame: &[[f32; COLS]], outputs: &mut [[f32; OUTPUTS]]) {
    let mut scaled = [0.0; COLS];
    for (row, (readings, outputs)) in frame.iter().zip(outputs).enumerate() {
        let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
        if let Some(Network::Fixed16(network)) = network {
            infer_row_portably(&network, readings, &mut scaled, outputs);
        }
    }
}
