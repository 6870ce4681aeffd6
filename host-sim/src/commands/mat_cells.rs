//! Columns of a data file that are the cells of a mat, with their names in a model.

use taxel_data::dataset::USUAL_INPUTS;
use taxel_data::mat::{self, Grid, Mat};
use taxel_data::{DataFile, columns};

/// Input columns of a file, each with its name in a model: that of a cell, if they are a mat.
pub struct MatCells {
    names: Vec<(String, String)>,
    /// Mat that the numbers in the columns' names were found to fill.
    pub found: Option<Mat>,
}

impl MatCells {
    /// Columns of `file` that match the `pattern`, and whose `grid` may be given.
    pub fn of(
        file: &DataFile,
        pattern: Option<&str>,
        grid: Option<Grid>,
    ) -> taxel_data::Result<Self> {
        let chosen = columns::select(&file.header, pattern.unwrap_or(USUAL_INPUTS));
        let (cells, found) =
            mat::cell_names(&file.header, &chosen, grid).map_err(taxel_data::Error::unfit)?;
        let own = chosen.iter().map(|column| file.header[*column].clone());
        Ok(Self { names: own.zip(cells).collect(), found })
    }

    /// Names inputs, which are among these columns, after their cells.
    pub fn name(&self, inputs: &mut [String]) {
        for name in inputs {
            if let Some((_, cell)) = self.names.iter().find(|(own, _)| own == name) {
                name.clone_from(cell);
            }
        }
    }

    /// Wires of which every reading is among the `unused` columns.
    pub fn silent_wires(&self, unused: &[String]) -> Vec<String> {
        let silent = self.names.iter().filter(|(own, _)| unused.contains(own));
        let silent: Vec<String> = silent.map(|(_, cell)| cell.clone()).collect();
        let cells: Vec<String> = self.names.iter().map(|(_, cell)| cell.clone()).collect();
        mat::whole_wires(&cells, &silent)
    }
}
