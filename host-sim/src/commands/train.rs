//! Command `train`: from a scene or any CSV file to a weight blob.

use std::path::Path;

use super::progress::Terminal;
use crate::evaluate::device_cost::DeviceCost;
use crate::measurements::Measurements;
use crate::metrics::{self, NETWORK};
use crate::report::format::symbol;
use crate::report::{self, Digits, Sections, TableOf};
use crate::select::{Scored, Selection};
use crate::subject::Subject;
use crate::training_options::TrainingOptions;
use crate::training_set::TrainingSet;
use crate::worth::Worth;
use crate::{Error, Result};
use clap::Args;
use taxel_data::{columns, output};
use taxel_learn::kinds::Choice;
use taxel_learn::reading_model::Extent;
use taxel_learn::{ModelBlob, Options};

use super::data_argument::JudgedBy;
use super::format_note::note_format;
use super::model_outputs::{self, ModelOutput};
use super::subject_argument::SubjectOptions;
use super::{Common, arguments, print, refused_readings};

mod choice;

/// Train a model on a scene or a CSV file, and write its blob.
///
/// A CSV file trains one network for all selected columns, as a scene does for all rows. If the columns have the
/// project's own names (r4c17_ohm, r4e2_dz_mm), --each-row trains one for each row-wire.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel train press -o press.bin
  taxel train press --centres 256 -o press.bin
  taxel train press --paper -o paper.bin
  taxel train measured.csv --inputs 'ch*' --outputs 'f?_n' --centres 200 --spread 0.5 -o m.bin
  taxel train measured.csv --inputs 'ch*' --outputs 'f?_n' --select --fold-column fold -o m.bin
  taxel train log.csv --inputs 'ch*' --outputs 'f?_n' --relative-inputs -o m.bin
  taxel train log.csv --missing -1 --first-share 0.8 --inputs c2..c16 --outputs c17 --fold-blocks 10 -o m.bin")]
pub struct Arguments {
    /// A built-in scene (paper, press, contact, moving, shear), a scene file (.toml) or a data file (CSV, .mcap).
    source: String,
    #[command(flatten)]
    to: arguments::OutputFile,
    /// Choose K, spread and penalty among the candidates by cross-validation, and print every score. If the best spread
    /// or penalty is the smallest or largest default, more are tried beyond it; for given candidates, a note says so.
    #[arg(long)]
    select: bool,
    #[command(flatten)]
    subject: SubjectOptions,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let source = Path::new(&arguments.source);
    let baseline = arguments.subject.data.baseline().unwrap_or(source);
    let inputs = [source, baseline];
    print::check_output(&arguments.to.output, &inputs)?;
    let subject = load(arguments, common)?;
    refused_readings::note_scene(&subject, common);
    let mut options = subject.options();
    let set = subject.training_set();
    set.check()?;
    let (features, selection) = choice::choose(arguments, &subject, &set, &mut options, common)?;

    let progress = Terminal::new(common);
    let blob = set
        .blob(&options, &progress)
        .map_err(|error| arguments::blamed(error, &arguments.subject.training))?;
    output::write_bytes(&arguments.to.output, blob.bytes())?;

    note_format(&blob.parse(), &options, DeviceCost::new(&blob).cycles, common);
    let trained = Trained { subject: &subject, set: &set, options: &options, blob: &blob };
    let sections = trained.sections(&arguments.to.output, features.as_ref(), selection.as_ref());
    Ok(print::sections(common, &sections))
}

/// Scene or CSV file that is trained on: all frames of a file, or so many of a scene.
fn load(arguments: &Arguments, common: &Common) -> Result<Subject> {
    let options = &arguments.subject;
    if options.data.baseline().is_some() && options.training.relative_inputs.is_none() {
        let message = "--baseline is what --relative-inputs divides by: give both, or neither";
        return Err(Error::Usage(message.into()));
    }
    let mut training = options.training.clone();
    if arguments.select {
        // One of the candidates holds until one is chosen.
        let fewest = training.centres.iter().flatten().min().map(|fewest| vec![*fewest]);
        training = TrainingOptions { centres: fewest, spread: None, penalty: None, ..training };
    }
    let how = (&training, arguments.select);
    let subject = options.load(&arguments.source, how, common, JudgedBy::None)?;
    if subject.measurements().is_some_and(|data| data.training.relative_inputs) {
        options.data.refuse_time("train --relative-inputs")?;
    }
    Ok(subject)
}

/// Model that was trained, and what it was trained on.
struct Trained<'a> {
    subject: &'a Subject,
    set: &'a TrainingSet<'a>,
    options: &'a Options,
    blob: &'a ModelBlob,
}

impl Trained<'_> {
    /// What is worth to know of it; `features` and settings in `selection` were chosen before.
    fn sections(
        &self,
        file: &Path,
        features: Option<&Choice>,
        selection: Option<&Selection>,
    ) -> Sections {
        let Self { subject, set, options, blob } = *self;
        let (model, measured) = (blob.parse(), subject.measurements());
        let worth = Worth::new(subject, set, blob, selection);
        let outputs = model_outputs::of(&model);
        let mut result = Sections::new(format!("Model of {}", subject.name()));
        result.value("subject", subject.name());
        if let Some(selection) = selection {
            scores(&mut result, selection, &outputs);
        }
        result.fact("file", "file", "", file.display().to_string());
        result.fact("blob_bytes", "size", "bytes", blob.bytes().len());
        result.fact("model_crc", "CRC-32", "", format!("{:08x}", model.crc()));
        let formats: Vec<&str> = model.networks().map(|it| it.format().name()).collect();
        result.value("formats", &formats);
        result.line("format", formats.first().copied().unwrap_or_default());
        let centres = model.networks().map(|it| it.shape().centres).max().unwrap_or(0);
        result.fact("centres", "centres K", "", centres);
        if centres < options.centres {
            let asked = options.centres;
            result
                .line("asked for", format!("{asked} centres; the data has fewer distinct samples"));
        }
        let spread = if set.refine { blob.spread() } else { options.spread };
        result.fact("spread", "spread", "", spread);
        result.fact("refined", "refined", "", set.refine);
        result.fact("penalty", "penalty", "", options.penalty);
        result.fact("solver", "weights by", "", options.solver.name());
        result.fact("training_frames", "training frames", "", set.frames.frames());
        result.fact("seed", "seed", "", set.origin.seed);
        let relative = set.frames.relative_inputs;
        result.fact("relative_inputs", "readings relative to the baseline", "", relative);
        let extent = model.reading_model().map(|it| Extent::ALL[usize::from(it.assesses())].name());
        result.fact("reading_model", "reading model", "", extent);
        result.value("features", &features);
        result.line("chosen", features.map_or(String::new(), ToString::to_string));
        result.value("outputs", &outputs);
        result.value("selection", &selection);
        result.value("outliers", &measured.map(|data| &data.outliers));
        result.value("lines_left_out", &measured.map(|data| &data.left_out));
        result.value("unused_inputs", &measured.map(|data| &data.unused));
        let constant = measured.map(Measurements::constant_inputs).unwrap_or_default();
        result.value("constant_inputs", &constant);
        let Worth { judged_on, verdict, decoders } = &worth;
        result.value("judged_on", judged_on);
        result.value("decoders", decoders);
        result.value("verdict", verdict);
        let words = judged_on.words();
        report::errors_of(&mut result, decoders, &words.replacen("On", "on", 1));
        report::worth(&mut result, verdict, metrics::of_decoder(decoders, NETWORK));
        result.lead = format!("{words}: {}", result.lead);
        result
    }
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
        .names("decoder", "", |row| row.0.clone())
        .names("centres", "K", |row| text(row.1.map(|it| it.centres.to_string())))
        .names("spread", "spread", |row| text(row.1.map(|it| it.spread.to_string())))
        .names("penalty", "penalty", |row| text(row.1.and_then(|it| it.penalty).map(choice::short)))
        .numbers("score", "score", "", Digits::Decimals(4), |row| Some(row.2));
    for (place, (group, _)) in groups.iter().enumerate() {
        let (heading, unit) = (symbol(group), columns::unit_of(group));
        let (key, digits) = (format!("rmse_{group}"), Digits::Significant(4));
        table = table.numbers(&key, &heading, unit, digits, |row| Some(row.3[place]));
    }
    sections.table(table);
    if let Some(better) = selection.better_baseline() {
        let name = better.decoder;
        sections.note(format!("Not worth its cost: the baseline {name} has a lower score."));
    }
}
