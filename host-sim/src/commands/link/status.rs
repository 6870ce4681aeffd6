//! `identify`: what a device is and does.

use crate::Result;
use serde::Serialize;
use taxel_firmware::link::message::{Configuration, Statistics};
use taxel_rig::device::{Device, DeviceIdentity};

use super::super::check_arguments::memory_lines;
use super::super::{Common, print};

#[derive(Serialize)]
struct Status {
    device: DeviceIdentity,
    configuration: Configuration,
    statistics: Statistics,
}

pub fn show(device: &mut Device, common: &Common) -> Result<()> {
    let status = Status {
        device: device.identify()?,
        configuration: device.configuration()?,
        statistics: device.statistics()?,
    };
    if common.json {
        return print::json(&status);
    }
    let (d, s) = (&status.device, &status.statistics);
    let mut page = print::Page::default();
    page.line(format_args!("{:<17} {}, firmware {}", "device", d.board, d.firmware));
    page.line(format_args!(
        "{:<17} {} rows, {} columns, {} outputs a row",
        "room for", d.rows, d.columns, d.outputs
    ));
    if let Some(m) = &d.model {
        page.line(format_args!(
            "{:<17} {:?}, CRC-32 {:08x}, slot {}, generation {}, weights in {}",
            "model",
            d.model_name,
            m.crc_32,
            m.slot,
            m.generation,
            if m.in_ram { "RAM" } else { "flash" }
        ));
        page.line(format_args!(
            "{:<17} {} × {} readings to {} × {} outputs",
            "shape", m.rows, m.inputs, m.rows, m.outputs
        ));
        if m.on_trial {
            page.line(format_args!(
                "{:<17} until `confirm`; a restart or `undo` returns to the previous model",
                "on trial"
            ));
        }
    } else {
        page.line(format_args!("{:<17} none: upload one", "model"));
    }
    let scanning = match status.configuration.frame_period_us {
        0 => "paused: the configuration has no frame period".into(),
        us => format!("a frame every {} ms", f64::from(us) / 1e3),
    };
    page.line(format_args!("{:<17} {scanning}", "scanning"));
    page.line(format_args!(
        "{:<17} {} scanned, {} decoded, {} missed, {} samples failed",
        "frames", s.frames_scanned, s.frames_decoded, s.frames_missed, s.failed_samples
    ));
    page.line(format_args!(
        "{:<17} scan {} µs, decoding {} µs",
        "longest", s.longest_scan_us, s.longest_decode_us
    ));
    if s.longest_latency_us > 0 {
        page.line(format_args!(
            "{:<17} {} µs at most from the start of a scan until the line took its estimate",
            "latency", s.longest_latency_us
        ));
    }
    if s.longest_decode_cycles > 0 {
        page.line(format_args!(
            "{:<17} decoding {} to {} of the processor",
            "cycles", s.shortest_decode_cycles, s.longest_decode_cycles
        ));
    }
    if s.frames_clamped > 0 {
        page.line(format_args!(
            "{:<17} {} frames had readings far beyond the model's training range",
            "clamped", s.frames_clamped
        ));
    }
    if s.longest_confidence_us > 0 {
        page.line(format_args!(
            "{:<17} {} novel frames; computed in {} µs at most",
            "confidence", s.frames_novel, s.longest_confidence_us
        ));
    }
    page.line(format_args!(
        "{:<17} {} requests, {} bad packets, {} lost reports, {} bad loops",
        "link", s.requests, s.bad_packets, s.lost_reports, s.bad_loops
    ));
    page.line(format_args!("{:<17} {} since the start", "slots erased", s.slot_erases));
    memory_lines(&mut page, &d.memory);
    page.print()
}
