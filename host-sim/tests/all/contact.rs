//! Scenes that ask for the contact alone: one small network for the whole array.

use crate::common::Folder;

#[test]
fn features_are_chosen_alike_whichever_way_weights_are_computed() {
    let folder = Folder::new("contact-solvers");
    let [by_qr, by_rls] = ["qr", "rls"].map(|solver| {
        let options = ["-n", "600", "--centres", "12", "--no-refine", "-o", "m.bin"];
        folder.json(&[&["train", "contact", "--solver", solver][..], &options].concat())
    });
    assert_eq!(by_qr["features"], by_rls["features"]);
    assert_ne!(by_qr["model_crc"], by_rls["model_crc"]);
}
