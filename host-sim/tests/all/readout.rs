//! The firmware's readout on the virtual board: how far a reading is off. docs/board.md derives the equations.

use taxel_core::ColumnWires;
use taxel_core::health::Limits;
use taxel_data::Table;
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::Configuration;
use taxel_firmware::readout::{Selection, WaitingSource};
use taxel_learn::faults::diagnose;
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

#[test]
fn a_short_is_named_and_no_reading_beside_it_is_believed() {
    let world = World::press();
    let line = all_readings(&world, 1).values;
    let names: Vec<String> =
        (1..=8).flat_map(|m| (1..=18).map(move |k| format!("r{m}c{k}_ohm"))).collect();
    let board = VirtualBoard::new(Series { row_switch: 0.26, lead: 0.0 });
    for (cell, short_ohm) in
        (0..10).flat_map(|cell| [0.0, 0.5, 5.0, 20.0, 33.0].map(|ohm| (cell * 15 + 2, ohm)))
    {
        let mut resistances = line.to_vec();
        resistances[cell] = f64::max(short_ohm, 1e-3);
        board.set_readings(&resistances);
        let mut frame = vec![0.0; 144];
        board.scanner().scan(Configuration::DEFAULT.scan, WIRES, &mut frame);
        let row = cell / 18;
        for (at, (ohm, truth)) in frame.iter().zip(&resistances).enumerate() {
            let is_right = match at {
                _ if at == cell => *ohm == 0.0,
                _ if at / 18 == row => ohm.is_nan(),
                _ => (f64::from(*ohm) / truth - 1.0).abs() < 2e-3,
            };
            assert!(is_right, "{short_ohm} Ω at {cell}: {ohm} for {truth} at {at}");
        }
        let values = frame.iter().map(|ohm| f64::from(*ohm)).collect::<Vec<_>>().repeat(5).into();
        let faults = diagnose(&Table { names: names.clone(), values }, Limits::USUAL, None);
        let faults: Vec<String> = faults.iter().map(|found| found.fault.to_string()).collect();
        let (row, column) = (row + 1, cell % 18 + 1);
        let short = format!("r{row}c{column} shorted (or too small)");
        assert_eq!(faults, [format!("row-wire {row} unknown beside a short"), short]);
    }
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
fn resistances_of_switches_and_leads_are_removed_from_readings() {
    let series = Series { row_switch: 0.26, lead: 0.1 };
    let pairs = scanned(series, WIRES, 40);
    assert!(rms(&pairs) < 4e-4, "{}", rms(&pairs));
    // Three columns of all, whose others load the rows too.
    let three = Selection { columns: ColumnWires(1 << 2 | 1 << 8 | 1 << 14), ..WIRES };
    let pairs = scanned(Series { row_switch: 0.26, lead: 0.0 }, three, 200);
    assert!(rms(&pairs) < 3e-4, "{}", rms(&pairs));
}
