//! QR decomposition of a matrix that arrives a few rows at a time.
//!
//! [`Triangle`] keeps the upper triangle R of the rows so far, and the targets z transformed with them.
//! New rows B below it are annihilated by Householder reflections, a panel of columns at a time. The
//! product of a panel's reflections is applied to the columns on their right as I − V·T·Vᵀ (Schreiber &
//! Van Loan, "A storage-efficient WY representation for products of Householder transformations", SIAM
//! J. Sci. Stat. Comput. 10, 1989).
//!
//! Above B, R is triangular, so V = [I; U] with a dense U the height of B, and the work is 2·n²
//! operations a row (Golub & Van Loan, *Matrix Computations*, §12.5). Triangles absorb triangles as in
//! TSQR (Demmel et al., SIAM J. Sci. Comput. 34, 2012). Orthogonal transformations do not square the
//! condition number, as normal equations would.
//!
//! The order of operations is fixed by the shapes alone, and nothing is contracted: the result is the
//! same on every machine.
#![expect(clippy::needless_range_loop, reason = "loops over lanes read as the formulas do")]

use taxel_data::widest;

/// Columns in a tile, which stand side by side in memory.
const LANES: usize = 8;
/// Columns in a panel, whose reflections are applied to the rest at once.
const PANEL: usize = 24;
/// Rows that are annihilated at once: U, and a tile beside it, stay in the first cache.
pub const ROWS_AT_ONCE: usize = 144;
/// Rows for which a product is computed at a time: 6 × 8 sums fill the vector registers.
const STRIP: usize = 6;
/// Sum of squares below which a column holds nothing but underflow.
const NEGLIGIBLE: f64 = 1e-280;

/// Row of a tile: a cache line.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
struct Tile([f64; LANES]);

const BLANK: Tile = Tile([0.0; LANES]);

/// Row of a panel: whole cache lines.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
struct PanelRow([f64; PANEL]);

const BLANK_ROW: PanelRow = PanelRow([0.0; PANEL]);

/// Columns of [R | z] and of the new rows below it: tile after tile, each from top to bottom. The
/// regressors are filled up with zeros to whole panels, the outputs to whole tiles.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Columns {
    regressors: usize,
    outputs: usize,
}

impl Columns {
    fn panels(self) -> usize {
        self.regressors.div_ceil(PANEL)
    }

    fn tiles(self) -> usize {
        self.panels() * (PANEL / LANES) + self.outputs.div_ceil(LANES)
    }

    /// Whether a tile is nothing but filling.
    fn is_blank(self, tile: usize) -> bool {
        (self.regressors.div_ceil(LANES)..self.panels() * (PANEL / LANES)).contains(&tile)
    }
}

/// Triangle R and transformed targets z of all rows so far.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Triangle {
    columns: Columns,
    /// Tiles of `panels · PANEL` rows each.
    tiles: Vec<Tile>,
}

/// New rows of regressors and targets, up to [`ROWS_AT_ONCE`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NewRows {
    columns: Columns,
    /// Tiles of [`ROWS_AT_ONCE`] rows each; rows that were not set are 0 and change nothing.
    tiles: Vec<Tile>,
    /// Working space: [`ROWS_AT_ONCE`] rows of one panel.
    panel: Vec<PanelRow>,
}

impl NewRows {
    pub(super) fn new(regressors: usize, outputs: usize) -> Self {
        let columns = Columns { regressors, outputs };
        let tiles = vec![BLANK; columns.tiles() * ROWS_AT_ONCE];
        Self { columns, tiles, panel: vec![BLANK_ROW; ROWS_AT_ONCE] }
    }

    pub(super) fn clear(&mut self) {
        self.tiles.fill(BLANK);
    }

    /// Sets one row.
    pub(super) fn set(&mut self, row: usize, regressors: &[f64], targets: &[f64]) {
        let after = self.columns.panels() * (PANEL / LANES) * ROWS_AT_ONCE;
        for (values, from) in [(regressors, 0), (targets, after)] {
            let (whole, rest) = values.as_chunks::<LANES>();
            let mut places = self.tiles[from + row..].iter_mut().step_by(ROWS_AT_ONCE);
            whole.iter().zip(&mut places).for_each(|(values, place)| place.0 = *values);
            if let (false, Some(place)) = (rest.is_empty(), places.next()) {
                place.0[..rest.len()].copy_from_slice(rest);
            }
        }
    }
}

impl Triangle {
    /// Triangle of no rows: R = 0.
    pub(super) fn new(regressors: usize, outputs: usize) -> Self {
        let columns = Columns { regressors, outputs };
        let rows = columns.panels() * PANEL;
        Self { columns, tiles: vec![BLANK; columns.tiles() * rows] }
    }

    /// Sets R to this `diagonal`: the rows of a prior.
    pub(super) fn set_diagonal(&mut self, diagonal: impl Fn(usize) -> f64) {
        let rows = self.rows();
        for i in 0..self.columns.regressors {
            self.tiles[i / LANES * rows + i].0[i % LANES] = diagonal(i);
        }
    }

    fn rows(&self) -> usize {
        self.columns.panels() * PANEL
    }

    /// Absorbs the rows of `new`, which is working space afterwards.
    pub(super) fn absorb(&mut self, new: &mut NewRows) {
        self.absorb_from(new, 0);
    }

    /// Absorbs all rows that `other` has absorbed.
    pub(super) fn merge(&mut self, other: &Self) {
        let rows = other.rows();
        let mut rows_of_other = NewRows::new(self.columns.regressors, self.columns.outputs);
        for first in (0..rows).step_by(ROWS_AT_ONCE) {
            let count = ROWS_AT_ONCE.min(rows - first);
            rows_of_other.clear();
            let tiles = rows_of_other
                .tiles
                .chunks_exact_mut(ROWS_AT_ONCE)
                .zip(other.tiles.chunks_exact(rows));
            tiles.for_each(|(to, from)| to[..count].copy_from_slice(&from[first..first + count]));
            // A triangle's rows are 0 on the left of its diagonal.
            self.absorb_from(&mut rows_of_other, first / PANEL);
        }
    }

    fn absorb_from(&mut self, new: &mut NewRows, first_panel: usize) {
        let (columns, rows) = (self.columns, self.rows());
        let tiles = &mut self.tiles;
        widest!({
            let u = new.panel.first_chunk_mut().expect("rows of one panel");
            for panel in first_panel..columns.panels() {
                annihilate(columns, rows, tiles, &mut new.tiles, panel, u);
            }
        });
    }

    /// Returns R (`n × n`, row-major, its diagonal not negative) and z (`n × outputs`).
    pub(super) fn into_root_and_projection(self) -> (Vec<f64>, Vec<f64>) {
        let (n, outputs, rows) = (self.columns.regressors, self.columns.outputs, self.rows());
        let at =
            |row: usize, column: usize| self.tiles[column / LANES * rows + row].0[column % LANES];
        let sign = |row: usize| if at(row, row) < 0.0 { -1.0 } else { 1.0 };
        let root = (0..n * n)
            .map(|i| (i / n, i % n))
            .map(|(row, column)| if row <= column { sign(row) * at(row, column) } else { 0.0 });
        let projection = (0..n * outputs).map(|i| (i / outputs, i % outputs));
        let projection = projection.map(|(row, output)| sign(row) * at(row, rows + output));
        (root.collect(), projection.collect())
    }
}

/// Annihilates one panel of new rows against its rows of R, and transforms all columns on its right.
#[inline(always)]
fn annihilate(
    columns: Columns,
    rows: usize,
    triangle: &mut [Tile],
    new_tiles: &mut [Tile],
    panel: usize,
    u: &mut [PanelRow; ROWS_AT_ONCE],
) {
    let first_tile = panel * (PANEL / LANES);
    let head_rows = panel * PANEL..(panel + 1) * PANEL;
    let mut head = [BLANK_ROW; PANEL];
    for t in 0..PANEL / LANES {
        let lanes = t * LANES..(t + 1) * LANES;
        let from = &new_tiles[(first_tile + t) * ROWS_AT_ONCE..][..ROWS_AT_ONCE];
        u.iter_mut().zip(from).for_each(|(u, from)| u.0[lanes.clone()].copy_from_slice(&from.0));
        let from = &triangle[(first_tile + t) * rows..][head_rows.clone()];
        head.iter_mut().zip(from).for_each(|(h, from)| h.0[lanes.clone()].copy_from_slice(&from.0));
    }
    let factor = reflect(&mut head, u);
    for t in 0..PANEL / LANES {
        let to = &mut triangle[(first_tile + t) * rows..][head_rows.clone()];
        let lanes = t * LANES..(t + 1) * LANES;
        to.iter_mut().zip(&head).for_each(|(to, h)| to.0.copy_from_slice(&h.0[lanes.clone()]));
    }
    for tile in first_tile + PANEL / LANES..columns.tiles() {
        if !columns.is_blank(tile) {
            let above = &mut triangle[tile * rows..][head_rows.clone()];
            let above = above.first_chunk_mut().expect("a panel of rows");
            let below = &mut new_tiles[tile * ROWS_AT_ONCE..][..ROWS_AT_ONCE];
            transform(u, &factor, above, below.first_chunk_mut().expect("rows of one panel"));
        }
    }
}

/// Reduces [head; u] to [R; 0], with an upper triangular head. Leaves R in `head` and U in `u`, and
/// returns T.
#[inline(always)]
fn reflect(head: &mut [PanelRow; PANEL], u: &mut [PanelRow; ROWS_AT_ONCE]) -> [PanelRow; PANEL] {
    let mut t = [BLANK_ROW; PANEL];
    // Factors that columns of U lack while they are computed.
    let mut scales = [0.0; PANEL];
    // Products of one column with all columns, from its own row of `u` on downwards.
    let mut products = [0.0; PANEL];
    for PanelRow(row) in u.iter() {
        (0..PANEL).for_each(|c| products[c] += row[0] * row[c]);
    }
    for j in 0..PANEL {
        let (mut update, own) = ([0.0; PANEL], &mut head[j].0);
        if products[j] > NEGLIGIBLE {
            let (alpha, length) = (own[j], (own[j] * own[j] + products[j]).sqrt());
            let beta = if alpha > 0.0 { -length } else { length };
            let (scale, tau) = (1.0 / (alpha - beta), (beta - alpha) / beta);
            own[j] = beta;
            for c in j + 1..PANEL {
                let w = tau * (own[c] + scale * products[c]);
                own[c] -= w;
                update[c] = scale * w;
            }
            for (i, PanelRow(t)) in t[..j].iter_mut().enumerate() {
                let sum: f64 = (i..j).map(|k| t[k] * (scales[k] * products[k])).sum();
                t[j] = -tau * scale * sum;
            }
            (t[j].0[j], scales[j]) = (tau, scale);
        }
        if j + 1 < PANEL {
            products = sweep(u, j, &update);
        }
    }
    for PanelRow(row) in u.iter_mut() {
        row.iter_mut().zip(&scales).for_each(|(u, scale)| *u *= scale);
    }
    t
}

/// Applies the reflection of column `j`, and returns the products of column `j` + 1 with all columns.
#[inline(always)]
fn sweep(u: &mut [PanelRow; ROWS_AT_ONCE], j: usize, update: &[f64; PANEL]) -> [f64; PANEL] {
    let (mut products, next_update) = ([0.0; PANEL], update[j + 1]);
    for PanelRow(row) in u.iter_mut() {
        let own = row[j];
        let next = row[j + 1] - own * next_update;
        for c in 0..PANEL {
            row[c] -= own * update[c];
            products[c] += next * row[c];
        }
    }
    products
}

/// Transforms one tile of columns: [above; below] ← (I − V·Tᵀ·Vᵀ)·[above; below].
#[inline(always)]
fn transform(
    u: &[PanelRow; ROWS_AT_ONCE],
    t: &[PanelRow; PANEL],
    above: &mut [Tile; PANEL],
    below: &mut [Tile; ROWS_AT_ONCE],
) {
    let (mut sums, mut w) = (*above, [BLANK; PANEL]);
    for (strip, sums) in sums.as_chunks_mut::<STRIP>().0.iter_mut().enumerate() {
        *sums = add_products(*sums, u, below, strip * STRIP);
    }
    for (strip, w) in w.as_chunks_mut::<STRIP>().0.iter_mut().enumerate() {
        // T is upper triangular: what follows in these columns is 0.
        let (first, rows) = (strip * STRIP, (strip + 1) * STRIP);
        *w = add_products(*w, &t[..rows], &sums[..rows], first);
    }
    for (above, w) in above.iter_mut().zip(&w) {
        (0..LANES).for_each(|l| above.0[l] -= w.0[l]);
    }
    for (u, b) in u.as_chunks::<STRIP>().0.iter().zip(below.as_chunks_mut::<STRIP>().0) {
        let mut own = *b;
        for (k, Tile(w)) in w.iter().enumerate() {
            for i in 0..STRIP {
                for l in 0..LANES {
                    own[i].0[l] -= u[i].0[k] * w[l];
                }
            }
        }
        *b = own;
    }
}

/// Adds Aᵀ·B to `sums` for [`STRIP`] columns of A, from the one at `first` on.
#[inline(always)]
fn add_products(
    mut sums: [Tile; STRIP],
    a: &[PanelRow],
    b: &[Tile],
    first: usize,
) -> [Tile; STRIP] {
    for (PanelRow(a), Tile(b)) in a.iter().zip(b) {
        let a = a[first..].first_chunk::<STRIP>().expect("a strip");
        for i in 0..STRIP {
            for l in 0..LANES {
                sums[i].0[l] += a[i] * b[l];
            }
        }
    }
    sums
}
