//! A table's lines in blocks: a lane a line, what belongs to one input or output side by side.

use pulp::Simd;

/// Registers that hold one value of every line of a block.
pub(super) const VECTORS: usize = 2;

/// One value of every line of a block.
pub(super) type Lanes<S> = [<S as Simd>::f32s; VECTORS];

/// Lines of a table for one network of a row: each starts a step after the one before.
pub(super) struct Lines<'a> {
    pub readings: &'a [f64],
    pub readings_step: usize,
    pub outputs: &'a mut [f64],
    pub outputs_step: usize,
}

impl Lines<'_> {
    /// Blocks of as many lines as there are lanes, the last perhaps of fewer.
    #[inline(always)]
    pub(super) fn blocks<S: Simd>(self) -> impl Iterator<Item = Self> {
        let lanes = VECTORS * S::F32_LANES;
        let Self { readings, readings_step, outputs, outputs_step } = self;
        let outputs = outputs.chunks_mut(outputs_step * lanes);
        readings.chunks(readings_step * lanes).zip(outputs).map(move |(readings, outputs)| Self {
            readings,
            readings_step,
            outputs,
            outputs_step,
        })
    }

    /// Takes the readings of a block; lanes of no line keep what they had. Returned is NaN where one is not
    /// finite as an `f32`, and 0 elsewhere.
    #[inline(always)]
    pub(super) fn take<S: Simd>(&self, simd: S, inputs: &mut [Lanes<S>]) -> Lanes<S> {
        let values = bytemuck::cast_slice_mut::<_, f32>(inputs);
        for (number, lines) in self.readings.chunks(4 * self.readings_step).enumerate() {
            let places = values.chunks_exact_mut(VECTORS * S::F32_LANES);
            let mut lines = lines.chunks(self.readings_step);
            let four = [lines.next(), lines.next(), lines.next(), lines.next()];
            if let [Some(a), Some(b), Some(c), Some(d)] = four {
                let readings = a.iter().zip(b).zip(c).zip(d);
                for (places, (((a, b), c), d)) in places.zip(readings) {
                    places.as_chunks_mut().0[number] = [*a as f32, *b as f32, *c as f32, *d as f32];
                }
            } else {
                for (input, places) in places.enumerate() {
                    for (place, line) in places[4 * number..].iter_mut().zip(four.iter().flatten())
                    {
                        *place = line[input] as f32;
                    }
                }
            }
        }
        let mut poison = [simd.splat_f32s(0.0); VECTORS];
        for input in inputs {
            add_difference_to_itself(simd, &mut poison, input);
        }
        poison
    }

    /// Gives the lines of a block their outputs, all NaN where `poison` or one of them is not finite.
    #[inline(always)]
    pub(super) fn give<S: Simd>(self, simd: S, outputs: &[Lanes<S>], poison: Lanes<S>) {
        let mut poison = poison;
        for output in outputs {
            add_difference_to_itself(simd, &mut poison, output);
        }
        let count = outputs.len();
        let values = bytemuck::cast_slice::<_, f32>(outputs);
        let poison = bytemuck::cast_slice::<_, f32>(&poison);
        let lines = self.outputs.chunks_mut(self.outputs_step).enumerate();
        for ((lane, line), poison) in lines.zip(poison) {
            let line = &mut line[..count];
            for (place, values) in line.iter_mut().zip(values.chunks_exact(VECTORS * S::F32_LANES))
            {
                *place = f64::from(values[lane]);
            }
            if poison.is_nan() {
                line.fill(f64::NAN);
            }
        }
    }
}

/// Adds 0 where `value` is finite, and NaN elsewhere.
#[inline(always)]
fn add_difference_to_itself<S: Simd>(simd: S, sum: &mut Lanes<S>, value: &Lanes<S>) {
    for (sum, &value) in sum.iter_mut().zip(value) {
        *sum = simd.add_f32s(*sum, simd.sub_f32s(value, value));
    }
}
