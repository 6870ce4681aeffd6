//! What the formats with a routine in assembly share: it serves the usual sizes on a Cortex-M4F, and its
//! compiled twin, to the bit the same, all others.
#![cfg_attr(
    cortex_m4f,
    expect(unsafe_code, reason = "calls to assembly, whose conditions are checked before")
)]

use super::parameters::Shape;
#[cfg(cortex_m4f)]
use crate::cortex_m4::Inputs;
use crate::cortex_m4::{Finite, INPUTS, OUTPUTS};

/// A network of such a format.
pub(crate) trait Assembled {
    /// The network's sizes.
    fn shape(&self) -> Shape;

    /// Readings in the format's unit of inputs, not clamped yet.
    fn scale(&self, reading: &[f32], scaled: &mut [f32]);

    /// The routine for one group of outputs.
    ///
    /// # Safety
    /// The network [suits](Self::suits) 18 outputs.
    #[cfg(cortex_m4f)]
    unsafe fn routine(&self, inputs: Inputs<'_>, output: &mut [f32; OUTPUTS]) -> Finite;

    /// The routine for several groups of outputs.
    ///
    /// # Safety
    /// The network [suits](Self::suits) as many outputs.
    #[cfg(cortex_m4f)]
    unsafe fn array_routine(&self, inputs: Inputs<'_>, groups: &mut [[f32; OUTPUTS]]) -> Finite;

    /// The routine's twin.
    fn infer_scaled_in_rust(&self, scaled: &mut [f32], output: &mut [f32]);

    /// Whether the network's sizes are those of the routines, with as many outputs.
    #[cfg(cortex_m4f)]
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "where lengths are known, nothing is left of it")]
    fn suits(&self, all_outputs: usize) -> bool {
        let Shape { inputs, outputs, .. } = self.shape();
        inputs == INPUTS && outputs == all_outputs
    }

    /// Infers `output` from one row of readings; `scaled` is working space.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "callers rely on it for constant lengths")]
    fn infer(&self, reading: &[f32], scaled: &mut [f32], output: &mut [f32]) -> Finite {
        #[cfg(cortex_m4f)]
        if let (Ok(reading), Ok(output)) = (reading.try_into(), (&mut *output).try_into())
            && self.suits(OUTPUTS)
        {
            // SAFETY: the network suits one group.
            return unsafe { self.routine(Inputs::Readings(reading), output) };
        }
        self.scale(reading, scaled);
        self.infer_scaled(scaled, output);
        Finite::Unknown
    }

    /// Infers groups of 18 outputs from one row of readings. `None` for a network of other sizes.
    #[cfg(cortex_m4f)]
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a match and a call")]
    fn infer_in_assembly(
        &self,
        reading: &[f32; INPUTS],
        groups: &mut [[f32; OUTPUTS]],
    ) -> Option<Finite> {
        if !self.suits(groups.as_flattened().len()) {
            return None;
        }
        let inputs = Inputs::Readings(reading);
        Some(match groups {
            // SAFETY: the network suits the groups, of which there is one.
            [output] => unsafe { self.routine(inputs, output) },
            // SAFETY: the network suits the groups.
            groups => unsafe { self.array_routine(inputs, groups) },
        })
    }

    /// Infers `output` from `scaled` inputs, which are used up.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "callers rely on it for constant lengths")]
    fn infer_scaled(&self, scaled: &mut [f32], output: &mut [f32]) {
        #[cfg(cortex_m4f)]
        if let (Ok(scaled), Ok(output)) = ((&*scaled).try_into(), (&mut *output).try_into())
            && self.suits(OUTPUTS)
        {
            // SAFETY: the network suits one group.
            unsafe { self.routine(Inputs::Scaled(scaled), output) };
            return;
        }
        self.infer_scaled_in_rust(scaled, output);
    }

    /// By the twin, which knows the usual sizes.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "for callers that are not inlined themselves")]
    fn infer_scaled_by_twin(&self, scaled: &mut [f32], output: &mut [f32]) {
        let usual: (Result<&mut [f32; INPUTS], _>, Result<&mut [f32; OUTPUTS], _>) =
            ((&mut *scaled).try_into(), (&mut *output).try_into());
        if let (Ok(scaled), Ok(output)) = usual {
            self.infer_scaled_in_rust(scaled, output);
        } else {
            self.infer_scaled_in_rust(scaled, output);
        }
    }
}
