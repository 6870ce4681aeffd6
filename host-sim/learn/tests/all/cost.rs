//! Costs of decoding, predicted by the price list in the repository.

use model_core::blob::ModelShape;
use model_core::rbf::Format;
use taxel_learn::Exponential;
use taxel_learn::cost::{Cost, Design, Frames, Prices, kernel_name};

const PAPER: ModelShape = ModelShape { rows: 8, inputs: 18, outputs: 18 };

fn frames(prices: &Prices, design: &Design) -> Frames<Cost> {
    prices.frames(design, Exponential::default()).unwrap()
}

#[test]
fn every_shape_has_a_price_and_a_gate_saves_and_costs_something() {
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
                            let Frames { ungated, at_rest, awake } = frames(&prices, &design);
                            for cost in [ungated, at_rest, awake] {
                                assert!(cost.instructions < cost.cycles, "{design:?}: {cost:?}");
                                assert!(cost.cycles < cost.flash_cycles, "{design:?}: {cost:?}");
                            }
                            assert!(ungated.cycles < awake.cycles, "{design:?}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_left_out_costs_nothing() {
    let prices = Prices::accepted().unwrap();
    let cycles = |shape, format, centres, affine| {
        frames(&prices, &Design::of_rows(shape, format, centres, affine)).ungated.cycles
    };
    // The compiled code of `f32-direct` is made for 18 inputs and outputs; others may take more.
    for format in [Format::F32, Format::Fixed16] {
        let all = cycles(PAPER, format, 64, true);
        let [z_only, one_row, few_columns] = [
            ModelShape { outputs: 6, ..PAPER },
            ModelShape { rows: 1, ..PAPER },
            ModelShape { inputs: 8, ..PAPER },
        ]
        .map(|shape| cycles(shape, format, 64, true));
        assert!(z_only < all * 9 / 10 && few_columns < all * 95 / 100, "{format:?}");
        assert!(one_row < all / 7, "{format:?}");
        assert!(cycles(PAPER, format, 64, false) < all && cycles(PAPER, format, 32, true) < all);
    }
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
        let exponential = Exponential::ALL.into_iter().find_map(|exponential| {
            let named = |format: &Format| kernel_name(*format, exponential) == kernel;
            Some((Format::ALL.into_iter().find(named)?, exponential))
        });
        let Some((format, exponential)) = exponential else { continue };
        let centres = centres.parse().unwrap();
        let (design, scope): (fn(_, _, _, _) -> Design, _) = match scope.strip_prefix("array-") {
            Some(scope) => (Design::of_array, scope),
            None => (Design::of_rows, scope),
        };
        let design = design(PAPER, format, centres, affine == "yes");
        let frames = prices.frames(&design, exponential).unwrap();
        let predicted = match scope {
            "frame" => frames.ungated,
            "resting-frame" => frames.at_rest,
            "awake-frame" => frames.awake,
            _ => continue,
        };
        let percent = |predicted: u64, counted: &str| {
            100.0 * (predicted as f64 / counted.parse::<f64>().unwrap() - 1.0)
        };
        let errors =
            [percent(predicted.instructions, instructions), percent(predicted.cycles, cycles)];
        assert!(errors.iter().all(|error| error.abs() < 1.0), "{line}: {errors:?} %");
        // The image that counts has all weights in RAM.
        let waiting = if scope == "resting-frame" { 0 } else { design.least_waiting_for_weights() };
        let error = percent(predicted.flash_cycles - waiting, flash);
        assert!(error.abs() < 10.0, "{line}: {error} % from flash");
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}
