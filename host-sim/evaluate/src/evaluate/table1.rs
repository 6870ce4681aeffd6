//! Table 1 of the paper: errors by spread and noise, by every definition.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use taxel_data::{Dataset, Progress, Purpose, Random, Stream, columns};
use taxel_learn::decoders::standard::{self, StandardNetwork};
use taxel_learn::decoders::textbook::{Textbook, TextbookNetwork};
use taxel_learn::decoders::{BASELINES, RowDecoder, Rows, mean};
use taxel_learn::train::{FittedNetwork, Samples};
use taxel_learn::{Decoder, Options};
use taxel_simulate::Synthesis;
use taxel_simulate::motion::Kind;
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::sensor::Sensor;

use crate::error::{Error, Result};
use crate::experiment::{Experiment, Table1 as Settings};
use crate::metrics::{self, Definition, Errors, LimitSummary, Measure};

use super::printed::{self, CELLS, Cells, NOISE_LEVELS, Nearness, SPREADS};
pub use crate::metrics::NETWORK;

/// Table 1 of a scene: errors of every decoder at every noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table1 {
    /// Number of centres of each row-wire's network.
    pub centres: usize,
    pub noise_kind: NoiseKind,
    pub training_frames: usize,
    /// Number of frames on which each cell was evaluated.
    pub test_frames: usize,
    /// Number of frames, and of centres, of the standard networks.
    pub standard_frames: usize,
    /// How the output weights of the networks were computed: `rls` or `qr`.
    pub solver: &'static str,
    /// Columns of the table, one a noise level.
    pub columns: Vec<Column>,
    /// The table by every formula that could be the paper's, beside the printed cells; empty for another sensor or motion
    /// than the paper's, for other spreads or noise levels, and without Δz.
    pub comparison: Vec<Comparison>,
}

/// Table 1 by one formula of the error beside the printed one, along z.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Formula of the error, in per cent.
    pub formula: String,
    /// Errors of the network in per cent, by spread and noise level.
    pub cells: Cells,
    /// Errors of always predicting the mean in per cent, by noise level.
    pub mean_percent: [f64; 4],
    /// Nearness to the printed cells.
    pub nearness: Nearness,
}

/// Errors of all decoders at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// Noise level p: a fraction, or in Ω for absolute noise.
    pub noise_level: f64,
    /// Least possible errors, of a decoder that sees all readings of a frame.
    pub limit: LimitSummary,
    /// Baselines, then the networks, spread after spread. A standard network (K = N) is omitted where
    /// its interpolation matrix is singular.
    pub decoders: Vec<Entry>,
}

/// Errors of one decoder at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    pub decoder: String,
    /// Width σ on scaled inputs, for decoders that have one.
    pub spread: Option<f64>,
    pub errors: Vec<Errors>,
    /// Largest |e|/(H − Δz) of a row's electrodes, mean over rows and frames, in per cent; for compressions alone.
    #[serde(skip)]
    pub largest_positional_percent: Option<f64>,
}

impl Column {
    /// Errors of the decoder called `decoder`, with that spread if it has one; empty if there is no such
    /// decoder.
    pub fn errors(&self, decoder: &str, spread: Option<f64>) -> &[Errors] {
        self.entry(decoder, spread).map_or(&[], |entry| &entry.errors)
    }

    fn entry(&self, decoder: &str, spread: Option<f64>) -> Option<&Entry> {
        let mut entries = self.decoders.iter();
        entries.find(|entry| entry.decoder == decoder && entry.spread == spread)
    }

    /// Baselines, in the order of [`BASELINES`].
    pub fn baselines(&self) -> impl Iterator<Item = &Entry> {
        self.decoders.iter().rev().filter(|entry| entry.spread.is_none())
    }

    /// Spreads of the networks.
    pub fn spreads(&self) -> impl Iterator<Item = f64> {
        self.decoders.iter().filter(|entry| entry.decoder == NETWORK).filter_map(|e| e.spread)
    }
}

/// Computes Table 1 as the scene asks for.
///
/// # Errors
/// [`Error`] for a scene without `[table1]`, or an error of [`train`](taxel_learn::train::train).
pub fn compute(experiment: &Experiment, progress: &dyn Progress) -> Result<Table1> {
    let settings = experiment.table1.as_ref().ok_or_else(|| {
        let cause =
            "it has no [table1]: add one, or use a scene that has (paper, paper-as-printed)";
        Error::of_scene(&experiment.name, cause)
    })?;
    let columns = settings.noise_levels.iter().map(|&level| {
        let frames = Synthesis::new(&experiment.world).noise_level(level);
        let training = experiment.dataset(&frames, Stream::Training, settings.frames);
        let test = experiment.dataset(&frames, Stream::Test, settings.test_frames);
        let noise = experiment.world.noise.with_level(level);
        let (measure, limit) =
            experiment.measure_beside_limit(noise, settings.test_frames, progress);
        progress.stage(&format!("table 1, noise {level}"), experiment.world.read_rows.len());
        let decoders = decoders(settings, experiment.world.seed, &training, progress)?;
        let judged = |(spread, decoder): &Spread| entry(decoder.as_ref(), *spread, &test, &measure);
        let decoders = decoders.iter().map(judged).collect();
        Ok(Column { noise_level: level, limit, decoders })
    });
    let columns = columns.collect::<Result<Vec<_>>>()?;
    let comparison = if is_comparable(experiment, settings) {
        compare(&columns, experiment.world.sensor.size_mm[2])
    } else {
        Vec::new()
    };
    Ok(Table1 {
        centres: settings.centres,
        noise_kind: experiment.world.noise.kind,
        training_frames: settings.frames,
        test_frames: settings.test_frames,
        standard_frames: settings.standard_frames,
        solver: settings.solver().name(),
        columns,
        comparison,
    })
}

/// Whether a scene's `table` is one that the paper's could be: of its sensor, with electrodes that move on their own along
/// z at least, and its spreads and noise levels in per cent.
fn is_comparable(experiment: &Experiment, table: &Settings) -> bool {
    let world = &experiment.world;
    let is_moved = matches!(world.motion, Kind::Independent(_));
    let is_of_paper = world.sensor == Sensor::paper() && is_moved;
    let names = world.output_names();
    let has_z = columns::groups(&names).iter().any(|(group, _)| columns::is_compression(group));
    is_of_paper
        && has_z
        && world.noise.kind != NoiseKind::Absolute
        && printed::is_layout(&table.spreads, &table.noise_levels)
}

/// The table along z by every formula that could be the paper's, beside the printed cells.
fn compare(columns: &[Column], thickness_mm: f64) -> Vec<Comparison> {
    type Formula = (&'static str, fn(&Entry, &Errors, f64) -> Option<f64>);
    const FORMULAS: [Formula; 5] = [
        ("mean|e|/(H − Δz)", |_, errors, _| errors.positional_percent),
        ("mean of max|e|/(H − Δz)", |entry, _, _| entry.largest_positional_percent),
        ("mean|e|/full scale", |_, errors, _| errors.full_scale_percent),
        ("‖e‖/‖Δz‖", |_, errors, _| errors.relative_l2_percent),
        ("RMSE/H", |_, errors, thickness_mm| Some(100.0 * errors.rmse / thickness_mm)),
    ];
    let by = |(formula, of): &Formula| {
        let z = |entry: Option<&Entry>| {
            let entry = entry?;
            let along_z = entry.errors.iter().find(|it| columns::is_compression(&it.group))?;
            of(entry, along_z, thickness_mm)
        };
        let mut cells = [[f64::NAN; 4]; 10];
        let mut mean_percent = [f64::NAN; 4];
        for (j, column) in columns.iter().enumerate() {
            mean_percent[j] = z(column.entry(mean::NAME, None))?;
            for (line, spread) in cells.iter_mut().zip(SPREADS) {
                line[j] = z(column.entry(NETWORK, Some(spread)))?;
            }
        }
        let nearness = Nearness::new(&cells);
        Some(Comparison { formula: (*formula).into(), cells, mean_percent, nearness })
    };
    FORMULAS.iter().filter_map(by).collect()
}

/// Decoder, with its spread if it has one.
type Spread = (Option<f64>, Box<dyn Decoder>);

fn entry(decoder: &dyn Decoder, spread: Option<f64>, test: &Dataset, measure: &Measure) -> Entry {
    let estimates = decoder.decode_all(&test.inputs.values, 1).values;
    Entry {
        decoder: decoder.name().into(),
        spread,
        errors: metrics::by_group(&test.outputs, &estimates, measure),
        largest_positional_percent: largest_positional_percent(test, &estimates, measure),
    }
}

/// Largest |e|/(H − Δz) of a row's electrodes, mean over rows and frames, in per cent.
fn largest_positional_percent(test: &Dataset, estimates: &[f64], measure: &Measure) -> Option<f64> {
    let thickness_mm = measure.thickness_mm?;
    let names = &test.outputs.names;
    let of_a_row = names.len() / test.rows.max(1);
    let groups = columns::groups(names);
    let (_, along_z) = groups.iter().find(|(group, _)| columns::is_compression(group))?;
    let mut sum = 0.0;
    for (truth, estimate) in test.outputs.lines().zip(estimates.chunks_exact(names.len())) {
        for row in along_z.chunk_by(|a, b| a / of_a_row == b / of_a_row) {
            let positional =
                |i: &usize| (estimate[*i] - truth[*i]).abs() / (thickness_mm - truth[*i]);
            sum += row.iter().map(positional).fold(0.0, f64::max);
        }
    }
    Some(100.0 * sum / (test.outputs.len() * test.rows) as f64)
}

/// Networks of one row-wire, one a spread; a standard network is none where its interpolation matrix is singular.
struct RowNetworks<N, S> {
    networks: Vec<N>,
    standard: Vec<Option<S>>,
}

/// Fits every decoder of the table at one noise level to `training`.
fn decoders(
    settings: &Settings,
    seed: u64,
    training: &Dataset,
    progress: &dyn Progress,
) -> Result<Vec<Spread>> {
    match settings.textbook_covariance {
        None => fit_rows(settings, training, progress, |row| {
            row_networks(settings, seed, row, training)
        }),
        Some(covariance) => fit_rows(settings, training, progress, |row| {
            Ok(textbook_networks(settings, covariance, seed, row, training))
        }),
    }
}

/// Decoders of all rows, whose networks `fit` makes.
fn fit_rows<N, S>(
    settings: &Settings,
    training: &Dataset,
    progress: &dyn Progress,
    fit: impl Fn(usize) -> Result<RowNetworks<N, S>> + Sync,
) -> Result<Vec<Spread>>
where
    N: RowDecoder + Clone + Send + 'static,
    S: RowDecoder + Clone + Send + 'static,
{
    let rows = (0..training.rows).into_par_iter();
    let rows: Vec<RowNetworks<N, S>> = rows
        .map(|row| {
            let networks = fit(row);
            progress.step();
            networks
        })
        .collect::<Result<_>>()?;
    let baselines = BASELINES.iter().rev().filter_map(|baseline| baseline.fit(training));
    let mut decoders: Vec<Spread> = baselines.map(|baseline| (None, baseline)).collect();
    for (place, &spread) in settings.spreads.iter().enumerate() {
        let networks = rows.iter().map(|row| row.networks[place].clone()).collect();
        decoders.push((Some(spread), Box::new(Rows::new(NETWORK, training, networks))));
        let standard: Option<Vec<S>> = rows.iter().map(|row| row.standard[place].clone()).collect();
        if let Some(standard) = standard {
            let standard = Rows::new(standard::NAME, training, standard);
            decoders.push((Some(spread), Box::new(standard)));
        }
    }
    Ok(decoders)
}

fn row_networks(
    settings: &Settings,
    seed: u64,
    row: usize,
    training: &Dataset,
) -> Result<RowNetworks<FittedNetwork, StandardNetwork>> {
    let table = training.row_table(row);
    let samples = Samples::new(&table);
    let options = |spread| {
        let (centres, solver) = (settings.centres, settings.solver());
        let paper = Options::of_rows().as_in_paper();
        let mut options = Options { centres, spread, solver, seed, ..paper };
        options.search.most_points = 4096;
        options.search.restarts = 1;
        options
    };
    // The centres do not depend on the spread.
    let centres = samples.centres(&options(1.0), row);
    let few = table.subset(&(0..settings.standard_frames).collect::<Vec<_>>());
    let each = settings.spreads.par_iter().map(|&spread| {
        let network = samples.fit(&centres, &options(spread))?;
        Ok((network, StandardNetwork::fit(&few, spread)))
    });
    let (networks, standard) = each.collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok(RowNetworks { networks, standard })
}

/// Initial covariance of standard networks in f64: the penalty is too small to be felt.
const INTERPOLATING: f64 = 1e12;

/// Networks of one row-wire in f64, with this initial `covariance`.
fn textbook_networks(
    settings: &Settings,
    covariance: f64,
    seed: u64,
    row: usize,
    training: &Dataset,
) -> RowNetworks<TextbookNetwork, TextbookNetwork> {
    let table = training.row_table(row);
    let few = table.subset(&(0..settings.standard_frames).collect::<Vec<_>>());
    let hidden = |table: &Dataset, centres| {
        let mut random = Random::new(seed, Stream::Training, Purpose::Centres, 0, row as u64);
        Arc::new(Textbook::new(table, centres, &mut random))
    };
    let (network, standard) =
        (hidden(&table, settings.centres), hidden(&few, settings.standard_frames));
    let each = settings.spreads.par_iter().map(|&spread| {
        let network = network.fit(&table, spread, covariance);
        (network, Some(standard.fit(&few, spread, INTERPOLATING)))
    });
    let (networks, standard) = each.collect::<Vec<_>>().into_iter().unzip();
    RowNetworks { networks, standard }
}

impl Table1 {
    /// Table as CSV: one line a noise level, decoder, spread, group and definition. Undefined values are
    /// empty.
    pub fn to_csv(&self) -> String {
        use std::fmt::Write as _;
        let mut csv = String::from("noise_level,decoder,spread,group,definition,value\n");
        for column in &self.columns {
            for Entry { decoder, spread, errors, .. } in &column.decoders {
                let spread = spread.map_or(String::new(), |s| s.to_string());
                for group in errors {
                    for definition in Definition::ALL {
                        let value = definition.of(group);
                        let value = value.map_or(String::new(), |v| v.to_string());
                        let (level, name) = (column.noise_level, definition.name);
                        // Writing to a string cannot fail.
                        let _ = writeln!(
                            csv,
                            "{level},{decoder},{spread},{},{name},{value}",
                            group.group
                        );
                    }
                }
            }
        }
        let printed = SPREADS.iter().zip(&CELLS).filter(|_| !self.comparison.is_empty());
        for (spread, line) in printed {
            for (noise_level, percent) in NOISE_LEVELS.iter().zip(line) {
                let _ = writeln!(csv, "{noise_level},paper,{spread},dz_mm,as_printed,{percent}");
            }
        }
        csv
    }

    /// Formula by which the table is nearest to the printed one.
    pub fn nearest_formula(&self) -> Option<&Comparison> {
        let gap = |it: &Comparison| it.nearness.gap;
        self.comparison.iter().min_by(|a, b| gap(a).total_cmp(&gap(b)))
    }
}

#[cfg(test)]
mod tests {
    use taxel_data::Silent;
    use taxel_simulate::World;

    use super::*;

    #[test]
    fn only_a_table_that_the_papers_could_be_stands_beside_the_printed_cells() {
        let paper = Experiment::load("paper").unwrap();
        let is_beside = |change: fn(&mut Experiment)| {
            let mut changed = paper.clone();
            change(&mut changed);
            is_comparable(&changed, changed.table1.as_ref().unwrap())
        };
        assert!(is_beside(|_| ()));
        assert!(!is_beside(|it| it.table1.as_mut().unwrap().noise_levels[2] = 0.06));
        assert!(!is_beside(|it| it.table1.as_mut().unwrap().spreads[2] = 0.35));
        assert!(!is_beside(|it| it.world.sensor.size_mm[0] = 21.0));
        assert!(!is_beside(|it| it.world.noise.kind = NoiseKind::Absolute));
        assert!(!is_beside(|it| it.world.motion = World::press().motion));
    }

    #[test]
    fn no_cell_of_the_papers_table_is_worse_than_the_mean_by_more_than_two_per_cent() {
        let mut paper = Experiment::load("paper").unwrap();
        // Two rows of eight that are alike, and the least and the greatest of the table's widths and noise levels.
        paper.world.read_rows = vec![3, 4];
        let settings = paper.table1.as_mut().unwrap();
        settings.spreads = vec![0.1, 1.0];
        let (settings, measure) = (paper.table1.as_ref().unwrap(), paper.measure());
        let (mut worst, mut cells) = (0.0_f64, 0);
        for noise_level in [0.005, 0.1] {
            let frames = Synthesis::new(&paper.world).noise_level(noise_level);
            let training = paper.dataset(&frames, Stream::Training, settings.frames);
            let test = paper.dataset(&frames, Stream::Test, settings.test_frames);
            let decoders = decoders(settings, paper.world.seed, &training, &Silent).unwrap();
            let errors_of = |name, spread| {
                let is_wanted = |it: &&Spread| it.0 == spread && it.1.name() == name;
                let (_, decoder) = decoders.iter().find(is_wanted).unwrap();
                entry(decoder.as_ref(), spread, &test, &measure).errors
            };
            for spread in [0.1, 1.0] {
                let pairs = errors_of(NETWORK, Some(spread)).into_iter();
                for (network, mean) in pairs.zip(errors_of(mean::NAME, None)) {
                    // R² is the RMSE again, on a scale where the mean is 0.
                    for definition in Definition::ALL.iter().filter(|d| d.name != "r_squared") {
                        let pair = (definition.of(&network), definition.of(&mean));
                        let (Some(network), Some(mean)) = pair else { continue };
                        worst = worst.max(network / mean);
                        cells += 1;
                    }
                }
            }
        }
        println!("{cells} cells; the worst is {worst:.4} × the mean's error");
        assert_eq!(cells, 2 * 2 * (4 + 4 + 5));
        assert!(worst <= 1.02, "{worst}");
    }
}
