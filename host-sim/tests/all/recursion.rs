//! Training by recursion, as by a user.

use crate::common::{Folder, small_scene};

#[test]
fn both_solvers_give_the_same_errors() {
    let folder = Folder::new("solvers");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["synth", "scene.toml", "-n", "300", "--seed", "99", "-o", "test.csv"]);
    let rmse = |solver: &str| {
        folder.succeed(&["train", "scene.toml", "--solver", solver, "-o", "m.bin"]);
        let evaluated = folder.succeed(&["eval", "m.bin", "test.csv", "--json"]);
        let evaluated: serde_json::Value = serde_json::from_str(&evaluated).unwrap();
        evaluated["decoders"][0]["errors"][2]["rmse"].as_f64().unwrap()
    };
    let (qr, rls) = (rmse("qr"), rmse("rls"));
    assert!((rls / qr - 1.0).abs() < 1e-4, "{qr} {rls}");
}
