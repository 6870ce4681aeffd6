//! Table 1 of the paper: errors by spread and noise, by every definition.

use std::fmt::Display;

use taxel_data::{Progress, columns};
use taxel_learn::decoders::{BASELINES, mean, standard};
use taxel_learn::train::resolution;
use taxel_simulate::motion::Kind;
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::sensor::Sensor;
use toml::{Table, Value};

use crate::error::{Error, Result};
use crate::evaluate::paper_networks::{Cell, TEXTBOOK};
use crate::experiment::{Experiment, Table1 as Settings};
use crate::metrics::{Errors, LimitSummary};
use crate::sweep::file::{Also, Wanted};
use crate::sweep::plan::Point;
use crate::sweep::plan::{Base, SEED};
use crate::sweep::{Plan, Record, judge, work};
use crate::training_options::{Method, TrainingOptions};

pub mod printed;

use printed::{Cells, Nearness, SPREADS};

pub use crate::evaluate::paper_networks::Entry;
pub use crate::metrics::NETWORK;

/// Table 1 of a scene: errors of every decoder at every noise level.
#[derive(Debug, Clone, PartialEq)]
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
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Formula of the error, in per cent.
    pub formula: &'static str,
    /// Errors of the network in per cent, by spread and noise level.
    pub cells: Cells,
    /// Errors of always predicting the mean in per cent, by noise level.
    pub mean_percent: [f64; 4],
    /// Nearness to the printed cells.
    pub nearness: Nearness,
}

/// Errors of all decoders at one noise level.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Noise level p: a fraction, or in Ω for absolute noise.
    pub noise_level: f64,
    /// Least possible errors, of a decoder that sees all readings of a frame.
    pub limit: LimitSummary,
    /// Baselines, then the networks, spread after spread. A standard network (K = N) is omitted where
    /// its interpolation matrix is singular.
    pub decoders: Vec<Entry>,
}

impl Column {
    /// Column of the `cells` of all spreads.
    fn new(noise_level: f64, cells: &[Cell]) -> Self {
        let named =
            |cell: &Cell, name: &str| cell.entries.iter().find(|it| it.decoder == name).cloned();
        let baselines = BASELINES.iter().rev().filter_map(|it| named(&cells[0], it.name));
        let networks = cells.iter().flat_map(|cell| {
            let in_f64 = named(cell, TEXTBOOK).map(|it| Entry { decoder: NETWORK.into(), ..it });
            let network = in_f64.or_else(|| named(cell, NETWORK));
            network.into_iter().chain(named(cell, standard::NAME))
        });
        let decoders = baselines.chain(networks).collect();
        Self { noise_level, limit: cells[0].limit.clone(), decoders }
    }

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

/// Computes Table 1 of a scene, with the seed and the inputs of its `experiment`.
///
/// # Errors
/// [`Error`] for a scene without `[table1]`, for readings or outputs that f32 does not hold, and for the first cell that fails.
pub fn compute(experiment: &Experiment, progress: &dyn Progress) -> Result<Table1> {
    let settings = experiment.table1.as_ref().ok_or_else(|| {
        let cause =
            "it has no [table1]: add one, or use a scene that has (paper, paper-as-printed)";
        Error::of_scene(&experiment.name, cause)
    })?;
    let plan = plan(experiment, settings)?;
    let points = plan.points()?;
    let of_level = settings.spreads.len();
    let noise = |level: usize| {
        format!("{} noise", experiment.world.noise.kind.in_words(settings.noise_levels[level]))
    };
    for (level, points) in points.chunks(of_level).enumerate() {
        let of_level = |why| Error::of_scene(&experiment.name, format!("{}: {why}", noise(level)));
        check(&plan, &points[0]).map_err(of_level)?;
    }
    let accept = |cell: usize, record: &Record| {
        let Some(why) = &record.failed else { return Ok(()) };
        let (noise, spread) = (noise(cell / of_level), settings.spreads[cell % of_level]);
        Err(Error::failed(format!("{noise}, spread {spread:?}: {why}")))
    };
    let records = work::until(&plan, &points, &accept, progress)?;
    let cells: Vec<Cell> = records.into_iter().filter_map(|record| record?.cell).collect();
    let columns = settings.noise_levels.iter().zip(cells.chunks(of_level));
    let columns: Vec<Column> = columns.map(|(level, cells)| Column::new(*level, cells)).collect();
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

/// Checks that f32 holds the frames of a `point`, which those of its noise level share.
fn check(plan: &Plan, point: &Point) -> Result<()> {
    let subject = judge::subject_of(plan, point)?;
    Ok(resolution::check(&subject.training_set().frames)?)
}

/// Plan of Table 1: the network of the paper at every noise level and spread.
fn plan(experiment: &Experiment, settings: &Settings) -> Result<Plan> {
    let failed = |cause: &dyn Display| Error::of_scene(&experiment.name, cause.to_string());
    let mut document: Table = toml::from_str(&experiment.text).map_err(|cause| failed(&cause))?;
    let training = TrainingOptions {
        frames: Some(settings.frames),
        test_frames: Some(settings.test_frames),
        centres: Some(vec![settings.centres]),
        method: Some(Method::Paper),
        solver: Some(settings.solver()),
        relative_inputs: Some(experiment.training.relative_inputs),
        ..TrainingOptions::default()
    };
    let training = Table::try_from(training).map_err(|cause| failed(&cause))?;
    let seed = i64::try_from(experiment.world.seed).map_err(|cause| failed(&cause))?;
    document.extend([("training".to_owned(), training.into()), (SEED.to_owned(), seed.into())]);
    let values = |values: &[f64]| Value::from(values.to_vec());
    let level = format!("noise.level{}", experiment.world.noise.kind.unit_of_fields());
    let axes = [(level.as_str(), &settings.noise_levels), ("training.spread", &settings.spreads)];
    let wanted = Wanted {
        also: vec![Also::Table1],
        axes: axes.map(|(field, of)| (field.to_owned(), values(of))).into_iter().collect(),
        ..Wanted::default()
    };
    let base = Base { label: experiment.name.clone(), document, digest: experiment.digest };
    Ok(Plan::new(&experiment.name, (vec![base], None), wanted, "")?)
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
        Some(Comparison { formula, cells, mean_percent, nearness })
    };
    FORMULAS.iter().filter_map(by).collect()
}

impl Table1 {
    /// Formula by which the table is nearest to the printed one.
    pub fn nearest_formula(&self) -> Option<&Comparison> {
        let gap = |it: &Comparison| it.nearness.gap;
        self.comparison.iter().min_by(|a, b| gap(a).total_cmp(&gap(b)))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use taxel_data::Silent;
    use taxel_simulate::World;

    use super::*;
    use crate::metrics::Definition;

    #[test]
    fn only_a_table_of_the_papers_settings_is_compared_with_it() {
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
    fn the_first_cell_that_fails_ends_the_work() {
        let paper = Experiment::load("paper-as-printed").unwrap();
        let plan = plan(&paper, paper.table1.as_ref().unwrap()).unwrap();
        // A scene that cannot be read fails at once.
        let mut points = plan.points().unwrap();
        points.iter_mut().for_each(|point| point.scene.clear());
        let judged = AtomicUsize::new(0);
        let accept = |cell: usize, record: &Record| {
            judged.fetch_add(1, Ordering::Relaxed);
            let why = record.failed.clone().unwrap_or_default();
            Err(Error::failed(format!("cell {cell}: {why}")))
        };
        let error = work::until(&plan, &points, &accept, &Silent).unwrap_err().to_string();
        assert!(error.starts_with("cell ") && error.contains("missing field"), "{error}");
        assert!(judged.into_inner() <= work::threads());
    }

    #[test]
    fn no_cell_of_the_papers_table_is_2_percent_worse_than_the_mean() {
        // Two rows of eight that are alike, and the least and the greatest of the table's widths and noise levels.
        let mut text = Experiment::text("paper").unwrap().into_owned();
        for (from, to) in [
            ("[outputs]", "[readout]\nrow_wires = [4, 5]\n\n[outputs]"),
            (
                "spreads = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]",
                "spreads = [0.1, 1.0]",
            ),
            ("noise_levels = [0.005, 0.01, 0.05, 0.1]", "noise_levels = [0.005, 0.1]"),
        ] {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let paper = Experiment::parse("paper", &text).unwrap();
        let mut plan = plan(&paper, paper.table1.as_ref().unwrap()).unwrap();
        plan.limit_frames = Some(0);
        let records = work::in_memory(&plan, &plan.points().unwrap(), &Silent).unwrap();
        let (mut worst, mut cells) = (0.0_f64, 0);
        for cell in records.into_iter().map(|record| record.unwrap().cell.unwrap()) {
            let errors_of = |name: &str| {
                let entry = cell.entries.iter().find(|it| it.decoder == name);
                entry.unwrap().errors.clone()
            };
            for (network, mean) in errors_of(NETWORK).into_iter().zip(errors_of(mean::NAME)) {
                // R² is the RMSE again, on a scale where the mean is 0.
                for definition in Definition::ALL.iter().filter(|d| d.name != "r_squared") {
                    let pair = (definition.of(&network), definition.of(&mean));
                    let (Some(network), Some(mean)) = pair else { continue };
                    worst = worst.max(network / mean);
                    cells += 1;
                }
            }
        }
        println!("{cells} cells; the worst is {worst:.4} × the mean's error");
        assert_eq!(cells, 2 * 2 * (4 + 4 + 5));
        assert!(worst <= 1.02, "{worst}");
    }
}
