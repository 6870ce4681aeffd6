//! Command `trade`: speed against accuracy, every setting measured.

use std::cmp::Ordering;

use crate::device::{BOARD_CLOCK_MHZ, Device, Wires};
use crate::measurements::Measurements;
use crate::metrics;
use crate::report::{self, TradeWith};
use crate::subject::Subject;
use crate::sweep::Plan;
use crate::sweep::bounds::{Bound, Bounds};
use crate::sweep::plan::Base;
use crate::trade::{self, Asked, Trade};
use crate::verdict::{SLOT_BYTES, Warning};
use crate::{Error, Result};
use clap::Args;
use taxel_data::{BadValue, Stream, columns};
use taxel_learn::Options;
use taxel_learn::train::projection;
use taxel_simulate::Synthesis;

use super::arguments::{self, blamed, of_option};
use super::decoder_arguments::{DecoderArguments, ScanTimeArgument, of_field};
use super::subject_argument::SubjectArgument;
use super::{Common, command_line, print, sweep};

mod files;

/// Trade speed for accuracy: measure every decoder, and choose the best.
///
/// Trains and evaluates every number format, K, number of columns read and number of samples averaged and, for
/// contacts that move, filters. Marks the Pareto front of error against the time from the start of
/// a scan to its estimate, and chooses the best point within your bounds.
///
/// Writes trade.csv, trade.json, trade.html and its figures/ to `out/<scene>/` (-o: `DIR/<scene>/`), and with a bound
/// chosen.bin, all together at the end, and removes those of an earlier trade. Each point is saved in points/ as soon as
/// it is done: a trade that was stopped continues where it was, and another choice among the same points takes seconds.
///
/// The time of a point is that of its scan, by the plan of the board's firmware for either readout (docs/board.md), and
/// that of decoding, as predicted (docs/cycles.md). Bounds that no point can meet are refused before
/// training.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel trade press
  taxel trade press --frame-rate 100
  taxel trade press --max-error 0.045
  taxel trade press --max-cycles 40000 --max-flash 40000
  taxel trade press --average 1,4,16 --max-latency-ms 25
  taxel trade moving --average 1,4,12 --max-latency-ms 2
  taxel trade press --plan > plan.toml
  taxel trade measured.csv --inputs 'ch*' --outputs 'f?_n' --fold-column place --scan-ms 2")]
pub struct Arguments {
    #[command(flatten)]
    to: arguments::OutputFolder,
    #[command(flatten)]
    tried: DecoderArguments,
    /// Column steps to try: 1 reads every column of the scene, 2 every second one, and so on. Fewer columns make the scan
    /// shorter [default: 1,2,3,6 with --frame-rate or --max-latency-ms, else 1].
    #[arg(long, value_name = "STEP", value_delimiter = ',')]
    column_step: Vec<usize>,
    /// Choose the cheapest point with an RMSE of at most this, in the group's unit.
    #[arg(long, value_name = "RMSE")]
    max_error: Option<f64>,
    /// Choose among points that take at most so many cycles a frame, at zero wait. Unless --max-error is given, the most
    /// accurate point within all bounds is chosen (the cheapest of those whose errors do not differ significantly).
    #[arg(long, value_name = "CYCLES")]
    max_cycles: Option<u64>,
    /// Choose among points whose blob has at most so many bytes; the front has no others [default: 131072, the size of a slot].
    #[arg(long, value_name = "BYTES")]
    max_flash: Option<usize>,
    /// Choose among points that scan and decode at least so many frames a second.
    #[arg(long, value_name = "HZ")]
    frame_rate: Option<f64>,
    /// Clock of the device.
    #[arg(long, value_name = "MHZ", default_value_t = BOARD_CLOCK_MHZ)]
    clock_mhz: f64,
    #[command(flatten)]
    scan: ScanTimeArgument,
    /// Determine front and choice by the largest error on the scene's own contacts and on those that the model was not
    /// trained on.
    #[arg(long)]
    worst_case: bool,
    /// Print this trade's plan for `sweep`, which computes it in parts on many machines, and compute nothing.
    #[arg(long, conflicts_with = "output")]
    plan: bool,
    /// Print all points, not only the front and the chosen one (files have all of them).
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    subject: SubjectArgument,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let subject = arguments.subject.load_to_trade(common)?;
    let asked = asked(arguments, &subject, common)?;
    let bounds = bounds(arguments, &asked)?;
    let is_timed = arguments.frame_rate.is_some() || arguments.tried.max_latency_ms.is_some();
    if is_timed && asked.device.scan_ms(wires(&subject, 1), 1).is_none() {
        let message = "--frame-rate and --max-latency-ms count the scan, whose time is not known: the readings name no \
                       wires; give --scan-ms MS, or --grid ROWSxCOLUMNS for the board's own scan";
        return Err(Error::Usage(message.into()));
    }
    let mut wanted = asked.wanted(&subject);
    wanted.limit_frames = arguments.tried.limit.frames();
    for (field, value) in arguments.subject.set(&subject, common)? {
        // A spread that is set would follow the kind of networks, which is an axis.
        if field == "training.spread" || wanted.axes.contains_key(&field) {
            wanted.axes.insert(field, vec![value].into());
        } else {
            wanted.set.insert(field, value);
        }
    }
    let base = match &subject {
        Subject::Scene(_) => Base::of_scene(subject.name(), arguments.subject.source())?,
        Subject::Measured(_) => Base::measured(subject.name()),
    };
    let data = subject.measurements().map(Measurements::unnamed);
    let build = sweep::build()?;
    let plan = Plan::new(subject.name(), (vec![base], data), wanted.clone(), &build);
    let plan = plan.map_err(of_field)?;
    let points = plan.points().map_err(of_field)?;
    if let Some(scene) = subject.scene() {
        let left = |n| asked.device.averaged(scene.world.noise, wires(&subject, 1), n);
        let idle = |n: &usize| Warning::idle_averaging(*n, left);
        asked.samples_averaged.iter().filter_map(idle).for_each(|it| common.remark(it));
    }
    if arguments.plan {
        wanted.bounds.extend(bounds);
        return Ok(print::Outcome::of(arguments.subject.plan_text(subject.name(), &wanted)?));
    }
    let folder = arguments.to.in_out().join(subject.name());
    files::FILES.check(&folder, &arguments.subject.paths())?;
    let refused = |cause: &str| {
        let way =
            in_the_way(arguments, &subject, &asked).map_or(String::new(), |way| format!("; {way}"));
        let given = given_bounds(arguments).into_iter();
        let given = given.filter_map(|(option, ..)| option).collect::<Vec<_>>().join(", ");
        Error::Usage(format!("{given}: {cause}{way}"))
    };
    if let Some(cause) = trade::impossible(&plan, &points, &bounds, &asked)? {
        return Err(refused(&cause));
    }
    let merged = sweep::all(&plan, &points, &folder, common)?;
    let mut trade = Trade::new(&subject, &asked, merged)?;
    let choice = trade.choose(&bounds);
    let shown = trade.shown(&subject, &plan, &points)?;
    let command = command_line::of_this_process("trade", &["-o", "--output"], None);
    let without_bounds = without_bounds(arguments, &asked);
    let with = |all| {
        let with = TradeWith { shown: shown.as_ref(), all, command: &without_bounds };
        report::of_trade(&trade, with)
    };
    let chosen = folder.join("chosen.bin");
    let is_of_earlier = trade.chosen.is_none() && chosen.exists();
    files::write(&folder, (&trade, shown.as_ref()), (&with(false), &command), common)?;
    let (mut written, chosen) = (vec![], chosen.display());
    if trade.chosen.is_some() {
        written.push(format!("the blob: {chosen}"));
    } else if is_of_earlier {
        common.remark(format_args!(
            "note: {chosen} of an earlier trade is removed, since this one chose none; the earlier command writes it again"
        ));
    }
    written.push(format!("open {}", folder.join("trade.html").display()));
    // Measurements are kept and shown even if no point is within the bounds.
    let choice = choice.map_err(|cause| refused(&cause));
    Ok(print::sections_above(common, &with(arguments.all), &written).and(choice))
}

/// Command line that tries the same points, without a bound but that of a blob's size, which the front keeps to.
fn without_bounds(arguments: &Arguments, asked: &Asked) -> String {
    let bounds = ["--max-error", "--max-cycles", "--max-latency-ms", "--frame-rate"];
    let command = command_line::of_this_process("trade", &bounds, None);
    // Bounds on time try more steps.
    if arguments.column_step.is_empty() && asked.column_steps.len() > 1 {
        let steps: Vec<String> = asked.column_steps.iter().map(usize::to_string).collect();
        return format!("{command} --column-step {}", steps.join(","));
    }
    command
}

/// Bounds as they can be given: the option where one is, its result, and the bound.
fn given_bounds(arguments: &Arguments) -> Vec<(Option<String>, &'static str, Option<Bound>)> {
    let most = |option: &str, result, most: Option<f64>| {
        (most.map(|most| format!("{option} {most}")), result, most.map(Bound::Most))
    };
    let least = arguments.frame_rate;
    vec![
        most("--max-error", "error", arguments.max_error),
        most("--max-cycles", "cycles", arguments.max_cycles.map(|it| it as f64)),
        most("--max-flash", "blob_bytes", arguments.max_flash.map(|it| it as f64)),
        most("--max-latency-ms", "frame_ms", arguments.tried.max_latency_ms),
        (
            least.map(|least| format!("--frame-rate {least}")),
            "frames_per_s",
            least.map(|least| Bound::Least { least }),
        ),
    ]
}

/// Bounds on results that options give.
fn bounds(arguments: &Arguments, asked: &Asked) -> Result<Bounds> {
    let mut bounds = Bounds::new();
    for (option, result, bound) in given_bounds(arguments) {
        let (Some(option), Some(bound)) = (option, bound) else { continue };
        let (Bound::Most(value) | Bound::Least { least: value }) = bound;
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::Usage(format!("{option}: give a positive number")));
        }
        let result = if result == "error" { asked.error() } else { result.into() };
        bounds.insert(result, bound);
    }
    Ok(bounds)
}

/// What is varied, and what decides.
fn asked(arguments: &Arguments, subject: &Subject, common: &Common) -> Result<Asked> {
    let names = subject.output_names();
    let groups: Vec<&str> = columns::groups(&names).into_iter().map(|(group, _)| group).collect();
    let all_of_one = (groups.len() == 1).then(|| groups[0]);
    let group = match &arguments.tried.group {
        Some(group) if group == metrics::ALL => all_of_one.unwrap_or(metrics::ALL),
        Some(group) if groups.contains(&group.as_str()) => group.as_str(),
        Some(group) => {
            let message = format!("--group {group}: the outputs are {}; or all", groups.join(", "));
            return Err(Error::Usage(message));
        }
        None if subject.scene().is_none() && groups.len() > 1 => metrics::ALL,
        None => groups.last().copied().unwrap_or_default(),
    };
    let device = Device {
        clock_mhz: arguments.clock_mhz,
        readout: arguments.tried.readout.into(),
        scan_ms: arguments.scan.scan_ms,
    };
    let asked = Asked {
        centres: centres(arguments.subject.centres(), subject, common)?,
        column_steps: column_steps(arguments, subject)?,
        samples_averaged: match arguments.tried.average.as_slice() {
            [] => vec![1],
            given => distinct("--average", given)?,
        },
        device,
        group: group.into(),
        worst_case: arguments.worst_case,
        most_bytes: arguments.max_flash.unwrap_or(SLOT_BYTES),
    };
    check(subject, &asked).map_err(of_option)?;
    check_features(subject).map_err(|error| blamed(error, arguments.subject.training()))?;
    Ok(asked)
}

/// Checks the number of features, which is the same for all networks of the array.
fn check_features(subject: &Subject) -> Result<()> {
    /// Frames that tell which outputs there are.
    const FEW_FRAMES: usize = 64;
    let features = subject.options().features;
    if features.is_none() {
        return Ok(());
    }
    match subject {
        Subject::Scene(scene) => {
            let synthesis = Synthesis::new(&scene.world);
            let few = scene.dataset(&synthesis, Stream::Training, FEW_FRAMES);
            projection::check(&few, features)?;
        }
        Subject::Measured(data) => projection::check(&data.training, features)?,
    }
    Ok(())
}

/// Checks what is varied against the subject.
fn check(subject: &Subject, asked: &Asked) -> std::result::Result<(), BadValue> {
    for &centres in &asked.centres {
        let options = Options { centres, ..subject.options() };
        options.check(subject.training_frames()).map_err(|bad| match bad.field.as_str() {
            "centres" => bad.named("--centres"),
            _ => bad,
        })?;
    }
    let has_others = subject.scene().is_some_and(|scene| !scene.others.is_empty());
    if asked.worst_case && !has_others {
        let rule =
            "there are no other contacts to evaluate; leave it out, or give a scene of contacts";
        return Err(BadValue::new("--worst-case", true, rule));
    }
    Ok(())
}

/// Centres to try unless a user says otherwise.
const CENTRES: [usize; 5] = [16, 32, 64, 128, 256];

/// Centres that are asked for, or of the usual ones those that so many training frames allow.
fn centres(given: &[usize], subject: &Subject, common: &Common) -> Result<Vec<usize>> {
    if !given.is_empty() {
        return distinct("--centres", given);
    }
    let frames = subject.training_frames();
    let (fit, too_many): (Vec<usize>, Vec<usize>) = CENTRES.iter().partition(|k| **k < frames);
    if fit.is_empty() {
        let message = format!(
            "{frames} training frames are fewer than usual for a trade: give --centres below their number"
        );
        return Err(Error::Usage(message));
    }
    if !too_many.is_empty() {
        let names: Vec<String> = too_many.iter().map(ToString::to_string).collect();
        let names = names.join(", ");
        common.remark(format_args!(
            "note: K = {names} left out: there must be fewer centres than the {frames} training frames"
        ));
    }
    Ok(fit)
}

/// Steps of columns to try: those that are given, or that shorten the scan where its time matters.
fn column_steps(arguments: &Arguments, subject: &Subject) -> Result<Vec<usize>> {
    let time_matters = arguments.frame_rate.is_some() || arguments.tried.max_latency_ms.is_some();
    match subject {
        _ if !arguments.column_step.is_empty() => distinct("--column-step", &arguments.column_step),
        Subject::Scene(scene) if time_matters && arguments.scan.scan_ms.is_none() => {
            let columns = scene.world.sensor.column_wires;
            Ok([1, 2, 3, 6].into_iter().filter(|step| columns.is_multiple_of(*step)).collect())
        }
        _ => Ok(vec![1]),
    }
}

/// What stands in the way of bounds on time, if there are any, and what helps.
fn in_the_way(arguments: &Arguments, subject: &Subject, asked: &Asked) -> Option<String> {
    let of_rate = arguments.frame_rate.map(|hz| 1000.0 / hz);
    let most_ms = of_rate.into_iter().chain(arguments.tried.max_latency_ms).reduce(f64::min)?;
    let (step, samples) = (*asked.column_steps.last()?, *asked.samples_averaged.first()?);
    let scan_ms = asked.device.scan_ms(wires(subject, step), samples)?;
    let helps = match subject {
        _ if scan_ms < most_ms => "give fewer --centres, which decode faster, or ",
        _ if asked.device.scan_ms.is_some() => "",
        Subject::Scene(_) => "read fewer columns (a larger --column-step), or ",
        Subject::Measured(_) => "read fewer columns (--inputs), or ",
    };
    Some(format!(
        "a frame may take {most_ms:.3} ms, of which the scan takes {scan_ms:.3} ms: {helps}give the time of a faster \
         converter with --scan-ms"
    ))
}

/// Wires that are read if only every `step`th column of a scene is; `None` where names of readings tell none.
fn wires(subject: &Subject, step: usize) -> Option<Wires> {
    match &*subject.with_every_column(step) {
        Subject::Scene(scene) => {
            let columns = scene.world.sensor.column_wires;
            Some(Wires { rows: scene.world.read_rows.len(), columns })
        }
        Subject::Measured(data) => Wires::named(&data.training.inputs.names),
    }
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
