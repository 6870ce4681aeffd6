use taxel_data::{Dataset, Silent};
use taxel_learn::decoders::mean::Mean;
use taxel_learn::reading_model::Extent;

use super::*;
use crate::experiment::Experiment;

fn errors(rmse: f64, r_squared: f64) -> Vec<Errors> {
    vec![Errors::of("dz_mm", rmse, r_squared)]
}

fn others(contacts: &[(&str, f64, f64, Option<f64>)]) -> Others {
    let contacts = contacts.iter().map(|(name, rmse, r_squared, percent_novel)| OtherErrors {
        name: (*name).into(),
        errors: errors(*rmse, *r_squared),
        mean: errors(0.2, 0.0),
        percent_novel: *percent_novel,
    });
    let contacts: Vec<OtherErrors> = contacts.collect();
    Others { frames: 1000, own_percent_novel: contacts[0].percent_novel, contacts }
}

/// Warning beside an RMSE of 0.04 mm and an R² of 0.96 on own contacts.
fn warning(contacts: &[(&str, f64, f64, Option<f64>)]) -> Option<String> {
    let decoders = [("network", 0.04, 0.96), ("mean", 0.2, 0.0)];
    let decoders = decoders.map(|(name, rmse, r)| DecoderErrors::new(name, errors(rmse, r)));
    others(contacts).warning(&decoders).map(|warning| warning.text)
}

#[test]
fn contacts_with_much_larger_errors_give_a_warning_with_advice() {
    // Not more than 1.5 times the RMSE, nor 1.5 times the share of the deviation: √0.09/√0.04.
    assert_eq!(warning(&[("edge", 0.0599, 0.9101, None)]), None);
    let by_rmse = warning(&[("edge", 0.0601, 0.97, None)]).unwrap();
    let told = "edge (dz_mm 0.060 mm with R² 0.97 instead of 0.040 with 0.96)";
    assert!(
        by_rmse.contains(told) && by_rmse.ends_with("notice them (train --reading-model full)"),
        "{by_rmse}"
    );
    assert!(warning(&[("small", 0.03, 0.90, None)]).unwrap().contains("small (dz_mm 0.030 mm"));
    let many = [("a", 0.07, 0.9, None), ("b", 0.09, 0.9, None), ("c", 0.08, 0.9, None)];
    let many = warning(&many).unwrap();
    assert!(
        many.contains(": b (") && many.contains(", c (") && many.contains(" and 1 more;"),
        "{many}"
    );
}

#[test]
fn novel_contacts_and_poorly_decoded_outputs_give_no_warning() {
    assert_eq!(warning(&[("edge", 0.09, 0.5, Some(90.0))]), None);
    let missed = warning(&[("edge", 0.09, 0.5, Some(89.9))]).unwrap();
    assert!(missed.ends_with("do not use estimates of novel frames"), "{missed}");
    let hardly = [("network", 0.18, 0.19), ("mean", 0.2, 0.0)];
    let hardly = hardly.map(|(name, rmse, r)| DecoderErrors::new(name, errors(rmse, r)));
    assert_eq!(others(&[("edge", 0.4, -3.0, None)]).warning(&hardly), None);
}

/// Small model of `press` for compression, on rows 4 and 5.
fn press() -> Experiment {
    let mut scene = Experiment::load("press").unwrap();
    scene.world.read_rows = vec![3, 4];
    (scene.frames, scene.training.options.centres, scene.training.refine) = (2000, 16, false);
    scene.training.reading_model = Some(Extent::Full);
    scene
}

#[test]
fn a_model_is_judged_by_other_contacts_of_its_own_sensor() {
    let scene = press();
    let blob = scene.train(&Silent).unwrap();
    let model = blob.prepare();
    let measure = scene.measure();
    let few = Experiment { test_frames: 60, ..scene.clone() };
    assert!(frames(&Subject::Scene(few.into())).iter().all(|(_, it)| it.frames() == 60));
    let subject = Subject::Scene(scene.into());
    let frames = frames(&subject);
    let names: Vec<&str> = frames.iter().map(|(name, _)| name.as_str()).collect();
    let expected = [
        "smaller radii",
        "larger radii",
        "more shear",
        "flat punch",
        "edge",
        "ellipse",
        "long tail",
        "two contacts",
    ];
    assert_eq!(names, expected);
    let (training, own) = subject.sets();
    let own = Dataset::clone(&own);
    let found =
        Others::new(&frames, (&model, &Mean::fit(&training.frames)), &own, &measure).unwrap();
    for ((_, frames), found) in frames.iter().zip(&found.contacts) {
        assert_eq!((frames.frames(), &frames.outputs.names), (1000, &own.outputs.names));
        let judged = metrics::judge(&model, frames, &measure);
        assert_eq!(judged.errors[2].rmse, found.errors[2].rmse);
        assert!(found.mean[2].rmse > 0.05 && found.errors[2].ratio_to_limit.is_none());
    }
    // Narrow dents leave most electrodes at rest; wide ones press them all.
    let of = |name: &str| found.contacts.iter().find(|it| it.name == name).unwrap();
    assert!(of("smaller radii").mean[2].rmse < 0.8 * of("larger radii").mean[2].rmse);
    assert!(of("smaller radii").errors[2].r_squared < Some(0.7));
    // Wider contacts are more novel than what was trained on, of which half a percent is.
    let own_novel = found.own_percent_novel.unwrap();
    assert!(own_novel < 2.0, "{own_novel} %");
    assert!(found.contacts.iter().all(|it| it.percent_novel.is_some()));
    assert!(of("larger radii").percent_novel > Some(4.0 * own_novel));
}

#[test]
fn scenes_without_a_contact_have_no_others() {
    let subject = |scene: Experiment| Subject::Scene(scene.into());
    assert!(frames(&subject(Experiment::load("paper").unwrap())).is_empty());
    let contact = Experiment::load("contact").unwrap();
    // Two contacts have no one centre.
    assert!(contact.others.iter().all(|other| other.name != "two contacts"));
    assert_eq!(contact.others.len(), 7);
    // Other contacts are still, so that rubber that creeps does not matter for them.
    let moving = Experiment::text("moving").unwrap();
    let creeping = "[rubber]\nkind = \"standard_linear_solid\"\ninstant_share = 0.8\ntime_constant_ms = 100.0\n";
    let others = [String::new(), creeping.into()]
        .map(|rubber| Experiment::parse("s", &format!("{moving}\n{rubber}")).unwrap().others.len());
    assert_eq!(others, [8, 8]);
}

#[test]
fn frames_without_a_novelty_count_neither_as_novel_nor_as_known() {
    assert_eq!(percent_novel(&[1.0, -1.0, f64::NAN, f64::NAN]), 50.0);
}
