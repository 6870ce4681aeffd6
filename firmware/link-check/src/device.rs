//! Calls every function that a device calls, on inputs that are opaque to the optimiser.

use taxel_core::{ColumnWire, Decoder, Estimate, RowStatus, RowWire, Wires, decoder_ram_bytes};
use taxel_firmware::store::blob_in_slot;

use crate::application;
use crate::opaque::{opaque, slot};
use crate::readout;

/// A decoder for the paper's sensor, as in the application.
type PaperDecoder = Decoder<'static, 8>;

/// The RAM figure of `host-sim inspect` must be at least the compiler's.
const _: () = assert!(size_of::<PaperDecoder>() <= decoder_ram_bytes(8));

/// Calls the decoder directly, as a user's own program does; the application decodes into buffers.
fn exercise_decoding() {
    let Ok(decoder) = PaperDecoder::load(blob_in_slot(slot())) else { return };

    let wires = opaque(Wires { rows: 8, columns: 18 });
    opaque(wires.place(RowWire(opaque(0)), ColumnWire(opaque(0))));
    let frame = opaque([60.0; 144]);
    let (mut outputs, mut status) = (opaque([0.0; 144]), [RowStatus::MissingReading; 8]);
    let mut scratch = [0.0; 288];
    let length = |all: usize| opaque(all);
    let (Some(frame), Some(outputs)) = (frame.get(..length(144)), outputs.get_mut(..length(144)))
    else {
        return;
    };
    let mut estimate = Estimate { outputs, status: &mut status };
    opaque(decoder.decode_into(frame.into(), &mut scratch, &mut estimate).is_ok());
    let mut deviation = opaque([0.0; 144]);
    let Some(of_outputs) = deviation.get_mut(..length(144)) else { return };
    opaque(decoder.assess_into(frame.into(), &mut scratch, of_outputs).is_ok());
    opaque(deviation);
    opaque((decoder.shape(), decoder.scratch_floats()));

    let metadata = decoder.metadata();
    metadata.output_names.iter().for_each(|name| _ = opaque(name));
    opaque(metadata.output_names.position(opaque("r1e1_dz_mm")));
    metadata.training_rmse.iter().for_each(|rmse| _ = opaque(rmse));
    opaque(decoder.model_crc());

    opaque(&*estimate.outputs);
    if cfg!(feature = "must-fail") {
        opaque(estimate.outputs[opaque(0)]);
    }
}

/// Entry point for a linker without a script: it leaves out whatever this function does not reach.
#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    exercise_decoding();
    application::exercise();
    readout::exercise();
    loop {
        core::hint::spin_loop();
    }
}
