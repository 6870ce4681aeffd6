//! The firmware's readout on the virtual board: a bound on what quantisation alone adds to a reading. docs/readout.md
//! derives it, for readings without noise, cross-talk and series resistance.

use taxel_data::Table;
use taxel_firmware::circuit::{Divider, ZeroPotential};
use taxel_simulate::World;
use taxel_simulate::readout::{Circuit, Readout};
use taxel_virtual_board::{SeriesResistance, VirtualBoard, all_readings};

/// Counts of the converter at its reference voltage.
const COUNTS: f64 = 4096.0;
/// Bound γ₈ on the relative error of a product of eight operations rounded to f32.
const GAMMA_8: f64 = 4.0 * f32::EPSILON as f64;

/// Largest |scanned − `ohm`| in Ω for a converter of 12 bits behind `circuit` with its typical parts. Each sample is off by
/// half a count.
fn bound_ohm(circuit: Circuit, ohm: f64) -> f64 {
    let bound = match circuit {
        Circuit::Divider => {
            let reference_ohm = f64::from(Divider::<1, 1>::TYPICAL.reference_ohm[0]);
            let counts = COUNTS * reference_ohm / (reference_ohm + ohm);
            (reference_ohm + ohm) * 0.5 / (counts - 0.5)
        }
        Circuit::ZeroPotential => {
            let typical = ZeroPotential::<1, 1>::TYPICAL;
            let drive = f64::from(typical.drive_v) / f64::from(typical.reference_v) * COUNTS;
            // The sample and the idle sample are both off.
            ohm / (drive * f64::from(typical.feedback_ohm[0]) / ohm - 1.0)
        }
    };
    bound + GAMMA_8 * (ohm + bound)
}

/// Scans `readings` through `circuit` by a converter of so many bits, with no other fault.
fn scanned(circuit: Circuit, bits: u8, readings: &Table) -> Table {
    let readout = Readout { circuit: Some(circuit), adc_bits: Some(bits), ..Readout::default() };
    let board = VirtualBoard::with_readout(&World::press(), &readout).unwrap();
    taxel_virtual_board::scan(&board, SeriesResistance::NONE, readings).unwrap()
}

#[test]
fn every_reading_stays_within_the_bound_of_quantisation_and_coarser_converters_do_not() {
    let ideal = all_readings(&World::press(), 40);
    for (circuit, at_55_ohm) in [(Circuit::Divider, 0.072), (Circuit::ZeroPotential, 0.022)] {
        assert!((bound_ohm(circuit, 55.0) / at_55_ohm - 1.0).abs() < 0.02);
        let [fine, coarse] = [12, 10].map(|bits| -> Vec<f64> {
            let scanned = scanned(circuit, bits, &ideal);
            let pairs = scanned.values.iter().zip(&ideal.values);
            pairs.map(|(scanned, ohm)| (scanned - ohm).abs() / bound_ohm(circuit, *ohm)).collect()
        });
        // The bound is not far off. (The idle sample is the same in all frames, a quarter of a count off: together with
        // half a count of the sample, three quarters of the bound.)
        let largest = fine.iter().fold(0.0_f64, |a, b| a.max(*b));
        assert!((0.7..=1.0).contains(&largest), "{}: {largest}", circuit.name());
        let beyond = coarse.iter().filter(|share| **share > 1.0).count();
        assert!(beyond > 40 * 144 / 3, "{beyond}");
    }
}
