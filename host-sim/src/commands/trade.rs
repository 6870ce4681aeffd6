//! `trade`: speed against accuracy, every knob measured.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::evaluate::trade::{self, Limits, Plan, Point, Trade};
use host_sim::progress::Progress;
use host_sim::{Error, Result, columns, output, report};

use super::scene_argument::{NoiseArgument, SceneArgument};
use super::{Common, print};

/// All files that the command may write.
const FILES: [&str; 5] = ["trade.csv", "trade.json", "trade.svg", "trade.html", "chosen.bin"];

/// Trade speed for accuracy: train and judge every number format, exponential, K, affine tail and number of
/// samples averaged; mark the front of what nothing beats; pick a point within limits.
///
/// Writes trade.csv, trade.json, trade.svg and trade.html to out/<scene>/, and with a limit chosen.bin.
/// Instructions and cycles are those that `cargo xtask cycles` measured of the firmware's code.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim trade press
  host-sim trade press --max-error 0.05
  host-sim trade press --max-cycles 40000 --max-flash 40000 --average 1")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Folder that receives a folder named after the scene.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    output: PathBuf,
    /// Centres K to try.
    #[arg(long, value_name = "K", value_delimiter = ',', default_value = "16,32,64,128,256")]
    centres: Vec<usize>,
    /// Samples averaged for each reading, to try.
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,4,16")]
    average: Vec<usize>,
    /// Outputs that the front and the choice go by, such as dz_mm [default: the last].
    #[arg(long, value_name = "GROUP")]
    group: Option<String>,
    /// Pick the cheapest point with an RMSE of at most this, in the group's unit.
    #[arg(long, value_name = "RMSE", allow_negative_numbers = true)]
    max_error: Option<f64>,
    /// Pick within so many cycles a frame: the most accurate point, unless --max-error asks for the cheapest.
    #[arg(long, value_name = "CYCLES")]
    max_cycles: Option<u64>,
    /// Pick within a blob of so many bytes.
    #[arg(long, value_name = "BYTES")]
    max_flash: Option<usize>,
    /// Clock of the device, for times.
    #[arg(long, value_name = "MHZ", default_value_t = 168.0, allow_negative_numbers = true)]
    clock_mhz: f64,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut scene = arguments.scene.load(common)?;
    arguments.noise.apply(&mut scene)?;
    let names = scene.output_names();
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
        samples_averaged: distinct("--average", &arguments.average)?,
        clock_mhz: arguments.clock_mhz,
    };
    let limits = Limits {
        error: arguments.max_error,
        cycles: arguments.max_cycles,
        flash_bytes: arguments.max_flash,
    };
    let folder = arguments.output.join(&scene.name);
    let trade = output::in_folder(&folder, || {
        for file in FILES {
            output::check_writable(&folder.join(file), &[arguments.scene.path()])?;
        }
        let trade = trade::compute(&scene, &plan, group, &limits, &Progress::on_terminal())?;
        write_files(&folder, &trade)?;
        Ok(trade)
    })?;
    if common.json {
        return print::json(&trade);
    }
    page_of(&trade, &folder).print()
}

fn distinct(option: &str, values: &[usize]) -> Result<Vec<usize>> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::Usage(format!("{option} gives {} twice; give it once", pair[0]))),
        None => Ok(sorted),
    }
}

fn write_files(folder: &Path, trade: &Trade) -> Result<()> {
    let json = serde_json::to_string_pretty(trade)
        .map_err(|cause| Error::Failed(format!("cannot write JSON: {cause}")))?;
    let csv = csv_of(trade);
    let texts = [
        ("trade.csv", csv),
        ("trade.json", json + "\n"),
        ("trade.svg", report::trade_svg(trade)),
        ("trade.html", report::trade_html(trade)),
    ];
    for (name, text) in texts {
        output::write_bytes(&folder.join(name), text.as_bytes())?;
    }
    match trade.chosen {
        Some(point) => output::write_bytes(&folder.join("chosen.bin"), trade.blob(point)),
        None => Ok(()),
    }
}

fn csv_of(trade: &Trade) -> String {
    let groups: Vec<&str> = trade.mean.iter().map(|e| e.group.as_str()).collect();
    let rmse = groups.iter().map(|group| format!("{group}_rmse,{group}_ratio_to_best"));
    let mut csv = format!(
        "kernel,centres,affine_tail,samples_averaged,{},instructions,cycles,frame_us,flash_bytes,ram_bytes,\
         on_front,chosen\n",
        rmse.collect::<Vec<_>>().join(",")
    );
    for (i, p) in trade.points.iter().enumerate() {
        let errors = p.errors.iter().zip(&p.ratio_to_best);
        let errors = errors.map(|(e, ratio)| format!("{},{ratio}", e.rmse)).collect::<Vec<_>>();
        let _ = writeln!(
            csv,
            "{},{},{},{},{},{},{},{},{},{},{},{}",
            p.kernel,
            p.centres,
            p.affine_tail,
            p.samples_averaged,
            errors.join(","),
            p.frame.instructions,
            p.frame.cycles,
            p.frame_us,
            p.flash_bytes,
            p.ram_bytes,
            p.on_front,
            trade.chosen == Some(i)
        );
    }
    csv
}

fn page_of(trade: &Trade, folder: &Path) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} points, noise {} % a sample, {} test frames; cycles of a frame on a Cortex-M4F by the\n\
         model of docs/cycles.md, zero wait states, code of {}",
        trade.scene,
        trade.points.len(),
        (trade.noise_level * 1e6).round() / 1e4,
        trade.test_frames,
        trade.compiler
    ));
    let groups: Vec<String> = trade.mean.iter().map(|e| format!("{:>16}", e.group)).collect();
    page.line(format_args!(
        "\n{:<22} {:>4} {:>5} {:>4}{groups}{:>13} {:>9} {:>8} {:>8} {:>6}",
        "RMSE (× best)",
        "K",
        "tail",
        "avg",
        "instructions",
        "cycles",
        "µs",
        "flash",
        "RAM",
        groups = groups.concat()
    ));
    for (i, point) in trade.points.iter().enumerate() {
        page.line(line_of(point, trade.chosen == Some(i)));
    }
    let mean: Vec<String> = trade.mean.iter().map(|e| format!("{:>9.4}       ", e.rmse)).collect();
    page.line(format_args!("{:<39}{}", "the mean", mean.concat()));
    page.line(format_args!(
        "\n*: nothing is better than this in RMSE of {}, cycles and samples, and worse in none",
        trade.group
    ));
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
    }
    page.line(format_args!("all of it, and the curve: {}", folder.join("trade.html").display()));
    page
}

fn line_of(point: &Point, chosen: bool) -> String {
    let errors = point.errors.iter().zip(&point.ratio_to_best);
    let errors: Vec<String> = errors
        .map(|(e, ratio)| format!("{:>9.4} {:<6}", e.rmse, format!("({ratio:.2})")))
        .collect();
    let errors = errors.concat();
    format!(
        "{} {:<20} {:>4} {:>5} {:>4}{errors}{:>13} {:>9} {:>8.1} {:>8} {:>6}{}",
        if point.on_front { "*" } else { " " },
        point.kernel,
        point.centres,
        if point.affine_tail { "yes" } else { "no" },
        point.samples_averaged,
        point.frame.instructions,
        point.frame.cycles,
        point.frame_us,
        point.flash_bytes,
        point.ram_bytes,
        if chosen { "  <- chosen" } else { "" }
    )
}
