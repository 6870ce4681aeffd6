//! Grid of wires whose readings are the columns of a table.

use std::ops::Range;

use taxel_data::columns;

use super::Place;

/// Numbers of the row-wires and column-wires that a table has readings of, row after row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    rows: Vec<usize>,
    columns: Vec<usize>,
}

impl Grid {
    /// Grid of columns called `r1c1_ohm` and so on: every reading of two rows or more and two columns or more, row after
    /// row. `None` for other columns.
    pub fn new(names: &[String]) -> Option<Self> {
        let wires: Option<Vec<(usize, usize)>> =
            names.iter().map(|name| Self::wires_of_name(name)).collect();
        let wires = wires?;
        let first = wires.first()?.0;
        let columns: Vec<usize> =
            wires.iter().take_while(|(row, _)| *row == first).map(|(_, column)| *column).collect();
        let rows: Vec<usize> = wires.iter().step_by(columns.len()).map(|(row, _)| *row).collect();
        let all = rows.iter().flat_map(|row| columns.iter().map(move |column| (*row, *column)));
        let whole = rows.len() > 1 && columns.len() > 1 && all.eq(wires.iter().copied());
        whole.then_some(Self { rows, columns })
    }

    /// Wires of the reading at index `at`.
    fn wires(&self, at: usize) -> (usize, usize) {
        (self.rows[at / self.columns.len()], self.columns[at % self.columns.len()])
    }

    /// Number of readings.
    pub(super) fn readings(&self) -> usize {
        self.rows.len() * self.columns.len()
    }

    /// Place of the reading at index `at`.
    pub(super) fn place(&self, at: usize) -> Place {
        let (row, column) = self.wires(at);
        Place::Reading(row, column)
    }

    /// Whether the reading at index `at` belongs to `place`.
    pub fn is_in(&self, place: Place, at: usize) -> bool {
        let (row, column) = self.wires(at);
        place.holds(row, column)
    }

    /// Pairs of neighbouring wires.
    pub(super) fn neighbours(&self) -> impl Iterator<Item = Place> {
        let rows = self.rows.windows(2).filter(|pair| pair[1] == pair[0] + 1);
        let columns = self.columns.windows(2).filter(|pair| pair[1] == pair[0] + 1);
        let rows = rows.map(|pair| Place::Rows(pair[0], pair[1]));
        rows.chain(columns.map(|pair| Place::Columns(pair[0], pair[1])))
    }

    /// Indices of the readings of two neighbours, in pairs of those that would be alike if the two touched.
    pub(super) fn pairs(&self, place: Place) -> Vec<[usize; 2]> {
        let width = self.columns.len();
        let index = |wires: &[usize], wire| wires.iter().position(|known| *known == wire);
        match place {
            Place::Rows(a, b) => {
                let rows = index(&self.rows, a).zip(index(&self.rows, b));
                let pairs =
                    rows.map(|(a, b)| (0..width).map(move |k| [a * width + k, b * width + k]));
                pairs.into_iter().flatten().collect()
            }
            Place::Columns(a, b) => {
                let columns = index(&self.columns, a).zip(index(&self.columns, b));
                let of = |(a, b)| (0..self.rows.len()).map(move |m| [m * width + a, m * width + b]);
                columns.into_iter().flat_map(of).collect()
            }
            _ => vec![],
        }
    }

    /// Fewest places that hold these `readings` and hardly any other: wires of which all are among them, and single
    /// readings. All wires, if all are.
    pub fn wires_of(&self, readings: &[usize]) -> Vec<Place> {
        let (height, width) = (self.rows.len(), self.columns.len());
        if readings.len() == height * width {
            return vec![Place::All];
        }
        let mut left = vec![false; height * width];
        readings.iter().for_each(|at| left[*at] = true);
        let whole = left.clone();
        let mut places = Vec::new();
        for (m, row) in self.rows.iter().enumerate() {
            if whole[m * width..][..width].iter().all(|one| *one) {
                places.push(Place::Row(*row));
                left[m * width..][..width].fill(false);
            }
        }
        for (k, column) in self.columns.iter().enumerate() {
            let of_column = || (0..height).map(|m| m * width + k);
            if of_column().all(|at| whole[at]) {
                places.push(Place::Column(*column));
                of_column().for_each(|at| left[at] = false);
            }
        }
        places.extend((0..left.len()).filter(|at| left[*at]).map(|at| self.place(at)));
        places
    }

    /// Readings of the rows of which some are `shorted`, and all others are `missing`.
    pub fn rows_beside(&self, shorted: &[usize], missing: &[usize]) -> Vec<usize> {
        let width = self.columns.len();
        let are_beside = |row: &Range<usize>| {
            let [shorted, missing] =
                [shorted, missing].map(|them| them.iter().filter(|at| row.contains(at)).count());
            shorted > 0 && missing > 0 && shorted + missing == width
        };
        let rows = (0..self.rows.len()).map(|row| row * width..(row + 1) * width);
        rows.filter(are_beside).flatten().collect()
    }

    /// Wires of a column called `r4c5_ohm`.
    pub fn wires_of_name(name: &str) -> Option<(usize, usize)> {
        let ([row, column], own) = columns::cell_of(name)?;
        (own == "ohm").then_some((row, column))
    }
}
