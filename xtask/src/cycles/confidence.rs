//! Cost of a frame's confidence: deviations of all outputs of the paper's sensor, and the frame's novelty.

use std::fs;
use std::path::Path;

use model_core::blob::ModelShape;
use model_core::confidence::{Confidence, Sizes};
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

/// Sizes of a confidence of the paper's sensor: directions and components.
const SIZES: [(usize, usize); 3] = [(10, 16), (10, 32), (16, 32)];

/// Budget: directions, components, and cycles.
const BUDGET: (usize, usize, u64) = (10, 32, 46_000);

/// Middle of the readings (Ω), as in synthetic models.
const MIDDLE: f32 = 60.0;

/// What one frame costs.
pub struct Measured {
    sizes: Sizes,
    count: Count,
}

/// Measures a frame of every size.
pub fn measure(image: &Path, code: &Code, directory: &Path) -> Outcome<Vec<Measured>> {
    fs::create_dir_all(directory).map_err(|cause| cause.to_string())?;
    let one = |&(directions, components): &(usize, usize)| {
        let (readings, outputs) = (PAPER.rows * PAPER.inputs, PAPER.rows * PAPER.outputs);
        let sizes = Sizes { readings, directions, components, outputs };
        let path = directory.join(format!("confidence-{directions}-{components}.bin"));
        let run = blob(sizes)
            .and_then(|blob| fs::write(&path, blob).map_err(|cause| cause.to_string()))
            .and_then(|()| machine::run(image, code, &path))
            .and_then(|run| figures::measured(&run.log, &run.counts))
            .and_then(|regions| of_confidence(&regions));
        let count = run.map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(Measured { sizes, count })
    };
    SIZES.par_iter().map(one).collect()
}

/// A small model of the paper's sensor with a confidence of these `sizes`. Its components are equally probable, so that
/// none of those that deviations are formed of is left out.
fn blob(sizes: Sizes) -> Outcome<Vec<u8>> {
    let block = block(sizes);
    let confidence = Confidence::new(sizes, &block).map_err(|cause| cause.to_string())?;
    let design = Design::of_array(PAPER, Format::Fixed16, 16, false);
    synthetic::blob_with(&design, Some(confidence))
}

fn block(sizes: Sizes) -> Vec<f32> {
    let Sizes { readings, directions, components, outputs } = sizes;
    let mut projection = vec![0.0; directions * (1 + readings)];
    (0..directions).for_each(|i| projection[directions * (1 + i) + i] = 1.0);
    let features = sizes.features();
    let component: Vec<f32> = [vec![-1.0], vec![0.0; features]]
        .into_iter()
        // Rows of the triangle: 0.1 on the diagonal, and little before it.
        .chain((0..features).map(|row| [vec![0.01; row], vec![0.1]].concat()))
        .flatten()
        .collect();
    [
        vec![MIDDLE; readings],
        vec![0.2; readings],
        projection,
        component.repeat(components),
        vec![0.25; components * outputs],
        vec![2.0; outputs],
        vec![3.0],
    ]
    .concat()
}

fn of_confidence(regions: &[figures::Measured]) -> Outcome<Count> {
    let region = regions.iter().find(|region| region.scope == Scope::Confidence);
    region.map(|it| it.counts.whole).ok_or_else(|| "no confidence was measured".to_owned())
}

/// The figures as a table in Markdown.
pub fn markdown(measured: &[Measured]) -> String {
    let lines = measured.iter().map(|it| {
        let Count { instructions, cycles, flash_cycles } = it.count;
        let Sizes { directions, components, .. } = it.sizes;
        let bytes = 4 * it.sizes.block_floats();
        format!(
            "| {directions} | {components} | {instructions} | {cycles} | {flash_cycles} | {bytes} |\n"
        )
    });
    format!(
        "| directions | components | instructions | cycles | from flash | bytes of parameters |\n\
         |--:|--:|--:|--:|--:|--:|\n{}",
        lines.collect::<String>()
    )
}

/// Checks that the frame of the budget takes no more than that.
pub fn held(measured: &[Measured]) -> Outcome {
    let (directions, components, most) = BUDGET;
    let is_meant =
        |it: &&Measured| (it.sizes.directions, it.sizes.components) == (directions, components);
    let what = format!("confidence of {directions} directions and {components} components");
    match measured.iter().find(is_meant) {
        None => Err(format!("{what}: not measured")),
        Some(it) if it.count.cycles > most => {
            Err(format!("{what}: {} cycles, {most} allowed", it.count.cycles))
        }
        Some(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use model_core::Decoder;
    use taxel_learn::ModelBlob;

    use super::*;

    #[test]
    fn frames_near_the_middle_are_near_every_component() {
        let sizes = Sizes { readings: 144, directions: 10, components: 16, outputs: 144 };
        let blob = ModelBlob::of_bytes(&blob(sizes).unwrap()).unwrap();
        let decoder = Decoder::<8>::of(blob.parse()).unwrap();
        let (mut scratch, mut deviation) = (vec![0.0; decoder.scratch_floats()], [0.0; 144]);
        let frame = [MIDDLE + 1.0; 144];
        let assessed = decoder.assess_into(frame[..].into(), &mut scratch, &mut deviation);
        assert!(assessed.unwrap().is_some_and(f32::is_finite));
        assert_eq!(deviation, [0.5; 144]);
    }

    #[test]
    fn a_budget_may_be_used_up_but_not_exceeded() {
        let (directions, components, most) = BUDGET;
        let of = |cycles| {
            let count = Count { instructions: 7, cycles, flash_cycles: cycles + 100 };
            [Measured { sizes: Sizes { readings: 3, directions, components, outputs: 2 }, count }]
        };
        assert!(held(&of(most)).is_ok());
        assert!(held(&of(most + 1)).unwrap_err().ends_with("46000 allowed"));
        assert!(held(&[]).unwrap_err().ends_with("not measured"));
        assert!(markdown(&of(9)).ends_with("| 10 | 32 | 7 | 9 | 109 | 10436 |\n"));
    }
}
