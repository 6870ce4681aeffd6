//! Data sets of tables.

use taxel_data::dataset::{Chosen, Kept};
use taxel_data::{DataFile, Dataset};

/// Frames of a table, with how many of its lines they are from.
fn frames(names: &[&str], values: Vec<f64>, inputs: &str, outputs: &str) -> (Dataset, Kept) {
    let header = names.iter().map(ToString::to_string).collect();
    let file = DataFile::of_table("log.csv".as_ref(), header, values).unwrap();
    let chosen = Chosen::new(&file, Some(inputs), Some(outputs), &[]).unwrap();
    Dataset::from_file(file, chosen).unwrap()
}

#[test]
fn outputs_of_other_rows_make_one_row_of_all() {
    let names = ["r1c1_ohm", "r2c1_ohm", "r3e1_dz_mm", "r4e1_dz_mm"];
    let (frames, _) = frames(&names, vec![1.0, 2.0, 3.0, 4.0], "r*_ohm", "r*_mm");
    assert_eq!((frames.rows, frames.names()), (1, names.to_vec()));
}

#[test]
fn keeping_frames_gives_the_subset_and_inputs_may_share_a_span() {
    let names = |all: [&str; 2]| all.map(String::from).to_vec();
    let mut set = Dataset::empty(names(["a", "b"]), names(["x_mm", "f_n"]), 1, 5);
    set.inputs.values = vec![1.0, 50.0, 3.0, 20.0, 2.0, 40.0, 7.0, 30.0, 5.0, 60.0].into();
    set.outputs.values = (0..10).map(f64::from).collect();
    let mut kept = set.clone();
    kept.keep(&[0, 2, 3]);
    assert_eq!(kept, set.subset(&[0, 2, 3]));
    assert_eq!(kept.input_ranges(), [[1.0, 7.0], [30.0, 50.0]]);
    kept.common_span = true;
    assert_eq!(kept.input_ranges(), [[-6.0, 14.0], [30.0, 50.0]]);
}

#[test]
fn columns_that_lack_most_are_named_the_emptiest_first() {
    let gap = f64::NAN;
    #[rustfmt::skip]
    let values = vec![
        gap, gap, 1.0, gap, gap,
        2.0, gap, 2.0, gap, gap,
        3.0, 3.0, 3.0, gap, gap,
        4.0, 4.0, 4.0, 4.0, gap,
    ];
    let (_, kept) = frames(&["a", "b", "c", "d", "e"], values, "a,b,c", "d,e");
    let most = kept.left_out.missing_most;
    assert_eq!(most, [("e", 4), ("d", 3), ("b", 2)].map(|(name, n)| (name.into(), n)));
}
