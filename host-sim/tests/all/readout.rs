//! The firmware's readout on the virtual board: the errors that it adds, and the difference between
//! circuits.

use crate::common::unrefined;
use crate::quantisation::{output_bounds, reading_bound_ohm};
use host_sim::experiment::Experiment;
use model_core::rbf::Format;
use taxel_data::progress::Silent;
use taxel_data::table::Table;
use taxel_learn::{Exponential, ModelBlob};
use taxel_simulate::World;
use taxel_simulate::readout::{Circuit, Readout};
use taxel_simulate::virtual_board::{self, SeriesResistance, VirtualBoard, all_readings};

const FRAMES: usize = 40;

/// Scene and model of `run press`, with direct distances, for which the bound is derived.
fn press() -> (Experiment, ModelBlob) {
    let mut scene = unrefined("press");
    scene.training.format = Format::F32Direct;
    let model = scene.train(&Silent).unwrap();
    (scene, model)
}

/// Scans `readings` through `circuit` by a converter of so many bits, with no other fault.
fn scanned(world: &World, circuit: Circuit, bits: u8, readings: &Table) -> Table {
    let readout = Readout { circuit: Some(circuit), adc_bits: Some(bits), ..Readout::default() };
    let board = VirtualBoard::with_readout(world, &readout).unwrap();
    virtual_board::scan(&board, SeriesResistance::NONE, readings).unwrap()
}

/// Ratios of |a − b| to `bound`, pair by pair.
fn shares(a: &Table, b: &Table, bound: &Table) -> Vec<f64> {
    let pairs = a.values.iter().zip(&b.values).zip(&bound.values);
    pairs.map(|((a, b), bound)| (a - b).abs() / bound).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a, b| a.max(*b))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn every_output_stays_within_the_bound_of_quantisation_and_coarser_converters_do_not() {
    let (scene, blob) = press();
    let model = blob.prepare(Exponential::default());
    let ideal = all_readings(&scene.world, FRAMES);
    let decode = |readings: &Table| model.decode_table(readings);
    // Measured: 0.034 and 0.0055 mm on average.
    for (circuit, most_mm) in [(Circuit::Divider, 0.05), (Circuit::ZeroPotential, 0.01)] {
        let bound_ohm = ideal.values.iter().map(|ohm| reading_bound_ohm(circuit, *ohm, 12));
        let bound_ohm = Table { names: ideal.names.clone(), values: bound_ohm.collect() };
        let bound = output_bounds(model.model(), circuit, 12, &ideal);
        let truth = decode(&ideal);
        let [fine, ten, nine] =
            [12, 10, 9].map(|bits| scanned(&scene.world, circuit, bits, &ideal));

        let of_readings = shares(&fine, &ideal, &bound_ohm);
        let of_outputs = shares(&decode(&fine), &truth, &bound);
        println!(
            "{}: bound {:.4} mm (mean), {:.4} mm (largest); readings reach {:.3} of theirs, outputs \
             {:.3}, on average {:.4}",
            circuit.name(),
            mean(&bound.values),
            largest(&bound.values),
            largest(&of_readings),
            largest(&of_outputs),
            mean(&of_outputs),
        );
        assert_eq!(of_outputs.len(), FRAMES * 144);
        assert!(largest(&of_readings) <= 1.0 && largest(&of_outputs) <= 1.0);
        // The bound is not far off. (The idle sample is the same in all frames, a quarter of a count
        // off: together with half a count of the sample, three quarters of the bound.)
        assert!(largest(&of_readings) > 0.7, "{}", largest(&of_readings));
        assert!(mean(&of_outputs) > 1e-3, "{}", mean(&of_outputs));
        assert!(mean(&bound.values) < most_mm, "{} mm", mean(&bound.values));

        // Two bits fewer exceed the bound of readings; three bits fewer exceed that of many outputs.
        let beyond = |shares: &[f64]| shares.iter().filter(|share| **share > 1.0).count();
        let readings_beyond = beyond(&shares(&ten, &ideal, &bound_ohm));
        let outputs_beyond = [&ten, &nine].map(|r| beyond(&shares(&decode(r), &truth, &bound)));
        println!(
            "  beyond: {readings_beyond} readings by 10 bits, {outputs_beyond:?} outputs by 10 and 9"
        );
        assert!(readings_beyond > FRAMES * 144 / 3, "{readings_beyond}");
        assert!(outputs_beyond[1] > FRAMES, "{outputs_beyond:?}");
    }
}
