use taxel_core::rbf::Format;
use taxel_data::{Dataset, Silent, Stream};
use taxel_simulate::{Synthesis, World};

use super::*;
use crate::packing::{Origin, pack};
use crate::train;
use crate::{Exponential, ModelBlob};

fn press(stream: Stream, frames: usize) -> Dataset {
    Synthesis::new(&World::press()).frames(stream, frames)
}

fn blob(data: &Dataset, options: Options) -> ModelBlob {
    let trained = train::train(data, &options, &Silent).unwrap();
    pack(&trained, data, &Origin::of_data("press", 0, 1, data)).unwrap()
}

fn options(format: Format, output_rank: Option<usize>) -> Options {
    Options {
        centres: 32,
        spread: 0.4,
        format,
        whole_array: true,
        output_rank,
        ..Options::default()
    }
}

/// Squared error of all outputs on `test`.
fn error(blob: &ModelBlob, test: &Dataset) -> f64 {
    let predicted = blob.prepare(Exponential::default()).decode_lines(&test.inputs.values);
    test.outputs.squared_errors(&predicted).iter().sum()
}

#[test]
fn each_rank_comes_nearer_to_the_full_network_in_every_format() {
    let (training, test) = (press(Stream::Training, 3000), press(Stream::Test, 1000));
    for format in Format::ALL {
        let full = error(&blob(&training, options(format, None)), &test);
        let ratios = [4, 12, 40].map(|rank| {
            let blob = blob(&training, options(format, Some(rank)));
            let model = blob.parse();
            assert_eq!(model.networks().next().unwrap().shape().outputs, rank);
            assert_eq!(model.expansion().unwrap().components(), rank);
            error(&blob, &test) / full
        });
        assert!(ratios[0] > 1.3 && ratios[1] > 1.005, "{format:?}: {ratios:?}");
        assert!(ratios[0] > ratios[1], "{format:?}: {ratios:?}");
        // Few components also leave out what is noise, so that a test error may even be less.
        assert!((0.999..1.001).contains(&ratios[2]), "{format:?}: {ratios:?}");
    }
}

/// All errors are of the training frames, where the directions are the best ones there are.
#[test]
fn no_other_directions_fit_better() {
    let data = press(Stream::Training, 2000);
    let parameters = train::projection::fit(&data, None).unwrap();
    let seen = train::projection::apply(train::projection::view(&parameters, &data), &data);
    let table = seen.row_table(0);
    let samples = Samples::new(&table);
    let options = options(Format::F32Direct, Some(6));
    let centres = samples.centres(&options, 0);
    let best = expansion(&samples, &samples.layer(centres.clone(), &options), 6, &options);
    let outputs = table.outputs.names.len();
    // What is left of the targets after a projection on the network's predictions along six directions.
    let error = |block: &[f32]| {
        let of_components =
            RowTable { outputs: components(block, 6, &table.outputs), ..table.clone() };
        let samples = Samples { table: &of_components, ..samples.clone() };
        let fitted = samples.fit(&centres, &Options { output_rank: None, ..options }).unwrap();
        let inferred =
            crate::infer::infer(&fitted.network(), Exponential::default(), &table.inputs.values);
        let predicted = expand(Expansion::new(6, outputs, block).unwrap(), &inferred);
        table.outputs.squared_errors(&predicted).iter().sum::<f64>()
    };
    let least = error(&best);
    for direction in 0..6 {
        for other in [0, 50, 143] {
            // Turned by a tenth of a radian towards another output.
            let mut turned = best.clone();
            let line = &mut turned[(1 + direction) * outputs..][..outputs];
            line[other] += 0.1;
            let length = line.iter().map(|part| part * part).sum::<f32>().sqrt();
            line.iter_mut().for_each(|part| *part /= length);
            assert!(error(&turned) > least, "direction {direction}, output {other}");
        }
    }
}

#[test]
fn a_line_with_a_missing_component_has_no_output() {
    let block = [0.5, 1.0, 2.0, 3.0];
    let expansion = Expansion::new(1, 2, &block).unwrap();
    let values = expand(expansion, &[1.0, f64::NAN, 2.0]);
    assert_eq!((&values[..2], &values[4..]), (&[2.5, 4.0][..], &[4.5, 7.0][..]));
    assert!(values[2..4].iter().all(|value| value.is_nan()));
}

#[test]
fn ranks_that_save_nothing_are_refused() {
    let data = press(Stream::Training, 300);
    let refusal =
        |options: Options| train::train(&data, &options, &Silent).unwrap_err().to_string();
    for rank in [0, 144, 1000] {
        let message = refusal(options(Format::F32, Some(rank)));
        assert!(message.contains("1 to 143"), "{message}");
    }
    let of_rows = Options { whole_array: false, ..options(Format::F32, Some(8)) };
    assert!(refusal(of_rows).contains("whole array"));
}
