//! What the formats with a kernel in assembly share: it serves the usual sizes on a Cortex-M4F, and its
//! compiled twin, to the bit the same, all others.

use super::{Finite, USUAL_INPUTS, USUAL_OUTPUTS};
#[cfg(cortex_m4f)]
use crate::cortex_m4::Inputs;

/// A network of such a format.
pub(crate) trait Assembled {
    /// Readings in the format's unit of inputs, not clamped yet.
    fn scale(&self, reading: &[f32], scaled: &mut [f32]);

    /// The kernel, with one group of outputs.
    #[cfg(cortex_m4f)]
    fn kernel(&self, inputs: Inputs<'_>, output: &mut [f32; USUAL_OUTPUTS]) -> Finite;

    /// The kernel, with several groups.
    #[cfg(cortex_m4f)]
    fn array_kernel(&self, inputs: Inputs<'_>, groups: &mut [[f32; USUAL_OUTPUTS]]) -> Finite;

    /// The kernel's twin.
    fn infer_scaled_in_rust(&self, scaled: &mut [f32], output: &mut [f32]);

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "callers rely on it for constant lengths")]
    fn infer(&self, reading: &[f32], scaled: &mut [f32], output: &mut [f32]) -> Finite {
        #[cfg(cortex_m4f)]
        if let (Ok(reading), Ok(output)) = (reading.try_into(), (&mut *output).try_into()) {
            return self.kernel(Inputs::Readings(reading), output);
        }
        self.scale(reading, scaled);
        self.infer_scaled(scaled, output);
        Finite::Unknown
    }

    /// As [`infer`](Self::infer), of 18 outputs or several groups of them.
    #[cfg(cortex_m4f)]
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a match and a call")]
    fn infer_in_assembly(
        &self,
        reading: &[f32; USUAL_INPUTS],
        groups: &mut [[f32; USUAL_OUTPUTS]],
    ) -> Finite {
        let inputs = Inputs::Readings(reading);
        match groups {
            [output] => self.kernel(inputs, output),
            groups => self.array_kernel(inputs, groups),
        }
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "callers rely on it for constant lengths")]
    fn infer_scaled(&self, scaled: &mut [f32], output: &mut [f32]) {
        #[cfg(cortex_m4f)]
        if let (Ok(scaled), Ok(output)) = ((&*scaled).try_into(), (&mut *output).try_into()) {
            self.kernel(Inputs::Scaled(scaled), output);
            return;
        }
        self.infer_scaled_in_rust(scaled, output);
    }

    /// By the twin, which knows the usual sizes.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "for callers that are not inlined themselves")]
    fn infer_scaled_by_twin(&self, scaled: &mut [f32], output: &mut [f32]) {
        let usual: (Result<&mut [f32; USUAL_INPUTS], _>, Result<&mut [f32; USUAL_OUTPUTS], _>) =
            ((&mut *scaled).try_into(), (&mut *output).try_into());
        if let (Ok(scaled), Ok(output)) = usual {
            self.infer_scaled_in_rust(scaled, output);
        } else {
            self.infer_scaled_in_rust(scaled, output);
        }
    }
}
