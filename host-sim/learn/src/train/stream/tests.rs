use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_simulate::{Synthesis, World};

use super::super::Trained;
use super::*;

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
        let rank = whole_array.then_some(12);
        let options = Options { format, whole_array, output_rank: rank, ..options() };
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
