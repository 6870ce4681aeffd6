//! Models with inputs relative to the baseline: what they take, and what cancels in it.

use taxel_data::{Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack, relative};
use taxel_simulate::{Synthesis, World};

#[test]
fn readings_are_divided_before_everything_else() {
    let world = World { read_rows: vec![3, 4], ..World::press() };
    let synthesis = Synthesis::new(&world);
    let readings = synthesis.frames(Stream::Training, 1500);
    let training = relative::dataset(readings, &synthesis.baselines(Stream::Training, 1500, 100));
    let options = Options { centres: 16, ..Options::of_rows() };
    let trained = train(&training, &options, &Silent).unwrap();
    let blob = pack(&trained, &training, &Origin::of_data("ratios", 0, 1, &training)).unwrap();
    let model = blob.prepare();
    let metadata = model.model().metadata();
    assert!(metadata.relative_inputs);
    assert_eq!(metadata.input_units.iter().collect::<Vec<_>>(), [""; 36]);
    assert_eq!(metadata.input_names.iter().next(), Some("r4c1_ohm"));

    let readings = synthesis.frames(Stream::Test, 70).inputs.values;
    let baseline = synthesis.baselines(Stream::Test, 1, 100).values;
    let with_baseline = model.clone().with_baseline(&baseline);
    assert_eq!(with_baseline.share_out_of_range(&readings), 0.0);
    // The same ratios, computed outside.
    let ratios = with_baseline.model_inputs(&readings);
    assert_eq!(with_baseline.decode_lines(&readings), model.of_inputs().decode_lines(&ratios));
}
