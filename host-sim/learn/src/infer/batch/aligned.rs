//! Registers in memory that start at a line of the processor's cache.

use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

use bytemuck::Pod;

/// Bytes in a line of the cache.
const LINE: usize = 64;

/// Fixed number of `T`, aligned to lines of the cache.
///
/// `Vec` aligns for single numbers only, since that is how pulp's types are declared. Registers would
/// lie across two lines, and take twice as long to load.
pub(super) struct Aligned<T> {
    /// Registers, after the words that are skipped to reach a line of the cache.
    words: Vec<u32>,
    first: usize,
    of: PhantomData<T>,
}

impl<T: Pod> Aligned<T> {
    /// Memory for `count` registers of zeros.
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
