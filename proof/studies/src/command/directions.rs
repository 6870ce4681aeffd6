//! Study `directions`: networks from deformations to readings, inverted, beside those that decode.

use crate::picture;
use crate::question::directions::{
    self, DirectionsResult, FRAMES, INVERTED, INVERTED_DAMPED, Level,
};
use clap::Args;
use host_sim::Result;
use host_sim::metrics::{self, NETWORK};
use taxel_learn::decoders::{linear, mean};

use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::SceneArgument;
use host_sim::commands::{Common, print};

use super::Picture;

/// Compare both directions of the paper's network: deformations to readings, inverted, and readings to deformations.
///
/// The end of the paper's §3 gives a network the 18 components of a row's deformation, and wants the 18 noisy readings.
/// Such a network decodes by solving it for the deformation, by damped Newton steps from rest in f64: exactly
/// (`inverted`), or within the noise, knowing mean and covariance of the scene's deformations (`inverted, damped`).
/// Beside it stand the network that decodes directly, the best linear decoder, the mean, and the limit.
#[derive(Args)]
#[command(after_help = "Examples:
  cargo xtask study directions press
  cargo xtask study directions paper -o directions.svg")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    /// Test frames.
    #[arg(short = 'n', long, value_name = "N", default_value_t = FRAMES)]
    frames: usize,
    #[command(flatten)]
    picture: Picture,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        self.picture.check(self.scene.path())?;
        let scene = self.scene.load(common)?;
        let result = directions::study(&scene, self.frames, &Terminal::new())?;
        self.picture.write(|| picture::decoding_svg(&result))?;
        super::show(common, &result, page_of)
    }
}

fn page_of(result: &DirectionsResult) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} rows of {} test frames, seed {}; K = {}, {} training frames",
        result.subject,
        result.rows,
        result.frames,
        result.seed,
        result.centres,
        result.training_frames
    ));
    let columns = super::noise_columns(&result.levels);
    let line = |name: &str, of: &dyn Fn(&Level) -> Option<f64>| {
        super::line(name, result.levels.iter().map(of))
    };
    page.line(format_args!("\n{:<18}{columns}", "RMSE of reading, Ω"));
    page.line(line("the noise itself", &|level| Some(level.noise_ohm)));
    for decoder in [NETWORK, linear::NAME, mean::NAME] {
        let rmse = |level: &Level| {
            metrics::of_decoder(&level.readings, decoder).first().map(|errors| errors.rmse)
        };
        page.line(line(decoder, &rmse));
    }
    page.line(line("network, to ideal", &|level| Some(level.ideal_rmse_ohm)));
    let decoders = [INVERTED, INVERTED_DAMPED, NETWORK, linear::NAME, mean::NAME];
    super::errors_by_noise(&mut page, &result.levels, &decoders);
    for (place, name) in [INVERTED, INVERTED_DAMPED].into_iter().enumerate() {
        let inversion = |level: &Level| level.inversions[place].clone();
        page.line(format_args!("\n{name:<18}{columns}"));
        page.line(line("rows converged, %", &|level| Some(inversion(level).percent_converged)));
        let times = result.levels.iter().map(|it| format!("{:>10.0}", inversion(it).frame_us));
        page.line(format_args!("{:<18}{}", "µs a frame", times.collect::<String>()));
    }
    page.line(
        "\nAll rows count: one that did not converge has the last place of the search, in the box of 20 % of H.\n\
         network, under readings: from deformations to readings; under deformations: decodes directly.\n\
         to ideal: against readings without noise. The time is that of all cores of this machine.\n\
         damped: within noise and the network's own error, which the training frames tell.",
    );
    super::refusals(&mut page, &result.levels);
    page
}
