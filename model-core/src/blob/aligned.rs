//! Memory at addresses that a blob may be borrowed from.

/// Bytes at an address that the floats of a blob may be borrowed from.
///
/// One line puts a model into a program:
///
/// ```
/// use taxel_core::{Aligned, Decoder};
/// # macro_rules! include_bytes { ($file:literal) => {
/// #     core::include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/hand-made.bin"))
/// # } }
/// static MODEL: &[u8] = &Aligned(*include_bytes!("model.bin")).0;
///
/// assert!(Decoder::<8>::load(MODEL).is_ok());
/// ```
#[derive(Debug, Clone, Copy)]
#[repr(C, align(4))]
pub struct Aligned<T: ?Sized>(pub T);

/// Bytes on the heap, at an address that the floats of a blob may be borrowed from.
///
/// ```
/// use taxel_core::AlignedBytes;
/// let mut bytes = AlignedBytes::copy_of(b"TAXL\x01");
/// assert_eq!(bytes.as_ptr() as usize % 4, 0);
/// bytes[4] = 2;
/// assert_eq!(&bytes[..], b"TAXL\x02");
/// ```
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AlignedBytes {
    words: std::vec::Vec<u32>,
    length: usize,
}

#[cfg(feature = "std")]
impl AlignedBytes {
    /// A buffer of `length` bytes, all 0.
    pub fn zeroed(length: usize) -> Self {
        Self { words: std::vec![0; length.div_ceil(4)], length }
    }

    /// A copy of `bytes`, which may lie anywhere.
    pub fn copy_of(bytes: &[u8]) -> Self {
        let mut copy = Self::zeroed(bytes.len());
        copy.copy_from_slice(bytes);
        copy
    }

    /// Shortens the buffer to `length` bytes; does nothing if it is not longer.
    pub fn truncate(&mut self, length: usize) {
        self.length = self.length.min(length);
        self.words.truncate(self.length.div_ceil(4));
        // Whole words are compared, so the unused bytes of the last one must be 0.
        if let (Some(last), used @ 1..) = (self.words.last_mut(), self.length % 4) {
            bytemuck::bytes_of_mut(last).iter_mut().skip(used).for_each(|byte| *byte = 0);
        }
    }
}

#[cfg(feature = "std")]
impl core::ops::Deref for AlignedBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words).get(..self.length).unwrap_or_default()
    }
}

#[cfg(feature = "std")]
impl core::ops::DerefMut for AlignedBytes {
    fn deref_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.words).get_mut(..self.length).unwrap_or_default()
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::AlignedBytes;

    #[test]
    fn bytes_of_any_length_are_kept_and_cut() {
        for length in 0..10_u8 {
            let bytes: std::vec::Vec<u8> = (1..=length).collect();
            let mut copy = AlignedBytes::copy_of(&bytes);
            assert_eq!(&copy[..], &bytes[..]);
            assert!((copy.as_ptr() as usize).is_multiple_of(4));
            for cut in (0..=length).rev() {
                copy.truncate(cut.into());
                assert_eq!(copy, AlignedBytes::copy_of(&bytes[..cut.into()]));
                copy.truncate(usize::from(cut) + 1);
                assert_eq!(copy.len(), usize::from(cut));
            }
        }
    }
}
