//! Table 1 of the paper: errors by spread and noise, by every definition.

use rayon::prelude::*;
use serde::Serialize;
use taxel_data::data_file::DataFile;
use taxel_data::dataset::Dataset;
use taxel_data::error::Problem;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_learn::decoders::standard::{self, StandardNetwork};
use taxel_learn::decoders::{BASELINES, Rows, mean};
use taxel_learn::train::{FittedNetwork, Samples};
use taxel_learn::{Decoder, Options};
use taxel_simulate::Synthesis;

use crate::error::{Error, Result};
use crate::experiment::{Experiment, Table1 as Settings};
use crate::metrics::{self, Definition, Errors, LimitSummary, Measure};

pub use crate::metrics::NETWORK;

/// Lowest and highest cell of the paper's printed Table 1, in per cent. The paper does not state its
/// definition of the error.
pub const PAPER_PRINTED_PERCENT: [f64; 2] = [6.5, 11.4];

/// Table 1 of a scene: errors of every decoder at every noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table1 {
    /// Number of centres of each row-wire's network.
    pub centres: usize,
    /// Whether the networks have an affine tail.
    pub affine_tail: bool,
    /// Number of frames on which each cell was trained.
    pub training_frames: usize,
    /// Number of frames on which each cell was evaluated.
    pub test_frames: usize,
    /// Number of frames, and of centres, of the standard networks.
    pub standard_frames: usize,
    /// How the output weights of the networks were computed: `rls` or `qr`.
    pub solver: &'static str,
    /// Columns of the table, one a noise level.
    pub columns: Vec<Column>,
    /// Cells as the paper prints them, where the reader supplied them.
    pub printed: Vec<Printed>,
}

/// Cell as the paper prints it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Printed {
    /// Spread of its line.
    pub spread: f64,
    /// Noise level of its column, as a fraction.
    pub noise_level: f64,
    /// Error in per cent.
    pub percent: f64,
}

impl Printed {
    /// Reads printed cells from a file with the columns `spread`, `noise_level` and `percent`.
    ///
    /// # Errors
    /// [`Error`] for a file that cannot be read, or a column or value that is missing.
    pub fn from_file(file: &DataFile) -> taxel_data::Result<Vec<Self>> {
        let columns = file.columns(["spread", "noise_level", "percent"])?;
        let cell = |line: usize| {
            let value = |column: usize| file.value(line, columns[column]);
            let cell = Self { spread: value(0), noise_level: value(1), percent: value(2) };
            if [cell.spread, cell.noise_level, cell.percent].iter().any(|v| v.is_nan()) {
                let (line, rule) =
                    (file.line_number(line), "every cell needs three numbers".into());
                let problem = Problem::MissingValue { line, rule };
                return Err(taxel_data::Error::file(&file.path, problem));
            }
            Ok(cell)
        };
        (0..file.lines()).map(cell).collect()
    }
}

/// Errors of all decoders at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// Noise level p, as a fraction.
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
    /// Name of the decoder.
    pub decoder: String,
    /// Width σ on scaled inputs, for decoders that have one.
    pub spread: Option<f64>,
    /// Errors by group.
    pub errors: Vec<Errors>,
}

impl Column {
    /// Errors of the decoder called `decoder`, with that spread if it has one; empty if there is no such
    /// decoder.
    #[must_use]
    pub fn errors(&self, decoder: &str, spread: Option<f64>) -> &[Errors] {
        let mut entries = self.decoders.iter();
        let found = entries.find(|entry| entry.decoder == decoder && entry.spread == spread);
        found.map_or(&[], |entry| &entry.errors)
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

/// Networks of one row-wire, one a spread.
struct RowNetworks {
    networks: Vec<FittedNetwork>,
    standard: Vec<Option<StandardNetwork>>,
}

/// Computes Table 1 as the scene asks for.
///
/// # Errors
/// [`Error`] for a scene without `[table1]`, or an error of [`train`](taxel_learn::train::train).
pub fn compute(experiment: &Experiment, progress: &dyn Progress) -> Result<Table1> {
    let settings = experiment.table1.as_ref().ok_or_else(|| Error::Syntax {
        scene: experiment.name.clone(),
        message: "it has no [table1]: add one, or use a scene that has (paper, press)".into(),
    })?;
    let columns = settings.noise_levels.iter().map(|&level| {
        let frames = Synthesis::of(&experiment.world).noise_level(level);
        let training = experiment.dataset(&frames, Stream::Training, settings.frames);
        let test = experiment.dataset(&frames, Stream::Test, settings.test_frames);
        let (measure, limit) =
            experiment.measure_beside_limit(level, settings.test_frames, progress);
        progress.stage(&format!("table 1, noise {level}"), experiment.world.read_rows.len());
        let decoders = decoders(settings, experiment.world.seed, &training, progress)?;
        let judged = |(spread, decoder): &Spread| entry(decoder.as_ref(), *spread, &test, &measure);
        let decoders = decoders.iter().map(judged).collect();
        Ok(Column { noise_level: level, limit, decoders })
    });
    Ok(Table1 {
        centres: settings.centres,
        affine_tail: settings.affine_tail,
        training_frames: settings.frames,
        test_frames: settings.test_frames,
        standard_frames: settings.standard_frames,
        solver: settings.solver.name(),
        columns: columns.collect::<Result<_>>()?,
        printed: Vec::new(),
    })
}

/// Decoder, with its spread if it has one.
type Spread = (Option<f64>, Box<dyn Decoder>);

fn entry(decoder: &dyn Decoder, spread: Option<f64>, test: &Dataset, measure: &Measure) -> Entry {
    let judged = metrics::judge(decoder, test, measure);
    Entry { decoder: judged.decoder, spread, errors: judged.errors }
}

/// Fits every decoder of the table at one noise level to `training`.
fn decoders(
    settings: &Settings,
    seed: u64,
    training: &Dataset,
    progress: &dyn Progress,
) -> Result<Vec<Spread>> {
    let rows = (0..training.rows).into_par_iter();
    let rows: Vec<RowNetworks> = rows
        .map(|row| {
            let networks = row_networks(settings, seed, row, training);
            progress.step();
            networks
        })
        .collect::<Result<_>>()?;
    let baselines = BASELINES.iter().rev().map(|baseline| (None, baseline.fit(training)));
    let mut decoders: Vec<Spread> = baselines.collect();
    for (place, &spread) in settings.spreads.iter().enumerate() {
        let networks = rows.iter().map(|row| row.networks[place].clone()).collect();
        decoders.push((Some(spread), Box::new(Rows::of(NETWORK, training, networks))));
        let standard: Option<Vec<StandardNetwork>> =
            rows.iter().map(|row| row.standard[place].clone()).collect();
        if let Some(standard) = standard {
            let standard = Rows::of(standard::NAME, training, standard);
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
) -> Result<RowNetworks> {
    let table = training.row_table(row);
    let samples = Samples::new(&table);
    let options = |spread| {
        let (centres, affine_tail) = (settings.centres, settings.affine_tail);
        let solver = settings.solver;
        let mut options =
            Options { centres, spread, affine_tail, solver, seed, ..Options::default() };
        options.search.most_points = 4096;
        options.search.restarts = 1;
        options
    };
    // The centres do not depend on the spread.
    let centres = samples.centres(&options(1.0), row);
    let few = table.first(settings.standard_frames);
    let each = settings.spreads.par_iter().map(|&spread| {
        let network = samples.fit(&centres, &options(spread))?;
        Ok((network, StandardNetwork::fit(&few, spread)))
    });
    let (networks, standard) = each.collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok(RowNetworks { networks, standard })
}

impl Table1 {
    /// Table as CSV: one line a noise level, decoder, spread, group and definition. Undefined values are
    /// empty.
    #[must_use]
    pub fn to_csv(&self) -> String {
        use std::fmt::Write as _;
        let mut csv = String::from("noise_level,decoder,spread,group,definition,value\n");
        for column in &self.columns {
            for Entry { decoder, spread, errors } in &column.decoders {
                let spread = spread.map_or(String::new(), |s| s.to_string());
                for group in errors {
                    for definition in Definition::ALL {
                        let value = definition.of(group);
                        let value = value.map_or(String::new(), |v| v.to_string());
                        let (level, name) = (column.noise_level, definition.name());
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
        for Printed { spread, noise_level, percent } in &self.printed {
            let _ = writeln!(csv, "{noise_level},paper,{spread},dz_mm,as_printed,{percent}");
        }
        csv
    }

    /// Groups of outputs that the table covers.
    #[must_use]
    pub fn groups(&self) -> Vec<&str> {
        let first = self.columns.first().and_then(|column| column.decoders.first());
        first
            .map_or(&[][..], |entry| &entry.errors)
            .iter()
            .map(|errors| errors.group.as_str())
            .collect()
    }

    /// Largest ratio of the network's RMSE to the RMSE of always predicting the mean, over all cells of
    /// `group`.
    #[must_use]
    pub fn worst_ratio_to_mean(&self, group: &str) -> Option<f64> {
        let rmse = |errors: &[Errors]| errors.iter().find(|e| e.group == group).map(|e| e.rmse);
        let ratios = self.columns.iter().flat_map(|column| {
            let mean = rmse(column.errors(mean::NAME, None));
            let networks = column.decoders.iter().filter(|entry| entry.decoder == NETWORK);
            networks.filter_map(move |entry| Some(rmse(&entry.errors)? / mean?))
        });
        ratios.max_by(f64::total_cmp)
    }
}
