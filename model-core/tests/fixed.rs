//! Models of fixed size whose sizes do not fit are refused by name. (That they decode as their blobs do is tested by
//! `firmware/tests/bit_for_bit.rs` and `cargo xtask c`.)

use taxel_core::blob::Front;
use taxel_core::rbf::{arrays::F32, float32::Network};
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_core::touch::{Kind, Touch};
use taxel_core::{Fixed, Networks};

static NETWORK: F32<4, 1, 2, 0> = F32 {
    input_minimum: [50.0; 4],
    input_per_span: [0.1; 4],
    centres: [[0.5; 4]],
    decay: [2.0],
    output_weights: [[3e38, 1.0]],
    bias: [3e38, 1.0],
    affine: [],
};
const FRONT: Front<'static> = Front { outputs: 2, touch: None, projection: None };

type Model<const ROWS: usize, const SCRATCH: usize> = Fixed<Network<'static>, ROWS, 4, 2, SCRATCH>;

const fn model<const ROWS: usize, const SCRATCH: usize>() -> Model<ROWS, SCRATCH> {
    let networks = Networks::OfFrames(const { &[(FRONT, NETWORK.network())] });
    Fixed { networks, relative_inputs: false, reading_model: None }
}

#[test]
fn an_output_that_overflows_is_nan() {
    let decoded = model::<1, 4>().checked().decode(&[[55.0; 4]], None);
    assert!(decoded.outputs[0].iter().all(|y| y.is_nan()), "{decoded:?}");
    assert!(model::<1, 4>().assess(&[[55.0; 4]], None, &mut [[0.0; 2]]).is_nan());
    assert_eq!(model::<1, 4>().fill(&mut [[f32::NAN; 4]], None), 0);
}

#[test]
fn sizes_that_do_not_fit_are_named() {
    let says = |check: &(dyn Fn() + std::panic::RefUnwindSafe), says: &str| {
        let cause = std::panic::catch_unwind(check).unwrap_err();
        assert_eq!(*cause.downcast_ref::<&str>().unwrap(), says);
    };
    let rows = Networks::OfRows(const { &[NETWORK.network(); 2] });
    says(&|| _ = Model { networks: rows, ..model::<1, 4>() }.checked(), "a row has no network");
    says(&|| _ = model::<2, 8>().checked(), "networks give another number of outputs");
    says(&|| _ = model::<1, 3>().checked(), "too little working space");
    says(
        &|| _ = Model { relative_inputs: true, ..model::<1, 7>() }.checked(),
        "too little working space",
    );
    let sizes = |readings, outputs| Sizes { readings, factors: 1, components: 1, outputs };
    for (sizes, cause) in [
        (sizes(3, 2), "a reading model of other readings"),
        (sizes(4, 1), "a reading model of other outputs"),
        (sizes(4, 2), "too little working space"),
    ] {
        let block = vec![0.0; sizes.block_floats()].leak();
        let reading_model = Some(ReadingModel::of_array(sizes, block));
        says(&|| _ = Model { reading_model, ..model::<1, 4>() }.checked(), cause);
    }
    says(&|| _ = Touch::of_array(Kind::Place, &[0.0; 6]), "a touch of half a reading");
    says(&|| _ = ReadingModel::of_array(sizes(4, 2), &[]), "a reading model of another length");
}
