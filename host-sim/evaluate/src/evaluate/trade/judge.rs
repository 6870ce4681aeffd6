//! Training and judging of the points that share their training and test frames.

use rayon::prelude::*;
use taxel_core::filter::{Settings, Track};
use taxel_core::rbf::Format;
use taxel_data::progress::Progress;
use taxel_learn::cost::{Cost, DecoderRam, Design};
use taxel_learn::train::{Examples, FittedNetwork, Refinement, Samples, Start, refine};
use taxel_learn::{ModelBlob, Options, Origin, Trained, pack};

use super::progress::Part;
use super::readings::in_words;
use super::touches::Way;
use super::ways::{Ways, formats};
use super::{Device, Point, SLOT_BYTES};
use crate::error::Result;
use crate::metrics::{self, Measure};

/// Bytes of RAM that a filter in time takes for each output.
const FILTER_BYTES: usize = size_of::<Track>();

/// Points that were trained and judged, and the blobs that they decode with.
#[derive(Default)]
pub(super) struct Judged {
    pub points: Vec<Point>,
    /// Formats that cannot hold a network of some settings, and why.
    pub left_out: Vec<String>,
    /// Index of each point's blob among the distinct ones.
    pub blobs: Vec<usize>,
    pub distinct: Vec<Vec<u8>>,
}

impl Judged {
    /// Trains networks for all `ways`, and judges them by the `measure` of their readings.
    pub fn add(
        &mut self,
        ways: &Ways<'_>,
        readings: (usize, &Measure),
        device: &Device,
        progress: &dyn Progress,
    ) -> Result<()> {
        let frames = ways.frames;
        let fitted = fit(ways, progress)?;
        for (index, format) in formats().enumerate() {
            let mut trained = Trained::default();
            let added = ways.inputs.starts.iter().zip(&fitted).try_for_each(|(start, fitted)| {
                let of_rows = fitted.networks.iter().map(|row| row[index].as_ref().cloned());
                let networks = of_rows.collect::<std::result::Result<Vec<_>, _>>()?;
                trained.add(start.front(fitted.projection.as_ref()), networks);
                Ok(())
            });
            if let Err(cause) = added {
                self.leave_out(format, ways, cause);
                continue;
            }
            let origin = &frames.set.origin;
            let noise = (origin.noise.0, frames.noise_level());
            let origin = Origin { noise, ..origin.clone() };
            let blob = pack(&trained, frames.training(), &origin)?;
            if !ways.inputs.each_row() && blob.bytes().len() > SLOT_BYTES {
                continue;
            }
            self.points(&blob, ways, format, readings, device)?;
            self.distinct.push(blob.bytes().to_vec());
        }
        Ok(())
    }

    /// Notes why a format cannot hold a network of these settings.
    fn leave_out(&mut self, format: Format, ways: &Ways<'_>, cause: &taxel_learn::Error) {
        let of = if ways.inputs.each_row() { "" } else { " array" };
        let (name, centres) = (format.name(), ways.centres);
        let readings = in_words(ways.frames.wires.map(|wires| wires.columns), None);
        let cause = match cause {
            taxel_learn::Error::Setting(bad) if bad.field == "spread" => {
                let spread =
                    bad.value.parse::<f64>().map_or(f64::NAN, |it| (it * 1e4).round() / 1e4);
                let where_to = " (in a scene's [training], or by `train --spread`)";
                let rule = bad.rule.replace(", or another format (f32)", where_to);
                format!("spread = {spread}: {rule}")
            }
            cause => cause.to_string(),
        };
        self.left_out.push(format!("{name}{of}, K = {centres}{readings}: {cause}"));
    }

    /// Adds the points of a network: one, and on contacts that move another one behind a filter.
    fn points(
        &mut self,
        blob: &ModelBlob,
        Ways { frames, inputs, .. }: &Ways<'_>,
        format: Format,
        (readings, measure): (usize, &Measure),
        device: &Device,
    ) -> Result<()> {
        let test = &frames.test;
        let model = blob.prepare().of_inputs();
        let others = frames.others.errors(&model, measure);
        let design = Design::new(blob);
        let ram = DecoderRam::new(&design);
        // Fewer than asked for where there are fewer distinct samples.
        let centres = design.networks.iter().map(|network| network.shape.centres).max();
        let centres = centres.unwrap_or_default();
        let cost = Cost::of_frame(&design);
        let mut add = |filter: Settings, frame: Cost, errors| {
            self.points.push(Point {
                format,
                each_row: inputs.each_row(),
                centres,
                spread: blob.spread(),
                readings,
                columns: frames.wires.map(|wires| wires.columns),
                samples_averaged: frames.samples_averaged,
                filter: filter.is_on().then(|| filter.into()),
                errors,
                others: others.clone(),
                ratio_to_best: vec![],
                frame,
                times: device.times(frames.scan_ms, &frame),
                blob_bytes: blob.bytes().len(),
                ram_bytes: ram.bytes()
                    + if filter.is_on() { FILTER_BYTES * test.outputs.names.len() } else { 0 },
                on_front: false,
            });
            self.blobs.push(self.distinct.len());
        };
        if let Some(touches) = &frames.touches {
            let device = (device, frames.scan_ms);
            let touched = touches.judge((blob, &model), cost, device, measure)?;
            for Way { filter, cost, errors, .. } in touched.ways {
                add(filter, cost, errors);
            }
            return Ok(());
        }
        let estimate = model.decode_lines(&test.inputs.values);
        let errors = metrics::by_group(&test.outputs, &estimate, measure);
        add(Settings::default(), cost, errors);
        Ok(())
    }
}

/// Steps of progress that [`Judged::add`] takes.
pub(super) fn steps(ways: &Ways<'_>) -> usize {
    weight(ways.centres) * parts(ways).iter().sum::<usize>()
}

/// Steps of refinement, and of fitting weights, which take about as long each.
fn parts(Ways { frames, inputs, .. }: &Ways<'_>) -> [usize; 2] {
    let networks = if inputs.each_row() { frames.training().rows } else { inputs.starts.len() };
    let steps = Refinement::default().steps;
    let refining = match frames.set.examples() {
        None => 0,
        Some(Examples::Fresh(_)) => steps * inputs.starts.len(),
        Some(Examples::Folds(_)) => refine::fold_steps(steps, networks),
    };
    [refining, networks]
}

/// Steps of progress that a step with so many centres is worth: about its share of the time, which for many centres
/// grows with their square.
fn weight(centres: usize) -> usize {
    8 + centres * centres / 640
}

/// Networks of a row, or of the whole array: one of each format, or why there is none.
type OfFormats = Vec<taxel_learn::Result<FittedNetwork>>;

/// Networks that share layers, of every format for every row, and the projection in front of them.
struct Fitted {
    projection: Option<Vec<f32>>,
    networks: Vec<OfFormats>,
}

/// Networks of every format on the same layers, for each start of training.
fn fit(
    ways @ Ways { frames, inputs, centres }: &Ways<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Fitted>> {
    let own = Options { centres: *centres, ..inputs.options };
    own.check_for(frames.training())?;
    let [refining, fitting] = parts(ways).map(|steps| Part::new(progress, steps, weight(*centres)));
    let of_start = |start| {
        // Layers are shared by all formats.
        let start: &Start = start;
        let mut layers = start.layers(&own);
        let settings = Refinement::default();
        let examples = frames.set.examples();
        if let Some(examples) = examples {
            layers = refine::refine(&start.frames, &layers, &own, &settings, examples, &refining)?;
        }
        let options = start.fitting(&layers, &own, examples.is_some().then_some(&settings))?;
        let rows = layers.hidden.par_iter().enumerate();
        let fitted = rows.map(|(row, layer)| {
            let seen = layers.seen.row(row);
            let samples = Samples::of(&seen);
            let fit = |format| samples.fit_layer(layer, &Options { format, ..options });
            let fitted = formats().collect::<Vec<_>>().into_par_iter().map(fit).collect();
            fitting.step();
            fitted
        });
        let networks = fitted.collect();
        Ok(Fitted { projection: layers.projection, networks })
    };
    let fitted = inputs.starts.iter().map(of_start).collect();
    refining.finish();
    fitting.finish();
    fitted
}
