//! Contacts that move: what commands say of them.

use crate::common::{Folder, tiny_scene};

#[test]
fn commands_tell_the_error_as_a_robot_meets_it_beside_the_age_of_an_estimate() {
    let folder = Folder::new("moving-commands");
    let motion = "[motion]\nspeed_mm_per_s = [50.0, 50.0]\npress_rate_hz = [3.0, 3.0]\ntrajectories = 4\n[noise]";
    folder.write("small.toml", tiny_scene().replace("[noise]", motion));
    folder.write("still.toml", tiny_scene());
    let run = folder.json(&["run", "small.toml"]);
    let ways = run["moving"].as_array().unwrap();
    let rmse = |of: &serde_json::Value| of["rmse_dz_mm"].as_f64().unwrap();
    let is_filtered = |of: &serde_json::Value| of["filter_ms"].is_number();
    assert_eq!([0, 1, 2].map(|way| is_filtered(&ways[way])), [false, true, false]);
    assert_eq!((&ways[0]["decoder"], &ways[2]["decoder"]), (&"network".into(), &"linear".into()));
    assert!(rmse(&ways[0]) < rmse(&ways[2]), "{ways:?}");
    assert!(ways[0]["age_ms"].as_f64().unwrap() > 0.3);
    let shown = folder.read("out/small/figures/trajectory.csv");
    assert_eq!(shown.lines().count(), 1 + 3 * 486);
    let text = folder.succeed(&["run", "small.toml"]);
    assert!(
        text.contains(
            "as a robot meets them, on 4 contacts that slide at 50 mm/s and press 3 times a second"
        ),
        "{text}"
    );
    let page = folder.read("out/small/report.html");
    assert!(page.contains("Contacts that move") && page.contains("while a contact slides"));
    assert_eq!(folder.json(&["run", "still.toml"])["moving"], serde_json::json!([]));

    let trade = ["trade", "small.toml", "--centres", "12", "--no-refine", "--max-error", "1"];
    let traded = folder.json(&trade);
    assert_eq!(traded["motion"]["speed_mm_per_s"], serde_json::json!([50.0, 50.0]));
    let chosen = traded["chosen"].as_u64().unwrap() as usize;
    assert_eq!(traded["points"][chosen]["device.samples"], 1);
}
