//! Parts shared by all formats: the shape of a network, its errors, and cutting arrays from a block.

/// Numbers of inputs, centres and outputs of one network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Number of inputs: readings, or features of a projection.
    pub inputs: usize,
    /// Number of centres K.
    pub centres: usize,
    /// Number of outputs.
    pub outputs: usize,
}

/// Why parameters are not a network, or why a buffer does not fit one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// A dimension is zero.
    #[error("a network needs at least one input, one centre and one output")]
    Empty,
    /// An array has the wrong number of elements.
    #[error("{what} has {found} elements; the network's shape asks for {expected}")]
    Length {
        /// Name of the array.
        what: &'static str,
        /// Number of elements that it must have.
        expected: usize,
        /// Number of elements that it has.
        found: usize,
    },
    /// A parameter is NaN or infinite.
    #[error("{what} holds a number that is not finite")]
    NotFinite {
        /// Name of the array.
        what: &'static str,
    },
    /// A number that must be positive is not.
    #[error("{what} holds a number that is negative, or 0 where it must be positive")]
    NotPositive {
        /// Name of the array.
        what: &'static str,
    },
    /// A width is zero, negative or without bound: its decay 1/(2σ²) is not a positive number.
    #[error("width of centre {centre} is not a positive finite number")]
    InvalidWidth {
        /// Index of the decay, from 0.
        centre: usize,
    },
    /// An input's 1/(maximum − minimum) is negative.
    #[error("input {input} has a negative span")]
    NegativeSpan {
        /// Index of the input, from 0.
        input: usize,
    },
    /// The exponent of a centre could leave the range of its format for some input.
    #[error("the exponent of centre {centre} can leave the range that the format computes with")]
    ExponentOutOfRange {
        /// Index of the centre, from 0.
        centre: usize,
    },
    /// There are more inputs than the format can add up.
    #[error("{found} inputs; the format holds at most {most}")]
    TooManyInputs {
        /// Largest number of inputs that the format allows.
        most: usize,
        /// Number of inputs found.
        found: usize,
    },
}

/// Cuts arrays of four-byte words from the front of a network's block.
pub(crate) struct Cut<'a>(pub &'a [u32]);

impl<'a> Cut<'a> {
    /// Cuts the next `length` words; an empty slice if there are fewer.
    pub(super) fn words(&mut self, length: usize) -> &'a [u32] {
        let (head, tail) = self.0.split_at_checked(length).unwrap_or_default();
        self.0 = tail;
        head
    }

    pub(super) fn floats(&mut self, length: usize) -> &'a [f32] {
        bytemuck::cast_slice(self.words(length))
    }
}

pub(super) const fn check_length<T>(
    what: &'static str,
    values: &[T],
    expected: usize,
) -> Result<(), NetworkError> {
    if values.len() == expected {
        Ok(())
    } else {
        Err(NetworkError::Length { what, expected, found: values.len() })
    }
}

pub(super) fn check_finite(arrays: &[(&'static str, &[f32])]) -> Result<(), NetworkError> {
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
    match arrays.iter().find(|(_, values)| !finite(values)) {
        Some((what, _)) => Err(NetworkError::NotFinite { what }),
        None => Ok(()),
    }
}

pub(super) fn check_spans(per_span: &[f32]) -> Result<(), NetworkError> {
    match per_span.iter().position(|s| *s < 0.0) {
        Some(input) => Err(NetworkError::NegativeSpan { input }),
        None => Ok(()),
    }
}
