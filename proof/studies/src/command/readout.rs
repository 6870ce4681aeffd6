//! Command `readout`: the effect of circuits on readings, and on the estimates from them.

use std::path::PathBuf;

use crate::question::readout::{self, ReadoutResult, Stage};
use clap::Args;
use host_sim::Result;
use host_sim::commands::progress::Terminal;
use host_sim::metrics::Errors;
use taxel_learn::Exponential;
use taxel_simulate::readout::Circuit;
use taxel_simulate::virtual_board::VirtualBoard;

use host_sim::commands::scene_argument::{self, SceneArgument};
use host_sim::commands::{Common, print};

/// Compare readout circuits: scan a scene through a virtual board, and decode.
///
/// The firmware's own scanner runs on virtual pins and converters in front of a network of all wires.
/// Faults are added one after the other. Parts that the scene's [readout] does not set have typical values
/// (docs/readout.md). The frames have none of the scene's noise.
#[derive(Args)]
#[command(after_help = "Example: cargo xtask study readout press --frames 500")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    /// Frames to scan.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 200)]
    frames: usize,
    /// Weight blob of this scene, instead of training one.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        let scene = self.scene.load(common)?;
        scene.require_inverse("readout")?;
        scene.world.check_frames("--frames", self.frames)?;
        VirtualBoard::new(&scene.world)?;
        let model = scene_argument::model(self.model.as_deref(), &scene, &Terminal::new())?;
        let result = readout::measure(&scene, &model.prepare(Exponential::default()), self.frames)?;
        super::show(common, &result, page_of)
    }
}

fn page_of(result: &ReadoutResult) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} frames without noise, seed {}, model {}",
        result.subject, result.frames, result.seed, result.model_crc
    ));
    page.line("error of readings: scanned/ideal − 1; RMSE: decoded against true\n");
    let cells = |of_group: fn(&Errors) -> String, errors: &[Errors]| {
        errors.iter().map(of_group).collect::<Vec<_>>().concat()
    };
    let header =
        cells(|group| format!(" {:>13}", format!("{} RMSE", group.group)), result.ideal_errors());
    let rmse = |errors: &[Errors]| {
        cells(|group| format!(" {:>10.4} {:<2}", group.rmse, group.unit), errors)
    };
    page.line(format_args!(
        "{:<15} {:<31} {:>9} {:>9} {:>8}{header}",
        "circuit", "simulated", "RMS", "largest", "missing"
    ));
    let without = |what: &str, errors: &[Errors]| {
        format!("{:<15} {what:<31} {:>9} {:>9} {:>8}{}", "-", "-", "-", "-", rmse(errors))
    };
    page.line(without("ideal readings", result.ideal_errors()));
    for line in &result.lines {
        page.line(format_args!(
            "{:<15} {:<31} {:>7.3} % {:>7.3} % {:>8}{}",
            line.circuit.name(),
            line.stage.name(),
            line.readings.rms_percent,
            line.readings.largest_percent,
            line.readings.missing,
            rmse(&line.errors)
        ));
    }
    page.line(without("predicting the mean", result.mean_errors()));
    if let Some(conclusion) = conclusion(result) {
        page.line(conclusion);
    }
    page
}

/// Conclusion about compression, if the numbers support it.
fn conclusion(result: &ReadoutResult) -> Option<String> {
    let z = |errors: &[Errors]| {
        errors.iter().find(|errors| errors.group == "dz_mm").map(|errors| errors.rmse)
    };
    let of = |circuit, stage| result.line(circuit, stage).and_then(|line| z(&line.errors));
    let divider = of(Circuit::Divider, Stage::Everything)?;
    let zero_potential = of(Circuit::ZeroPotential, Stage::Everything)?;
    let miscalibrated = of(Circuit::ZeroPotential, Stage::Miscalibrated)?;
    let (ideal, mean) = (z(result.ideal_errors())?, z(result.mean_errors())?);
    (divider > mean && zero_potential < mean).then(|| {
        format!(
            "\nWith all faults the divider decodes z with {:.1} times the error of the mean; zero \
             potential with {:.2} times\nthat of ideal readings, but {:.1} times if its series \
             resistance is known only to 10 %.",
            divider / mean,
            zero_potential / ideal,
            miscalibrated / ideal
        )
    })
}
