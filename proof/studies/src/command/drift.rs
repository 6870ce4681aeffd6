//! Command `drift`: the effect of a drifting gain, on readings and on readings relative to the baseline.

use crate::question::drift::{self, DriftResult, Line, TYPICAL_GAIN};
use clap::Args;
use host_sim::Result;
use host_sim::metrics::Errors;
use taxel_learn::decoders::mean;
use taxel_simulate::world::check_gain;

use host_sim::commands::arguments::of_option;
use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::{NoiseArgument, SceneArgument};
use host_sim::commands::{Common, print};

/// Compare inputs: readings, and readings relative to the baseline, when the gain drifts.
///
/// Trains the scene's model on readings, on readings of sessions that drift, and on readings relative to each
/// session's baseline. Evaluates each on the same test frames without and with drift (docs/drift.md).
#[derive(Args)]
#[command(after_help = "Example: cargo xtask study drift press --gain 0.02")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Largest relative change of the gain: each session has one factor on all its readings, uniform on
    /// [1 − GAIN, 1 + GAIN] [default: the scene's, or 0.02].
    #[arg(long, value_name = "GAIN", allow_negative_numbers = true)]
    gain: Option<f64>,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        let mut scene = self.scene.load(common)?;
        scene.require_inverse("drift")?;
        self.noise.apply(&mut scene)?;
        let of_scene = scene.world.drift.map_or(TYPICAL_GAIN, |drift| drift.gain);
        let gain = self.gain.unwrap_or(of_scene);
        check_gain("gain", gain).map_err(|bad| of_option(bad, &[("gain", "--gain")]))?;
        let result = drift::measure(&scene, gain, &Terminal::new())?;
        super::show(common, &result, page_of)
    }
}

fn page_of(result: &DriftResult) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: gain drift ±{} %, seed {}, {} training and {} test frames",
        result.subject,
        (result.gain * 1e6).round() / 1e4,
        result.seed,
        result.training_frames,
        result.test_frames
    ));
    let groups = result.lines.first().map_or(&[][..], |line| &line.undrifted);
    for (place, Errors { group, unit, .. }) in groups.iter().enumerate() {
        let heading = format!("RMSE of {group}, in {unit}");
        page.line(format_args!(
            "\n{heading:<44} {:>9} {:>10} {:>7}",
            "no drift", "with drift", "ratio"
        ));
        for line in &result.lines {
            let [undrifted, drifted] = [&line.undrifted, &line.drifted].map(|e| e[place].rmse);
            page.line(format_args!(
                "{:<44} {undrifted:>9.4} {drifted:>10.4} {:>7.3}",
                name(line),
                drifted / undrifted
            ));
        }
    }
    page.line(
        "\nRMSE = √mean(e²). with drift: one factor multiplies all readings of a session, and its baseline.\n\
         relative inputs: R/R₀, where R₀ is the mean of 100 frames of the untouched sensor.\n\
         mean: always predicting the mean of the training outputs.",
    );
    page
}

/// Decoder, its inputs and its training in a few words.
fn name(line: &Line) -> String {
    match (line.relative_inputs, line.trained_with_drift) {
        _ if line.decoder == mean::NAME => line.decoder.clone(),
        (true, _) => format!("{}, relative inputs", line.decoder),
        (false, true) => format!("{}, readings, trained with drift", line.decoder),
        (false, false) => format!("{}, readings", line.decoder),
    }
}
