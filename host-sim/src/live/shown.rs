//! What the page is shown of a feed: its layout, and each moment.

use taxel_firmware::link::message::EstimateReport;
use taxel_recording::{Column, Electrode, Layout};
use taxel_view::message::{self as page, Channel, Flag};

use super::feed::Feed;
use super::moment::Moment;

/// End of the colour scale in mm.
const SCALE_MM: f32 = 1.0;

/// Layout of a `feed` as the page takes it.
pub fn layout(feed: &dyn Feed) -> page::Layout {
    let (layout, about) = (feed.layout(), feed.about());
    let channel =
        |column: &Column| Channel { name: column.name.clone(), unit: column.unit.clone() };
    let electrode = |it: &Electrode| page::Electrode {
        name: it.name.clone(),
        place_mm: it.place_mm.map(|place| place as f32),
        outputs: it.outputs,
    };
    page::Layout {
        title: layout.title.clone(),
        kind: about.kind,
        source: about.source,
        rows: layout.rows,
        columns: layout.columns,
        readings: layout.readings.iter().map(channel).collect(),
        outputs: layout.outputs.iter().map(channel).collect(),
        electrodes: layout.electrodes.iter().map(electrode).collect(),
        scale_mm: SCALE_MM,
        can: about.can,
        duration_s: about.duration_s,
    }
}

/// Sum of the squared errors in mm² of deformations, and their number.
pub fn errors(layout: &Layout, outputs: Option<&[f32]>, truth: Option<&[f32]>) -> (f64, usize) {
    let (Some(outputs), Some(truth)) = (outputs, truth) else { return (0.0, 0) };
    let pairs = outputs.iter().zip(truth).zip(&layout.outputs);
    let squares =
        pairs.filter(|(_, column)| column.unit == "mm").map(|((a, b), _)| (a - b).powi(2));
    let known: Vec<f64> = squares.filter(|it| it.is_finite()).map(f64::from).collect();
    (known.iter().sum(), known.len())
}

/// What is to be said of a row, by how its decoding ended.
fn row_flag(status: u8) -> Option<Flag> {
    match status {
        0 => None,
        _ => Some(Flag::Missing),
    }
}

/// A moment as the page takes it.
pub fn frame(moment: &Moment) -> page::Frame {
    let frame = &moment.frame;
    let flags = [
        (EstimateReport::NOVEL, Flag::Novel),
        (EstimateReport::CLAMPED, Flag::Clamped),
        (EstimateReport::FAULTY_READING, Flag::Missing),
    ];
    page::Frame {
        number: frame.number.into(),
        time_us: frame.time_us,
        age_ms: moment.heard.elapsed().as_secs_f32() * 1000.0,
        readings: frame.readings.clone(),
        outputs: frame.outputs.clone().unwrap_or_default(),
        deviations: frame.deviations.clone(),
        truth: frame.truth.clone(),
        row_status: (!moment.row_status.is_empty())
            .then(|| moment.row_status.iter().map(|status| row_flag(*status)).collect()),
        novelty: moment.novelty,
        flags: flags.into_iter().filter(|(flag, _)| moment.has(*flag)).map(|it| it.1).collect(),
        contact: frame.contact_mm.map(|[x_mm, y_mm, depth_mm]| page::Contact {
            x_mm,
            y_mm,
            depth_mm,
        }),
        force_n: frame.force_n.map(|force| force[2]),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use taxel_rig::scans::{Scan, ScanEstimate};

    use super::*;

    #[test]
    fn a_scan_is_shown_with_what_the_device_said_of_it() {
        let estimate = ScanEstimate {
            outputs: vec![0.5, 0.25],
            row_status: vec![0, 2],
            flags: EstimateReport::NOVEL | EstimateReport::FAULTY_READING,
            deviations: vec![0.1, 0.2],
            novelty: Some(3.0),
        };
        let (number, start_us, heard) = (7, 9000, Instant::now());
        let events = vec![];
        let scan =
            Scan { number, start_us, heard, readings: vec![], estimate: Some(estimate), events };
        let mut moment = Moment::of_scan(scan.clone(), 3);
        (moment.frame.force_n, moment.frame.contact_mm) =
            (Some([1.0, 2.0, 4.0]), Some([5.0, 6.0, 0.5]));
        let shown = frame(&moment);
        assert!(shown.readings.len() == 3 && shown.readings.iter().all(|it| it.is_nan()));
        assert_eq!((shown.number, shown.time_us, shown.outputs), (7, 9000, vec![0.5, 0.25]));
        assert_eq!(shown.row_status, Some(vec![None, Some(Flag::Missing)]));
        assert_eq!(shown.flags, [Flag::Novel, Flag::Missing]);
        assert_eq!((shown.novelty, shown.force_n), (Some(3.0), Some(4.0)));
        assert_eq!(shown.deviations, Some(vec![0.1, 0.2]));
        let contact = page::Contact { x_mm: 5.0, y_mm: 6.0, depth_mm: 0.5 };
        assert_eq!(shown.contact, Some(contact));
        // Without a model there are no outputs, whatever came.
        let flags = EstimateReport::NO_MODEL;
        let estimate = Some(ScanEstimate { flags, ..ScanEstimate::default() });
        let shown = frame(&Moment::of_scan(Scan { estimate, ..scan }, 3));
        assert!(shown.outputs.is_empty() && shown.flags.is_empty() && shown.row_status.is_none());
    }
}
