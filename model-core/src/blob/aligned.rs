//! Memory at addresses that a blob may be borrowed from.

/// Bytes at an address that the floats of a blob may be borrowed from.
///
/// ```
/// static MODEL: model_core::Aligned<[u8; 4]> = model_core::Aligned(*b"TAXL");
/// assert_eq!(MODEL.0.as_ptr() as usize % 4, 0);
/// ```
#[derive(Debug, Clone, Copy)]
#[repr(C, align(4))]
pub struct Aligned<T: ?Sized>(pub T);
