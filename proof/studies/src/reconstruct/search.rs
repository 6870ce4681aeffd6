//! Search for the set-up that gives the paper's printed Table 1.
//!
//! The paper leaves much open ([`AXES`], the penalty, the formula of the error). The search draws set-ups, then varies
//! the best. It chooses by one half of the cells; the other half judges. What it finds says which choices *could* have
//! been made, not which were.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use taxel_data::progress::Progress;
use taxel_data::random::{Purpose, Random, Stream};

use taxel_evaluate::evaluate::printed::{self, CELLS, Cells, NOISE_LEVELS, Nearness, SPREADS};

use super::cells::{self, FORMULAS, INITIAL_COVARIANCES};
use super::setup::{AXES, JUDGED, JudgedOn, Setup};

/// Number of set-ups that are tried unless a user says otherwise.
pub const USUAL_SETUPS: usize = 1920;
/// Set-ups that are tried before the best are looked at again, and results are saved.
pub const BATCH: usize = 48;
/// Set-ups that are drawn before any is varied; later every fourth is drawn.
const DRAWN_FIRST: usize = 240;
/// Gap between the tables of two set-ups, in points, below which they count as one.
const ALIKE: f64 = 0.1;
/// Best set-ups, of which variations are tried.
const PARENTS: usize = 16;
/// Best set-ups that are judged by more draws.
const FINALISTS: usize = 8;
/// Draws of samples and noise by which finalists are judged.
const DRAWS: u64 = 4;
/// Largest number of samples that a table is judged on.
const ALL: usize = usize::MAX;

/// Set-up that was tried, with the penalty and the formula that suit it best.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    pub setup: Setup,
    /// Index of the initial covariance among [`INITIAL_COVARIANCES`].
    pub covariance: usize,
    /// Index of the formula of the error among [`FORMULAS`].
    pub formula: usize,
    /// Its table, in per cent.
    pub cells: Cells,
    /// Every penalty and formula whose table is finite: their indices, and the gaps on the fitted cells and on those
    /// held out.
    pub gaps: Vec<(usize, usize, [f64; 2])>,
}

impl Tried {
    /// Tries `setup` on one draw. A set-up whose tables are not finite has a table of zeros, which is far from any.
    fn new(setup: Setup, draw: u64) -> Self {
        let mut best =
            Self { setup, covariance: 0, formula: 0, cells: [[0.0; 4]; 10], gaps: Vec::new() };
        let mut least = f64::INFINITY;
        for (covariance, tables) in cells::compute(&setup, draw, ALL).into_iter().enumerate() {
            for (formula, cells) in tables.into_iter().enumerate() {
                let Nearness { gap_fitted, gap_held_out, .. } = Nearness::new(&cells);
                if !cells.as_flattened().iter().all(|cell| cell.is_finite()) {
                    continue;
                }
                best.gaps.push((covariance, formula, [gap_fitted, gap_held_out]));
                if gap_fitted < least {
                    least = gap_fitted;
                    (best.covariance, best.formula, best.cells) = (covariance, formula, cells);
                }
            }
        }
        best
    }

    fn gap_fitted(&self) -> f64 {
        Nearness::new(&self.cells).gap_fitted
    }

    fn is_within_words(&self) -> bool {
        self.setup.judged_on() != JudgedOn::Training
    }

    /// Whether every index is one of its list, so that a saved result can be used.
    pub fn is_valid(&self) -> bool {
        self.setup.is_valid()
            && self.covariance < INITIAL_COVARIANCES.len()
            && self.formula < FORMULAS.len()
            && self.gaps.iter().all(|(covariance, formula, _)| {
                *covariance < INITIAL_COVARIANCES.len() && *formula < FORMULAS.len()
            })
    }
}

/// Search and what it found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reconstruction {
    /// Seed of the search and of all draws.
    pub seed: u64,
    /// Number of set-ups tried.
    pub setups: usize,
    /// Number of tables compared: each set-up with every penalty and formula that gave one.
    pub tables: usize,
    /// A table whose cells are all the mean of the printed ones.
    pub constant: Nearness,
    /// Scatter of the printed cells about a smooth table, in points.
    pub roughness: f64,
    /// Rise of the printed cells with noise and with spread, in points.
    pub printed_rises: [f64; 2],
    /// Set-ups nearest to the printed cells: the nearest first, as chosen by the fitted half over several draws.
    pub nearest: Vec<Candidate>,
    /// Set-ups that keep to the paper's words: judged on other samples than those of training. The nearest first.
    pub within_words: Vec<Candidate>,
    /// What distinguishes set-ups: every value of every axis.
    pub values: Vec<AxisValue>,
    /// Scatter of the nearest table within the paper's words, if few samples judge it.
    pub scatter: Vec<Scatter>,
    /// Printed cells that the nearest set-ups miss by most.
    pub unexplained: Vec<Unexplained>,
}

/// Set-up with its table by several draws.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Values of the axes by name, the penalty and the formula last.
    pub choices: Vec<(String, String)>,
    /// Number N of samples, and K of centres.
    pub samples_and_centres: [usize; 2],
    /// Table in per cent, mean of the draws, by spread and noise level.
    pub cells: Cells,
    pub nearness: Nearness,
    /// Gap on the cells held out: mean over single draws, and their standard deviation.
    pub gap_held_out_of_a_draw: [f64; 2],
}

/// One value of one axis, over all set-ups that have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisValue {
    pub axis: String,
    pub value: String,
    /// Number of set-ups tried that have it.
    pub setups: usize,
    /// Least gap on the fitted cells of any of them; none if none was tried. The search crowds about the best set-ups, so
    /// that values are not tried equally often.
    pub least_gap_fitted: Option<f64>,
    /// Gap of that set-up on the cells held out.
    pub its_gap_held_out: Option<f64>,
    /// Least gap on the fitted cells if this value alone is changed in the nearest set-up, and in the nearest within the
    /// paper's words; with any penalty and formula, where these are not what is changed.
    pub changed_alone: [Option<f64>; 2],
}

/// Scatter of cells that few samples judge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scatter {
    /// Number of samples that judge a cell.
    pub samples: usize,
    /// Standard deviation of a cell between draws, in points.
    pub points: f64,
}

/// Printed cell that near set-ups miss.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unexplained {
    pub spread: f64,
    pub noise_level: f64,
    /// Error that the paper prints, in per cent.
    pub printed_percent: f64,
    /// Mean of the nearest set-ups, in per cent.
    pub nearest_percent: f64,
}

/// Searches `setups` set-ups, going on from those that were `tried` before with the same `seed`. `save` is given all
/// that were tried after every [`BATCH`].
///
/// The result depends on `seed` and `setups` alone: not on the number of threads, nor on where a search was ended. Set-ups
/// that were tried beyond `setups` are left alone.
pub fn search<E>(
    seed: u64,
    setups: usize,
    tried: Vec<Tried>,
    save: impl FnMut(&[Tried]) -> Result<(), E>,
    progress: &dyn Progress,
) -> Result<Reconstruction, E> {
    let tried = try_in_batches((seed, BATCH), setups, tried, save, progress)?;
    Ok(judge(seed, &tried[..setups], progress))
}

fn try_in_batches<E>(
    (seed, batch): (u64, usize),
    setups: usize,
    mut tried: Vec<Tried>,
    mut save: impl FnMut(&[Tried]) -> Result<(), E>,
    progress: &dyn Progress,
) -> Result<Vec<Tried>, E> {
    if tried.len() < setups {
        // A batch is chosen as a whole.
        tried.truncate(tried.len() / batch * batch);
        progress.stage("try set-ups", setups - tried.len());
    }
    while tried.len() < setups {
        let next = next_batch(seed, setups.min(tried.len() + batch), &tried);
        let found: Vec<Tried> = next
            .into_par_iter()
            .map(|setup| {
                let found = Tried::new(setup, seed);
                progress.step();
                found
            })
            .collect();
        tried.extend(found);
        save(&tried)?;
    }
    Ok(tried)
}

/// Set-ups of the next batch, up to number `end`: drawn, or variations of the best so far, by turns of all and of those within the
/// paper's words.
fn next_batch(seed: u64, end: usize, tried: &[Tried]) -> Vec<Setup> {
    let all = best(tried, PARENTS, |_| true);
    let within = best(tried, PARENTS, Tried::is_within_words);
    let mut next: Vec<Setup> = Vec::new();
    for number in tried.len()..end {
        let mut random = Random::new(seed, Stream::Training, Purpose::Setup, number as u64, 0);
        let mut draw = || {
            if number < DRAWN_FIRST || number % 4 == 0 || all.is_empty() || within.is_empty() {
                return Setup::random(&mut random);
            }
            let (parents, kept) =
                if number % 2 == 1 { (&all, None) } else { (&within, Some(JUDGED)) };
            parents[random.below(parents.len())].setup.mutated(kept, &mut random)
        };
        let mut setup = draw();
        for _ in 0..20 {
            if !next.contains(&setup) && tried.iter().all(|other| other.setup != setup) {
                break;
            }
            setup = draw();
        }
        next.push(setup);
    }
    next
}

/// The `most` set-ups nearest on the fitted cells, among those that are `wanted`; of those with tables alike, the nearest.
fn best(tried: &[Tried], most: usize, wanted: impl Fn(&Tried) -> bool) -> Vec<Tried> {
    let mut wanted: Vec<(f64, &Tried)> =
        tried.iter().filter(|it| wanted(it)).map(|it| (it.gap_fitted(), it)).collect();
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Vec<Tried> = Vec::new();
    for (_, it) in wanted {
        if best.len() == most {
            break;
        }
        if best.iter().all(|other| printed::gap(&other.cells, &it.cells) > ALIKE) {
            best.push(it.clone());
        }
    }
    best
}

/// Judges the best set-ups by more draws, and sums up the search.
fn judge(seed: u64, tried: &[Tried], progress: &dyn Progress) -> Reconstruction {
    let all = best(tried, FINALISTS, |_| true);
    let within = best(tried, FINALISTS, Tried::is_within_words);
    progress.stage("judge the nearest by more draws", all.len() + within.len() + 2);
    let candidates = |finalists: &[Tried]| {
        let mut found: Vec<(Candidate, Tried)> = finalists
            .par_iter()
            .map(|it| {
                let candidate = candidate(it, seed);
                progress.step();
                (candidate, it.clone())
            })
            .collect();
        found.sort_by(|(a, _), (b, _)| a.nearness.gap_fitted.total_cmp(&b.nearness.gap_fitted));
        found
    };
    let (nearest, within) = (candidates(&all), candidates(&within));
    let scatter = within.first().map_or_else(Vec::new, |(_, it)| scatter(it, seed));
    progress.step();
    let first = [&nearest, &within].map(|found| found.first().map(|(_, it)| it));
    let values = values(tried, first, seed);
    progress.step();
    let strip = |found: Vec<(Candidate, Tried)>| -> Vec<Candidate> {
        found.into_iter().map(|(candidate, _)| candidate).collect()
    };
    let nearest = strip(nearest);
    Reconstruction {
        seed,
        setups: tried.len(),
        tables: tried.iter().map(|it| it.gaps.len()).sum(),
        constant: Nearness::of_a_constant(),
        roughness: roughness(),
        printed_rises: printed::rises(&CELLS),
        unexplained: unexplained(&nearest),
        nearest,
        within_words: strip(within),
        values,
        scatter,
    }
}

/// Table of a set-up by one more draw, judged on at most `most` samples.
fn table(it: &Tried, seed: u64, draw: u64, most: usize) -> Cells {
    // A seed of its own for every draw, far from those that people give.
    let mut random = Random::new(seed, Stream::Test, Purpose::Setup, draw, 0);
    let own_seed = (random.unit() * (1_u64 << 53) as f64) as u64;
    cells::compute(&it.setup, own_seed, most)[it.covariance][it.formula]
}

fn candidate(it: &Tried, seed: u64) -> Candidate {
    let tables: Vec<Cells> =
        (0..DRAWS).into_par_iter().map(|draw| table(it, seed, draw, ALL)).collect();
    let held_out: Vec<f64> = tables.iter().map(|cells| Nearness::new(cells).gap_held_out).collect();
    let cells = mean(&tables);
    let penalty = penalty(INITIAL_COVARIANCES[it.covariance]);
    let named = it.setup.named().chain([("error", FORMULAS[it.formula])]);
    let mut choices: Vec<(String, String)> =
        named.map(|(axis, value)| (axis.to_owned(), value.to_owned())).collect();
    choices.push(("penalty 1/δ".into(), penalty));
    Candidate {
        choices,
        samples_and_centres: [it.setup.frames(), it.setup.centres()],
        nearness: Nearness::new(&cells),
        cells,
        gap_held_out_of_a_draw: mean_and_deviation(&held_out),
    }
}

fn penalty(initial_covariance: f64) -> String {
    format!("{}", (1e8 / initial_covariance).round() / 1e8)
}

fn mean(tables: &[Cells]) -> Cells {
    let mut mean = [[0.0; 4]; 10];
    for table in tables {
        let pairs = mean.as_flattened_mut().iter_mut().zip(table.as_flattened());
        pairs.for_each(|(mean, cell)| *mean += cell / tables.len() as f64);
    }
    mean
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    [mean, (squares / (count - 1.0).max(1.0)).sqrt()]
}

/// Scatter of a set-up's cells between draws, if so many samples judge them.
fn scatter(it: &Tried, seed: u64) -> Vec<Scatter> {
    let of_samples = |samples: usize| {
        let tables: Vec<Cells> =
            (0..2 * DRAWS).into_par_iter().map(|draw| table(it, seed, draw, samples)).collect();
        let of_cell = |k: usize| {
            let values: Vec<f64> = tables.iter().map(|table| table.as_flattened()[k]).collect();
            mean_and_deviation(&values)[1].powi(2)
        };
        Scatter { samples, points: ((0..40).map(of_cell).sum::<f64>() / 40.0).sqrt() }
    };
    [10, 20, 50, 200].map(of_samples).to_vec()
}

/// What set-ups with each value of each axis reach, and what changing it alone does to the `nearest` ones.
fn values(tried: &[Tried], nearest: [Option<&Tried>; 2], seed: u64) -> Vec<AxisValue> {
    let of = |axis: &str, value: String, gaps: Vec<[f64; 2]>, changed_alone| {
        let least = gaps.iter().min_by(|a, b| a[0].total_cmp(&b[0]));
        AxisValue {
            axis: axis.into(),
            value,
            setups: gaps.len(),
            least_gap_fitted: least.map(|gaps| gaps[0]),
            its_gap_held_out: least.map(|gaps| gaps[1]),
            changed_alone,
        }
    };
    let places = AXES.iter().enumerate();
    let places: Vec<(usize, usize)> =
        places.flat_map(|(i, axis)| (0..axis.values.len()).map(move |value| (i, value))).collect();
    let mut all: Vec<AxisValue> = places
        .into_par_iter()
        .map(|(index, value)| {
            let gaps = |it: &Tried| {
                let Nearness { gap_fitted, gap_held_out, .. } = Nearness::new(&it.cells);
                [gap_fitted, gap_held_out]
            };
            let with = tried.iter().filter(|it| it.setup.0[index] == value).map(gaps).collect();
            let changed = |it: &Tried| {
                let setup = it.setup.with(index, value)?;
                Some(Tried::new(setup, seed).gap_fitted())
            };
            let axis = &AXES[index];
            of(axis.name, axis.values[value].into(), with, nearest.map(|it| it.and_then(changed)))
        })
        .collect();
    // Every set-up was tried with all penalties and formulas.
    let mut of_gaps = |axis: &str, value: String, has: &dyn Fn(usize, usize) -> bool| {
        let least = |it: &Tried| {
            let with = it.gaps.iter().filter(|(covariance, formula, _)| has(*covariance, *formula));
            with.map(|(_, _, gaps)| *gaps).min_by(|a, b| a[0].total_cmp(&b[0]))
        };
        let changed = nearest.map(|it| it.and_then(least).map(|gaps| gaps[0]));
        all.push(of(axis, value, tried.iter().filter_map(least).collect(), changed));
    };
    for (index, covariance) in INITIAL_COVARIANCES.iter().enumerate() {
        of_gaps("penalty 1/δ", penalty(*covariance), &|covariance, _| covariance == index);
    }
    for (index, name) in FORMULAS.iter().enumerate() {
        of_gaps("error", (*name).into(), &|_, formula| formula == index);
    }
    all
}

/// The three printed cells that are farthest from the mean of the nearest set-ups.
fn unexplained(nearest: &[Candidate]) -> Vec<Unexplained> {
    let tables: Vec<Cells> = nearest.iter().map(|candidate| candidate.cells).collect();
    let mean = mean(&tables);
    let mut all: Vec<Unexplained> = Vec::new();
    for (i, spread) in SPREADS.into_iter().enumerate() {
        for (j, noise_level) in NOISE_LEVELS.into_iter().enumerate() {
            let (printed_percent, nearest_percent) = (CELLS[i][j], mean[i][j]);
            all.push(Unexplained { spread, noise_level, printed_percent, nearest_percent });
        }
    }
    let miss = |it: &Unexplained| (it.printed_percent - it.nearest_percent).abs();
    all.sort_by(|a, b| miss(b).total_cmp(&miss(a)));
    all.truncate(3);
    all
}

/// Scatter of the printed cells about the nearest sum of a function of the spread and one of the noise, in points:
/// what no table that is smooth in this sense explains.
fn roughness() -> f64 {
    let whole = printed::mean(&CELLS);
    let column = |j: usize| CELLS.iter().map(|line| line[j]).sum::<f64>() / 10.0;
    let mut squares = 0.0;
    for line in &CELLS {
        let of_line = line.iter().sum::<f64>() / 4.0;
        for (j, cell) in line.iter().enumerate() {
            squares += (cell - of_line - column(j) + whole).powi(2);
        }
    }
    // 40 cells, less 10 + 4 − 1 numbers that were fitted.
    (squares / 27.0).sqrt()
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use taxel_data::progress::Silent;

    use super::*;

    /// Set-up with a table that is `offset` off the printed one.
    fn tried(setup: Setup, offset: f64) -> Tried {
        let cells = CELLS.map(|line| line.map(|cell| cell + offset));
        let Nearness { gap_fitted, gap_held_out, .. } = Nearness::new(&cells);
        let gaps = vec![(0, 0, [gap_fitted, gap_held_out])];
        Tried { setup, covariance: 0, formula: 0, cells, gaps }
    }

    #[test]
    fn printed_cells_scatter_by_two_fifths_of_a_point() {
        assert!((roughness() - 0.403).abs() < 1e-3, "{}", roughness());
    }

    #[test]
    fn what_is_tried_next_depends_on_the_seed_and_what_was_tried_alone() {
        let drawn = |number: u64| {
            let mut random = Random::new(3, Stream::Test, Purpose::Setup, number, 0);
            tried(Setup::random(&mut random), 1.0 + number as f64)
        };
        let before: Vec<Tried> = (0..300).map(drawn).collect();
        let (few, many) = (next_batch(7, 310, &before), next_batch(7, 348, &before));
        assert_eq!((few.len(), many.len()), (10, 48));
        assert_eq!(few[..], many[..10]);
        assert_ne!(next_batch(8, 310, &before), few);
        let is_new = |setup: &Setup| before.iter().all(|it| it.setup != *setup);
        assert!(many.iter().all(is_new));
    }

    #[test]
    fn a_search_goes_on_to_the_same_set_ups_and_loses_none() {
        let mut saved = Vec::new();
        let mut run = |setups, before: Vec<Tried>| {
            let keep = |tried: &[Tried]| -> Result<(), Infallible> {
                saved = tried.to_vec();
                Ok(())
            };
            let Ok(all) = try_in_batches((7, 2), setups, before, keep, &Silent);
            all
        };
        let at_once = run(2, Vec::new());
        let ended = run(1, Vec::new());
        assert_eq!(ended[..], at_once[..1]);
        assert_eq!(run(2, ended), at_once);
        assert_eq!(run(1, at_once.clone()), at_once, "what was tried beyond is kept");
        assert_eq!(saved, at_once);
        assert_eq!(judge(7, &at_once[..1], &Silent).setups, 1);
    }

    #[test]
    fn the_best_come_first_and_tables_that_are_alike_once() {
        let with =
            |first: usize, offset: f64| tried(Setup([first, 0, 0, 0, 0, 0, 0, 0, 0, 0]), offset);
        let tried = [with(0, 2.0), with(1, 0.3), with(1, 0.25), with(2, 1.0)];
        let best: Vec<usize> = best(&tried, 2, |_| true).iter().map(|it| it.setup.0[0]).collect();
        assert_eq!(best, [1, 2]);
        let values = values(&tried, [None, None], 7);
        assert_eq!((values[1].setups, values[1].least_gap_fitted), (2, Some(0.25)));
    }
}
