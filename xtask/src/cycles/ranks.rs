//! Cost of a frame by one network for the paper's array that computes few components, which are expanded to all
//! outputs.

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

/// Rows, and inputs and outputs of each, of the paper's sensor.
const PAPER: ModelShape = ModelShape { rows: 8, inputs: 18, outputs: 18 };

/// Numbers of centres K.
const CENTRES: [usize; 2] = [64, 256];

/// Numbers of components; `None` for a network that computes all outputs.
const RANKS: [Option<usize>; 4] = [None, Some(16), Some(24), Some(32)];

/// Most bytes of parameters that leave a slot room for names.
const MOST_BYTES: usize = 120_000;

/// Budgets: format, K, components, and cycles of a frame with an affine tail. This is 0.25 ms at 168 MHz.
const BUDGETS: [(Format, usize, usize, u64); 1] = [(Format::Fixed16, 256, 24, 42_000)];

/// What one frame costs.
pub struct Measured {
    format: Format,
    centres: usize,
    rank: Option<usize>,
    bytes: usize,
    count: Count,
}

/// Measures a frame of every K and number of components in both formats that have assembly routines, with an affine
/// tail. A model that does not fit a slot is left out.
pub fn measure(image: &Path, code: &Code, directory: &Path) -> Outcome<Vec<Measured>> {
    fs::create_dir_all(directory).map_err(|cause| cause.to_string())?;
    let wanted: Vec<_> = [Format::F32, Format::Fixed16]
        .into_iter()
        .flat_map(|format| CENTRES.map(|centres| (format, centres)))
        .flat_map(|(format, centres)| RANKS.map(|rank| (format, centres, rank)))
        .map(|(format, centres, rank)| (design(format, centres, rank), format, centres, rank))
        .filter(|(design, ..)| design.parameter_bytes() <= MOST_BYTES)
        .collect();
    let one = |(design, format, centres, rank): &(Design, Format, usize, Option<usize>)| {
        let (format, centres, rank) = (*format, *centres, *rank);
        let name = format!("{}-{centres}-rank-{}.bin", format.name(), rank.unwrap_or(0));
        let path = directory.join(name);
        let run = synthetic::blob(design)
            .and_then(|blob| fs::write(&path, blob).map_err(|cause| cause.to_string()))
            .and_then(|()| machine::run(image, code, &path))
            .and_then(|run| figures::measured(&run.log, &run.counts))
            .and_then(|regions| frame(&regions));
        let count = run.map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(Measured { format, centres, rank, bytes: design.parameter_bytes(), count })
    };
    wanted.par_iter().map(one).collect()
}

fn design(format: Format, centres: usize, rank: Option<usize>) -> Design {
    let full = Design::of_array(PAPER, format, centres, true);
    match rank {
        Some(rank) => full.with_components(rank),
        None => full,
    }
}

/// Cost of the run's frame without a gate.
fn frame(regions: &[figures::Measured]) -> Outcome<Count> {
    let frame = regions.iter().find(|region| region.scope == Scope::ArrayFrame);
    frame.map(|region| region.counts.whole).ok_or_else(|| "no frame was measured".to_owned())
}

/// The figures as a table in Markdown.
pub fn markdown(measured: &[Measured]) -> String {
    let lines = measured.iter().map(|it| {
        format!(
            "| {} | {} | {} | {} | {} | {} | {} |\n",
            it.format.name(),
            it.centres,
            it.rank.map_or("all".to_owned(), |rank| rank.to_string()),
            it.count.instructions,
            it.count.cycles,
            it.count.flash_cycles,
            it.bytes
        )
    });
    format!(
        "| kernel | K | components | instructions | cycles | from flash | bytes of parameters |\n\
         |---|--:|--:|--:|--:|--:|--:|\n{}",
        lines.collect::<String>()
    )
}

/// Checks that no frame takes more than its budget.
pub fn held(measured: &[Measured]) -> Outcome {
    let over = |&(format, centres, rank, most): &(Format, usize, usize, u64)| {
        let what = format!("{}, K = {centres}, {rank} components", format.name());
        let is_meant =
            |it: &&Measured| (it.format, it.centres, it.rank) == (format, centres, Some(rank));
        match measured.iter().find(is_meant) {
            None => Some(format!("{what}: not measured")),
            Some(it) if it.count.cycles > most => {
                Some(format!("{what}: {} cycles, {most} allowed", it.count.cycles))
            }
            Some(_) => None,
        }
    };
    let over: Vec<String> = BUDGETS.iter().filter_map(over).collect();
    if over.is_empty() { Ok(()) } else { Err(over.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(rank: Option<usize>, cycles: u64) -> Measured {
        let count = Count { instructions: 7, cycles, flash_cycles: cycles + 100 };
        Measured { format: Format::Fixed16, centres: 256, rank, bytes: 5, count }
    }

    #[test]
    fn a_budget_may_be_used_up_but_not_exceeded() {
        assert!(held(&[measured(None, 90_000), measured(Some(24), 42_000)]).is_ok());
        let over = held(&[measured(Some(24), 42_001)]).unwrap_err();
        assert_eq!(over, "fixed16, K = 256, 24 components: 42001 cycles, 42000 allowed");
        assert!(held(&[measured(None, 10)]).unwrap_err().ends_with("not measured"));
        let table = markdown(&[measured(None, 3), measured(Some(24), 1)]);
        assert!(table.contains("| fixed16 | 256 | all | 7 | 3 | 103 | 5 |\n"), "{table}");
        assert!(table.ends_with("| fixed16 | 256 | 24 | 7 | 1 | 101 | 5 |\n"), "{table}");
    }
}
