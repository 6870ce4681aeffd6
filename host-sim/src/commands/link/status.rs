//! `identify`: what a device is and does.

use crate::Result;
use crate::report::Sections;
use taxel_rig::device::Device;

use super::super::{Common, device_lines, print};

pub fn show(device: &mut Device, common: &Common) -> Result<print::Outcome> {
    let (d, configuration, s) = (device.identify()?, device.configuration()?, device.statistics()?);
    let mut result = Sections::new(format!("Device {}, firmware {}", d.board, d.firmware));
    device_lines::value(&mut result, &d);
    result.value("configuration", &configuration);
    result.value("statistics", &s);
    result.line(
        "room for",
        format!("{} rows, {} columns, {} outputs a row", d.rows, d.columns, d.outputs),
    );
    if let Some(m) = &d.model {
        result.line(
            "model",
            format!(
                "{:?}, CRC-32 {:08x}, slot {}, generation {}, weights in {}",
                d.model_name,
                m.crc_32,
                m.slot,
                m.generation,
                if m.in_ram { "RAM" } else { "flash" }
            ),
        );
        result.line(
            "shape",
            format!("{} × {} readings to {} × {} outputs", m.rows, m.inputs, m.rows, m.outputs),
        );
        if m.on_trial {
            result.line(
                "on trial",
                "until `confirm`; a restart or `undo` returns to the previous model",
            );
        }
    } else {
        result.line("model", "none: upload one");
    }
    let scanning = match configuration.frame_period_us {
        0 => "paused: the configuration has no frame period".into(),
        us => format!("a frame every {} ms", f64::from(us) / 1e3),
    };
    result.line("scanning", scanning);
    result.line(
        "frames",
        format!(
            "{} scanned, {} decoded, {} missed, {} samples failed",
            s.frames_scanned, s.frames_decoded, s.frames_missed, s.failed_samples
        ),
    );
    result.line(
        "longest",
        format!("scan {} µs, decoding {} µs", s.longest_scan_us, s.longest_decode_us),
    );
    if s.longest_latency_us > 0 {
        result.line(
            "latency",
            format!(
                "{} µs at most from the start of a scan until its estimate was sent",
                s.longest_latency_us
            ),
        );
    }
    if s.longest_decode_cycles > 0 {
        result.line(
            "cycles",
            format!(
                "decoding {} to {} of the processor",
                s.shortest_decode_cycles, s.longest_decode_cycles
            ),
        );
    }
    if s.frames_clamped > 0 {
        result.line(
            "clamped",
            format!(
                "{} frames had readings far beyond the model's training range",
                s.frames_clamped
            ),
        );
    }
    if s.longest_confidence_us > 0 {
        result.line(
            "confidence",
            format!(
                "{} novel frames; computed in {} µs at most",
                s.frames_novel, s.longest_confidence_us
            ),
        );
    }
    result.line(
        "link",
        format!(
            "{} requests, {} bad packets, {} lost reports, {} bad loops",
            s.requests, s.bad_packets, s.lost_reports, s.bad_loops
        ),
    );
    result.line("slots erased", format!("{} since the start", s.slot_erases));
    device_lines::memory(&mut result, &d.memory);
    Ok(print::sections(common, &result))
}
