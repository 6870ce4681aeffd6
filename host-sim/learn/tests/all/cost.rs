//! Costs of decoding, predicted by the price list in the repository.

use std::fmt::Write as _;

use taxel_core::blob::ModelShape;
use taxel_core::rbf::Format;
use taxel_learn::cost::{Cost, DecoderRam, Design, Prices};

const PAPER: ModelShape = ModelShape { rows: 8, inputs: 18, outputs: 18 };

fn frame(prices: &Prices, design: &Design) -> Cost {
    prices.frame(design).unwrap()
}

#[test]
fn every_shape_has_a_price() {
    let prices = Prices::accepted().unwrap();
    let sizes = || [1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 24, 37, 64, 144].into_iter();
    let shapes = [1, 2, 3, 8].into_iter().flat_map(|rows| {
        let shapes = sizes().flat_map(|inputs| sizes().map(move |outputs| (inputs, outputs)));
        shapes.map(move |(inputs, outputs)| ModelShape { rows, inputs, outputs })
    });
    for shape in shapes {
        for format in Format::ALL {
            for centres in [60, 300] {
                for affine in [false, true] {
                    for design in [Design::of_rows, Design::of_array] {
                        let design = design(shape, format, centres, affine);
                        for relative_inputs in [false, true] {
                            let design = Design { relative_inputs, ..design.clone() };
                            let cost = frame(&prices, &design);
                            assert!(cost.instructions < cost.cycles, "{design:?}: {cost:?}");
                            assert!(cost.cycles < cost.flash_cycles, "{design:?}: {cost:?}");
                        }
                    }
                }
            }
        }
    }
}

/// Sensors that leave out something of the paper's, or have more of it: name, shape and centres a row.
const SENSORS: [(&str, ModelShape, usize); 7] = [
    ("paper", PAPER, 64),
    ("z only", ModelShape { outputs: 6, ..PAPER }, 64),
    ("three rows", ModelShape { rows: 3, ..PAPER }, 64),
    ("one row", ModelShape { rows: 1, ..PAPER }, 64),
    ("4 × 4 pad", ModelShape { rows: 4, inputs: 4, ..PAPER }, 64),
    ("own CSV file", ModelShape { rows: 1, inputs: 12, outputs: 5 }, 64),
    ("16 × 32", ModelShape { rows: 16, inputs: 32, ..PAPER }, 16),
];

#[test]
fn a_sensor_that_leaves_something_out_takes_less_and_the_page_says_what_each_takes() {
    let prices = Prices::accepted().unwrap();
    let page = include_str!("../../../../docs/cycles.md");
    let mut table = String::new();
    for format in [Format::F32, Format::Fixed16] {
        let takes = |(_, shape, centres): (&str, ModelShape, usize)| {
            let design = Design::of_rows(shape, format, centres, true);
            let cost = frame(&prices, &design);
            let ram = DecoderRam::new(&design).bytes() as u64;
            [
                design.parameter_bytes() as u64,
                ram,
                cost.instructions,
                cost.cycles,
                cost.flash_cycles,
            ]
        };
        let paper = takes(SENSORS[0]);
        for sensor @ (name, shape, _) in SENSORS {
            let figures = takes(sensor);
            let ModelShape { rows, inputs, outputs } = shape;
            let within_paper =
                rows <= PAPER.rows && inputs <= PAPER.inputs && outputs <= PAPER.outputs;
            if shape != PAPER && within_paper {
                let less = figures.iter().zip(&paper).all(|(part, all)| part < all);
                assert!(less, "{name} in {format:?}: {figures:?}");
            }
            let figures = figures.map(|figure| figure.to_string()).join(" | ");
            let format = format.name();
            let _ = writeln!(
                table,
                "| {name} | {rows} × ({inputs} → {outputs}) | {format} | {figures} |"
            );
        }
    }
    assert!(page.contains(&table), "docs/cycles.md must have\n{table}");
}

/// The accepted figures are counts of trained models, which the price list was not made from.
#[test]
fn the_accepted_figures_of_trained_models_are_told() {
    let prices = Prices::accepted().unwrap();
    let figures = include_str!("../../../../firmware/cycles.csv");
    let mut compared = 0;
    for line in figures.lines().skip(1) {
        let [compiler, kernel, centres, affine, scope, instructions, cycles, flash] =
            line.split(',').collect::<Vec<_>>()[..]
        else {
            panic!("{line}");
        };
        if compiler.replace(';', ",") != prices.compiler {
            continue;
        }
        let Some(format) = Format::from_name(kernel) else { continue };
        let centres = centres.parse().unwrap();
        let design: fn(_, _, _, _) -> Design = match scope {
            "array-frame" => Design::of_array,
            "frame" => Design::of_rows,
            _ => continue,
        };
        let design = design(PAPER, format, centres, affine == "yes");
        let predicted = prices.frame(&design).unwrap();
        let percent = |predicted: u64, counted: &str| {
            100.0 * (predicted as f64 / counted.parse::<f64>().unwrap() - 1.0)
        };
        let errors =
            [percent(predicted.instructions, instructions), percent(predicted.cycles, cycles)];
        assert!(errors.iter().all(|error| error.abs() < 1.0), "{line}: {errors:?} %");
        // The image that counts has all weights in RAM.
        let waiting = design.least_waiting_for_weights();
        let error = percent(predicted.flash_cycles - waiting, flash);
        assert!(error.abs() < 10.0, "{line}: {error} % from flash");
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn a_filter_takes_what_its_page_says() {
    let prices = Prices::accepted().unwrap();
    let page = include_str!("../../../../docs/filter.md");
    for (name, rows, outputs) in [
        ("144 outputs of 8 rows", 8, 18),
        ("48 outputs of 8 rows", 8, 6),
        ("6 outputs of one row", 1, 6),
    ] {
        let Cost { instructions, cycles, flash_cycles } =
            prices.filter(ModelShape { outputs, rows, ..PAPER }).unwrap();
        let us = flash_cycles as f64 / 180.0;
        let line = format!("| {name} | {instructions} | {cycles} | {flash_cycles} | {us:.0} µs |");
        assert!(page.contains(&line), "docs/filter.md should say\n{line}");
    }
}
