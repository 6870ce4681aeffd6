//! Calls everything that a device calls, on inputs of which the optimiser knows nothing.

use firmware::store::blob_in_slot;
use model_core::rls::{self, Rls};
use model_core::{ColumnWire, Decoder, Frame, RowWire, decoder_ram_bytes};

use crate::application;
use crate::opaque::{opaque, slot};
use crate::readout;

/// A decoder for the paper's sensor, as the application has one.
type PaperDecoder = Decoder<'static, 8, 18, 18>;

/// What `host-sim inspect` tells users of RAM must hold here.
const _: () = assert!(size_of::<PaperDecoder>() <= decoder_ram_bytes(8));

/// The decoder by itself, as a program of one's own calls it: the application decodes into buffers.
fn exercise_decoding() {
    let Ok(decoder) = PaperDecoder::load(blob_in_slot(slot())) else { return };

    let mut frame = opaque(Frame::missing());
    opaque(frame.set_ohm(RowWire(opaque(0)), ColumnWire(opaque(0)), opaque(60.0)));
    opaque(frame.ohm(RowWire(opaque(0)), ColumnWire(opaque(0))));
    let estimate = opaque(decoder.decode(&frame));

    let metadata = decoder.metadata();
    metadata.output_names.iter().for_each(|name| _ = opaque(name));
    metadata.training_rmse.iter().for_each(|rmse| _ = opaque(rmse));
    opaque(decoder.model_crc());

    if cfg!(feature = "must-fail") {
        opaque(estimate.outputs[opaque(0)]);
    }
}

/// Recursive least squares, which no image calls yet.
fn exercise_recalibration() {
    let Ok(mut rls) = Rls::<f32, 17, 3>::try_new(opaque(1e3), opaque(0.999)) else { return };
    rls.update(opaque([0.5; 17]), opaque([0.25; 3]));
    opaque(rls.output_weights());
}

/// Recursive least squares of sizes known only when it runs.
fn exercise_recalibration_on_slices() {
    let mut numbers = [0.0_f32; 512];
    let (root, rest) = numbers.split_at_mut(256);
    let (projection, rest) = rest.split_at_mut(128);
    let (regressor, target) = rest.split_at_mut(64);
    let n = opaque(16);
    opaque(rls::start(root, projection, n, opaque(1e3)).is_ok());
    let (Some(h), Some(y)) = (regressor.get_mut(..n), target.get_mut(..opaque(3))) else { return };
    rls::update(root, projection, h, y, opaque(0.999));
    rls::solve(root, projection, n, target);
    opaque(numbers);
}

/// Where a linker begins that is given no script: what this does not reach is left out.
#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    exercise_decoding();
    exercise_recalibration();
    exercise_recalibration_on_slices();
    application::exercise();
    readout::exercise();
    loop {
        core::hint::spin_loop();
    }
}
