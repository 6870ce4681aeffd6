//! Frames of models of any design: measured, and with the pieces of code that tell what they cost.

use std::fs;
use std::path::Path;

use model_core::rbf::Format;
use rayon::prelude::*;
use taxel_learn::Exponential;
use taxel_learn::cost::{Design, FramePieces, Gating, Price, Prices};

use super::code::Code;
use super::figures::{self, Scope};
use super::loops::Loop;
use super::regions::{Count, Region};
use super::{machine, synthetic};
use crate::process::Outcome;

/// A frame that was measured.
pub struct Frame {
    pub design: Design,
    pub kernel: String,
    pub scope: Scope,
    pub pieces: FramePieces,
    pub whole: Count,
    pub assembly: Count,
}

/// Measures frames of every design, and the loops in them, with blobs that are written into `directory` meanwhile.
pub fn measure_designs(
    designs: &[Design],
    image: &Path,
    code: &Code,
    directory: &Path,
) -> Outcome<(Vec<Frame>, Vec<Loop>)> {
    let directory = directory.join("designs");
    fs::create_dir_all(&directory).map_err(|cause| cause.to_string())?;
    let one = |(index, design): (usize, &Design)| {
        let path = directory.join(format!("{index}.bin"));
        let frames = synthetic::blob(design)
            .and_then(|blob| fs::write(&path, blob).map_err(|cause| cause.to_string()))
            .and_then(|()| measure(design, &path, image, code));
        let _ = fs::remove_file(&path);
        frames.map_err(|cause| format!("{}: {cause}", name_of(design)))
    };
    let runs: Vec<(Vec<Frame>, Vec<Loop>)> =
        designs.par_iter().enumerate().map(one).collect::<Outcome<_>>()?;
    let (frames, loops): (Vec<_>, Vec<_>) = runs.into_iter().unzip();
    Ok((frames.into_iter().flatten().collect(), loops.concat()))
}

/// Measures frames of the blob at `path`, and the loops in them, whose model has this `design`.
pub fn measure(
    design: &Design,
    path: &Path,
    image: &Path,
    code: &Code,
) -> Outcome<(Vec<Frame>, Vec<Loop>)> {
    let run = machine::run(image, code, path)?;
    let regions = figures::measured(&run.log, &run.counts)?;
    let frames = regions.iter().filter_map(|region| frame(design, region)).collect();
    Ok((frames, run.loops))
}

fn frame(design: &Design, region: &figures::Measured) -> Option<Frame> {
    let gating = match region.scope {
        Scope::Frame | Scope::ArrayFrame => Gating::Ungated,
        Scope::RestingFrame | Scope::ArrayRestingFrame => Gating::AtRest,
        Scope::AwakeFrame | Scope::ArrayAwakeFrame => Gating::Awake,
        Scope::Inference | Scope::Exponential | Scope::Row | Scope::Confidence => return None,
    };
    let named = region.kernel.strip_prefix(&format!("{}-", Format::F32Direct.name()));
    let exponential = match named {
        Some(name) => Exponential::by_name(name)?,
        // Compiled twins are no code of the firmware.
        None if region.kernel.ends_with("-portable") => return None,
        None => Exponential::default(),
    };
    let Region { whole, assembly, .. } = region.counts;
    let (kernel, scope) = (region.kernel.clone(), region.scope);
    let pieces = FramePieces::of(design, exponential, gating);
    Some(Frame { design: design.clone(), kernel, scope, pieces, whole, assembly })
}

impl Frame {
    /// Kernel, scope and design in words.
    pub fn what(&self) -> String {
        format!("{} {}, {}", self.kernel, self.scope.name(), name_of(&self.design))
    }

    /// Cost of what is not in assembly.
    pub fn compiled(&self) -> Count {
        self.whole - self.assembly
    }

    /// What `prices` tell of the assembly, and of all.
    pub fn predicted(&self, prices: &Prices) -> Outcome<[Price; 2]> {
        let sum = |pieces| prices.sum(pieces).map_err(|cause| cause.to_string());
        let [assembly, compiled] = [sum(&self.pieces.assembly)?, sum(&self.pieces.compiled)?];
        let mut whole = assembly;
        whole.iter_mut().zip(compiled).for_each(|(sum, part)| *sum += part);
        Ok([assembly, whole])
    }
}

/// A design in words.
pub fn name_of(design: &Design) -> String {
    let shape = design.shape;
    let Some(network) = design.networks.first() else { return "no network".to_owned() };
    let parts = [
        (design.projection, "one network"),
        (network.affine_tail, "tail"),
        (design.relative_inputs, "relative"),
        (!network.common_width, "own widths"),
    ];
    let parts = parts.iter().filter(|(holds, _)| *holds).map(|(_, name)| format!(", {name}"));
    let rank = design.components.map(|components| format!(", {components} components"));
    format!(
        "{} × ({} → {}), K = {}{}{}",
        shape.rows,
        shape.inputs,
        shape.outputs,
        network.shape.centres,
        rank.unwrap_or_default(),
        parts.collect::<String>()
    )
}
