//! Costs of decoding, as predicted, beside those that were counted.

use std::fmt::Write as _;

use taxel_core::blob::ModelShape;
use taxel_core::rbf::Format;
use taxel_learn::cost::{Cost, DecoderRam, Design};

const PAPER: ModelShape = ModelShape { rows: 8, inputs: 18, outputs: 18 };

/// Sensors that leave out something of the paper's, or have more of it: name, shape and centres a row.
const SENSORS: [(&str, ModelShape, usize); 6] = [
    ("paper", PAPER, 64),
    ("z only", ModelShape { outputs: 6, ..PAPER }, 64),
    ("one row", ModelShape { rows: 1, ..PAPER }, 64),
    ("4 × 4 pad", ModelShape { rows: 4, inputs: 4, ..PAPER }, 64),
    ("own CSV file", ModelShape { rows: 1, inputs: 12, outputs: 5 }, 64),
    ("16 × 32", ModelShape { rows: 16, inputs: 32, ..PAPER }, 16),
];

#[test]
fn sensors_with_fewer_parts_cost_less_as_the_page_says() {
    let page = include_str!("../../../../docs/cycles.md");
    let mut table = String::new();
    let takes = |(_, shape, centres): (&str, ModelShape, usize)| {
        let [fixed16, f32] = [Format::Fixed16, Format::F32]
            .map(|format| Design::of_rows(shape, format, centres, true));
        let ram = DecoderRam::new(&fixed16).bytes() as u64;
        let cycles = [&fixed16, &f32].map(|design| Cost::of_frame(design).cycles);
        [fixed16.parameter_bytes() as u64, ram, cycles[0], cycles[1]]
    };
    let paper = takes(SENSORS[0]);
    for sensor @ (name, shape, _) in SENSORS {
        let figures = takes(sensor);
        let ModelShape { rows, inputs, outputs } = shape;
        let within_paper = rows <= PAPER.rows && inputs <= PAPER.inputs && outputs <= PAPER.outputs;
        if shape != PAPER && within_paper {
            // Not so in f32, whose loops over 18 inputs and outputs the compiler unrolls.
            let less = figures.iter().zip(&paper).take(3).all(|(part, all)| part < all);
            assert!(less, "{name}: {figures:?}");
        }
        let figures = figures.map(|figure| figure.to_string()).join(" | ");
        let _ = writeln!(table, "| {name} | {rows} × ({inputs} → {outputs}) | {figures} |");
    }
    assert!(page.contains(&table), "docs/cycles.md must have\n{table}");
}

/// Design of a model by its name in `firmware/cycles.csv`, such as `f32 8 x (18 -> 6) K = 64`.
fn design(name: &str) -> Option<Design> {
    let (format, rest) = name.split_once(' ')?;
    let format = Format::ALL.into_iter().find(|it| it.name() == format)?;
    let (shape, centres) = rest.split_once(" K = ")?;
    let centres = centres.parse().ok()?;
    if shape == "144 -> 144" {
        return Some(Design::of_array(PAPER, format, centres, true));
    }
    let (rows, row) = shape.split_once(" x ")?;
    let (inputs, outputs) = row.trim_matches(['(', ')']).split_once(" -> ")?;
    let [rows, inputs, outputs] = [rows, inputs, outputs].map(|count| count.parse().ok());
    let shape = ModelShape { rows: rows?, inputs: inputs?, outputs: outputs? };
    Some(Design::of_rows(shape, format, centres, true))
}

#[test]
fn counted_frames_are_predicted_to_a_tenth() {
    let figures = include_str!("../../../../firmware/cycles.csv");
    let mut compared = 0;
    for line in figures.lines().skip(1) {
        let [_, model, scope, counted, _] = line.split(',').collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        let (Some(design), "frame") = (design(model), scope) else { continue };
        let predicted = Cost::of_frame(&design).instructions as f64;
        let error = predicted / counted.parse::<f64>().unwrap() - 1.0;
        assert!(error.abs() < 0.1, "{line}: {predicted}");
        compared += 1;
    }
    assert!(compared > 12, "{compared}");
}

#[test]
fn a_filter_takes_what_its_page_says() {
    let page = include_str!("../../../../docs/rate.md");
    let cost = Cost::of_filter(ModelShape { outputs: 18, rows: 8, ..PAPER });
    let line = format!("144 outputs take {:.0} µs", cost.cycles as f64 / 180.0);
    assert!(page.contains(&line), "docs/rate.md should say\n{line}");
}
