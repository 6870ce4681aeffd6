//! Lines of a table in lanes: one line a lane, with the values of one input or output side by side.

use pulp::Simd;

use super::aligned::Aligned;

/// Registers that hold one value of each line that is computed at once.
pub(super) const VECTORS: usize = 2;

/// Registers that are exponentiated side by side: a single polynomial would wait for every operation.
pub(super) const ABREAST: usize = 4;

/// Values of a line that are transposed into columns, and back, at a time.
const TILE: usize = 4;

/// One value of each line that is computed at once, a lane a line.
pub(super) type Lanes<S> = [<S as Simd>::f32s; VECTORS];

/// Lines of a table for the network of one row-wire: each starts a step after the previous one.
pub(super) struct Lines<'a> {
    pub readings: &'a [f64],
    pub readings_step: usize,
    pub outputs: &'a mut [f64],
    pub outputs_step: usize,
}

impl Lines<'_> {
    /// Splits the lines into parts of as many as there are lanes; the last may have fewer.
    #[inline(always)]
    pub(super) fn parts<S: Simd>(self) -> impl Iterator<Item = Self> {
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
}

/// Inputs or outputs of the lines that are computed at once.
///
/// pulp decides which lane has which line: what it shuffles on the way in, it shuffles back.
pub(super) struct Values<S: Simd> {
    count: usize,
    /// Columns of one value of each line: whole tiles, the last perhaps with columns that are not used.
    columns: Aligned<Lanes<S>>,
}

impl<S: Simd> Values<S> {
    /// Memory for `count` values a line, all zero.
    pub(super) fn zeroed(count: usize) -> Self {
        Self { count, columns: Aligned::zeroed(count.next_multiple_of(TILE)) }
    }

    #[inline(always)]
    fn columns(&self) -> &[Lanes<S>] {
        &self.columns[..self.count]
    }

    #[inline(always)]
    pub(super) fn columns_mut(&mut self) -> &mut [Lanes<S>] {
        &mut self.columns[..self.count]
    }

    /// Takes the readings of a part; lanes without a line have any value. Returns NaN in lanes with a reading
    /// that is not finite as an `f32`, and 0 elsewhere.
    #[inline(always)]
    pub(super) fn take(&mut self, simd: S, part: &Lines<'_>) -> Lanes<S> {
        let lanes = VECTORS * S::F32_LANES;
        let tiles: &mut [[f32; TILE]] = bytemuck::cast_slice_mut(&mut self.columns);
        for (lane, line) in part.readings.chunks(part.readings_step).enumerate() {
            let (whole, rest) = line[..self.count].as_chunks::<TILE>();
            let mut places = tiles[lane..].iter_mut().step_by(lanes);
            for (readings, places) in whole.iter().zip(&mut places) {
                *places = readings.map(|reading| reading as f32);
            }
            if let Some(places) = places.next() {
                let rest = rest.iter().zip(places);
                rest.for_each(|(reading, place)| *place = *reading as f32);
            }
        }
        for tile in self.columns.as_chunks_mut::<TILE>().0 {
            let lines: [S::f32s; TILE * VECTORS] = bytemuck::cast(*tile);
            for (v, lines) in lines.as_chunks::<TILE>().0.iter().enumerate() {
                let columns = simd.deinterleave_shfl_f32s(*lines);
                tile.iter_mut().zip(columns).for_each(|(place, column)| place[v] = column);
            }
        }
        poisoned(simd, [simd.splat_f32s(0.0); VECTORS], self.columns())
    }

    /// Writes the outputs of a part's lines; NaN for a line where `poison` or an output is not finite.
    #[inline(always)]
    pub(super) fn give(&mut self, simd: S, part: &mut Lines<'_>, poison: Lanes<S>) {
        let poison = poisoned(simd, poison, self.columns());
        let lanes = VECTORS * S::F32_LANES;
        for tile in self.columns.as_chunks_mut::<TILE>().0 {
            let mut lines = [simd.splat_f32s(f32::NAN); TILE * VECTORS];
            for (v, lines) in lines.as_chunks_mut::<TILE>().0.iter_mut().enumerate() {
                let sound = simd.equal_f32s(poison[v], poison[v]);
                for (line, column) in lines.iter_mut().zip(&*tile) {
                    *line = simd.select_f32s(sound, column[v], *line);
                }
                *lines = simd.interleave_shfl_f32s(*lines);
            }
            *tile = bytemuck::cast(lines);
        }
        let tiles: &[[f32; TILE]] = bytemuck::cast_slice(&self.columns);
        for (lane, line) in part.outputs.chunks_mut(part.outputs_step).enumerate() {
            let (whole, rest) = line[..self.count].as_chunks_mut::<TILE>();
            let mut values = tiles[lane..].iter().step_by(lanes);
            for (places, values) in whole.iter_mut().zip(&mut values) {
                *places = values.map(f64::from);
            }
            if let Some(values) = values.next() {
                let rest = rest.iter_mut().zip(values);
                rest.for_each(|(place, value)| *place = f64::from(*value));
            }
        }
    }
}

/// Adds NaN to `poison` in lanes where not all of `values` are finite.
#[inline(always)]
fn poisoned<S: Simd>(simd: S, poison: Lanes<S>, values: &[Lanes<S>]) -> Lanes<S> {
    let mut poison = poison;
    for value in values {
        for (sum, &value) in poison.iter_mut().zip(value) {
            // 0 where a value is finite.
            *sum = simd.add_f32s(*sum, simd.sub_f32s(value, value));
        }
    }
    poison
}
