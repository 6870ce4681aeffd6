//! Sums of products of each line's own factors with numbers that all lines share.

use core::fmt::Debug;

use super::lines::VECTORS;

/// Centres whose exponents are computed at a time.
pub(super) const CENTRES: usize = 4;
/// Outputs that are accumulated at a time.
const OUTPUTS: usize = 6;

/// Operation that adds a factor, combined with a number that all lines share, to a sum.
pub(super) trait Accumulate: Copy {
    /// Number that all lines share, or a pair of them.
    type Shared: Copy + Default + Debug;
    /// Numbers of several lines, a lane a line.
    type Register: Copy;

    fn splat(self, shared: Self::Shared) -> Self::Register;
    fn accumulate(
        self,
        sum: Self::Register,
        factor: Self::Register,
        shared: Self::Register,
    ) -> Self::Register;
}

/// Registers with a factor of each line that is computed at once.
pub(super) type OfLines<A> = [<A as Accumulate>::Register; VECTORS];

/// Accumulates `factors` with the shared numbers of each of N sums, one factor after the other, in registers.
#[inline(always)]
pub(super) fn accumulate<A: Accumulate, const N: usize>(
    how: A,
    factors: &[OfLines<A>],
    shared: &[[A::Shared; N]],
    sums: &mut [OfLines<A>; N],
) {
    let mut accumulated = *sums;
    for (factor, shared) in factors.iter().zip(shared) {
        for (sums, &shared) in accumulated.iter_mut().zip(shared) {
            let shared = how.splat(shared);
            for (sum, &factor) in sums.iter_mut().zip(factor) {
                *sum = how.accumulate(*sum, factor, shared);
            }
        }
    }
    *sums = accumulated;
}

/// Lines of centres, each of `length` numbers, [`CENTRES`] at a time; fill is 0.
pub(super) fn in_fours<T: Copy + Default>(
    length: usize,
    lines: impl Iterator<Item = impl Iterator<Item = T>>,
) -> Vec<[T; CENTRES]> {
    let mut fours = Vec::new();
    for (k, line) in lines.enumerate() {
        let tile = k / CENTRES * length;
        fours.resize(tile + length, [T::default(); CENTRES]);
        for (four, value) in fours[tile..].iter_mut().zip(line) {
            four[k % CENTRES] = value;
        }
    }
    fours
}

/// Weights of each factor (a centre or an input, or a pair of them) for each output, some outputs at a time.
#[derive(Debug)]
pub(super) struct Weights<T> {
    factors: usize,
    whole: Vec<[T; OUTPUTS]>,
    /// Weights of the outputs that are left, factor after factor.
    rest: Vec<T>,
}

impl<T: Copy> Weights<T> {
    /// Lays out `factors × outputs` weights.
    pub(super) fn of(values: &[T], outputs: usize) -> Self {
        let tiles = outputs / OUTPUTS;
        let mut whole = Vec::with_capacity(values.len() / OUTPUTS);
        for tile in 0..tiles {
            let lines = values.chunks_exact(outputs);
            whole.extend(lines.map(|line| line.as_chunks::<OUTPUTS>().0[tile]));
        }
        let rest = values.chunks_exact(outputs).flat_map(|line| &line[tiles * OUTPUTS..]);
        Self { factors: values.len() / outputs, whole, rest: rest.copied().collect() }
    }

    /// Number of factors of each output.
    pub(super) fn factors(&self) -> usize {
        self.factors
    }

    /// Adds the products of `factors` and their weights, from factor number `first` on, to `sums`.
    #[inline(always)]
    pub(super) fn accumulate<A: Accumulate<Shared = T>>(
        &self,
        how: A,
        first: usize,
        factors: &[OfLines<A>],
        sums: &mut [OfLines<A>],
    ) {
        let (tiles, rest) = sums.as_chunks_mut::<OUTPUTS>();
        for (sums, weights) in tiles.iter_mut().zip(self.whole.chunks_exact(self.factors.max(1))) {
            accumulate(how, factors, &weights[first..], sums);
        }
        match rest.len() {
            1 => self.accumulate_rest::<A, 1>(how, first, factors, rest),
            2 => self.accumulate_rest::<A, 2>(how, first, factors, rest),
            3 => self.accumulate_rest::<A, 3>(how, first, factors, rest),
            4 => self.accumulate_rest::<A, 4>(how, first, factors, rest),
            5 => self.accumulate_rest::<A, 5>(how, first, factors, rest),
            _ => (),
        }
    }

    #[inline(always)]
    fn accumulate_rest<A: Accumulate<Shared = T>, const N: usize>(
        &self,
        how: A,
        first: usize,
        factors: &[OfLines<A>],
        sums: &mut [OfLines<A>],
    ) {
        let Some(sums) = sums.first_chunk_mut::<N>() else { return };
        accumulate(how, factors, &self.rest.as_chunks::<N>().0[first..], sums);
    }
}
