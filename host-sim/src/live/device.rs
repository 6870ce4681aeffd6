//! Frames of a sensor on a serial line: a Taxel device, or one that prints numbers.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use serde::Serialize;
use taxel_core::health::Limits;
use taxel_firmware::link::message::{ConfidenceSent, Configuration};
use taxel_learn::ModelBlob;
use taxel_recording::Layout;
use taxel_rig::device::{Device, DeviceIdentity, serial};
use taxel_rig::scans::{DeviceScans, Listener, MarkedBytes, NumberLines, Scan, Sent, Source};
use taxel_view::message::{Can, Kind};

use super::decode::FrameByFrame;
use super::feed::{About, Feed, Next};
use super::moment::Moment;
use super::sheet;
use crate::{Error, Result};

/// Scans that wait while a recording is written to a slow disk.
const BUFFER: usize = 4096;
/// Time without a scan after which something is wrong.
const SILENCE: Duration = Duration::from_secs(2);
/// Time from one attempt to open the port to the next.
const RETRY: Duration = Duration::from_secs(1);

/// How a sensor on a serial line tells its readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
pub enum Protocol {
    /// Taxel's link (docs/link.md).
    Taxel,
    /// FlexiTac's firmware: 0xAA 0x55, then one byte per reading.
    Flexitac,
    /// A line of numbers for each scan, separated by commas, semicolons, tabs or blanks.
    Csv,
}

/// A line, and what is known of the sensor on it.
#[derive(Debug, Clone)]
pub struct Line {
    pub port: String,
    pub baud: u32,
    pub protocol: Protocol,
    /// Rows and columns, for a sensor that does not tell them.
    pub shape: Option<[usize; 2]>,
    /// Time from one scan of a Taxel device to the next; by default its own.
    pub period_us: Option<u32>,
}

/// What opening told of a Taxel device: its identity, whether it decodes, and limits of its readings.
type Opened = Option<(DeviceIdentity, bool, Limits)>;

/// Frames of a sensor on a serial line. After a loss of the line it is opened again.
pub struct DeviceFeed<'b> {
    line: Line,
    blob: Option<&'b ModelBlob>,
    /// Decoder of what the device does not decode.
    decoder: Option<FrameByFrame<'b>>,
    layout: Layout,
    limits: Limits,
    source: String,
    listener: Option<Listener>,
    /// Time of the last scan, or of the last attempt to open the port.
    last: Instant,
    /// Scan that waits until the new layout is known to who asks.
    waiting: Option<Scan>,
    lost_before: u64,
    /// Readings of the untouched sensor, for a decoder that divides by them.
    baseline: Option<Vec<f32>>,
}

impl<'b> DeviceFeed<'b> {
    /// Opens the line. What the device does not decode is decoded by the model in `blob`.
    ///
    /// # Errors
    /// If the port cannot be opened, or a Taxel device does not answer.
    pub fn open(line: Line, blob: Option<&'b ModelBlob>) -> Result<Self> {
        let layout = sheet::layout("", vec![], vec![], None);
        let (decoder, source, last) = (None, line.port.clone(), Instant::now());
        let (listener, waiting, lost_before, baseline) = (None, None, 0, None);
        let mut feed = Self {
            line,
            blob,
            decoder,
            layout,
            limits: Limits::USUAL,
            source,
            listener,
            last,
            waiting,
            lost_before,
            baseline,
        };
        feed.connect()?;
        Ok(feed)
    }

    /// Opens the port and learns the layout. Returns whether that has changed.
    fn connect(&mut self) -> Result<bool> {
        let (line, inputs) = (self.line.clone(), self.blob.map(inputs_of));
        // A model is compared by what the device tells of it.
        let blob = self.blob.map(|blob| blob.bytes().to_vec());
        let open = move |stop: &Arc<AtomicBool>| open(&line, inputs, blob, stop);
        let (listener, opened) = Listener::start(BUFFER, open)?;
        let opened =
            opened.recv().map_err(|_| Error::failed("an error in the program: no listener"))??;
        let (layout, device_decodes) = match (&opened, self.blob) {
            (_, Some(blob)) => {
                let decodes = opened.as_ref().is_some_and(|(_, decodes, _)| *decodes);
                (sheet::of_model(blob.parse().metadata(), None), decodes)
            }
            (Some((identity, decodes, _)), None) => (sheet::of_device(identity), *decodes),
            // A line tells its count by its first scans; it is likely that of before.
            (None, None) if !self.layout.readings.is_empty() => (self.layout.clone(), false),
            (None, None) => (self.shaped(self.line.shape.map_or(0, |[m, k]| m * k)), false),
        };
        self.source = match &opened {
            Some((identity, ..)) => {
                format!("{} at {}, firmware {}", identity.board, self.line.port, identity.firmware)
            }
            None => format!("{} at {} baud", self.line.port, self.line.baud),
        };
        self.limits = opened.map_or(Limits::USUAL, |(.., limits)| limits);
        self.decoder = match self.blob {
            Some(blob) if !device_decodes => Some(FrameByFrame::new(blob, self.limits)?),
            _ => None,
        };
        if let (Some(decoder), Some(baseline)) = (&mut self.decoder, &self.baseline) {
            decoder.set_baseline(baseline);
        }
        (self.listener, self.last) = (Some(listener), Instant::now());
        let has_changed = self.layout != layout;
        self.layout = layout;
        Ok(has_changed)
    }

    /// Layout of `count` readings of a sensor without names, in the rows and columns that were given.
    fn shaped(&self, count: usize) -> Layout {
        let unit = if self.line.protocol == Protocol::Flexitac { "counts" } else { "" };
        let [rows, width] = match self.line.shape {
            Some(shape) if shape[0] * shape[1] == count => shape,
            _ => [1, count],
        };
        let names = (1..=rows).flat_map(|m| (1..=width).map(move |k| format!("r{m}c{k}_reading")));
        let names: Vec<String> = names.collect();
        let columns = sheet::columns(names.iter().map(String::as_str), vec![unit; count]);
        sheet::layout("sensor", columns, vec![], None)
    }

    fn moment(&mut self, scan: Scan) -> Result<Next> {
        let mut moment = Moment::of_scan(scan, self.layout.readings.len());
        if let Some(decoder) = &mut self.decoder {
            decoder.decode(&mut moment)?;
        }
        // A model may have been exchanged.
        let outputs = moment.frame.outputs.as_ref().map_or(0, Vec::len);
        let fits = moment.frame.readings.len() == self.layout.readings.len()
            && (outputs == 0 || outputs == self.layout.outputs.len());
        if fits {
            return Ok(Next::Frame(Box::new(moment)));
        }
        self.drop_line();
        Ok(Next::Trouble(
            "frames have another shape: was the model replaced? The device is asked again".into(),
        ))
    }

    fn drop_line(&mut self) {
        if let Some(listener) = self.listener.take() {
            self.lost_before += listener.lost();
        }
        self.last = Instant::now();
    }
}

/// Number of inputs of the model in `blob`.
fn inputs_of(blob: &ModelBlob) -> usize {
    blob.parse().metadata().input_names.iter().count()
}

/// Opens the port, and tells what the device says of itself.
fn open(
    line: &Line,
    inputs: Option<usize>,
    blob: Option<Vec<u8>>,
    stop: &Arc<AtomicBool>,
) -> taxel_rig::Result<(Box<dyn Source>, Opened)> {
    let wire = serial::open(&line.port, line.baud)?;
    let count = inputs.or(line.shape.map(|[rows, columns]| rows * columns));
    match line.protocol {
        Protocol::Csv => return Ok((Box::new(NumberLines::new(wire, count.unwrap_or(0))?), None)),
        Protocol::Flexitac => {
            return Ok((Box::new(MarkedBytes::new(wire, count.unwrap_or(0))?), None));
        }
        Protocol::Taxel => {}
    }
    let mut device = Device::new(wire)?;
    device.stop = Some(Arc::clone(stop));
    let identity = device.identify()?;
    let is_other = match blob {
        Some(bytes) => {
            let checked = ModelBlob::of_bytes(&bytes);
            let blob = checked.map_err(|cause| taxel_data::Error::failed(cause.to_string()))?;
            !identity.is_made_of(&blob.parse())
        }
        None => false,
    };
    let decodes = identity.model.is_some() && !is_other;
    let own = device.resume_to_scan()?;
    let configuration = Configuration {
        frame_period_us: line.period_us.unwrap_or(own.frame_period_us),
        confidence: ConfidenceSent::Deviations,
        ..own
    };
    let sent = Sent { readings: true, estimates: decodes };
    let (scans, identity) = DeviceScans::new(device, configuration, Some(sent))?;
    Ok((Box::new(scans), Some((identity, decodes, configuration.limits()))))
}

impl Feed for DeviceFeed<'_> {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn about(&self) -> About {
        let can = Can { zero: true, record: true, seek: false };
        About { kind: Kind::Device, source: self.source.clone(), can, duration_s: None }
    }

    fn next(&mut self, within: Duration) -> Result<Next> {
        if let Some(scan) = self.waiting.take() {
            return self.moment(scan);
        }
        let Some(listener) = &self.listener else {
            if self.last.elapsed() < RETRY {
                std::thread::sleep(within);
                return Ok(Next::Nothing);
            }
            let outcome = self.connect();
            self.last = Instant::now();
            return Ok(match outcome {
                Ok(true) => Next::Anew,
                Ok(false) => Next::Nothing,
                Err(cause) => Next::Trouble(advice(&self.line, &cause.to_string())),
            });
        };
        match listener.next(within) {
            Ok(Some(scan)) => {
                self.last = scan.heard;
                // Lines of numbers tell their count themselves.
                let is_other = scan.readings.len() != self.layout.readings.len();
                if self.blob.is_none() && self.line.protocol == Protocol::Csv && is_other {
                    self.layout = self.shaped(scan.readings.len());
                    self.waiting = Some(scan);
                    return Ok(Next::Anew);
                }
                self.moment(scan)
            }
            Ok(None) if self.last.elapsed() > SILENCE => {
                let silence = self.last.elapsed().as_secs();
                Ok(Next::Trouble(match listener.refused() {
                    0 => format!(
                        "no data for {silence} s: is the cable plugged in, and does the device scan?"
                    ),
                    bytes => format!(
                        "no scan for {silence} s, although {bytes} bytes came: are --protocol, --baud and --shape right?"
                    ),
                }))
            }
            Ok(None) => Ok(Next::Nothing),
            Err(cause) => {
                self.drop_line();
                Ok(Next::Trouble(advice(&self.line, &cause.to_string())))
            }
        }
    }

    fn zero(&mut self, readings: &[f32]) -> std::result::Result<(), String> {
        if let Some(decoder) = &mut self.decoder {
            decoder.set_baseline(readings);
            self.baseline = Some(readings.to_vec());
        }
        let listener = self.listener.as_ref().ok_or("the device is not connected")?;
        listener.set_baseline(readings.to_vec()).map_err(|cause| cause.to_string())
    }

    fn note(&self) -> Option<String> {
        self.decoder.as_ref().and_then(FrameByFrame::note)
    }

    fn lost(&self) -> u64 {
        self.lost_before + self.listener.as_ref().map_or(0, Listener::lost)
    }
}

/// What happened to the line, and what helps.
fn advice(line: &Line, cause: &str) -> String {
    let help = if cause.contains("ermission denied") {
        "a line in /etc/udev/rules.d/50-taxel.rules gives you the port: SUBSYSTEM==\"tty\", MODE=\"0666\""
    } else {
        "is the cable plugged in, and the device powered? The port is tried again every second"
    };
    format!("no data from {}: {cause}; {help}", line.port)
}
