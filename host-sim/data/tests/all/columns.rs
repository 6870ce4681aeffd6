//! Names of columns: units, groups, patterns and likely meanings.

use taxel_data::columns::{
    READINGS, group_of, is_judged_in_ohm, is_place, known_names, place, quantity_of, row_of,
    select, some_names, unit_of, unmatched, without_unit,
};

#[test]
fn names_tell_row_group_and_unit() {
    assert_eq!(row_of("r12c3_ohm"), Some(12));
    assert_eq!(row_of("r4e2_dz_mm"), Some(4));
    for other in ["fx_n", "r_x", "row1", "r3", "r3x1", "rc1", ""] {
        assert_eq!(row_of(other), None, "{other}");
    }
    assert_eq!(group_of("r4e2_dz_mm"), "dz_mm");
    assert_eq!(group_of("fx_n"), "fx_n");
    assert_eq!((group_of("r4c17_ohm"), unit_of(READINGS)), (READINGS, "Ω"));
    assert_eq!(unit_of("r12c3_ohm"), "Ω");
    assert_eq!(unit_of("fx_n"), "N");
    assert_eq!(unit_of("ch1"), "");
    for (name, unit, bare) in [
        ("fz (N)", "N", "fz"),
        ("fz[mN]", "mN", "fz"),
        ("load_g", "g", "load"),
        ("p_kPa", "kPa", "p"),
        ("x_um", "µm", "x"),
        ("T (°C)", "°C", "T"),
        ("p (bar)", "bar", "p"),
        ("r1 (ohm)", "Ω", "r1"),
        ("x_bar", "", "x_bar"),
        ("ch_A", "", "ch_A"),
        ("n", "", "n"),
        ("(N)", "", "(N)"),
        ("x_min", "", "x_min"),
        ("p (front)", "", "p (front)"),
        ("f_MN", "", "f_MN"),
    ] {
        assert_eq!((unit_of(name), without_unit(name)), (unit, bare), "{name}");
    }
    assert!(is_judged_in_ohm("r4c17_ohm") && !is_judged_in_ohm("r1 (ohm)"));
    assert_eq!(quantity_of("contact_x_mm"), quantity_of("contact_y_mm"));
    assert_ne!(quantity_of("contact_x_mm"), quantity_of("contact_depth_mm"));
    assert_eq!(quantity_of("r4e2_dz_mm"), quantity_of("x_mm"));
    assert_eq!(["x_mm", "contact_y_mm", "pos_x", "Y (µm)"].map(is_place), [true; 4]);
    let amounts = ["contact_depth_mm", "contact_shear_x_mm", "force_x", "x_n", "r1e2_x_mm", "max"];
    assert_eq!(amounts.map(is_place), [false; 6]);
}

#[test]
fn globs_select_columns_in_file_order() {
    let header = ["ch1", "fx_n", "ch12", "x_mm", "fz_n"].map(String::from);
    assert_eq!(select(&header, "ch*"), [0, 2]);
    assert_eq!(select(&header, "x_mm, f?_n"), [1, 3, 4]);
    assert_eq!(select(&header, "ch?"), [0]);
    assert_eq!(unmatched(&header, "ch*,fy_n"), Some("fy_n"));
    assert_eq!(unmatched(&header, "ch*"), None);
    let (long, many) = (["a".repeat(200)], "*a".repeat(60));
    assert_eq!((select(&long, &(many.clone() + "b")), select(&long, &many)), (vec![], vec![0]));
}

#[test]
fn parts_with_an_exclamation_mark_leave_columns_out() {
    let header = ["adc_1", "adc_2", "adc_3", "!x", "f (N)", "f2"].map(String::from);
    assert_eq!(select(&header, "adc_*,!adc_2"), [0, 2]);
    assert_eq!(select(&header, "!adc_2..adc_3, *"), [0, 3, 4, 5]);
    assert_eq!(select(&header, "!x"), [3]);
    assert_eq!(select(&header, "f"), [4]);
    assert_eq!(unmatched(&header, "adc_*,!adc_7"), Some("!adc_7"));
    assert_eq!(select(&header, "!adc_1,!f2"), [0; 0]);
    let names = |name| place(&header, name);
    assert_eq!((names("f"), names("f (N)"), names("g")), (Some(4), Some(4), None));
    assert_eq!((names("f2 (N)"), names("f (g)")), (Some(5), None));
    assert_eq!(place(&["f (N)", "f [g]"].map(String::from), "f"), None);
}

#[test]
fn ranges_select_columns_from_one_to_another() {
    let header = ["c1", "c2", "c3", "b.c1", "b.c2", "a..b"].map(String::from);
    assert_eq!(select(&header, "c2..c3"), [1, 2]);
    assert_eq!(select(&header, "b.c2, c3..b.c1,c3"), [2, 3, 4]);
    assert_eq!(select(&header, "c1..c1"), [0]);
    assert_eq!(select(&header, "a..b"), [5]);
    for nothing in ["c2..c9", "c3..c2", "..", "c2.."] {
        assert_eq!(unmatched(&header, nothing), Some(nothing));
    }
}

#[test]
fn a_wrong_name_is_answered_by_the_one_that_is_most_like_it() {
    let header = ["t", "Force_z (N)", "force", "x_mm", "y_mm"].map(String::from);
    let meant = |wanted: &str| {
        let known = known_names(&header, wanted);
        let (names, meant) = known.split_once("; did you mean ").unwrap_or((&known, ""));
        assert_eq!(names, "t, Force_z (N), force, x_mm, y_mm", "{wanted}");
        meant.replace(['"', '?'], "")
    };
    // The same but for case, unit and signs goes before a part of it; one letter is a part of anything.
    for (wanted, found) in [
        ("FORCE", "force"),
        ("forcez", "Force_z (N)"),
        ("my_force_mN", "force"),
        ("Force_z_mN", "Force_z (N)"),
        ("orc", "Force_z (N)"),
        ("Y", "y_mm"),
        ("tx", ""),
        ("gap", ""),
        ("*", ""),
    ] {
        assert_eq!(meant(wanted), found, "{wanted}");
    }
    let names = |count: usize| -> Vec<String> { (1..=count).map(|i| format!("c{i}")).collect() };
    assert_eq!(some_names(&names(8)), names(8).join(", "));
    assert_eq!(some_names(&names(9)), "c1, c2, c3, c4, c5, …, c7, c8, c9 (9 columns)");
}
