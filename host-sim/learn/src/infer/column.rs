//! Numbers of many lines side by side.

use taxel_data::simd::LANES;

/// One number of each of [`LANES`] lines, aligned to the widest vectors.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct Column<T = f32>(pub [T; LANES]);

impl<T: Copy + Default> Column<T> {
    /// So many columns of zeros.
    pub fn zeros(count: usize) -> Vec<Self> {
        vec![Self([T::default(); LANES]); count]
    }
}

/// Numbers that are converted at a time.
const AT_ONCE: usize = 8;

/// Copies the numbers of up to [`LANES`] lines to columns. A line starts every `step` values. Lanes without a line get
/// numbers of others.
///
/// Not for the widest vectors: their instructions that load and store numbers apart are slower than single ones.
#[inline(never)]
pub(super) fn take(lines: &[f64], step: usize, columns: &mut [Column]) {
    let width = columns.len();
    for (first, lines) in (0..LANES).step_by(AT_ONCE).zip(lines.chunks(AT_ONCE * step)) {
        let mut each = lines.chunks(step);
        let lines: [_; AT_ONCE] = std::array::from_fn(|_| &each.next().unwrap_or(lines)[..width]);
        for (number, column) in columns.iter_mut().enumerate() {
            for (place, line) in column.0[first..].iter_mut().zip(lines) {
                *place = line[number] as f32;
            }
        }
    }
}

/// Copies columns to the numbers of up to [`LANES`] lines, as [`take`] does. A line starts every `step` values.
#[inline(never)]
pub(super) fn give(columns: &[Column], lines: &mut [f64], step: usize) {
    let (whole, rest) = columns.as_chunks::<AT_ONCE>();
    for (lane, line) in (0..LANES).zip(lines.chunks_mut(step)) {
        let (of_whole, of_rest) = line.split_at_mut(whole.len() * AT_ONCE);
        for (numbers, columns) in of_whole.as_chunks_mut::<AT_ONCE>().0.iter_mut().zip(whole) {
            *numbers = columns.each_ref().map(|column| f64::from(column.0[lane]));
        }
        for (number, column) in of_rest.iter_mut().zip(rest) {
            *number = f64::from(column.0[lane]);
        }
    }
}

/// NaN in lanes where not all `columns` are finite, and 0 in others.
#[inline(always)]
pub(super) fn poison(columns: &[Column]) -> Column {
    let mut poison = Column([0.0; LANES]);
    for column in columns {
        for (poison, number) in poison.0.iter_mut().zip(&column.0) {
            *poison += 0.0 * number;
        }
    }
    poison
}

/// Makes all `columns` NaN in lanes where `poison` is.
#[inline(always)]
pub(super) fn blank(columns: &mut [Column], poison: &Column) {
    for column in columns {
        for (number, poison) in column.0.iter_mut().zip(&poison.0) {
            *number = if poison.is_nan() { f32::NAN } else { *number };
        }
    }
}
