//! Check of scans: a device that scans a virtual board must read and decode like the host.

use std::net::{Shutdown, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use firmware::circuit::ZeroPotential;
use firmware::link::message::{ConfidenceSent, Configuration, Report};
use serde::Serialize;
use taxel_data::progress::Progress;
use taxel_data::table::Table;
use taxel_learn::ModelBlob;
use taxel_simulate::World;
use taxel_simulate::readout::{Circuit, Drive, Readout, Sampler};
use taxel_simulate::virtual_board::{self, SeriesResistance, VirtualBoard, all_readings};

use super::expected::{Expected, prepare};
use super::{Device, Wire};
use crate::error::{Error, Result};

/// Time from one scan to the next, if the readout's line were fast enough; it is slower.
const PERIOD_US: u32 = 1000;
/// Longest time that the line may take for a sample, even on a slow computer.
const SAMPLE: Duration = Duration::from_millis(5);

/// Findings about scans.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanFindings {
    /// Number of scans asked for.
    pub scans: usize,
    /// Number of scans in which every reading has the same bits as the host's scan.
    pub bit_identical_readings: usize,
    /// Number of scans in which every output has the bits that the host computes, and so have novelty and deviations.
    pub bit_identical_estimates: usize,
    /// Number of samples that the device did not get.
    pub failed_samples: u32,
    /// Scans a second, decoding and both lines included.
    pub scans_per_s: f64,
}

impl ScanFindings {
    /// Whether every scan was as expected and no sample failed.
    pub fn all_good(&self) -> bool {
        self.bit_identical_readings == self.scans
            && self.bit_identical_estimates == self.scans
            && self.failed_samples == 0
    }
}

/// World with the parts of the images' readout wherever `world` does not set them.
pub fn with_parts_of_image(world: &World) -> Result<World> {
    let wanted = &world.readout;
    if wanted.circuit.is_some_and(|circuit| circuit != Circuit::ZeroPotential) {
        return Err(Error::OtherReadout { field: "circuit", only: "zero-potential" });
    }
    if wanted.sampler.is_some_and(|sampler| sampler != Sampler::Mcp3208) {
        return Err(Error::OtherReadout { field: "sampler", only: "mcp3208" });
    }
    if wanted.row_drive.is_some_and(|drive| drive != Drive::ShiftRegister) {
        return Err(Error::OtherReadout { field: "row_drive", only: "shift-register" });
    }
    let readout = Readout {
        circuit: Some(Circuit::ZeroPotential),
        sampler: Some(Sampler::Mcp3208),
        row_drive: Some(Drive::ShiftRegister),
        ..wanted.clone()
    };
    let world = World { readout, ..world.clone() };
    VirtualBoard::new(&world)?;
    Ok(world)
}

/// Lets `device` scan the test frames of `world` on a virtual board that is served on `line`.
///
/// The results are compared with those of the same scanner on an equal board. The model of `blob` is
/// active afterwards, with the baseline `baseline_ohm` if it needs one.
///
/// # Errors
/// [`Error`] if the device stops answering, the board refuses a request, or world, model and device do
/// not fit together. Wrong results are no error: they are in the findings.
pub fn check<W: Wire>(
    device: &mut Device<W>,
    world: &World,
    blob: &ModelBlob,
    baseline_ohm: Option<&[f64]>,
    line: TcpStream,
    scans: usize,
    progress: &dyn Progress,
) -> Result<ScanFindings> {
    let world = with_parts_of_image(world)?;
    device.pause()?;
    let exponential = prepare(device, blob, progress)?;

    let readings = all_readings(&world, scans);
    let board = VirtualBoard::new(&world)?;
    let scanned = virtual_board::scan(&board, series_of_image(), &readings)?;
    let expected = Expected::new(blob, exponential, &scanned, baseline_ohm);
    expected.set_baseline(device)?;
    let scan = board.scan_settings();
    let configuration = Configuration {
        frame_period_us: PERIOD_US,
        scan,
        send_readings: true,
        send_estimates: true,
        confidence: ConfidenceSent::Deviations,
        ..Configuration::DEFAULT
    };
    let wires = board.wires();
    let readings_a_scan = (wires.rows.len() + 1) * wires.columns;
    let samples = readings_a_scan as u32 * u32::from(scan.oversampling);
    let patience = device.patience.max(Duration::from_secs(5) + samples * SAMPLE);
    // A request may have to wait for a scan.
    device.patience = patience;

    let end = line.try_clone()?;
    progress.stage("scanning on the device", scans);
    thread::scope(|scope| {
        let served = scope.spawn(|| serve(&world, &readings, line));
        let go_on = || !served.is_finished();
        let counted =
            count_same(device, configuration, &expected, scans, patience, go_on, progress);
        let _ = end.shutdown(Shutdown::Both); // unless the other end has shut it down
        // The reason why the board ended tells more than the device's silence.
        served
            .join()
            .unwrap_or_else(|_| Err(Error::Silent("the virtual board panicked".into())))?;
        counted
    })
}

/// Series resistances for which the images correct.
fn series_of_image() -> SeriesResistance {
    let typical = ZeroPotential::<1, 1>::TYPICAL;
    SeriesResistance {
        row_source_ohm: typical.row_source_ohm[0],
        column_ohm: typical.series_ohm[0],
    }
}

/// Serves a board with the first of `readings`, after each scan with the next, and finally with the
/// last.
fn serve(world: &World, readings: &Table, line: TcpStream) -> Result<()> {
    let board = VirtualBoard::new(world)?;
    let mut frames = readings.lines();
    let mut show_next = || {
        if let Some(frame) = frames.next() {
            board.set_readings(frame);
        }
    };
    show_next();
    Ok(board.serve(line, show_next)?)
}

/// Lets the device scan under `configuration` as long as `go_on` wants, and counts the scans that are as
/// expected.
fn count_same<W: Wire>(
    device: &mut Device<W>,
    configuration: Configuration,
    expected: &Expected,
    scans: usize,
    patience: Duration,
    go_on: impl Fn() -> bool,
    progress: &dyn Progress,
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
            Report::Readings { frame, readings_ohm, .. } => {
                let same = expected.was_read(index(*frame), readings_ohm.iter());
                findings.bit_identical_readings += usize::from(same);
                None
            }
            Report::Estimate(estimate) => {
                let index = index(estimate.frame);
                let same = expected.is_same(index, estimate);
                findings.bit_identical_estimates += usize::from(same);
                Some(index as usize + 1)
            }
            _ => None,
        })?;
        if let Some(now_ended) = heard {
            (ended, deadline) = (now_ended, Instant::now() + patience);
            progress.step();
        } else if Instant::now() >= deadline || !go_on() {
            let message = format!("only {ended} of {scans} scans were reported");
            return Err(Error::Silent(message));
        }
    }
    findings.scans_per_s = scans as f64 / start.elapsed().as_secs_f64();
    // The device may have begun another scan, and answers after it.
    device.pause()?;
    findings.failed_samples = device.statistics()?.failed_samples - before.failed_samples;
    Ok(findings)
}
