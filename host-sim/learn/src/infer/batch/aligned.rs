//! Registers in memory that begin where a line of the processor's cache does.

use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

use bytemuck::Pod;

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// A fixed number of `T`. `Vec` aligns for single numbers, since that is how pulp's types are declared: registers
/// would lie across two lines, and take twice as long to load.
pub(super) struct Aligned<T> {
    /// The registers, and before them what is left to a line of the cache.
    words: Vec<u32>,
    first: usize,
    of: PhantomData<T>,
}

impl<T: Pod> Aligned<T> {
    /// Of zeros.
    pub(super) fn zeroed(count: usize) -> Self {
        let length = count * size_of::<T>() / size_of::<u32>();
        let mut words = vec![0; length + LINE / size_of::<u32>()];
        let first = words.as_ptr().align_offset(LINE).min(LINE / size_of::<u32>());
        words.truncate(first + length);
        Self { words, first, of: PhantomData }
    }
}

impl<T: Pod> Deref for Aligned<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        bytemuck::cast_slice(&self.words[self.first..])
    }
}

impl<T: Pod> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.words[self.first..])
    }
}
