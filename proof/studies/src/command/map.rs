//! Study `map`: error by centres, spread and number of samples, and the paper's claims on them.

use crate::picture;
use crate::question::map::{self, Claim, Map, MapStudy, Plan};
use clap::Args;
use host_sim::Result;
use taxel_simulate::sensor::Precision;

use host_sim::commands::arguments::{of_option, precision};
use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::{SceneArgument, group_of_scene, read_one_row};
use host_sim::commands::{Common, print};

use super::Picture;

/// Options that set the fields of a plan.
const OPTIONS: [(&str, &str); 6] = [
    ("samples", "--samples"),
    ("centres", "--centres"),
    ("spreads", "--spread"),
    ("noise_levels", "--noise"),
    ("test_frames", "--test-frames"),
    ("initial_covariance", "--initial-covariance"),
];

/// Map training and test error over centres K, spread and number of samples N.
///
/// Networks are the paper's: one width, no affine tail, for one row-wire. With K = N every sample is a centre. The page
/// judges what the paper says of wide and narrow Gaussians, of noise, and of equations and unknowns.
#[derive(Args)]
#[command(after_help = "Example: cargo xtask study map paper -o map.svg")]
pub struct Arguments {
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
    plan: Plan,
    /// Outputs whose error is mapped, such as dz_mm or dx_mm.
    #[arg(long, value_name = "GROUP", default_value = "dz_mm")]
    group: String,
    /// Print every cell, not only the best ones (JSON has all of them).
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    picture: Picture,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        let scene = SceneArgument::new(&self.scene, self.precision);
        self.picture.check(scene.path())?;
        let mut scene = scene.load_world(common)?;
        read_one_row(&mut scene, self.row)?;
        group_of_scene(&scene, &self.group)?;
        self.plan.check().map_err(|bad| of_option(bad, &OPTIONS))?;
        let study = map::compute(&scene, &self.group, &self.plan, &Terminal::new())?;
        self.picture.write(|| picture::study_map_svg(&study))?;
        super::show(common, &study, |study| page_of(study, self))
    }
}

fn page_of(study: &MapStudy, options: &Arguments) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: row {}, seed {}, {} test frames, δ = {:e}; RMSE of {} in {}\n",
        study.subject,
        study.row_wire,
        study.seed,
        study.test_frames,
        study.initial_covariance,
        study.group,
        study.unit
    ));
    if options.all {
        study.maps.iter().for_each(|map| cells(&mut page, map, study));
    }
    page.line(format_args!(
        "{:>7} {:>6} {:>8}   {:<35} {:<35}",
        "noise", "N", "mean", "least test error: K, spread, errors", "K = N: spread, errors"
    ));
    study.maps.iter().for_each(|map| page.line(map_line(map)));
    page.line(
        "errors: on the samples / on test frames. mean: always predicting the mean of the samples.\n",
    );
    by_spread(&mut page, study);
    for claim in &study.claims {
        claim_lines(&mut page, claim);
    }
    if let Some(path) = &options.picture.output {
        page.line(format_args!("\nwritten to {}", path.display()));
    }
    page
}

fn map_line(map: &Map) -> String {
    let errors = |training: f64, test: f64| format!("{training:.4} / {test:.4}");
    let best = map.best(|_| true).map_or(String::new(), |cell| {
        let errors = errors(cell.training_rmse, cell.test_rmse);
        format!("{:>4}, {:<4} {errors}", cell.centres, cell.spread)
    });
    let whole = map.best(|cell| cell.centres == map.samples).map_or("–".into(), |cell| {
        format!("{:<4} {}", cell.spread, errors(cell.training_rmse, cell.test_rmse))
    });
    let noise = print::percent(map.noise_level);
    format!("{noise:>7} {:>6} {:>8.4}   {best:<35} {whole}", map.samples, map.mean_rmse)
}

/// Least test error of any K by spread, with the most samples.
fn by_spread(page: &mut print::Page, study: &MapStudy) {
    let Some(most) = study.maps.iter().map(|map| map.samples).max() else { return };
    let mut line = |label: &str, values: Vec<String>| {
        let cells: Vec<String> = values.iter().map(|value| format!("{value:>7}")).collect();
        page.line(format_args!("{label:>7} {}", cells.join(" ")));
    };
    line("spread", study.spreads.iter().map(f64::to_string).collect());
    for map in study.maps.iter().filter(|map| map.samples == most) {
        let best = study.spreads.iter().filter_map(|spread| map.best(|it| it.spread == *spread));
        let (errors, centres) = best
            .map(|cell| (format!("{:.4}", cell.test_rmse), format!("K={}", cell.centres)))
            .unzip();
        line(&print::percent(map.noise_level), errors);
        line("", centres);
    }
    page.line(format_args!("least test error at each spread, and its K, for N = {most}.\n"));
}

/// Table of a map, one line a spread.
fn cells(page: &mut print::Page, map: &Map, study: &MapStudy) {
    page.line(format_args!(
        "{} noise, N = {}: errors on the samples / on test frames; always predicting the mean: {:.3}",
        print::percent(map.noise_level),
        map.samples,
        map.mean_rmse
    ));
    let of_spread = |spread: f64| map.cells.iter().filter(move |cell| cell.spread == spread);
    let first = study.spreads.first().copied().unwrap_or_default();
    let head = of_spread(first).map(|cell| format!(" {:>12}", format!("K = {}", cell.centres)));
    page.line(format_args!("{:<7}{}", "spread", head.collect::<String>()));
    for spread in &study.spreads {
        let cells = of_spread(*spread).map(|cell| {
            format!(" {:>12}", format!("{:.3}/{:.3}", cell.training_rmse, cell.test_rmse))
        });
        page.line(format_args!("{spread:<7}{}", cells.collect::<String>()));
    }
    page.line("");
}

fn claim_lines(page: &mut print::Page, claim: &Claim) {
    let level = claim
        .noise_level
        .map_or(String::new(), |level| format!(", {} noise", print::percent(level)));
    page.line(format_args!(
        "{:<7} {}{level}, N = {}",
        claim.verdict.words(),
        claim.claim,
        claim.samples
    ));
    let figures: Vec<String> =
        claim.compared.iter().map(|it| format!("{} at {}", short(it.value), it.at)).collect();
    page.line(format_args!("        {}:\n        {}", claim.quantity, figures.join(", ")));
}

/// A figure with the digits that matter.
fn short(value: f64) -> String {
    if value.fract() == 0.0 { format!("{value}") } else { format!("{value:.4}") }
}
