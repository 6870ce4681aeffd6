//! Command `train`: from a scene or any CSV file to a weight blob.

use std::path::{Path, PathBuf};

use super::progress::Terminal;
use crate::evaluate::device_cost::DeviceCost;
use crate::evaluate::worth::Worth;
use crate::measurements::Measurements;
use crate::metrics::{self, NETWORK};
use crate::report::format::symbol;
use crate::report::{self, Digits, Sections, TableOf};
use crate::subject::Subject;
use crate::{Error, Result};
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde::Serialize;
use taxel_data::dataset::{LeftOut, UnusedInputs};
use taxel_data::{columns, output};
use taxel_learn::kinds::Choice;
use taxel_learn::outliers::Outliers;
use taxel_learn::reading_model::Extent;
use taxel_learn::select::{Scored, Selection};
use taxel_learn::train::Solver;

use super::data_argument::JudgedBy;
use super::model_argument::{ModelArguments, NetworkArguments, note_format};
use super::model_outputs::{self, ModelOutput};
use super::scene_argument::Sizes;
use super::subject_argument::SubjectOptions;
use super::{Common, print, refused_readings};

mod choice;

/// Train a model on a scene or a CSV file, and write its blob.
///
/// A CSV file trains one network for all selected columns, as a scene does for all rows. If the columns have the project's own
/// names (r4c17_ohm, r4e2_dz_mm), --each-row trains one for each row-wire.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim train press -o press.bin
  host-sim train press --centres 256 -o press.bin
  host-sim train press --paper -o paper.bin
  host-sim train measured.csv --inputs 'ch*' --outputs 'f?_n' --centres 200 --spread 0.5 -o m.bin
  host-sim train measured.csv --inputs 'ch*' --outputs 'f?_n' --select --fold-column fold -o m.bin
  host-sim train log.csv --inputs 'ch*' --outputs 'f?_n' --relative-inputs -o m.bin
  host-sim train log.csv --missing -1 --first-share 0.8 --inputs c2..c16 --outputs c17 --fold-blocks 10 -o m.bin")]
pub struct Arguments {
    /// A built-in scene (paper, press, contact, moving), a scene file (.toml) or a data file (CSV, .mcap).
    source: String,
    /// Blob to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    network: NetworkArguments,
    #[command(flatten)]
    model: ModelArguments,
    /// Choose K, spread and penalty among the candidates by cross-validation, and print every score. Best values at
    /// an edge of default spreads and penalties are looked beyond; other edges are named.
    #[arg(long)]
    select: bool,
    /// Give the model statistics of its readings (docs/reading-model.md): with fill, it tells missing readings from the others
    /// of their frame, so that a broken wire costs accuracy, but no frames. With full, it also tells how far off each output
    /// may be, and how novel a frame is; on a CSV file, that trains once more for every fold: give folds of whole places or
    /// days (--fold-column), because frames of one resemble each other. Estimates of whole frames stay the same. For 144
    /// readings, fill takes 7 kB, and full 27 kB. Either takes ten frames of training for each reading.
    #[arg(long, value_name = "EXTENT", value_parser = PossibleValuesParser::new(Extent::NAMES))]
    reading_model: Option<String>,
    /// Frames to synthesise from a scene, instead of the scene's number.
    #[arg(short = 'n', long, value_name = "N")]
    frames: Option<usize>,
    #[command(flatten)]
    subject: SubjectOptions,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    seed: u64,
    file: PathBuf,
    blob_bytes: usize,
    model_crc: String,
    training_frames: usize,
    centres: usize,
    /// Width σ on scaled inputs; after refinement the mean over the networks.
    spread: f64,
    /// Penalty on squared weights, for each frame; `None` for the usual one.
    penalty: Option<f64>,
    /// How output weights were computed: `qr` or `rls`.
    solver: &'static str,
    /// Whether centres, widths and the projection were refined after K-means.
    refined: bool,
    /// Whether inputs are readings relative to the baseline.
    relative_inputs: bool,
    /// Features that training chose, and what it tried; `None` where there was no choice.
    features: Option<Choice>,
    /// What the model's statistics of readings tell: `fill` missing readings, `full` deviations and novelty, too; `None`
    /// without any.
    reading_model: Option<&'static str>,
    /// Number formats of the networks, in their order.
    formats: Vec<&'static str>,
    outputs: Vec<ModelOutput>,
    selection: Option<Selection>,
    /// What the model is worth, beside the baselines.
    #[serde(flatten)]
    worth: Worth,
    /// Values far from all others in their column; `None` for a scene.
    outliers: Option<Outliers>,
    /// Lines that lack a value; `None` for a scene.
    lines_left_out: Option<LeftOut>,
    /// Inputs that can tell nothing, and are left out; `None` for a scene.
    unused_inputs: Option<UnusedInputs>,
    /// Inputs that are left in and never change in training; a network cannot use them.
    constant_inputs: Vec<String>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let source = Path::new(&arguments.source);
    let baseline = arguments.subject.data.baseline().unwrap_or(source);
    let inputs = [source, baseline];
    print::check_output(&arguments.output, &inputs)?;
    let mut subject = load(arguments, common)?;
    refused_readings::note_scene(&subject);
    let mut options = arguments.model.over(&mut subject);
    let set = subject.training_set(None);
    set.check()?;
    if arguments.select && options.projects(&set.frames) {
        let message = "--select chooses for networks that are given readings: add --each-row, or leave it out";
        return Err(Error::Usage(message.into()));
    }
    let (features, selection) = choice::choose(arguments, &subject, &set, &mut options)?;

    let progress = Terminal::new();
    let blob = set.blob(&options, &progress)?;
    output::write_bytes(&arguments.output, blob.bytes())?;

    let model = blob.parse();
    note_format(&model, &options, DeviceCost::new(&blob).cycles);
    let summary = Summary {
        subject: subject.name().into(),
        seed: set.origin.seed,
        file: arguments.output.clone(),
        blob_bytes: blob.bytes().len(),
        model_crc: format!("{:08x}", model.crc()),
        training_frames: set.frames.frames(),
        centres: model.networks().map(|n| n.shape().centres).max().unwrap_or(0),
        spread: if set.refine { blob.spread() } else { options.spread },
        penalty: options.penalty,
        solver: options.solver.name(),
        refined: set.refine,
        relative_inputs: set.frames.relative_inputs,
        features,
        reading_model: model.reading_model().map(|it| Extent::NAMES[usize::from(it.assesses())]),
        formats: model.networks().map(|n| n.format().name()).collect(),
        outputs: model_outputs::of(&model),
        worth: Worth::new(&subject, &set, &blob, selection.as_ref()),
        selection,
        outliers: subject.measurements().map(|data| data.outliers.clone()),
        lines_left_out: subject.measurements().map(|data| data.left_out.clone()),
        unused_inputs: subject.measurements().map(|data| data.unused.clone()),
        constant_inputs: subject
            .measurements()
            .map(Measurements::constant_inputs)
            .unwrap_or_default(),
    };
    print::result(common, &summary, || {
        print::Page::of_sections(&sections_of(&summary, options.centres))
    })
}

/// Scene or CSV file that is trained on: all frames of a file, or so many of a scene.
fn load(arguments: &Arguments, common: &Common) -> Result<Subject> {
    let options = &arguments.subject;
    if options.data.baseline().is_some() && !options.relative_inputs.relative_inputs {
        let message = "--baseline is what --relative-inputs divides by: give both, or neither";
        return Err(Error::Usage(message.into()));
    }
    let centres = arguments.network.centres.iter().min().copied();
    let sizes = Sizes { frames: arguments.frames, centres };
    let extent = arguments.reading_model.as_deref().and_then(Extent::of_name);
    let subject = options.load(&arguments.source, common, JudgedBy::None, extent, sizes)?;
    match &subject {
        Subject::Scene(_) if options.data.folds().is_some() && !arguments.select => {
            let message = "--folds holds out frames of a CSV file, or with --select; a scene has fresh frames: leave it out";
            return Err(Error::Usage(message.into()));
        }
        Subject::Measured(_) if arguments.frames.is_some() => {
            return Err(Error::Usage("-n sets a scene's frames; a CSV file has its own".into()));
        }
        Subject::Measured(data)
            if !(data.refine || extent == Some(Extent::Full) || arguments.select) =>
        {
            options.data.refuse_folds()?;
        }
        Subject::Measured(data) if data.training.relative_inputs => {
            options.data.refuse_time("train --relative-inputs")?;
        }
        Subject::Scene(_) | Subject::Measured(_) => {}
    }
    Ok(subject)
}

fn sections_of(summary: &Summary, asked: usize) -> Sections {
    let mut sections = Sections::new(format!("Model of {}", summary.subject));
    if let Some(selection) = &summary.selection {
        scores(&mut sections, selection, &summary.outputs);
    }
    let few = if summary.centres < asked {
        format!("; {asked} were asked for, but the data has fewer distinct samples")
    } else {
        String::new()
    };
    let penalty =
        summary.penalty.map_or(String::new(), |it| format!(", penalty {}", choice::short(it)));
    sections.details(vec![
        (
            "Blob",
            format!(
                "{}, {} bytes, CRC-32 {}",
                summary.file.display(),
                summary.blob_bytes,
                summary.model_crc
            ),
        ),
        (
            "Network",
            format!(
                "{}, K = {}{few}, spread {}{}{penalty}{}{}",
                summary.formats.first().unwrap_or(&""),
                summary.centres,
                summary.spread,
                if summary.refined { " (refined)" } else { "" },
                if summary.solver == Solver::Rls.name() { ", weights by recursion" } else { "" },
                if summary.relative_inputs { ", inputs relative to the baseline" } else { "" },
            ),
        ),
        ("Frames", summary.training_frames.to_string()),
        ("Chosen", summary.features.as_ref().map_or(String::new(), ToString::to_string)),
        ("Reading model", summary.reading_model.unwrap_or_default().into()),
    ]);
    let Worth { judged_on, verdict, decoders } = &summary.worth;
    let words = judged_on.words();
    report::errors_of(&mut sections, decoders, &words.replacen("On", "on", 1));
    report::worth(&mut sections, verdict, metrics::of_decoder(decoders, NETWORK));
    sections.lead = format!("{words}: {}", sections.lead);
    sections
}

/// Adds the scores of cross-validation.
fn scores(sections: &mut Sections, selection: &Selection, outputs: &[ModelOutput]) {
    type Row<'r> = (String, Option<&'r Scored>, f64, Vec<f64>);
    let outputs: Vec<String> = outputs.iter().map(|it| it.name.clone()).collect();
    let groups = columns::groups(&outputs);
    let scored = selection.scored.iter().enumerate().map(|(i, it)| {
        let mark = if i == selection.chosen { "chosen" } else { "" };
        (mark.to_owned(), Some(it), it.score, metrics::pooled(&groups, &it.rmse))
    });
    let baselines = selection
        .baselines
        .iter()
        .map(|it| (it.decoder.to_owned(), None, it.score, metrics::pooled(&groups, &it.rmse)));
    let rows: Vec<Row<'_>> = scored.chain(baselines).collect();
    let text = |value: Option<String>| value.unwrap_or("–".into());
    let caption = "Cross-validation: RMSE on folds that were held out. Score: mean over the outputs of RMSE/standard deviation, \
                   which is 1 for always predicting the mean.";
    let mut table = TableOf::new(&rows, caption)
        .names("", |row| row.0.clone())
        .names("K", |row| text(row.1.map(|it| it.centres.to_string())))
        .names("spread", |row| text(row.1.map(|it| it.spread.to_string())))
        .names("penalty", |row| text(row.1.and_then(|it| it.penalty).map(choice::short)))
        .numbers("score", "", Digits::Decimals(4), |row| Some(row.2));
    for (place, (group, _)) in groups.iter().enumerate() {
        let (heading, unit) = (symbol(group), columns::unit_of(group));
        table = table.numbers(&heading, unit, Digits::Significant(4), |row| Some(row.3[place]));
    }
    sections.table(table);
    if let Some(better) = selection.better_baseline() {
        let name = better.decoder;
        sections.note(format!("Not worth its cost: the baseline {name} has a lower score."));
    }
}
