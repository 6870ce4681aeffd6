//! The firmware's readout on the virtual board: how far a reading is off. docs/readout.md derives the equations.

use taxel_core::ColumnWires;
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::Configuration;
use taxel_firmware::readout::{FrameSource, Selection};
use taxel_simulate::World;

use crate::virtual_board::{Series, VirtualBoard, WIRES, all_readings};

/// Counts of the converter at its reference voltage.
const COUNTS: f64 = 4096.0;
/// Bound γ₈ on the relative error of a product of eight operations rounded to f32.
const GAMMA_8: f64 = 4.0 * f32::EPSILON as f64;

/// Scans the `wires` of a board with these series resistances, for each of so many frames of a press: readings and
/// resistances in Ω.
fn scanned(series: Series, wires: Selection<'_>, frames: usize) -> Vec<(f64, f64)> {
    let board = VirtualBoard::new(series);
    let mut scanner = board.scanner();
    let mut pairs = Vec::new();
    for line in all_readings(&World::press(), frames).lines() {
        board.set_readings(line);
        let mut frame = vec![f32::NAN; wires.rows.len() * wires.columns.count()];
        scanner.scan(Configuration::DEFAULT.scan, wires, &mut frame);
        let truth = line.chunks(18).flat_map(|row| wires.columns.pick(row).copied());
        pairs.extend(frame.iter().map(|ohm| f64::from(*ohm)).zip(truth));
    }
    pairs
}

/// Root mean square of the relative errors.
fn rms(pairs: &[(f64, f64)]) -> f64 {
    let squares = pairs.iter().map(|(ohm, truth)| (ohm / truth - 1.0).powi(2));
    (squares.sum::<f64>() / pairs.len() as f64).sqrt()
}

/// Largest |scanned − `ohm`| in Ω for a converter of 12 bits behind typical parts. Each sample is off by half a count.
fn bound_ohm(ohm: f64) -> f64 {
    let typical = ZeroPotential::<1, 1>::TYPICAL;
    let drive = f64::from(typical.drive_v) / f64::from(typical.reference_v) * COUNTS;
    // The sample and the idle sample are both off.
    let bound = ohm / (drive * f64::from(typical.feedback_ohm[0]) / ohm - 1.0);
    bound + GAMMA_8 * (ohm + bound)
}

#[test]
fn every_reading_stays_within_the_bound_of_quantisation() {
    assert!((bound_ohm(55.0) / 0.022 - 1.0).abs() < 0.02);
    let shares = scanned(Series::NONE, WIRES, 40)
        .into_iter()
        .map(|(scanned, ohm)| (scanned - ohm).abs() / bound_ohm(ohm));
    // The bound is not far off. (The idle sample is the same in all frames, a quarter of a count off: together with
    // half a count of the sample, three quarters of the bound.)
    let largest = shares.fold(0.0, f64::max);
    assert!((0.7..=1.0).contains(&largest), "{largest}");
}

#[test]
fn switches_and_leads_are_taken_out_of_readings_while_the_sensor_is_pressed() {
    let series = Series { row_switch: 0.26, lead: 0.1 };
    let pairs = scanned(series, WIRES, 40);
    assert!(rms(&pairs) < 4e-4, "{}", rms(&pairs));
    // Three columns of all, whose others load the rows too.
    let three = Selection { columns: ColumnWires(1 << 2 | 1 << 8 | 1 << 14), ..WIRES };
    let pairs = scanned(Series { row_switch: 0.26, lead: 0.0 }, three, 200);
    assert!(rms(&pairs) < 3e-4, "{}", rms(&pairs));
}
