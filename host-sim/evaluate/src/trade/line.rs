//! Serial line of the board, which carries fewer estimates than a device may compute.

use taxel_core::blob::Floats;
use taxel_firmware::link::message::{EstimateReport, Report};
use taxel_firmware::link::{cobs, packet};
use taxel_firmware::timing::NUCLEO_BAUD;

/// Line of the board, and the estimates that it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    pub baud: u32,
    /// Length of an estimate on the line, without a confidence.
    pub estimate_bytes: usize,
    /// Number of estimates that it carries in a second, at most.
    pub estimates_per_s: f64,
}

impl Line {
    /// Line that carries estimates of so many outputs, in so many rows.
    pub fn new(rows: usize, outputs: usize) -> Self {
        let estimate_bytes = estimate_bytes(rows, outputs);
        // A byte takes ten bits.
        let estimates_per_s = f64::from(NUCLEO_BAUD) / (10 * estimate_bytes) as f64;
        Self { baud: NUCLEO_BAUD, estimate_bytes, estimates_per_s }
    }
}

/// Length of the frame of an estimate, an hour after the start.
fn estimate_bytes(rows: usize, outputs: usize) -> usize {
    let (row_status, outputs) = (vec![0; rows], vec![0.1_f32; outputs]);
    let report = Report::Estimate(EstimateReport {
        frame: 360_000,
        start_us: 3_600_000_000,
        flags: 0,
        row_status: &row_status,
        outputs: Floats::new(&outputs),
        novelty: None,
        deviation: Floats::new(&[]),
    });
    let mut buffer = vec![0; 100 + rows + 4 * outputs.len()];
    let message = packet::encode(packet::UNASKED, &report, &mut buffer).unwrap_or_default();
    let mut bytes = 0;
    cobs::encode(message, |piece| {
        bytes += piece.len();
        true
    });
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_carries_fewer_estimates_the_more_outputs_they_have() {
        // docs/link.md: 18 outputs of 4 bytes in each of 8 rows, the rows' status, and some 20 bytes around them.
        let paper = Line::new(8, 144);
        assert!((600..=610).contains(&paper.estimate_bytes), "{paper:?}");
        assert!((151.0..154.0).contains(&paper.estimates_per_s), "{paper:?}");
        let z_alone = Line::new(8, 48);
        assert!((384..=388).contains(&(paper.estimate_bytes - z_alone.estimate_bytes)));
        assert!(z_alone.estimates_per_s > 400.0, "{z_alone:?}");
    }
}
