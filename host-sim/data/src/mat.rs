//! Mats: readings of a grid of cells, each between a row-wire and a column-wire.
//!
//! A model calls the reading at row-wire m and column-wire k `r{m}c{k}_` and the file's own name. So the model alone tells
//! the wires of its readings, also where dead cells are left out.

use std::collections::BTreeSet;
use std::fmt::{self, Display};
use std::str::FromStr;

use crate::columns::{self, cell_of};

/// Fewest cells that make a square mat unless a user says so.
const FEWEST: usize = 64;

/// Numbers of row-wires and column-wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mat {
    pub rows: usize,
    pub columns: usize,
}

/// What a user says of the mat whose cells are the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grid {
    /// They are the cells of this mat.
    Of(Mat),
    /// They are no mat, whatever their names say.
    None,
}

impl FromStr for Grid {
    type Err = String;

    /// Parses `ROWSxCOLUMNS` or `none`.
    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::None);
        }
        let number = |text: &str| text.parse().ok().filter(|count| (1..=1000).contains(count));
        let wires = text.split_once(['x', 'X']).and_then(|(m, k)| Some((number(m)?, number(k)?)));
        let (rows, columns) = wires.ok_or("give ROWSxCOLUMNS, such as 16x16, or none")?;
        Ok(Self::Of(Mat { rows, columns }))
    }
}

impl Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Of(mat) => write!(f, "{}x{}", mat.rows, mat.columns),
            Self::None => f.write_str("none"),
        }
    }
}

impl Display for Mat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} × {}", self.rows, self.columns)
    }
}

impl Mat {
    fn cells(self) -> usize {
        self.rows * self.columns
    }

    /// Name of the reading at `cell`, row by row from 0, that a file calls `own`.
    fn name(self, cell: usize, own: &str) -> String {
        format!("r{}c{}_{own}", cell / self.columns + 1, cell % self.columns + 1)
    }
}

/// Name of each of the `chosen` columns of a `header` in a model: of a cell, if they are a mat.
///
/// They are one if they are named after their wires (`r0c0`, `m_r1c1` are not, `r3c4` is), which a grid must agree with; if
/// their names differ in a number alone, and these numbers run over a square of at least 8 × 8 cells, from which some may be
/// missing; or if `given` says so. Then numbers count the cells row by row; without numbers the columns are in that order.
/// The mat is returned if numbers told it.
///
/// # Errors
/// Reason why the columns are not the cells of the `given` mat.
pub fn cell_names(
    header: &[String],
    chosen: &[usize],
    given: Option<Grid>,
) -> Result<(Vec<String>, Option<Mat>), String> {
    let own: Vec<&str> = chosen.iter().map(|column| header[*column].as_str()).collect();
    let as_they_are = || own.iter().map(ToString::to_string).collect();
    let are_cells = !own.is_empty() && own.iter().all(|name| cell_of(name).is_some());
    let named = if are_cells { Some(as_they_are()) } else { named_after_wires(&own) };
    let given = match (given, named) {
        (Some(Grid::None), _) if !are_cells => return Ok((as_they_are(), None)),
        (Some(grid), Some(names)) => {
            check_agrees(grid, &names)?;
            return Ok((names, None));
        }
        (None, Some(names)) => return Ok((names, None)),
        (Some(Grid::Of(mat)), None) => Some(mat),
        (_, None) => None,
    };
    let found = numbers(&own).and_then(|(stem, numbers)| {
        let of_file: Vec<usize> = header.iter().filter_map(|name| number(name, stem)).collect();
        let (mat, first) = numbered(&numbers, &of_file, given)?;
        let named = own.iter().zip(&numbers).map(|(own, number)| mat.name(number - first, own));
        Some((named.collect(), Some(mat)))
    });
    match (found, given) {
        (Some(found), _) => Ok(found),
        (None, None) => Ok((as_they_are(), None)),
        (None, Some(mat)) if mat.cells() == own.len() => {
            Ok((own.iter().enumerate().map(|(cell, own)| mat.name(cell, own)).collect(), None))
        }
        (None, Some(Mat { rows, columns })) => Err(format!(
            "--grid {rows}x{columns} has {} cells, and {} columns are inputs: choose the same number (--inputs); dead cells may \
             be left out only if names contain the cells' numbers",
            rows * columns,
            own.len()
        )),
    }
}

/// Checks that a `grid` is given which has the wires that `names` of cells tell.
fn check_agrees(grid: Grid, names: &[String]) -> Result<(), String> {
    let is_in = |mat: Mat, [row, column]: [usize; 2]| row <= mat.rows && column <= mat.columns;
    let mut cells = names.iter().filter_map(|name| Some((name, cell_of(name)?.0)));
    let beside = cells.find(|(_, cell)| !matches!(grid, Grid::Of(mat) if is_in(mat, *cell)));
    beside.map_or(Ok(()), |(name, [row, column])| {
        Err(format!(
            "--grid {grid}: {name} names its own wires, row {row} and column {column}: leave --grid out, or rename the inputs"
        ))
    })
}

/// Names of cells for columns called `r0c0`, `r1c1` or `r1c1x`.
fn named_after_wires(own: &[&str]) -> Option<Vec<String>> {
    let wires_of = |name: &&str| -> Option<[usize; 2]> {
        let (row, rest) = name.strip_prefix('r')?.split_once('c')?;
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        Some([row.parse().ok()?, rest[..end].parse().ok()?])
    };
    let wires: Vec<[usize; 2]> = own.iter().map(wires_of).collect::<Option<_>>()?;
    let shift = usize::from(wires.as_flattened().contains(&0));
    let named = own.iter().zip(wires);
    Some(named.map(|(own, [m, k])| format!("r{}c{}_{own}", m + shift, k + shift)).collect())
}

/// What stands before and behind the last number of a name.
type Stem<'n> = (&'n str, &'n str);

/// Last number of `name`, if this `stem` is around it.
fn number(name: &str, (before, behind): Stem<'_>) -> Option<usize> {
    let digits = name.strip_prefix(before)?.strip_suffix(behind)?;
    digits.bytes().all(|digit| digit.is_ascii_digit()).then(|| digits.parse().ok())?
}

/// Number in each name, if names differ in it alone.
fn numbers<'n>(own: &[&'n str]) -> Option<(Stem<'n>, Vec<usize>)> {
    let first: &'n str = own.first()?;
    let end = first.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = first[..end].rfind(|c: char| !c.is_ascii_digit());
    let start = start.map_or(0, |at| at + first[at..].chars().next().map_or(1, char::len_utf8));
    let stem = (&first[..start], &first[end..]);
    let numbers: Vec<usize> = own.iter().map(|name| number(name, stem)).collect::<Option<_>>()?;
    let distinct: BTreeSet<&usize> = numbers.iter().collect();
    (distinct.len() == numbers.len()).then_some((stem, numbers))
}

/// The mat whose cells have these `numbers`, and the number of its first cell. The cells that were not chosen count as
/// well, by their numbers in the file.
fn numbered(numbers: &[usize], of_file: &[usize], given: Option<Mat>) -> Option<(Mat, usize)> {
    let (low, high) = (*numbers.iter().min()?, *numbers.iter().max()?);
    let of_file = (of_file.iter().min().copied()?, of_file.iter().max().copied()?);
    let mut spans = [(low, high), of_file, (0, high), (1, high)].into_iter();
    let fits = |(first, last): (usize, usize)| {
        let cells = (first <= low).then(|| last + 1 - first)?;
        let side = cells.isqrt();
        let square = (cells >= FEWEST && side * side == cells && 2 * numbers.len() > cells)
            .then_some(Mat { rows: side, columns: side });
        Some((
            given.filter(|mat| mat.cells() == cells).or(square.filter(|_| given.is_none()))?,
            first,
        ))
    };
    spans.find_map(fits)
}

/// Row-wires and column-wires, such as `row-wire 5`, of which at least two readings are called by `names` and all are
/// among the `faulty` ones.
pub fn whole_wires(names: &[String], faulty: &[String]) -> Vec<String> {
    let of = |names: &[String], kind: usize, wire: usize| {
        names.iter().filter(|name| cell_of(name).is_some_and(|(at, _)| at[kind] == wire)).count()
    };
    let wires = [("row-wire", 0), ("column-wire", 1)].into_iter().flat_map(|(called, kind)| {
        let wires = faulty.iter().filter_map(|name| Some(columns::cell_of(name)?.0[kind]));
        wires.collect::<BTreeSet<usize>>().into_iter().map(move |wire| (called, kind, wire))
    });
    let whole = wires.filter(|(_, kind, wire)| {
        let count = of(faulty, *kind, *wire);
        count >= 2 && count == of(names, *kind, *wire)
    });
    whole.map(|(called, _, wire)| format!("{called} {wire}")).collect()
}
