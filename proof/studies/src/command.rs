//! The studies' options, and the pages of their answers.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use host_sim::commands::arguments::{of_option, precision};
use host_sim::commands::print::{self, Page};
use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::{
    NoiseArgument, SceneArgument, group_of_scene, model, read_one_row,
};
use host_sim::commands::{Common, coverage_page};
use host_sim::metrics::{self, Errors, NETWORK};
use host_sim::{Error, Result};
use serde::Serialize;
use taxel_data::{BadValue, output};
use taxel_learn::Exponential;
use taxel_learn::decoders::{linear, mean};
use taxel_simulate::outputs::Outputs;
use taxel_simulate::rubber::{Kind, Rubber};
use taxel_simulate::sensor::Precision;
use taxel_simulate::world::check_gain;
use taxel_virtual_board::VirtualBoard;

use crate::equations::{DAMPED, EXACT};
use crate::level::AtNoise;
use crate::picture;
use crate::question::confidence::{self, Confidence};
use crate::question::directions::{self, DirectionsResult, INVERTED, INVERTED_DAMPED};
use crate::question::drift::{self, DriftResult, Line, TYPICAL_GAIN};
use crate::question::equations::{self, EquationsResult, RowWire};
use crate::question::map::{self, MapStudy};
use crate::question::rate::{self, RateStudy};
use crate::question::readout::{self, ReadoutResult};
use crate::question::recursion::{
    self, DIVERGED, FORGETTING_FACTORS, INITIAL_COVARIANCES, KINDS, Outcome,
};
use crate::question::rubber::{self, RubberResult, TYPICAL, TrainedOn};
use crate::question::widths::{self, WidthsStudy};
use crate::reconstruct;

/// What is studied.
#[derive(Subcommand)]
pub enum Question {
    /// Solve the sensor's equations for each row's deformation, without training, by noise.
    ///
    /// Equation 6 of the paper has as many unknowns as readings: `equations` solves it exactly, from rest, by damped Newton
    /// steps in f64. `damped` stops where readings are met within their noise, and knows mean and covariance of the scene's
    /// deformations. Beside them stand the scene's network, the best linear decoder, the mean, and the limit. So what the
    /// sensor loses is told from what a network loses (docs/what-the-sensor-knows.md).
    #[command(after_help = "Example: cargo xtask study equations paper -o equations.svg")]
    Equations {
        #[command(flatten)]
        scene: SceneArgument,
        /// Test frames.
        #[arg(short = 'n', long, value_name = "N", default_value_t = 60)]
        frames: usize,
        #[command(flatten)]
        picture: Picture,
    },
    /// Compare both directions of the paper's network: deformations to readings, inverted, and readings to deformations.
    ///
    /// The end of the paper's §3 gives a network the 18 components of a row's deformation, and wants the 18 noisy readings.
    /// Such a network decodes by solving it for the deformation, by damped Newton steps from rest in f64: exactly
    /// (`inverted`), or within the noise, knowing mean and covariance of the scene's deformations (`inverted, damped`).
    /// Beside it stand the network that decodes directly, the best linear decoder, the mean, and the limit.
    #[command(after_help = "Example: cargo xtask study directions paper -o directions.svg")]
    Directions {
        #[command(flatten)]
        scene: SceneArgument,
        /// Test frames.
        #[arg(short = 'n', long, value_name = "N", default_value_t = 60)]
        frames: usize,
        #[command(flatten)]
        picture: Picture,
    },
    /// Compare a width for each centre (by its neighbours) with one for all.
    ///
    /// Trains both rules by K-means alone and refined, for each K, and judges them on fresh frames. Other frames choose the
    /// best spread of each rule. A width for each centre needs the format f32-direct; one for all is tried in f32 and in
    /// fixed16 (docs/training.md).
    #[command(after_help = "Example: cargo xtask study widths press --row 4")]
    Widths {
        #[command(flatten)]
        scene: SceneArgument,
        #[command(flatten)]
        noise: NoiseArgument,
        /// Row-wire (from 1) that is read.
        #[arg(long, value_name = "ROW", default_value_t = 4)]
        row: usize,
        #[command(flatten)]
        plan: widths::Plan,
        /// Outputs whose error is shown, such as dz_mm.
        #[arg(long, value_name = "GROUP", default_value = "dz_mm")]
        group: String,
    },
    /// Map training and test error over centres K, spread and number of samples N.
    ///
    /// Networks are the paper's: one width, no affine tail, for one row-wire. With K = N every sample is a centre. The page
    /// judges what the paper says of wide and narrow Gaussians, of noise, and of equations and unknowns. JSON has all cells.
    #[command(after_help = "Example: cargo xtask study map paper -o map.svg")]
    Map {
        /// A built-in scene (paper, press) or the path of a scene file.
        #[arg(default_value = "paper")]
        scene: String,
        /// Precision of the sensor's readings, instead of the scene's.
        #[arg(long, value_parser = precision())]
        precision: Option<Precision>,
        /// Row-wire (from 1) that is read.
        #[arg(long, value_name = "ROW", default_value_t = 4)]
        row: usize,
        #[command(flatten)]
        plan: map::Plan,
        /// Outputs whose error is mapped, such as dz_mm or dx_mm.
        #[arg(long, value_name = "GROUP", default_value = "dz_mm")]
        group: String,
        #[command(flatten)]
        picture: Picture,
    },
    /// Study where recursive least squares diverges: by form, precision, λ, δ and condition.
    ///
    /// The covariance form as textbooks print it stands beside the square-root form, in f32 and f64, on the regressors of one
    /// row-wire. Each is compared with the batch solution of the problem that it solves, in f64.
    #[command(after_help = "Example: cargo xtask study recursion -o recursion.svg")]
    Recursion {
        /// A built-in scene (paper, press) or the path of a scene file.
        #[arg(default_value = "paper")]
        scene: String,
        /// Row-wire (from 1) whose readings are the inputs.
        #[arg(long, value_name = "ROW", default_value_t = 4)]
        row: usize,
        #[command(flatten)]
        plan: recursion::Plan,
        #[command(flatten)]
        picture: Picture,
    },
    /// Compare inputs: readings, and readings relative to the baseline, when the gain drifts.
    ///
    /// Trains the scene's model on readings, on readings of sessions that drift, and on readings relative to each
    /// session's baseline. Evaluates each on the same test frames without and with drift (docs/drift.md).
    #[command(after_help = "Example: cargo xtask study drift press --gain 0.02")]
    Drift {
        #[command(flatten)]
        scene: SceneArgument,
        #[command(flatten)]
        noise: NoiseArgument,
        /// Largest relative change of the gain: each session has one factor on all its readings, uniform on
        /// [1 − GAIN, 1 + GAIN] [default: the scene's, or 0.02].
        #[arg(long, value_name = "GAIN", allow_negative_numbers = true)]
        gain: Option<f64>,
    },
    /// Compare decoders trained without and with rubber that creeps, on moving contacts.
    ///
    /// Trains the scene's model on still contacts, on moving ones, and on moving ones on rubber that creeps: a standard linear
    /// solid. Judges each on the same moving contacts, on rubber that follows at once and on rubber that creeps: the scene's
    /// outputs, and the contact's force (docs/rubber.md).
    #[command(after_help = "Example: cargo xtask study rubber moving --time-constant-ms 300")]
    Rubber {
        #[command(flatten)]
        scene: SceneArgument,
        #[command(flatten)]
        noise: NoiseArgument,
        /// Share of a deformation that is reached at once [default: the scene's, or 0.8].
        #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
        instant_share: Option<f64>,
        /// Time constant of the creep in ms [default: the scene's, or 100].
        #[arg(long, value_name = "MS", allow_negative_numbers = true)]
        time_constant_ms: Option<f64>,
    },
    /// Compare readout circuits: scan a scene through a virtual board, and decode.
    ///
    /// The firmware's own scanner runs on virtual pins and converters in front of a network of all wires.
    /// Faults are added one after the other. Parts that the scene's [readout] does not set have typical values
    /// (docs/readout.md). The frames have none of the scene's noise.
    #[command(after_help = "Example: cargo xtask study readout press --frames 500")]
    Readout {
        #[command(flatten)]
        scene: SceneArgument,
        /// Frames to scan.
        #[arg(short = 'n', long, value_name = "N", default_value_t = 200)]
        frames: usize,
        /// Weight blob of this scene, instead of training one.
        #[arg(long, value_name = "FILE")]
        model: Option<PathBuf>,
    },
    /// Confidence of a scene's model: errors that its intervals cover, and frames that it finds novel.
    ///
    /// Errors are those of test frames. Frames that should be novel have a broken wire, two wires that touch, or two
    /// contacts where the scene has one (docs/confidence.md).
    #[command(after_help = "Examples:
  cargo xtask study confidence press
  host-sim train press --whole-array --confidence -o array.bin
  cargo xtask study confidence press --model array.bin")]
    Confidence {
        #[command(flatten)]
        scene: SceneArgument,
        #[command(flatten)]
        noise: NoiseArgument,
        /// Test frames, and frames of every anomaly.
        #[arg(short = 'n', long, value_name = "N", default_value_t = 8000)]
        frames: usize,
        /// Weight blob of this scene, trained with --confidence, instead of training one.
        #[arg(long, value_name = "FILE")]
        model: Option<PathBuf>,
    },
    /// Error against the rate of frames, for both readouts of the board, by samples a reading.
    ///
    /// Trains the scene's model for the noise that is left in the mean of so many samples, and judges it on still contacts, and
    /// on moving ones by the newest finished estimate, without a filter and behind one: for white noise, and for noise of the
    /// same level with a time constant of 2 and 20 ms (docs/rate.md).
    #[command(after_help = "Example: cargo xtask study rate moving -o rate.svg")]
    Rate {
        #[command(flatten)]
        scene: SceneArgument,
        #[command(flatten)]
        noise: NoiseArgument,
        #[command(flatten)]
        picture: Picture,
    },
    Reconstruct(reconstruct::Arguments),
}

/// Option of a study with a picture.
#[derive(Args)]
pub struct Picture {
    /// Picture to write.
    #[arg(short, long, value_name = "FILE.svg")]
    output: Option<PathBuf>,
}

impl Picture {
    /// Checks before long work that it can be written, and would not replace the `scene`.
    fn check(&self, scene: &Path) -> Result<()> {
        self.output.as_ref().map_or(Ok(()), |path| print::check_output(path, &[scene]))
    }

    /// Writes what is drawn, if it is asked for.
    fn write(&self, draw: impl FnOnce() -> String) -> Result<()> {
        let Some(path) = &self.output else { return Ok(()) };
        Ok(output::write_bytes(path, draw().as_bytes())?)
    }
}

/// Options that set the fields of plans.
const OPTIONS: [(&str, &str); 11] = [
    ("samples", "--samples"),
    ("centres", "--centres"),
    ("spread", "--spread"),
    ("spreads", "--spread"),
    ("noise_levels", "--noise"),
    ("test_frames", "--test-frames"),
    ("initial_covariance", "--initial-covariance"),
    ("updates", "--updates"),
    ("gain", "--gain"),
    ("rubber.instant_share", "--instant-share"),
    ("rubber.time_constant_ms", "--time-constant-ms"),
];

/// An error of a setting, as one of the option that sets it.
fn of_options(error: impl Into<Error>) -> Error {
    match error.into() {
        Error::Data(taxel_data::Error::Setting(bad)) => of_option(bad, &OPTIONS),
        other => other,
    }
}

impl Question {
    /// Name of the study in JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Equations { .. } => "study equations",
            Self::Directions { .. } => "study directions",
            Self::Widths { .. } => "study widths",
            Self::Map { .. } => "study map",
            Self::Recursion { .. } => "study recursion",
            Self::Drift { .. } => "drift",
            Self::Rubber { .. } => "study rubber",
            Self::Readout { .. } => "readout",
            Self::Confidence { .. } => "confidence",
            Self::Rate { .. } => "study rate",
            Self::Reconstruct(_) => "study reconstruct",
        }
    }

    /// Computes and prints the answer.
    #[expect(clippy::too_many_lines, reason = "an arm for each study")]
    pub fn answer(&self, common: &Common) -> Result<()> {
        let progress = Terminal::new();
        match self {
            Self::Equations { scene, frames, picture } => {
                picture.check(scene.path())?;
                let result = equations::study(&scene.load(common)?, *frames, &progress)?;
                picture.write(|| picture::equations_svg(&result))?;
                show(common, &result, equations_page)
            }
            Self::Directions { scene, frames, picture } => {
                picture.check(scene.path())?;
                let result = directions::study(&scene.load(common)?, *frames, &progress)?;
                picture.write(|| picture::decoding_svg(&result))?;
                show(common, &result, directions_page)
            }
            Self::Widths { scene, noise, row, plan, group } => {
                let mut scene = scene.load(common)?;
                noise.apply(&mut scene)?;
                read_one_row(&mut scene, *row)?;
                group_of_scene(&scene, group)?;
                let study = widths::compute(&scene, group, plan, &progress).map_err(of_options)?;
                show(common, &study, widths_page)
            }
            Self::Map { scene, precision, row, plan, group, picture } => {
                let argument = SceneArgument::new(scene, *precision);
                picture.check(argument.path())?;
                let mut scene = argument.load_world(common)?;
                read_one_row(&mut scene, *row)?;
                group_of_scene(&scene, group)?;
                plan.check().map_err(of_options)?;
                let study = map::compute(&scene, group, plan, &progress)?;
                picture.write(|| picture::study_map_svg(&study))?;
                show(common, &study, map_page)
            }
            Self::Recursion { scene, row, plan, picture } => {
                let argument = SceneArgument::new(scene, None);
                let mut scene = argument.load_world(common)?;
                read_one_row(&mut scene, *row)?;
                plan.check().map_err(of_options)?;
                picture.check(argument.path())?;
                let study = recursion::compute(&scene, plan, &progress)?;
                picture.write(|| picture::recursion_svg(&study))?;
                show(common, &study, recursion_page)
            }
            Self::Drift { scene, noise, gain } => {
                let mut scene = scene.load(common)?;
                scene.require_inverse("drift")?;
                noise.apply(&mut scene)?;
                let of_scene = scene.world.drift.map_or(TYPICAL_GAIN, |drift| drift.gain);
                let gain = gain.unwrap_or(of_scene);
                check_gain("gain", gain).map_err(of_options)?;
                show(common, &drift::measure(&scene, gain, &progress)?, drift_page)
            }
            Self::Rubber { scene, noise, instant_share, time_constant_ms } => {
                let mut scene = scene.load(common)?;
                scene.require_inverse("rubber")?;
                noise.apply(&mut scene)?;
                let path = scene.world.path.ok_or_else(|| {
                    let rule = "rubber creeps under contacts that move; take a scene with [motion], such as moving";
                    BadValue::new("motion", "still contacts", rule)
                })?;
                let Outputs::Electrodes(_) = scene.world.outputs else {
                    let rule =
                        "the contact's force is studied anyway; ask for outputs of electrodes";
                    return Err(BadValue::new("outputs.contact", &scene.name, rule).into());
                };
                let mut solid = match scene.world.rubber {
                    Kind::StandardLinearSolid(solid) => solid,
                    Kind::Elastic(_) => TYPICAL,
                };
                solid.instant_share = instant_share.unwrap_or(solid.instant_share);
                solid.time_constant_ms = time_constant_ms.unwrap_or(solid.time_constant_ms);
                solid.check().map_err(of_options)?;
                show(common, &rubber::measure(&scene, path, solid, &progress)?, rubber_page)
            }
            Self::Readout { scene, frames, model: path } => {
                let scene = scene.load(common)?;
                scene.require_inverse("readout")?;
                scene.world.check_frames("--frames", *frames)?;
                VirtualBoard::new(&scene.world)?;
                let model = model(path.as_deref(), &scene, &progress)?;
                let model = model.prepare(Exponential::default());
                show(common, &readout::measure(&scene, &model, *frames)?, readout_page)
            }
            Self::Confidence { scene, noise, frames, model: path } => {
                let mut scene = scene.load(common)?;
                scene.require_inverse("confidence")?;
                noise.apply(&mut scene)?;
                scene.world.check_frames("--frames", *frames)?;
                scene.training.confidence = true;
                let blob = model(path.as_deref(), &scene, &progress)?;
                let found = confidence::judge(scene, &blob, *frames);
                let found = found.ok_or_else(|| Error::Unfit {
                    path: path.clone().unwrap_or_default(),
                    message: "this model has no confidence: train it with --confidence".into(),
                })?;
                show(common, &found, confidence_page)
            }
            Self::Rate { scene, noise, picture } => {
                picture.check(scene.path())?;
                let mut scene = scene.load(common)?;
                noise.apply(&mut scene)?;
                let study = rate::measure(&scene, &progress)?;
                picture.write(|| picture::rate_svg(&study))?;
                show(common, &study, rate_page)
            }
            Self::Reconstruct(arguments) => reconstruct::answer(arguments, common),
        }
    }
}

/// Prints a result as JSON, or its page.
fn show<T: Serialize>(common: &Common, result: &T, page: fn(&T, &mut Page)) -> Result<()> {
    if common.json {
        return print::json(result);
    }
    let mut text = Page::default();
    page(result, &mut text);
    text.print()
}

/// Adds a table whose columns are as wide as they must be, the first one to the left and the others to the right. Its first
/// line is a head.
fn table(page: &mut Page, head: &[&str], lines: impl IntoIterator<Item = Vec<String>>) {
    let mut all = vec![head.iter().map(|&name| name.to_owned()).collect::<Vec<_>>()];
    all.extend(lines);
    let columns = all.iter().map(Vec::len).max().unwrap_or_default();
    let width = |column: usize| {
        let cells = all.iter().filter_map(|line| line.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or_default()
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    page.line("");
    for line in &all {
        let cells = line.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            if column == 0 { format!("{cell:<width$}") } else { format!("  {cell:>width$}") }
        });
        page.line(cells.collect::<String>().trim_end());
    }
}

/// A figure of a table.
fn figure(value: impl Into<Option<f64>>) -> String {
    match value.into() {
        None => "-".into(),
        Some(value) if value.fract() == 0.0 && value.abs() < 1e6 => format!("{value}"),
        Some(value) if (1e-3..1e5).contains(&value.abs()) => format!("{value:.4}"),
        Some(value) => format!("{value:.1e}"),
    }
}

/// A share in per cent.
fn percentage(value: impl Into<Option<f64>>) -> String {
    value.into().map_or("-".into(), |value| format!("{value:.1}"))
}

/// Value of a line at a noise level.
type Of<'l, L> = Box<dyn Fn(&L) -> Option<f64> + 'l>;

/// Line of a table by noise: its name, and its values.
type LineOf<'l, L> = (&'l str, Of<'l, L>);

/// Adds a table with a column for each noise level.
fn by_noise<L: AtNoise>(page: &mut Page, heading: &str, levels: &[L], lines: &[LineOf<'_, L>]) {
    let levels_text: Vec<_> = levels.iter().map(|it| print::percent(it.noise_level())).collect();
    let head: Vec<&str> =
        [heading].into_iter().chain(levels_text.iter().map(String::as_str)).collect();
    let cells = |(name, of): &LineOf<'_, L>| {
        let figures = levels.iter().map(|level| figure(of(level)));
        [(*name).to_owned()].into_iter().chain(figures).collect()
    };
    table(page, &head, lines.iter().map(cells));
}

/// Adds a table of each group's errors by noise: of `decoders`, and the limit; what the limit is of, and the reasons why
/// there is none.
fn errors_by_noise<L: AtNoise>(page: &mut Page, levels: &[L], decoders: &[&str]) {
    let groups = levels.first().map_or(&[][..], |level| &level.decoders()[0].errors);
    for (place, group) in groups.iter().enumerate() {
        let rmse = |level: &L, decoder: &str| {
            metrics::of_decoder(level.decoders(), decoder).get(place).map(|errors| errors.rmse)
        };
        let of = |&decoder| (decoder, Box::new(move |level: &L| rmse(level, decoder)) as Of<'_, L>);
        let mut lines: Vec<_> = decoders.iter().map(of).collect();
        let limit = |level: &L| level.limit().groups.get(place).map(|group| group.limit);
        lines.push(("limit", Box::new(limit)));
        by_noise(page, &format!("RMSE of {}, {}", group.group, group.unit), levels, &lines);
    }
    page.line("\nlimit: of a decoder that sees all readings of a frame, on the first test frames, at most 40.");
    for level in levels {
        if let Some(refused) = &level.limit().refused {
            let noise = print::percent(level.noise_level());
            print::wrapped(page, &format!("no limit at noise {noise}: {refused}"));
        }
    }
}

fn equations_page(result: &EquationsResult, page: &mut Page) {
    page.line(format_args!(
        "{}: {} rows of {} test frames, seed {}; networks by K-means on {} frames",
        result.subject, result.rows, result.frames, result.seed, result.training_frames
    ));
    let decoders = [EXACT, DAMPED, NETWORK, linear::NAME, mean::NAME];
    errors_by_noise(page, &result.levels, &decoders);
    let solved = |level: &equations::Level| Some(level.percent_solved);
    by_noise(page, "rows", &result.levels, &[("solved exactly, %", Box::new(solved))]);
    page.line(format_args!(
        "\nAll rows count: one without a solution has the last place of the search, in the box of 20 % of H.\n\n\
         Without noise, % of the rows, by row-wire ({} more searches a row for deformations that read alike):",
        result.searches
    ));
    let head = [
        "row",
        "truth",
        "another",
        "unsolved",
        "reached",
        "z < 1e-6",
        "ambiguous",
        "most",
        "any decoder",
        "turned",
    ];
    let all = result.all_rows();
    let line = |row: &RowWire| {
        let name = if row.row_wire == 0 { "all".into() } else { row.row_wire.to_string() };
        let shares = [
            row.percent_true,
            row.percent_other,
            row.percent_unsolved,
            row.percent_reached,
            row.percent_z_exact,
            row.percent_ambiguous,
        ];
        let mut cells = vec![name];
        cells.extend(shares.map(percentage));
        cells.push(row.most_alike.to_string());
        cells.extend([row.percent_any_decoder, row.percent_turned].map(percentage));
        cells
    };
    table(page, &head, result.without_noise.iter().chain(&all).map(line));
    page.line(
        "\ntruth: solved to the true deformation; another: to one that reads alike; reached: to the truth by any search;\n\
         z < 1e-6: off by less, in mm, at every electrode; ambiguous: several deformations within the scene's ranges\n\
         read alike, `most` of one row; any decoder: rows that the best choice among these gets right;\n\
         turned: the determinant of ∂ln R/∂Δ has not the sign that it has at rest.",
    );
}

fn directions_page(result: &DirectionsResult, page: &mut Page) {
    page.line(format_args!(
        "{}: {} rows of {} test frames, seed {}; K = {}, {} training frames",
        result.subject,
        result.rows,
        result.frames,
        result.seed,
        result.centres,
        result.training_frames
    ));
    let mut readings: Vec<LineOf<'_, directions::Level>> = vec![
        ("the noise itself", Box::new(|level| Some(level.noise_ohm))),
        ("network, to ideal", Box::new(|level| Some(level.ideal_rmse_ohm))),
    ];
    for decoder in [NETWORK, linear::NAME, mean::NAME] {
        let rmse = move |level: &directions::Level| {
            metrics::of_decoder(&level.readings, decoder).first().map(|errors| errors.rmse)
        };
        readings.push((decoder, Box::new(rmse)));
    }
    by_noise(page, "RMSE of reading, Ω", &result.levels, &readings);
    let decoders = [INVERTED, INVERTED_DAMPED, NETWORK, linear::NAME, mean::NAME];
    errors_by_noise(page, &result.levels, &decoders);
    for (place, name) in [INVERTED, INVERTED_DAMPED].into_iter().enumerate() {
        let lines: [LineOf<'_, directions::Level>; 2] = [
            ("rows converged, %", Box::new(move |it| Some(it.inversions[place].percent_converged))),
            ("µs a frame", Box::new(move |it| Some(it.inversions[place].frame_us))),
        ];
        by_noise(page, name, &result.levels, &lines);
    }
    page.line(
        "\nAll rows count: one that did not converge has the last place of the search, in the box of 20 % of H.\n\
         network, under readings: from deformations to readings; under deformations: decodes directly.\n\
         to ideal: against readings without noise. The time is that of all cores of this machine.\n\
         damped: within noise and the network's own error, which the training frames tell.",
    );
}

fn widths_page(study: &WidthsStudy, page: &mut Page) {
    page.line(format_args!(
        "{}: {} noise, row {:?}, seed {}, {} training and {} test frames; RMSE of {} in {}",
        study.subject,
        print::percent(study.noise_level),
        study.row_wires,
        study.seed,
        study.training_frames,
        study.test_frames,
        study.group,
        study.unit
    ));
    let training = |refined: bool| if refined { "refined" } else { "K-means" }.to_owned();
    let model = |model: &widths::Model| {
        vec![
            training(model.refined),
            model.centres.to_string(),
            model.widths.name().into(),
            model.format.into(),
            model.spread.to_string(),
            model.width_range.map(|width| format!("{width:.3}")).join(" … "),
            figure(model.rmse),
            figure(model.ratio_to_limit),
            model.blob_bytes.to_string(),
            model.cycles.to_string(),
        ]
    };
    let head = [
        "training",
        "K",
        "widths",
        "format",
        "spread",
        "from … to",
        "RMSE",
        "× limit",
        "bytes",
        "cycles",
    ];
    table(page, &head, study.models.iter().map(model));
    page.line(format_args!("\nalways predicting the mean: {}", figure(study.mean_rmse)));
    page.line("RMSE with a width for each centre, over that with one for all:");
    let gain = |gain: &widths::Gain| {
        let ratios = [Some(gain.at_equal_centres), gain.at_equal_cost].map(figure);
        [vec![training(gain.refined), gain.centres.to_string()], ratios.to_vec()].concat()
    };
    let head = ["training", "K", "with as many centres", "within the same bytes and cycles"];
    table(page, &head, study.gains.iter().map(gain));
    page.line("");
    print::wrapped(page, &study.limit.note());
    page.line(
        "spread: the best by other frames; refinement starts from it. from … to: widths in the model.\n\
         cycles: of a frame of this row on a Cortex-M4F, at zero wait.",
    );
}

fn map_page(study: &MapStudy, page: &mut Page) {
    page.line(format_args!(
        "{}: row {}, seed {}, {} test frames, δ = {:e}; RMSE of {} in {}, on the samples and on test frames",
        study.subject,
        study.row_wire,
        study.seed,
        study.test_frames,
        study.initial_covariance,
        study.group,
        study.unit
    ));
    let noise = |map: &map::Map| print::percent(map.noise_level);
    let cell = |cell: Option<&map::Cell>| match cell {
        Some(it) => [it.spread.to_string(), figure(it.training_rmse), figure(it.test_rmse)],
        None => ["-"; 3].map(str::to_owned),
    };
    let line = |map: &map::Map| {
        let best = map.best(|_| true);
        let whole = map.best(|cell| cell.centres == map.samples);
        let first = [noise(map), map.samples.to_string(), figure(map.mean_rmse)];
        let centres = [best.map_or("-".into(), |best| best.centres.to_string())];
        [&first[..], &centres, &cell(best), &cell(whole)].concat()
    };
    let head = [
        "noise",
        "N",
        "the mean",
        "best K",
        "spread",
        "samples",
        "test",
        "K = N: spread",
        "samples",
        "test",
    ];
    table(page, &head, study.maps.iter().map(line));
    let most = study.maps.iter().map(|map| map.samples).max().unwrap_or_default();
    page.line(format_args!("\nLeast test error at each spread, and its K, for N = {most}:"));
    let spreads: Vec<String> = study.spreads.iter().map(f64::to_string).collect();
    let head: Vec<&str> =
        ["spread"].into_iter().chain(spreads.iter().map(String::as_str)).collect();
    let lines = study.maps.iter().filter(|map| map.samples == most).flat_map(|map| {
        let best = study.spreads.iter().filter_map(|spread| map.best(|it| it.spread == *spread));
        let (errors, centres): (Vec<_>, Vec<_>) =
            best.map(|cell| (figure(cell.test_rmse), format!("K={}", cell.centres))).unzip();
        [[vec![noise(map)], errors].concat(), [vec![String::new()], centres].concat()]
    });
    table(page, &head, lines);
    for claim in &study.claims {
        let level = claim
            .noise_level
            .map_or(String::new(), |level| format!(", {} noise", print::percent(level)));
        let (verdict, says) = (claim.verdict.words(), claim.claim);
        page.line(format_args!("\n{verdict}: {says}{level}, N = {}", claim.samples));
        let figures: Vec<String> =
            claim.compared.iter().map(|it| format!("{} at {}", figure(it.value), it.at)).collect();
        page.line(format_args!("  {}:\n  {}", claim.quantity, figures.join(", ")));
    }
}

fn recursion_page(study: &recursion::Study, page: &mut Page) {
    let recursion::Plan { centres, updates } = study.plan;
    page.line(format_args!(
        "{}, row {}, K = {centres}, output {}, {updates} updates\n\n\
         difference from the batch solution in f64, in standard deviations of the output;\n\
         #N: diverged after N updates (a number not finite, or the next sample's prediction off by {DIVERGED} standard\n    \
         deviations, which is looked at after {} updates); ~N: so has the exact solution (covariance wind-up)",
        study.subject,
        study.row_wire,
        study.output,
        study.plan.settled_updates()
    ));
    let deltas = INITIAL_COVARIANCES.map(|delta| format!("δ={delta:e}"));
    for kind in KINDS {
        for &recursion::Width { width, condition } in &study.widths {
            let (form, precision) = (kind.0.name(), kind.1);
            page.line(format_args!(
                "\n{form} in {precision}, width {width}, condition {condition:.0e}"
            ));
            let line = |forgetting: &f64| {
                let cell = |delta| study.outcome(kind, width, *forgetting, delta);
                let cells = INITIAL_COVARIANCES.map(|it| cell(it).map_or(String::new(), outcome));
                [vec![format!("λ = {forgetting}")], cells.to_vec()].concat()
            };
            let head: Vec<&str> =
                [""].into_iter().chain(deltas.iter().map(String::as_str)).collect();
            table(page, &head, FORGETTING_FACTORS.iter().map(line));
        }
    }
}

fn outcome(outcome: &Outcome) -> String {
    match (outcome.diverged_after, outcome.difference) {
        (Some(updates), _) if outcome.wound_up => format!("~{updates}"),
        (Some(updates), _) => format!("#{updates}"),
        (None, Some(difference)) => format!("{difference:.0e}"),
        (None, None) => "-".into(),
    }
}

fn drift_page(result: &DriftResult, page: &mut Page) {
    page.line(format_args!(
        "{}: gain drift ±{}, seed {}, {} training and {} test frames",
        result.subject,
        print::percent(result.gain),
        result.seed,
        result.training_frames,
        result.test_frames
    ));
    let name = |line: &Line| match (line.relative_inputs, line.trained_with_drift) {
        _ if line.decoder == mean::NAME => line.decoder.clone(),
        (true, _) => format!("{}, relative inputs", line.decoder),
        (false, true) => format!("{}, readings, trained with drift", line.decoder),
        (false, false) => format!("{}, readings", line.decoder),
    };
    let groups = result.lines.first().map_or(&[][..], |line| &line.undrifted);
    for (place, Errors { group, unit, .. }) in groups.iter().enumerate() {
        let line = |line: &Line| {
            let [undrifted, drifted] = [&line.undrifted, &line.drifted].map(|it| it[place].rmse);
            let figures = [undrifted, drifted, drifted / undrifted].map(figure);
            [vec![name(line)], figures.to_vec()].concat()
        };
        let heading = format!("RMSE of {group}, {unit}");
        table(page, &[&heading, "no drift", "with drift", "ratio"], result.lines.iter().map(line));
    }
    page.line(
        "\nRMSE = √mean(e²). with drift: one factor multiplies all readings of a session, and its baseline.\n\
         relative inputs: R/R₀, where R₀ is the mean of 100 frames of the untouched sensor.\n\
         mean: always predicting the mean of the training outputs.",
    );
}

fn rubber_page(result: &RubberResult, page: &mut Page) {
    page.line(format_args!(
        "{}: {} % of a deformation at once, the rest with a time constant of {} ms; seed {}, {} training frames, {} moving \
         contacts, {:.2} ms a scan",
        result.subject,
        100.0 * result.instant_share,
        result.time_constant_ms,
        result.seed,
        result.training_frames,
        result.trajectories,
        result.scan_ms
    ));
    let name = |line: &rubber::Line| match (line.trained_on, line.creep_undone) {
        _ if line.decoder == mean::NAME => line.decoder.clone(),
        (TrainedOn::Still, false) => format!("{}, still contacts", line.decoder),
        (TrainedOn::Still, true) => format!("{}, still contacts, creep undone", line.decoder),
        (TrainedOn::Moving, false) => format!("{}, moving contacts", line.decoder),
        (TrainedOn::Moving, true) => format!("{}, moving contacts, creep undone", line.decoder),
        (TrainedOn::Creeping, _) => format!("{}, moving contacts, creeping rubber", line.decoder),
    };
    for lines in &result.outputs {
        let groups = lines.first().map_or(&[][..], |line| &line.at_once.when_read);
        for (place, Errors { group, unit, .. }) in groups.iter().enumerate() {
            let line = |line: &rubber::Line| {
                let [at_once, creeping] = [&line.at_once, &line.creeping]
                    .map(|of| [&of.when_read, &of.when_used].map(|it| figure(it[place].rmse)));
                [&[name(line)], &at_once[..], &creeping[..]].concat()
            };
            let heading = format!("RMSE of {group}, {unit}");
            let head = [&heading, "at once, read", "used", "creeping, read", "used"];
            table(page, &head, lines.iter().map(line));
        }
    }
    page.line(
        "\nat once, creeping: rubber under the moving contacts that decoders are judged on.\n\
         read: against the truth when each row was read. used: of the newest finished estimate, at every moment.\n\
         still contacts, moving contacts, creeping rubber: what the decoder was trained on.\n\
         creep undone: the load that would have crept to the estimates, found by the rubber's own equation.",
    );
}

fn readout_page(result: &ReadoutResult, page: &mut Page) {
    page.line(format_args!(
        "{}: {} frames without noise, seed {}, model {}\n\
         error of readings: scanned/ideal − 1; RMSE: decoded against true",
        result.subject, result.frames, result.seed, result.model_crc
    ));
    let headings: Vec<String> = result
        .ideal_errors()
        .iter()
        .map(|group| format!("{} RMSE, {}", group.group, group.unit))
        .collect();
    let mut head = vec!["circuit", "simulated", "RMS, %", "largest, %", "missing"];
    head.extend(headings.iter().map(String::as_str));
    let cells = |texts: [String; 5], errors: &[Errors]| {
        texts.into_iter().chain(errors.iter().map(|group| figure(group.rmse))).collect()
    };
    let without = |what: &str, errors: &[Errors]| {
        cells(["-", what, "-", "-", "-"].map(str::to_owned), errors)
    };
    let mut lines = vec![without("ideal readings", result.ideal_errors())];
    lines.extend(result.lines.iter().map(|line| {
        let readings = &line.readings;
        let texts = [
            line.circuit.name().into(),
            line.stage.name().into(),
            format!("{:.3}", readings.rms_percent),
            format!("{:.3}", readings.largest_percent),
            readings.missing.to_string(),
        ];
        cells(texts, &line.errors)
    }));
    lines.push(without("predicting the mean", result.mean_errors()));
    table(page, &head, lines);
}

fn confidence_page(found: &Confidence, page: &mut Page) {
    page.line(format_args!(
        "{} test frames of scene {}; intervals should cover 68.3 % and 95 % of the errors",
        found.frames, found.subject
    ));
    coverage_page::add(page, &found.coverage);
    let lines = found.detections.iter();
    let line = lines.map(|it| {
        vec![it.anomaly.clone(), it.frames.to_string(), format!("{:.2}", it.percent_novel)]
    });
    table(page, &["frames with", "frames", "novel, %"], line);
}

fn rate_page(study: &RateStudy, page: &mut Page) {
    page.line(format_args!(
        "{}, seed {}: RMSE of {} in {}; moving: of the newest finished estimate against the truth at that moment",
        study.subject, study.seed, study.group, study.unit
    ));
    let lines = study.lines.iter().map(|line| {
        let filter = line.filter.map_or("-".into(), |filter| {
            format!("{:.1} ms, {:.1} ahead", filter.time_constant_ms, filter.lead_ms)
        });
        let times = [format!("{:.1}", line.frames_per_s), format!("{:.2}", line.age_ms)];
        let errors = [line.still, line.moving, line.filtered].map(figure);
        let noise = match line.time_constant_ms {
            0.0 => "white".to_owned(),
            ms => format!("{ms} ms"),
        };
        let first = [noise, line.readout.image().to_owned(), line.samples_averaged.to_string()];
        [&first[..], &times, &errors, &[filter]].concat()
    });
    let head = ["image", "samples", "frames/s", "age, ms", "still", "moving", "filtered", "filter"];
    table(page, &head, lines);
}
