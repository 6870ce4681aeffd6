//! Table 1 of the paper: error against spread and noise, by every definition.

use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use super::metrics::{self, Definition, Errors, Measure};
use crate::data_file::DataFile;
use crate::dataset::{Block, Dataset};
use crate::error::{Error, Result};
use crate::infer::{Kernel, infer};
use crate::model::Origin;
use crate::output;
use crate::progress::Progress;
use crate::random::Stream;
use crate::scene::{Scene, Table1 as Settings};
use crate::synth;
use crate::train::linear::LinearDecoder;
use crate::train::standard::StandardNetwork;
use crate::train::{Options, Samples};

/// Lowest and highest cell of the paper's printed Table 1, in per cent of an error whose
/// definition the paper does not state.
pub const PAPER_PRINTED_PERCENT: [f64; 2] = [6.5, 11.4];

/// The whole table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table1 {
    /// Centres of each row-wire's network.
    pub centres: usize,
    /// Whether the networks have an affine tail.
    pub affine_tail: bool,
    /// Frames each cell was trained on.
    pub training_frames: usize,
    /// Frames each cell was evaluated on.
    pub test_frames: usize,
    /// Frames, and centres, of the standard networks.
    pub standard_frames: usize,
    /// One entry a noise level.
    pub columns: Vec<Column>,
    /// What the paper prints, where the reader supplied it.
    pub printed: Vec<Printed>,
}

/// One cell as the paper prints it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Printed {
    /// Spread of its line.
    pub spread: f64,
    /// Noise level of its column, as a fraction.
    pub noise_level: f64,
    /// The number, in per cent.
    pub percent: f64,
}

impl Printed {
    /// Reads printed cells from a file with the columns `spread`, `noise_level` and `percent`.
    ///
    /// # Errors
    /// [`Error::Data`] for a column or a value that is missing.
    pub fn from_file(file: &DataFile) -> Result<Vec<Self>> {
        let columns = file.columns(["spread", "noise_level", "percent"])?;
        let cell = |line: usize| {
            let value = |column: usize| file.value(line, columns[column]);
            let cell = Self { spread: value(0), noise_level: value(1), percent: value(2) };
            if [cell.spread, cell.noise_level, cell.percent].iter().any(|v| v.is_nan()) {
                let message =
                    format!("line {}: every cell needs three numbers", file.line_number(line));
                return Err(Error::data(&file.path, message));
            }
            Ok(cell)
        };
        (0..file.lines()).map(cell).collect()
    }
}

/// All that was measured at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// Noise level p, as a fraction.
    pub noise_level: f64,
    /// Errors of answering the training mean, by group.
    pub mean: Vec<Errors>,
    /// Errors of the best linear decoder, by group.
    pub linear: Vec<Errors>,
    /// One entry a spread.
    pub cells: Vec<Cell>,
}

/// One cell of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Errors of the K-centre network, by group.
    pub network: Vec<Errors>,
    /// Errors of the standard network (K = N), by group; `None` where its interpolation matrix
    /// is singular.
    pub standard: Option<Vec<Errors>>,
}

/// Answers of every decoder to one row-wire's test readings.
struct RowAnswers {
    mean: Vec<f64>,
    linear: Vec<f64>,
    /// One entry a spread.
    network: Vec<Vec<f64>>,
    standard: Vec<Option<Vec<f64>>>,
}

/// Computes the table that `scene` asks for.
///
/// # Errors
/// [`Error::Scene`] if the scene has no `[table1]`; else as [`train`](crate::train::train).
pub fn compute(scene: &Scene, progress: &Progress) -> Result<Table1> {
    let settings = scene.table1.as_ref().ok_or_else(|| Error::Scene {
        scene: scene.name.clone(),
        message: "it has no [table1]: add one, or use a scene that has (paper, press)".into(),
    })?;
    let origin = Origin::of_scene(scene);
    let measure = Measure { full_scale: origin.full_scale, thickness_mm: origin.thickness_mm };
    progress.stage("table 1", settings.noise_levels.len() * scene.read_rows.len());
    let columns = settings
        .noise_levels
        .iter()
        .map(|level| column(scene, settings, *level, &measure, progress));
    Ok(Table1 {
        centres: settings.centres,
        affine_tail: settings.affine_tail,
        training_frames: settings.frames,
        test_frames: settings.test_frames,
        standard_frames: settings.standard_frames,
        columns: columns.collect::<Result<_>>()?,
        printed: Vec::new(),
    })
}

fn column(
    scene: &Scene,
    settings: &Settings,
    noise_level: f64,
    measure: &Measure,
    progress: &Progress,
) -> Result<Column> {
    let mut scene = scene.clone();
    scene.noise.level = noise_level;
    let training = synth::synthesise(&scene, Stream::Training, settings.frames);
    let test = synth::synthesise(&scene, Stream::Test, settings.test_frames);
    let rows = (0..training.rows)
        .into_par_iter()
        .map(|row| {
            let (block, test) = (training.block(row), test.block(row));
            let answers = row_answers(&scene, settings, row, &block, &test);
            progress.step();
            answers
        })
        .collect::<Result<Vec<RowAnswers>>>()?;
    let errors = |of_row: &dyn Fn(&RowAnswers) -> &[f64]| {
        let parts: Vec<&[f64]> = rows.iter().map(of_row).collect();
        metrics::by_group(&test.outputs, &side_by_side(&parts, &test), measure)
    };
    let cells = settings.spreads.iter().enumerate().map(|(s, spread)| Cell {
        spread: *spread,
        network: errors(&|row| &row.network[s]),
        standard: rows
            .iter()
            .all(|row| row.standard[s].is_some())
            .then(|| errors(&|row| row.standard[s].as_deref().unwrap_or_default())),
    });
    Ok(Column {
        noise_level,
        mean: errors(&|row| &row.mean),
        linear: errors(&|row| &row.linear),
        cells: cells.collect(),
    })
}

fn row_answers(
    scene: &Scene,
    settings: &Settings,
    row: usize,
    block: &Block,
    test: &Block,
) -> Result<RowAnswers> {
    let samples = Samples::new(block);
    let options = |spread| {
        let mut options = Options::new(settings.centres, spread, settings.affine_tail, scene.seed);
        options.search.most_points = 4096;
        options.search.restarts = 1;
        options
    };
    // The centres do not depend on the spread.
    let centres = samples.centres(&options(1.0), row);
    let few = block.first(settings.standard_frames);
    let each = settings.spreads.par_iter().map(|&spread| {
        let fitted = samples.fit(&centres, &options(spread))?;
        let network = infer(&fitted.network(), Kernel::default(), &test.inputs);
        Ok((network, StandardNetwork::fit(&few, spread).map(|standard| standard.predict(test))))
    });
    let (network, standard) = each.collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok(RowAnswers {
        mean: LinearDecoder::mean(block).predict(test),
        linear: LinearDecoder::fit(block).predict(test),
        network,
        standard,
    })
}

/// Joins the answers of all row-wires into lines of the test set's output table.
pub(crate) fn side_by_side(parts: &[&[f64]], test: &Dataset) -> Vec<f64> {
    let width = test.outputs.names.len() / parts.len();
    (0..test.frames())
        .flat_map(|line| parts.iter().flat_map(move |part| &part[line * width..(line + 1) * width]))
        .copied()
        .collect()
}

impl Table1 {
    /// The table as CSV: one line a noise level, decoder, spread, group and definition. Values that
    /// are not defined are empty.
    #[must_use]
    pub fn to_csv(&self) -> String {
        use std::fmt::Write as _;
        let mut csv = String::from("noise_level,decoder,spread,group,definition,value\n");
        for column in &self.columns {
            let mut add = |decoder: &str, spread: Option<f64>, errors: &[Errors]| {
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
            };
            add("mean", None, &column.mean);
            add("linear", None, &column.linear);
            for cell in &column.cells {
                add("network", Some(cell.spread), &cell.network);
                if let Some(standard) = &cell.standard {
                    add("standard", Some(cell.spread), standard);
                }
            }
        }
        for Printed { spread, noise_level, percent } in &self.printed {
            let _ = writeln!(csv, "{noise_level},paper,{spread},dz_mm,as_printed,{percent}");
        }
        csv
    }

    /// Writes [`to_csv`](Self::to_csv) to `path`.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        output::write_bytes(path, self.to_csv().as_bytes())
    }

    /// The groups of outputs that the table covers.
    #[must_use]
    pub fn groups(&self) -> Vec<&str> {
        let first = self.columns.first().map_or(&[][..], |column| &column.mean);
        first.iter().map(|errors| errors.group.as_str()).collect()
    }

    /// The largest ratio of the network's RMSE to that of the mean over all cells of `group`.
    #[must_use]
    pub fn worst_ratio_to_mean(&self, group: &str) -> Option<f64> {
        let rmse = |errors: &[Errors]| errors.iter().find(|e| e.group == group).map(|e| e.rmse);
        let ratios = self.columns.iter().flat_map(|column| {
            let mean = rmse(&column.mean);
            column.cells.iter().filter_map(move |cell| Some(rmse(&cell.network)? / mean?))
        });
        ratios.max_by(f64::total_cmp)
    }
}
