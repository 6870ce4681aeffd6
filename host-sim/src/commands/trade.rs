//! Command `trade`: speed against accuracy, every setting measured.

use std::cmp::Ordering;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::progress::Terminal;
use clap::Args;
use host_sim::error::Bounded;
use host_sim::evaluate::gate::{self, RECOMMENDED_K};
use host_sim::evaluate::trade::{self, Bounds, Plan, Point, Trade};
use host_sim::metrics::{DecoderErrors, Errors};
use host_sim::{Error, Result, report};
use taxel_data::{columns, output};
use taxel_simulate::World;

use super::arguments::of_option;
use super::scene_argument::{NoiseArgument, RefineArgument, RelativeInputsArgument, SceneArgument};
use super::{Common, print};

/// Names of all files that the command may write.
const FILES: [&str; 5] = ["trade.csv", "trade.json", "trade.svg", "trade.html", "chosen.bin"];

/// Trade speed for accuracy: measure every decoder, and choose the best.
///
/// Trains and judges every number format, exponential, K, affine tail, number of samples averaged and gate.
/// Marks the Pareto front, and chooses the best point within your bounds.
///
/// Writes trade.csv, trade.json, trade.svg and trade.html to out/<scene>/, and with a bound chosen.bin.
/// Instructions and cycles are predicted by the price list of the firmware's code (docs/cycles.md). Behind a gate they
/// are the mean over the test frames, by the share of untouched rows (docs/trade.md).
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim trade press
  host-sim trade press --max-error 0.05
  host-sim trade press --max-cycles 40000 --max-flash 40000 --average 1
  host-sim trade press --gate 3,3.5 --max-cycles 20000")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    #[command(flatten)]
    relative_inputs: RelativeInputsArgument,
    #[command(flatten)]
    refine: RefineArgument,
    /// Folder that receives a folder named after the scene.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    output: PathBuf,
    /// Centres K to try.
    #[arg(long, value_name = "K", value_delimiter = ',', default_value = "16,32,64,128,256")]
    centres: Vec<usize>,
    /// Components that the network for the whole array computes instead of all outputs, to try where they take fewer
    /// multiplications (docs/projection.md); `none` for networks that compute all outputs alone.
    #[arg(long, value_name = "R,…", value_delimiter = ',', default_value = "24")]
    output_rank: Vec<RankOption>,
    /// Numbers of samples averaged for each reading, to try.
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,4,16")]
    average: Vec<usize>,
    /// Gates to try besides none: tolerances in standard deviations of the averaged noise; `none` for no
    /// gate [default: 3.5 if the scene's noise is relative].
    #[arg(long, value_name = "K,…", value_delimiter = ',', allow_negative_numbers = true)]
    gate: Vec<GateOption>,
    /// Outputs that determine the front and the choice, such as dz_mm [default: the last].
    #[arg(long, value_name = "GROUP")]
    group: Option<String>,
    /// Choose the cheapest point with an RMSE of at most this, in the group's unit.
    #[arg(long, value_name = "RMSE", allow_negative_numbers = true)]
    max_error: Option<f64>,
    /// Choose within so many cycles a frame (behind a gate: on average). Unless --max-error is given, the
    /// most accurate such point is chosen.
    #[arg(long, value_name = "CYCLES")]
    max_cycles: Option<u64>,
    /// Choose within a blob of so many bytes [default, with another bound: a slot's 131056].
    #[arg(long, value_name = "BYTES")]
    max_flash: Option<usize>,
    /// Clock of the device, for times.
    #[arg(long, value_name = "MHZ", default_value_t = 168.0, allow_negative_numbers = true)]
    clock_mhz: f64,
    /// Print all points, not only the front and the chosen one (files have all of them).
    #[arg(long)]
    all: bool,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut scene = arguments.scene.load(common)?;
    arguments.noise.apply(&mut scene)?;
    arguments.relative_inputs.apply(&mut scene);
    scene.training.refine = arguments.refine.over(scene.training.refine);
    let names = scene.world.output_names();
    let groups: Vec<&str> = columns::groups(&names).into_iter().map(|(group, _)| group).collect();
    let group = match &arguments.group {
        Some(group) if groups.contains(&group.as_str()) => group.as_str(),
        Some(group) => {
            let message = format!("--group {group}: the scene has {}", groups.join(", "));
            return Err(Error::Usage(message));
        }
        None => groups.last().copied().unwrap_or_default(),
    };
    if !(arguments.clock_mhz.is_finite() && arguments.clock_mhz > 0.0) {
        let message = format!("--clock-mhz {}: give a positive number", arguments.clock_mhz);
        return Err(Error::Usage(message));
    }
    let plan = Plan {
        centres: distinct("--centres", &arguments.centres)?,
        output_ranks: output_ranks(&arguments.output_rank)?,
        samples_averaged: distinct("--average", &arguments.average)?,
        gate_k: gate_k(&arguments.gate, &scene.world)?,
        clock_mhz: arguments.clock_mhz,
    };
    let bounds = Bounds {
        error: arguments.max_error,
        cycles: arguments.max_cycles,
        flash_bytes: arguments.max_flash,
    };
    bounds.check().map_err(|bad| of_option(bad, &OPTIONS))?;
    let folder = arguments.output.join(&scene.name);
    let (trade, choice) = output::in_folder(&folder, || {
        for file in FILES {
            output::check_writable(&folder.join(file), &[arguments.scene.path()])?;
        }
        let computed = trade::compute(&scene, &plan, group, &Terminal::new());
        let mut trade = computed.map_err(|error| match error {
            Error::Setting(bad) => of_option(bad, &OPTIONS),
            other => other,
        })?;
        let choice = trade.choose(&bounds);
        write_files(&folder, &trade)?;
        Ok::<_, Error>((trade, choice))
    })?;
    if common.json {
        print::json(&trade)?;
    } else {
        page_of(&trade, arguments.all, &folder).print()?;
    }
    // Measurements are kept and shown even if no point is within the bounds.
    choice.map_err(|cause| Error::Usage(cause.text(option)))
}

/// Options by the settings that they set.
const OPTIONS: [(&str, &str); 7] = [
    ("output-rank", "--output-rank"),
    ("centres", "--centres"),
    ("average", "--average"),
    ("gate", "--gate"),
    ("max-error", option(Bounded::Error)),
    ("max-cycles", option(Bounded::Cycles)),
    ("max-flash", option(Bounded::Flash)),
];

/// Option that sets a bound.
const fn option(bounded: Bounded) -> &'static str {
    match bounded {
        Bounded::Error => "--max-error",
        Bounded::Cycles => "--max-cycles",
        Bounded::Flash => "--max-flash",
    }
}

/// Value of `--gate`.
#[derive(Clone, Copy, PartialEq)]
enum GateOption {
    None,
    K(f64),
}

impl FromStr for GateOption {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "none" => Ok(Self::None),
            k => k.parse().map(Self::K).map_err(|_| "give numbers, such as 3.5, or none".into()),
        }
    }
}

/// Value of `--output-rank`.
#[derive(Clone, Copy)]
struct RankOption(Option<usize>);

impl FromStr for RankOption {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "none" => Ok(Self(None)),
            rank => match rank.parse() {
                Ok(rank) => Ok(Self(Some(rank))),
                Err(_) => Err("give whole numbers, such as 24, or none".into()),
            },
        }
    }
}

/// Ranks that are asked for, in order; networks that compute all outputs there are always.
fn output_ranks(given: &[RankOption]) -> Result<Vec<usize>> {
    let ranks: Vec<usize> = given.iter().filter_map(|rank| rank.0).collect();
    distinct("--output-rank", &ranks)
}

/// Gates that are asked for, or the one that docs/gating.md recommends where the noise allows one.
fn gate_k(given: &[GateOption], world: &World) -> Result<Vec<f64>> {
    if given.is_empty() {
        return Ok(match gate::check_noise(world) {
            Ok(()) => vec![RECOMMENDED_K],
            Err(cause) => {
                eprintln!("note: no points behind a gate: {cause}");
                vec![]
            }
        });
    }
    let k: Vec<f64> = given
        .iter()
        .filter_map(|gate| if let GateOption::K(k) = gate { Some(*k) } else { None })
        .collect();
    if k.len() == given.len() {
        return distinct("--gate", &k);
    }
    if given.len() > 1 {
        let message =
            "--gate none: there are always points without a gate; give none alone, or numbers";
        return Err(Error::Usage(message.into()));
    }
    Ok(vec![])
}

fn distinct<T: Copy + PartialOrd + std::fmt::Display>(
    option: &str,
    values: &[T],
) -> Result<Vec<T>> {
    let mut sorted = values.to_vec();
    // Values without an order are refused later, by whatever uses them.
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::Usage(format!("{option} gives {} twice; give it once", pair[0]))),
        None => Ok(sorted),
    }
}

fn write_files(folder: &Path, trade: &Trade) -> Result<()> {
    let json = print::json_text(trade)?;
    let csv = csv_of(trade);
    let texts = [
        ("trade.csv", csv),
        ("trade.json", json),
        ("trade.svg", report::trade_svg(trade)),
        ("trade.html", report::trade_html(trade)),
    ];
    for (name, text) in texts {
        output::write_bytes(&folder.join(name), text.as_bytes())?;
    }
    let chosen = folder.join("chosen.bin");
    match trade.chosen {
        Some(point) => output::write_bytes(&chosen, trade.blob(point))?,
        // A blob from an earlier run would lie beside figures that are not its own.
        None => output::remove(&chosen)?,
    }
    Ok(())
}

fn csv_of(trade: &Trade) -> String {
    let rmse = trade
        .groups()
        .map(|(group, _)| format!("{group}_rmse,{group}_ratio_to_best,{group}_ratio_to_limit"));
    let mut csv = format!(
        "kernel,whole_array,centres,spread,affine_tail,samples_averaged,gate_k,output_rank,{},instructions,cycles,flash_cycles,frame_us,flash_bytes,ram_bytes,\
         on_front,chosen\n",
        rmse.collect::<Vec<_>>().join(",")
    );
    for (i, p) in trade.points.iter().enumerate() {
        let errors = p.errors.iter().zip(&p.ratio_to_best);
        let to_limit = |e: &Errors| e.ratio_to_limit.map_or(String::new(), |r| r.to_string());
        let errors = errors.map(|(e, ratio)| format!("{},{ratio},{}", e.rmse, to_limit(e)));
        let errors = errors.collect::<Vec<_>>();
        let _ = writeln!(
            csv,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            p.arithmetic.name(),
            p.whole_array,
            p.centres,
            p.spread,
            p.affine_tail,
            p.samples_averaged,
            p.gate_k.map_or(String::new(), |k| k.to_string()),
            p.output_rank.map_or(String::new(), |rank| rank.to_string()),
            errors.join(","),
            p.frame.instructions,
            p.frame.cycles,
            p.frame.flash_cycles,
            p.frame_us,
            p.flash_bytes,
            p.ram_bytes,
            p.on_front,
            trade.chosen == Some(i)
        );
    }
    csv
}

fn page_of(trade: &Trade, all: bool, folder: &Path) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} points, noise {} % a sample, {} test frames; cycles of a frame on a Cortex-M4F by the\n\
         model of docs/cycles.md, zero wait states and from flash, code of {}",
        trade.scene,
        trade.points.len(),
        (trade.noise_level * 1e6).round() / 1e4,
        trade.test_frames,
        trade.compiler
    ));
    let groups: Vec<String> = trade.groups().map(|(group, _)| format!("{group:>16}")).collect();
    page.line(format_args!(
        "\n{:<28} {:>4} {:>4} {:>5} {:>4} {:>4}{groups} {:>7} {:>12} {:>9} {:>10} {:>8} {:>8} {:>6}",
        "format",
        "K",
        "rank",
        "tail",
        "avg",
        "gate",
        "× limit",
        "instructions",
        "cycles",
        "from flash",
        "µs",
        "flash",
        "RAM",
        groups = groups.concat()
    ));
    let shown = shown(trade, all);
    for i in &shown {
        page.line(line_of(&trade.points[*i], &trade.group, trade.chosen == Some(*i)));
    }
    for DecoderErrors { decoder, errors } in &trade.baselines {
        let errors: Vec<String> =
            errors.iter().map(|e| format!("{:>9.4}       ", e.rmse)).collect();
        page.line(format_args!("  {decoder:<53}{}", errors.concat()));
    }
    page.line(format_args!(
        "\nRMSE in {}; in brackets: relative to the smallest of all points\n\
         × limit: RMSE of {} relative to the least possible one with as many samples a reading\n\
         *: on the Pareto front (RMSE of {}, cycles, samples)\n\
         array: one network for all rows, behind a projection; not listed if larger than a slot (128 KiB)\n\
         rank: components that the array's network computes, which are expanded to all outputs (docs/projection.md)\n\
         flash: no point larger than a slot is chosen unless --max-flash allows it\n\
         gate: k of a gate that skips untouched rows; its cycles are the mean over the test frames",
        trade.unit,
        trade.group,
        trade.group
    ));
    if let Some(limit) = &trade.limit {
        page.line(limit.note());
    }
    page.line(if all {
        "f32 is not listed where its distances may not be expanded (docs/formats.md): see f32-direct there".into()
    } else {
        format!("{} more points with --all", trade.points.len() - shown.len())
    });
    for note in &trade.left_out {
        page.line(format_args!("left out: {note}"));
    }
    if let Some(chosen) = trade.chosen {
        let point = &trade.points[chosen];
        page.line(format_args!(
            "chosen: {}: {:.4} {} at {} cycles -> {}",
            point.name(),
            point.rmse(&trade.group),
            trade.unit,
            point.frame.cycles,
            folder.join("chosen.bin").display()
        ));
        let oversampling = (point.samples_averaged > 1).then(|| {
            format!(" --oversampling {}, which makes a scan longer", point.samples_averaged)
        });
        let tolerance = trade
            .rest_tolerance(chosen)
            .map(|tolerance| format!(" --rest-tolerance {tolerance}, once it has a baseline"));
        let options: Vec<String> = oversampling.into_iter().chain(tolerance).collect();
        if !options.is_empty() {
            page.line(format_args!("on a device, `host-sim link`:{}", options.join(";")));
        }
    }
    page.line(format_args!("all points, and the curve: {}", folder.join("trade.html").display()));
    page
}

/// Indices of the points to print: all as they were measured, or the front from cheap to dear for each
/// number of samples.
fn shown(trade: &Trade, all: bool) -> Vec<usize> {
    let numbers = 0..trade.points.len();
    if all {
        return numbers.collect();
    }
    let mut shown: Vec<usize> =
        numbers.filter(|i| trade.points[*i].on_front || trade.chosen == Some(*i)).collect();
    shown.sort_by_key(|i| (trade.points[*i].samples_averaged, trade.points[*i].frame.cycles));
    shown
}

fn line_of(point: &Point, group: &str, chosen: bool) -> String {
    let errors = point.errors.iter().zip(&point.ratio_to_best);
    let errors: Vec<String> = errors
        .map(|(e, ratio)| format!("{:>9.4} {:<6}", e.rmse, format!("({ratio:.2})")))
        .collect();
    let errors = errors.concat();
    let ratio = point.ratio_to_limit(group).map_or("-".into(), |ratio| format!("{ratio:.2}"));
    format!(
        "{} {:<26} {:>4} {:>4} {:>5} {:>4} {:>4}{errors} {ratio:>7} {:>12} {:>9} {:>10} {:>8.1} {:>8} {:>6}{}",
        if point.on_front { "*" } else { " " },
        point.way(),
        point.centres,
        point.output_rank.map_or("-".into(), |rank| rank.to_string()),
        if point.affine_tail { "yes" } else { "no" },
        point.samples_averaged,
        point.gate_k.map_or("-".into(), |k| k.to_string()),
        point.frame.instructions,
        point.frame.cycles,
        point.frame.flash_cycles,
        point.frame_us,
        point.flash_bytes,
        point.ram_bytes,
        if chosen { "  <- chosen" } else { "" }
    )
}
