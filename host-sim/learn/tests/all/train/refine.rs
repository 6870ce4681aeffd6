//! Refined training: its loss, its descent, and what it gains.

use std::sync::atomic::{AtomicUsize, Ordering};

use taxel_core::rbf::Format;
use taxel_data::{Dataset, Progress, Purpose, Random, Silent, Stream};
use taxel_learn::infer::infer;
use taxel_learn::train::refine::adam::Adam;
use taxel_learn::train::refine::loss::{Loss, held_out_errors, on_held_out, on_same};
use taxel_learn::train::refine::movable::{Movable, Piece, Sizes};
use taxel_learn::train::refine::{refine, width};
use taxel_learn::train::{
    Examples, Found, FreshFrames, Options, Refinement, Samples, Start, Trained, train,
    train_refined,
};
use taxel_learn::{Origin, pack};
use taxel_simulate::{Synthesis, World};

fn draws(purpose: u64) -> impl FnMut() -> f64 {
    let mut random = Random::new(11, Stream::Test, Purpose::Damage, purpose, 0);
    move || random.between([-1.0, 1.0])
}

/// Random samples: their inputs, and their outputs.
fn samples(inputs: usize, outputs: usize, samples: usize, purpose: u64) -> (Vec<f64>, Vec<f64>) {
    let mut draw = draws(purpose);
    let x: Vec<f64> = (0..samples * inputs).map(|_| draw()).collect();
    let lines = x.chunks_exact(inputs);
    let y: Vec<f64> = lines
        .flat_map(|x| {
            (0..outputs).map(|o| (2.0 * x[o % inputs] + o as f64).sin() * x[0]).collect::<Vec<_>>()
        })
        .map(|y| y + 0.1 * draw())
        .collect();
    (x, y)
}

/// Compares every part of the gradient with a difference of losses.
fn gradient_is_the_slope(sizes: Sizes, loss: &dyn Fn(&Movable) -> Loss) {
    let mut draw = draws(5);
    let centres: Vec<f64> = (0..sizes.centres * sizes.inputs).map(|_| draw()).collect();
    let mix: Vec<f64> = (0..sizes.sources * sizes.inputs).map(|_| draw()).collect();
    let movable = Movable::new(sizes, &centres, 0.8 + 0.3 * draw(), &mix);
    let found = loss(&movable).gradient;
    assert_eq!(found.len(), movable.values.len());
    let scale = found.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
    for (place, slope) in found.iter().enumerate() {
        let at = |step: f64| {
            let mut moved = movable.clone();
            moved.values[place] += step;
            loss(&moved).value
        };
        let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
        assert!((slope - difference).abs() < 1e-5 * scale, "{place}: {slope:e}, {difference:e}");
    }
}

#[test]
fn gradients_are_slopes_of_the_loss() {
    for (sources, affine_tail) in [(0, true), (5, true), (5, false)] {
        // Outputs and regressors fill strips and blocks of products, and others in part.
        let sizes = Sizes { inputs: 3, centres: 6, sources, affine_tail };
        let given = if sources > 0 { sources } else { 3 };
        // The second piece of the rest is not full.
        let [rest, held] = [(300, 1), (100, 2)].map(|(count, purpose)| {
            let (x, y) = samples(given, 18, count, purpose);
            let weights: Vec<f64> = (0..count).map(|s| 0.5 + (s % 7) as f64 / 6.0).collect();
            Piece::all((&x, given), (&y, 18), &weights)
        });
        let [rest, held] = [&rest, &held].map(|pieces| pieces.iter().collect::<Vec<_>>());
        let tasks = [(0..18).collect()];
        gradient_is_the_slope(sizes, &|movable| {
            on_same(movable, &tasks, &rest, 1e-9).unwrap().unwrap()
        });
        // The penalty has a part in the weights here, and all of it is derived.
        gradient_is_the_slope(sizes, &|movable| {
            on_held_out(movable, &tasks, &rest, &held, 1e-3).unwrap().unwrap()
        });
    }
}

/// Samples of two tasks side by side, and those of each task by itself: two outputs of the first 150 samples, and one of
/// all but every seventh.
fn of_two_tasks(tasks: &[Vec<usize>; 2], count: usize, purpose: u64) -> [Vec<Piece>; 3] {
    let (x, mut y) = samples(3, 3, count, purpose);
    let has = |task: usize, s: usize| if task == 0 { s < 150 } else { !s.is_multiple_of(7) };
    let alone = [0, 1].map(|task| {
        let lines = || (0..count).filter(|s| has(task, *s));
        let x: Vec<f64> = lines().flat_map(|s| x[3 * s..][..3].to_vec()).collect();
        let y: Vec<f64> = lines()
            .flat_map(|s| tasks[task].iter().map(|c| y[3 * s + c]).collect::<Vec<_>>())
            .collect();
        let width = tasks[task].len();
        Piece::all((&x, 3), (&y, width), &vec![1.0; y.len() / width])
    });
    for (s, line) in y.chunks_exact_mut(3).enumerate() {
        let missing = (0..2).filter(|task| !has(*task, s)).flat_map(|task| &tasks[task]);
        missing.for_each(|column| line[*column] = f64::NAN);
    }
    let [first, second] = alone;
    [Piece::all((&x, 3), (&y, 3), &vec![1.0; count]), first, second]
}

#[test]
fn tasks_that_share_activations_add_their_losses_and_gradients() {
    let sizes = Sizes { inputs: 3, centres: 6, sources: 0, affine_tail: true };
    let tasks = [vec![0, 2], vec![1]];
    let (rest, held) = (of_two_tasks(&tasks, 300, 1), of_two_tasks(&tasks, 200, 2));
    let [rest, held] =
        [&rest, &held].map(|all| all.each_ref().map(|it| it.iter().collect::<Vec<_>>()));
    let together = |movable: &Movable| {
        on_held_out(movable, &tasks, &rest[0], &held[0], 1e-3).unwrap().unwrap()
    };
    gradient_is_the_slope(sizes, &together);

    let mut draw = draws(5);
    let centres: Vec<f64> = (0..18).map(|_| draw()).collect();
    let movable = Movable::new(sizes, &centres, 0.8, &[]);
    let alone = [1, 2].map(|task| {
        let only = [(0..tasks[task - 1].len()).collect()];
        let loss = on_held_out(&movable, &only, &rest[task], &held[task], 1e-3).unwrap().unwrap();
        (loss, held_out_errors(&movable, &only, &rest[task], &held[task], 1e-3).unwrap().concat())
    });
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-10 * b.abs().max(1e-3), "{a:e} {b:e}");
    let together = together(&movable);
    close(together.value, alone[0].0.value + alone[1].0.value);
    for (place, slope) in together.gradient.iter().enumerate() {
        close(*slope, alone[0].0.gradient[place] + alone[1].0.gradient[place]);
    }
    let errors = held_out_errors(&movable, &tasks, &rest[0], &held[0], 1e-3).unwrap();
    for (errors, (_, alone)) in errors.iter().zip(&alone) {
        assert_eq!(errors.len(), alone.len());
        errors.iter().zip(alone).for_each(|(a, b)| close(*a, *b));
    }
}

/// An output that no sample on one side has takes no part, and none is left if there is no other.
#[test]
fn a_task_without_samples_on_both_sides_has_no_loss() {
    let sizes = Sizes { inputs: 3, centres: 6, sources: 0, affine_tail: true };
    let mut draw = draws(5);
    let centres: Vec<f64> = (0..18).map(|_| draw()).collect();
    let movable = Movable::new(sizes, &centres, 0.8, &[]);
    let without = |output: Option<usize>, count: usize, purpose: u64| {
        let (x, mut y) = samples(3, 2, count, purpose);
        y.chunks_exact_mut(2).for_each(|line| output.into_iter().for_each(|o| line[o] = f64::NAN));
        Piece::all((&x, 3), (&y, 2), &vec![1.0; count])
    };
    let loss = |rest: Option<usize>, held: Option<usize>| {
        let (rest, held) = (without(rest, 300, 1), without(held, 100, 2));
        let [rest, held] = [&rest, &held].map(|pieces| pieces.iter().collect::<Vec<_>>());
        on_held_out(&movable, &[vec![0], vec![1]], &rest, &held, 1e-3).unwrap()
    };
    let of_second = loss(Some(0), Some(0)).unwrap();
    for other in [loss(None, Some(0)), loss(Some(0), None)].map(Option::unwrap) {
        assert_eq!((other.value, &other.gradient), (of_second.value, &of_second.gradient));
    }
    assert!(loss(None, None).unwrap().value > of_second.value);
    assert!(loss(Some(0), Some(1)).is_none());
}

struct Fresh<'w>(Synthesis<'w>);

impl FreshFrames for Fresh<'_> {
    fn frames(&self, step: usize, count: usize) -> Dataset {
        self.0.frames_from(Stream::Refinement, step * count, count)
    }
}

fn quick() -> Refinement {
    Refinement { steps: 60, frames: 1024, ..Refinement::default() }
}

/// Root mean square of the errors in z of a model of one network on `test`.
fn rmse(trained: &Trained, test: &Dataset) -> f64 {
    let blob = pack(trained, test, &Origin::of_data("", 0, 1, test)).unwrap();
    let estimate = blob.prepare().decode_lines(&test.inputs.values);
    let squares: f64 = test.outputs.squared_errors(&estimate).iter().skip(2).step_by(3).sum();
    (3.0 * squares / estimate.len() as f64).sqrt()
}

#[test]
fn refined_models_are_better_and_equal_on_any_number_of_threads() {
    let whole = World::press();
    let row = World { read_rows: vec![3], ..World::press() };
    // Measured: 0.959 for a row, 0.916 for the array.
    for (world, whole_array, format, gain) in
        [(&row, false, Format::F32, 0.97), (&whole, true, Format::Fixed16, 0.93)]
    {
        let synthesis = Synthesis::new(world);
        let (training, test) =
            (synthesis.frames(Stream::Training, 3000), synthesis.frames(Stream::Test, 1000));
        let spread = if whole_array { 0.4 } else { 0.8 };
        let options =
            Options { centres: 12, spread, format, each_row: !whole_array, ..Options::of_rows() };
        let fresh = Fresh(synthesis);
        let refined = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let examples = Examples::Fresh(&fresh);
            pool.install(|| {
                train_refined(&training, &options, Some((&quick(), examples)), &Silent).unwrap()
            })
        };
        let (one, three) = (refined(1), refined(3));
        let projections = [&one, &three].map(|it| it.fronts.first().map(|front| &front.projection));
        assert_eq!((projections[0], &one.networks), (projections[1], &three.networks));
        assert_eq!(one.networks[0].format(), format);
        let start = train(&training, &options, &Silent).unwrap();
        let ratio = rmse(&one, &test) / rmse(&start, &test);
        assert!(ratio < gain, "{format:?}, array: {whole_array}: {ratio}");
    }
}

/// Counts steps.
struct Taken(AtomicUsize);

impl Progress for Taken {
    fn stage(&self, _: &str, _: usize) {}

    fn step(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// Few and noisy frames, where centres would only fit the noise, leave them where they are.
#[test]
fn refinement_on_folds_helps_many_frames_and_does_not_harm_few() {
    let world = World { read_rows: vec![3], ..World::press() };
    // Measured: 0.946 and 1.000.
    for (noise, frames, most) in [(0.005, 6000, 0.96), (0.02, 600, 1.001)] {
        let synthesis = Synthesis::new(&world).noise_level(noise);
        let [training, test] = [(Stream::Training, frames), (Stream::Test, 2000)]
            .map(|(stream, frames)| synthesis.frames(stream, frames));
        let options = Options { centres: 12, ..Options::of_rows() };
        let fold_of: Vec<usize> = (0..frames).map(|frame| frame % 4).collect();
        let examples = Examples::Folds(&fold_of);
        let taken = Taken(AtomicUsize::new(0));
        let starts = Start::all(&training, &options).unwrap();
        let layers = starts.iter().map(|start| start.layers(&options)).collect();
        let refinement = Some((&quick(), examples));
        let found = Found::new(&starts, layers, &options, &[None], refinement, &taken).unwrap();
        let refined = found.fit(options.format, false, &Silent).remove(0).unwrap();
        let start = train(&training, &options, &Silent).unwrap();
        let ratio = rmse(&refined, &test) / rmse(&start, &test);
        assert!(ratio < most, "{noise}: {ratio}");
        // Steps of the trial, and as many again as were best at one of the looks, every 20 steps.
        let steps = taken.0.into_inner() - quick().steps;
        assert!(steps.is_multiple_of(20) && (steps > 0) == (ratio < 0.99), "{steps}");
    }
}

/// Few inputs are near each other: there the decay's 32 bits are what ends.
#[test]
fn the_least_width_of_few_inputs_is_just_held_by_fixed16() {
    let mut draw = draws(5);
    let names = |count: usize| (0..count).map(|i| format!("c{i}")).collect::<Vec<_>>();
    let mut data = Dataset::empty(names(2), vec!["y_n".into()], 1, 300);
    data.inputs.values.fill_with(&mut draw);
    data.outputs.values.fill_with(&mut draw);
    let options = Options { centres: 12, format: Format::Fixed16, ..Options::of_rows() };
    let samples = Samples::new(&data);
    let centres = samples.centres(&options, 0);
    let least = width::least(&centres, &[[0.0, 1.0]; 2]);
    let held = |spread: f64| samples.fit(&centres, &Options { spread, ..options }).is_ok();
    assert!(held(least) && !held(0.999 * least), "{least}");
}

#[test]
fn settings_that_cannot_be_used_are_refused_by_name() {
    let world = World { read_rows: vec![3], ..World::press() };
    let training = Synthesis::new(&world).frames(Stream::Training, 50);
    let options = Options { centres: 4, ..Options::of_rows() };
    let start = Start::all(&training, &options).unwrap().remove(0);
    let layers = start.layers(&options);
    let refused = |settings: Refinement, folds: usize, field: &str| {
        let fold_of: Vec<usize> = (0..50).map(|frame| frame % folds).collect();
        let examples = Examples::Folds(&fold_of);
        let refused = refine(&start.frames, &layers, &options, &settings, examples, &Silent);
        let message = refused.unwrap_err().to_string();
        assert!(message.starts_with(field), "{message}");
    };
    refused(Refinement { steps: 0, ..quick() }, 5, "steps = 0");
    refused(Refinement { frames: 0, ..quick() }, 5, "frames = 0");
    refused(Refinement { rate: f64::NAN, ..quick() }, 5, "rate = NaN");
    refused(Refinement { ridge: 0.0, ..quick() }, 5, "ridge = 0");
    refused(quick(), 2, "folds = 2");
}

/// Narrow Gaussians that the data needs, and columns without any information, which must not widen them.
#[test]
fn refinement_leaves_narrow_gaussians_narrow() {
    let mut draw = draws(9);
    let x: Vec<f64> = (0..2000).map(|_| draw()).collect();
    let names = |count: usize| (0..count).map(|i| format!("c{i}")).collect::<Vec<_>>();
    for constants in [0, 20] {
        let mut data = Dataset::empty(names(1 + constants), vec!["y_n".into()], 1, x.len());
        for (line, x) in data.inputs.values.chunks_exact_mut(1 + constants).zip(&x) {
            line[0] = *x;
        }
        data.outputs.values = x.iter().map(|x| libm::sin(30.0 * x) + 0.02 * draw()).collect();
        let options = Options { centres: 40, spread: 0.03, ..Options::of_rows() };
        let fold_of: Vec<usize> = (0..x.len()).map(|frame| frame % 5).collect();
        let examples = Examples::Folds(&fold_of);
        let refined = train_refined(&data, &options, Some((&quick(), examples)), &Silent).unwrap();
        let start = train(&data, &options, &Silent).unwrap();
        let error = |trained: &Trained| {
            let network = trained.networks[0].network();
            let estimate = infer(&network, &data.inputs.values);
            (data.outputs.squared_errors(&estimate)[0] / x.len() as f64).sqrt()
        };
        let (before, after) = (error(&start), error(&refined));
        assert!(after < 1.1 * before, "{constants} constants: {before} -> {after}");
    }
}

#[test]
fn the_rate_falls_along_half_a_cosine() {
    let (mut adam, mut values) = (Adam::new(0.1, 4, 1), [0.0]);
    let moved = [0, 1, 2, 3].map(|_| {
        let before = values[0];
        adam.descend(&mut values, &[1.0]);
        before - values[0]
    });
    for (moved, share) in moved.iter().zip([1.0, 0.853_553, 0.5, 0.146_447]) {
        assert!((moved - 0.1 * share).abs() < 1e-6, "{moved} {share}");
    }
}
