//! Cost of one inference by networks of other shapes than the paper's, for each multiplication.

use std::fs;
use std::path::Path;

use model_core::blob::{Metadata, ModelParts, ModelShape, encode_to_vec};
use model_core::rbf::{Format, Network, Shape, expanded, fixed16};
use model_core::scale::UNITS;
use rayon::prelude::*;

use super::code::Code;
use super::regions::Count;
use super::{figures, machine};
use crate::process::Outcome;

/// Number of centres K.
const CENTRES: usize = 64;

/// The paper's inputs and outputs, with which the others are compared.
const PAPER: (usize, usize) = (18, 18);

/// Inputs and outputs, and the most cycles per multiplication, relative to the paper's, in f32 and in fixed16.
///
/// With 12 inputs and 5 outputs, the exponential of a centre alone takes a quarter to a third of all cycles.
const SHAPES: [((usize, usize), [f64; 2]); 5] = [
    (PAPER, [1.0; 2]),
    ((12, 5), [1.33, 1.41]),
    ((18, 6), [1.15; 2]),
    ((32, 24), [1.15, 1.17]),
    ((144, 6), [1.15; 2]),
];

/// What one inference costs.
pub struct Measured {
    format: Format,
    inputs: usize,
    outputs: usize,
    count: Count,
    /// Most cycles per multiplication, relative to the paper's shape.
    most: f64,
}

impl Measured {
    fn cycles_per_multiplication(&self) -> f64 {
        self.count.cycles as f64 / (CENTRES * (self.inputs + self.outputs)) as f64
    }

    /// Cycles per multiplication, relative to those of the paper's shape among `all`.
    fn relative(&self, all: &[Self]) -> f64 {
        let is_papers = |it: &&Self| it.format == self.format && (it.inputs, it.outputs) == PAPER;
        let papers = all.iter().find(is_papers).map_or(f64::NAN, Self::cycles_per_multiplication);
        self.cycles_per_multiplication() / papers
    }
}

/// Measures one inference of every shape in both formats that have assembly routines.
///
/// # Errors
/// A run fails, or counts something else.
pub fn measure(image: &Path, code: &Code, directory: &Path) -> Outcome<Vec<Measured>> {
    fs::create_dir_all(directory).map_err(|cause| cause.to_string())?;
    let wanted: Vec<_> = [Format::F32, Format::Fixed16]
        .into_iter()
        .enumerate()
        .flat_map(|(column, format)| SHAPES.map(|(shape, most)| (format, shape, most[column])))
        .collect();
    let one = |&(format, (inputs, outputs), most): &(Format, (usize, usize), f64)| {
        let path = directory.join(format!("{}-{inputs}-to-{outputs}.bin", format.name()));
        let run = blob(format, Shape { inputs, centres: CENTRES, outputs })
            .and_then(|blob| fs::write(&path, blob).map_err(|cause| cause.to_string()))
            .and_then(|()| machine::run(image, code, &path))
            .and_then(|run| figures::of_inference(&run.counts));
        let count = run.map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(Measured { format, inputs, outputs, count, most })
    };
    wanted.par_iter().map(one).collect()
}

/// A blob with one network for one row, without an affine tail. Its numbers make no difference to the cost.
fn blob(format: Format, shape: Shape) -> Outcome<Vec<u8>> {
    let Shape { inputs, centres, outputs } = shape;
    let (middle, per_unit) = (vec![60.0; inputs], vec![1e8; inputs]);
    let words: Vec<u32> = if format == Format::F32 {
        let parameters = expanded::Parameters {
            input_midpoint: &middle,
            input_per_unit: &per_unit,
            decay: 1.0 / inputs as f32 / UNITS / UNITS,
            bias: &vec![0.5; outputs],
            affine: &[],
            exponents: &vec![0.0; centres * (1 + inputs)],
            output_weights: &vec![0.25; centres * outputs],
        };
        parameters.words().collect()
    } else {
        let line = 1 + inputs.div_ceil(2);
        let mut group = vec![0; fixed16::words_at_once(shape)];
        let lines = group.chunks_exact_mut(line).take(fixed16::CENTRES_AT_ONCE);
        lines.for_each(|line| line[0] = 1 << 26);
        let parameters = fixed16::Parameters {
            input_midpoint: &middle,
            input_per_unit: &per_unit,
            decay: 1 << 20,
            bias: &vec![1; outputs],
            output_scale: &vec![1e-6; outputs],
            affine: &[],
            centres: &group.repeat(centres / fixed16::CENTRES_AT_ONCE),
        };
        parameters.words().collect()
    };
    let network = if format == Format::F32 {
        expanded::Network::try_new(shape, false, &words).map(Network::from)
    } else {
        fixed16::Network::try_new(shape, false, &words).map(Network::from)
    };
    let networks = [network.map_err(|cause| cause.to_string())?];
    let metadata = Metadata::unnamed(ModelShape { rows: 1, inputs, outputs });
    let parts = ModelParts { projection: None, networks: &networks, row_network: &[0], metadata };
    encode_to_vec(&parts).map(|bytes| bytes.to_vec()).map_err(|cause| cause.to_string())
}

/// The figures as a table in Markdown.
pub fn markdown(measured: &[Measured]) -> String {
    let lines = measured.iter().map(|it| {
        format!(
            "| {} | {} → {} | {} | {} | {:.3} | {:.3} |\n",
            it.format.name(),
            it.inputs,
            it.outputs,
            it.count.instructions,
            it.count.cycles,
            it.cycles_per_multiplication(),
            it.relative(measured)
        )
    });
    format!(
        "| kernel | shape | instructions | cycles | for each multiplication | relative to 18 → 18 |\n\
         |---|---|--:|--:|--:|--:|\n{}",
        lines.collect::<String>()
    )
}

/// Checks that no shape takes more than it may for each multiplication.
///
/// # Errors
/// Every shape that does.
pub fn held(measured: &[Measured]) -> Outcome {
    let over = |it: &Measured| {
        let relative = it.relative(measured);
        // Not `>`, so that what could not be computed is over.
        let within = relative <= it.most;
        (!within).then(|| {
            let (name, Measured { inputs, outputs, most, .. }) = (it.format.name(), it);
            format!("{name}, {inputs} → {outputs}: {relative:.3} times 18 → 18, {most} allowed")
        })
    };
    let over: Vec<String> = measured.iter().filter_map(over).collect();
    if over.is_empty() { Ok(()) } else { Err(over.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(inputs: usize, outputs: usize, cycles: u64) -> Measured {
        let count = Count { instructions: 7, cycles };
        Measured { format: Format::F32, inputs, outputs, count, most: 1.15 }
    }

    #[test]
    fn a_shape_is_compared_with_the_papers_by_multiplications() {
        let all = [measured(18, 18, 36 * 64), measured(18, 6, 24 * 64 + 230)];
        assert!(held(&all).is_ok(), "1.1497 times");
        assert!(markdown(&all).contains("| f32 | 18 → 6 | 7 | 1766 | 1.150 | 1.150 |\n"));
        let all = [measured(18, 18, 36 * 64), measured(18, 6, 24 * 64 + 231)];
        assert_eq!(held(&all).unwrap_err(), "f32, 18 → 6: 1.150 times 18 → 18, 1.15 allowed");
        assert!(held(&all[1..]).is_err(), "nothing to compare with");
    }

    #[test]
    fn every_shape_makes_a_sound_blob() {
        for ((inputs, outputs), _) in SHAPES {
            for format in [Format::F32, Format::Fixed16] {
                assert!(blob(format, Shape { inputs, centres: CENTRES, outputs }).is_ok());
            }
        }
    }
}
