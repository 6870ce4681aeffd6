use taxel_data::{Silent, Stream};
use taxel_simulate::{Synthesis, World};

use super::super::Trained;
use super::*;
use crate::infer::{Exponential, infer};
use crate::train::InputScale;

fn world() -> World {
    let mut world = World::press();
    world.read_rows = vec![3, 4];
    world
}

fn options() -> Options {
    Options { centres: 10, solver: Solver::Rls(Recursive::default()), ..Options::default() }
}

/// Trains on so many frames of a press, in pieces of this length after the first ones.
fn by_recursion(
    frames: usize,
    first: usize,
    piece: usize,
    options: &Options,
    test: Option<&Dataset>,
) -> (Trained, Vec<Learned>) {
    let world = world();
    let synthesis = Synthesis::new(&world);
    let first_frames = synthesis.frames(Stream::Training, first);
    let starts = (first..frames).step_by(piece);
    let rest = starts
        .map(|start| Ok(synthesis.frames_from(Stream::Training, start, piece.min(frames - start))));
    let count = Some(frames);
    let frames = Frames { first: &first_frames, rest: Box::new(rest), count, test };
    train(frames, options, None, &Silent).unwrap()
}

#[test]
fn the_cut_of_the_frames_changes_nothing() {
    let options = options();
    let whole = by_recursion(1500, 400, 1100, &options, None).0;
    let pieces = by_recursion(1500, 400, 37, &options, None).0;
    assert_eq!((&whole.networks, whole.frames), (&pieces.networks, 1500));
}

#[test]
fn without_a_rest_the_networks_are_those_of_training_in_memory() {
    let frames = Synthesis::new(&world()).frames(Stream::Training, 900);
    for (format, whole_array) in
        [(Format::F32, false), (Format::Fixed16, false), (Format::F32Direct, true)]
    {
        let options = Options { format, whole_array, ..options() };
        let streamed = by_recursion(900, 900, 1, &options, None).0;
        let in_memory = super::super::train(&frames, &options, &Silent).unwrap();
        assert_eq!(streamed.networks, in_memory.networks, "{}", format.name());
    }
}

#[test]
fn the_learning_curve_falls_and_ends_with_the_last_frame() {
    let test = Synthesis::new(&world()).frames(Stream::Test, 300);
    let (_, curve) = by_recursion(1500, 400, 300, &options(), Some(&test));
    let frames: Vec<usize> = curve.iter().map(|point| point.frames).collect();
    assert_eq!(frames, [10, 20, 50, 100, 200, 500, 1000, 1500]);
    let error = |point: &Learned| point.rmse.iter().map(|rmse| rmse * rmse).sum::<f64>().sqrt();
    assert!(error(&curve[7]) < 0.7 * error(&curve[1]), "{curve:?}");
    assert_eq!((curve[0].judged_frames, curve[0].rmse.len()), (300, 36));
}

#[test]
fn without_test_frames_the_curve_is_measured_on_the_next_ones() {
    let (_, curve) = by_recursion(700, 400, 300, &options(), None);
    let points: Vec<[usize; 2]> = curve.iter().map(|p| [p.frames, p.judged_frames]).collect();
    // A piece ends after 400 frames, the stream after 700.
    assert_eq!(points, [[10, 10], [20, 30], [50, 50], [100, 100], [200, 200], [500, 200]]);
}

#[test]
fn an_error_of_the_stream_ends_the_training() {
    let first = Synthesis::new(&world()).frames(Stream::Training, 50);
    let path = std::path::Path::new("log.csv");
    let problem = taxel_data::error::Problem::NoLines;
    let rest = [Err(taxel_data::Error::file(path, problem))].into_iter();
    let frames = Frames { first: &first, rest: Box::new(rest), count: None, test: None };
    let refused = train(frames, &options(), None, &Silent).unwrap_err().to_string();
    assert!(refused.starts_with("log.csv: "), "{refused}");
}

#[test]
fn a_piece_with_other_columns_is_refused() {
    let first = Synthesis::new(&world()).frames(Stream::Training, 50);
    let mut other = first.clone();
    other.outputs.names.swap(0, 1);
    let rest = Box::new([Ok(other)].into_iter());
    let frames = Frames { first: &first, rest, count: None, test: None };
    let refused = train(frames, &options(), None, &Silent).unwrap_err().to_string();
    assert!(refused.starts_with("columns = "), "{refused}");
}

/// The first frames have all outputs; of later ones, some lack the first output and some all but that.
#[test]
fn a_recursion_learns_each_output_from_the_frames_that_have_it() {
    let mut frames = Synthesis::new(&World { read_rows: vec![3], ..World::press() })
        .frames(Stream::Training, 1500);
    let width = frames.outputs.names.len();
    for (number, line) in frames.outputs.values.chunks_exact_mut(width).enumerate().skip(400) {
        match number % 3 {
            0 => line[0] = f64::NAN,
            1 if number > 1000 => line[1..].fill(f64::NAN),
            _ => (),
        }
    }
    let options = Options { format: Format::F32Direct, ..options() };
    let part = |range: Range<usize>| frames.subset(&range.collect::<Vec<_>>());
    let first = part(0..400);
    let rest = (400..1500).step_by(130).map(|start| Ok(part(start..1500.min(start + 130))));
    let count = Some(1500);
    let given = Frames { first: &first, rest: Box::new(rest), count, test: None };
    let (streamed, curve) = train(given, &options, None, &Silent).unwrap();
    assert!(curve.iter().all(|point| point.rmse.iter().all(|rmse| rmse.is_finite())), "{curve:?}");
    // The same layers, with weights of all frames at once.
    let layers = Layers::start(&first, &options).unwrap();
    let table = frames.row_table(0);
    let samples = Samples { scale: InputScale::new(&first.row_table(0)), ..Samples::new(&table) };
    let by_qr = Options { solver: Solver::Qr, ..options };
    let at_once = samples.fit_layer(&layers.hidden[0], &by_qr).unwrap();
    let [streamed, at_once] = [&streamed.networks[0], &at_once]
        .map(|it| infer(&it.network(), Exponential::default(), &frames.inputs.values));
    let deviations = frames.outputs.deviations();
    for (column, deviation) in deviations.into_iter().enumerate() {
        let pairs = streamed.iter().zip(&at_once).skip(column).step_by(width);
        let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(most < 1e-3 * deviation, "{column}: {most} of {deviation}");
    }
}
