//! Whether a device that scans a virtual board reads and decodes what the host does.

use std::net::{Shutdown, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use firmware::circuit::ZeroPotential;
use firmware::link::message::{Configuration, Report};
use serde::Serialize;

use super::check::{Expected, prepare};
use super::{Device, Wire};
use crate::dataset::Table;
use crate::error::{Error, Result};
use crate::evaluate::readout;
use crate::model::LoadedModel;
use crate::progress::Progress;
use crate::scene::{Circuit, Drive, Readout, Sampler, Scene};
use crate::virtual_hardware::{COLUMNS, ROWS, SeriesResistance, VirtualBoard};

/// Time from one scan to the next, if they could be made so fast: the line of the readout is slower.
const PERIOD_US: u32 = 1000;
/// How long the line may take for a sample, were it ever so slow a computer.
const SAMPLE: Duration = Duration::from_millis(5);

/// How scans went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanFindings {
    /// Scans asked for.
    pub scans: usize,
    /// Those whose every reading has the very bits of the host's scan.
    pub bit_identical_readings: usize,
    /// Those of which every output has the very bits that the host computes.
    pub bit_identical_estimates: usize,
    /// Samples that the device did not get.
    pub failed_samples: u32,
    /// Scans a second, decoding and both lines included.
    pub scans_per_s: f64,
}

impl ScanFindings {
    /// Whether all is as it must be.
    #[must_use]
    pub fn all_good(&self) -> bool {
        self.bit_identical_readings == self.scans
            && self.bit_identical_estimates == self.scans
            && self.failed_samples == 0
    }
}

/// `scene` with the parts of the images' readout where it says nothing of them.
///
/// # Errors
/// [`Error::Usage`] if it has other parts, or other wires.
pub fn with_parts_of_image(scene: &Scene) -> Result<Scene> {
    let of_scene = &scene.readout;
    let other = |field: &str, only: &str| {
        Err(Error::Usage(format!(
            "--scans: the image's readout has not what readout.{field} of scene {} says; set it to \
             {only:?}, or leave it out",
            scene.name
        )))
    };
    if of_scene.circuit.is_some_and(|circuit| circuit != Circuit::ZeroPotential) {
        return other("circuit", "zero-potential");
    }
    if of_scene.sampler.is_some_and(|sampler| sampler != Sampler::Mcp3208) {
        return other("sampler", "mcp3208");
    }
    if of_scene.row_drive.is_some_and(|drive| drive != Drive::ShiftRegister) {
        return other("row_drive", "shift-register");
    }
    let readout = Readout {
        circuit: Some(Circuit::ZeroPotential),
        sampler: Some(Sampler::Mcp3208),
        row_drive: Some(Drive::ShiftRegister),
        ..of_scene.clone()
    };
    let scene = Scene { readout, ..scene.clone() };
    VirtualBoard::new(&scene).map(|_| scene)
}

/// Lets `device` scan the test frames of `scene` on a virtual board that is served on `line`, and
/// compares with the same scanner on an equal board. `model` is in force when it is done.
///
/// # Errors
/// [`Error::Failed`] if the device stops answering, or the board refuses anything; [`Error::Usage`] if
/// scene, model and device do not fit together. What is merely wrong is in the findings.
pub fn check<W: Wire>(
    device: &mut Device<W>,
    scene: &Scene,
    model: &LoadedModel,
    line: TcpStream,
    scans: usize,
    progress: &Progress,
) -> Result<ScanFindings> {
    let scene = with_parts_of_image(scene)?;
    device.pause()?;
    let kernel = prepare(device, model, progress)?;

    let readings = readout::all_readings(&scene, scans);
    let board = VirtualBoard::new(&scene)?;
    let scanned = readout::scan(&board, series_of_image(), &readings)?;
    let expected = Expected::new(model, kernel, &readout::rows_read(&scene, &scanned));
    let scan = board.scan_settings();
    let configuration = Configuration {
        frame_period_us: PERIOD_US,
        scan,
        send_readings: true,
        send_estimates: true,
        ..Configuration::DEFAULT
    };
    let samples = ((ROWS + 1) * COLUMNS) as u32 * u32::from(scan.oversampling);
    let patience = Duration::from_secs(5) + samples * SAMPLE;
    // A request may have to wait for a scan.
    device.patience = device.patience.max(patience);

    let failed = |cause| Error::Failed(format!("the readout's line failed: {cause}"));
    let end = line.try_clone().map_err(failed)?;
    progress.stage("scanning on the device", scans);
    thread::scope(|scope| {
        let served = scope.spawn(|| serve(&scene, &readings, line));
        let go_on = || !served.is_finished();
        let counted =
            count_same(device, configuration, &expected, scans, patience, go_on, progress);
        let _ = end.shutdown(Shutdown::Both); // or the other end has
        // Why the board is not there any more tells more than that the device waits for it.
        served
            .join()
            .unwrap_or_else(|_| Err(Error::Failed("the virtual board panicked".into())))?;
        counted
    })
}

/// What the images correct for.
fn series_of_image() -> SeriesResistance {
    let typical = ZeroPotential::<1, 1>::TYPICAL;
    SeriesResistance {
        row_source_ohm: typical.row_source_ohm[0],
        column_ohm: typical.series_ohm[0],
    }
}

/// Serves a board with the first of `readings`, after each scan with the next, then with the last.
fn serve(scene: &Scene, readings: &Table, line: TcpStream) -> Result<()> {
    let board = VirtualBoard::new(scene)?;
    let mut frames = readings.lines();
    let mut show_next = || {
        if let Some(frame) = frames.next() {
            board.set_readings(frame);
        }
    };
    show_next();
    board.serve(line, show_next)
}

/// Scans under `configuration`, while it is worth it to `go_on`, and counts what is as expected.
fn count_same<W: Wire>(
    device: &mut Device<W>,
    configuration: Configuration,
    expected: &Expected,
    scans: usize,
    patience: Duration,
    go_on: impl Fn() -> bool,
    progress: &Progress,
) -> Result<ScanFindings> {
    let before = device.statistics()?;
    let mut findings = ScanFindings {
        scans,
        bit_identical_readings: 0,
        bit_identical_estimates: 0,
        failed_samples: 0,
        scans_per_s: 0.0,
    };
    let index = |frame: u32| frame.wrapping_sub(before.frames_scanned + 1);
    device.configure(configuration)?;
    let start = Instant::now();
    let (mut ended, mut deadline) = (0, start + patience);
    while ended < scans {
        let glance = Instant::now() + Duration::from_millis(100);
        let heard = device.hear(glance.min(deadline), |_, report| match report {
            Report::Readings { frame, readings_ohm } => {
                let same = expected.was_read(index(*frame), readings_ohm.iter());
                findings.bit_identical_readings += usize::from(same);
                None
            }
            Report::Estimate(estimate) => {
                let index = index(estimate.frame);
                let same = expected.is_same(index, estimate.outputs.iter());
                findings.bit_identical_estimates += usize::from(same);
                Some(index as usize + 1)
            }
            _ => None,
        })?;
        if let Some(now_ended) = heard {
            (ended, deadline) = (now_ended, Instant::now() + patience);
            progress.step();
        } else if Instant::now() >= deadline || !go_on() {
            return Err(Error::Failed(format!("only {ended} of {scans} scans were reported")));
        }
    }
    findings.scans_per_s = scans as f64 / start.elapsed().as_secs_f64();
    // It may have begun another scan, and answers after that.
    device.pause()?;
    findings.failed_samples = device.statistics()?.failed_samples - before.failed_samples;
    Ok(findings)
}
