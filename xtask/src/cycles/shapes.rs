//! Cost of one inference by networks of other shapes than the paper's, for each multiplication.

use std::fs;
use std::path::Path;

use model_core::blob::ModelShape;
use model_core::rbf::Format;
use rayon::prelude::*;
use taxel_learn::cost::Design;

use super::code::Code;
use super::figures::{self, Scope};
use super::regions::Count;
use super::{machine, synthetic};
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
    ((32, 24), [1.15; 2]),
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
pub fn measure(image: &Path, code: &Code, directory: &Path) -> Outcome<Vec<Measured>> {
    fs::create_dir_all(directory).map_err(|cause| cause.to_string())?;
    let wanted: Vec<_> = [Format::F32, Format::Fixed16]
        .into_iter()
        .enumerate()
        .flat_map(|(column, format)| SHAPES.map(|(shape, most)| (format, shape, most[column])))
        .collect();
    let one = |&(format, (inputs, outputs), most): &(Format, (usize, usize), f64)| {
        let path = directory.join(format!("{}-{inputs}-to-{outputs}.bin", format.name()));
        let shape = ModelShape { rows: 1, inputs, outputs };
        let run = synthetic::blob(&Design::of_rows(shape, format, CENTRES, false))
            .and_then(|blob| fs::write(&path, blob).map_err(|cause| cause.to_string()))
            .and_then(|()| machine::run(image, code, &path))
            .and_then(|run| figures::measured(&run.log, &run.counts))
            .and_then(|regions| inference(&regions));
        let count = run.map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(Measured { format, inputs, outputs, count, most })
    };
    wanted.par_iter().map(one).collect()
}

/// Cost of the run's inference.
fn inference(regions: &[figures::Measured]) -> Outcome<Count> {
    let inference = regions.iter().find(|region| region.scope == Scope::Inference);
    let count = inference.map(|region| region.counts.whole);
    count.ok_or_else(|| "no inference was measured".to_owned())
}

/// The figures as a table in Markdown.
pub fn markdown(measured: &[Measured]) -> String {
    let lines = measured.iter().map(|it| {
        format!(
            "| {} | {} → {} | {} | {} | {:.3} | {:.3} | {} |\n",
            it.format.name(),
            it.inputs,
            it.outputs,
            it.count.instructions,
            it.count.cycles,
            it.cycles_per_multiplication(),
            it.relative(measured),
            it.count.flash_cycles
        )
    });
    format!(
        "| kernel | shape | instructions | cycles | for each multiplication | relative to 18 → 18 | cycles from flash |\n\
         |---|---|--:|--:|--:|--:|--:|\n{}",
        lines.collect::<String>()
    )
}

/// Checks that no shape takes more than it may for each multiplication.
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
        let count = Count { instructions: 7, cycles, flash_cycles: cycles + 100 };
        Measured { format: Format::F32, inputs, outputs, count, most: 1.15 }
    }

    #[test]
    fn a_shape_is_compared_with_the_papers_by_multiplications() {
        let all = [measured(18, 18, 36 * 64), measured(18, 6, 24 * 64 + 230)];
        assert!(held(&all).is_ok(), "1.1497 times");
        assert!(markdown(&all).contains("| f32 | 18 → 6 | 7 | 1766 | 1.150 | 1.150 | 1866 |\n"));
        let all = [measured(18, 18, 36 * 64), measured(18, 6, 24 * 64 + 231)];
        assert_eq!(held(&all).unwrap_err(), "f32, 18 → 6: 1.150 times 18 → 18, 1.15 allowed");
        assert!(held(&all[1..]).is_err(), "nothing to compare with");
    }
}
