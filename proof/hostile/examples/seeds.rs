//! Writes the seeds of the corpora whose format is Taxel's own: `cargo run -p hostile --example seeds` in the folder
//! `proof`. Those of CSV files, arrays and scenes are files that were written by hand.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use hostile::seal;
use mock_board::{
    Bench, Flash, ask, blob, blob_of_features, blob_with_confidence, quiet, request_bytes,
    upload_steps,
};
use taxel_core::blob::Floats;
use taxel_core::rbf::Format;
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_firmware::app::Session;
use taxel_firmware::link::cobs;
use taxel_firmware::link::message::{Configuration, Report, Request, Setting};
use taxel_firmware::link::packet;
use taxel_firmware::store::{Kind, Slot};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, fill, pack, relative};
use taxel_recording::{
    Column, Contact, Electrode, Extras, Frame, Health, Layout, Replace, Status, Writer,
};
use taxel_simulate::outputs::{ElectrodeOutputs, Quantity};
use taxel_simulate::sensor::Axis;
use taxel_simulate::{World, synthesise};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

fn main() -> Outcome {
    let blobs: Vec<Vec<u8>> = blobs()?.iter().map(|blob| seal::body(blob).to_vec()).collect();
    let all = [
        ("blob", blobs),
        ("packet", packets()),
        ("settings", settings()),
        ("link", links()),
        ("recording", recordings()?),
    ];
    for (target, seeds) in all {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target);
        fs::create_dir_all(&folder)?;
        for (index, seed) in seeds.iter().enumerate() {
            fs::write(folder.join(format!("seed-{index:02}")), seed)?;
        }
    }
    Ok(())
}

/// A recording that is whole, and one that was cut, which has every topic. Their chunks have no checksum, so that what is
/// in them can change.
fn recordings() -> Outcome<Vec<Vec<u8>>> {
    let (whole, _) = recording(false)?;
    let (mut all, end) = recording(true)?;
    all.truncate(end);
    Ok(vec![whole, all])
}

/// A recording, with every topic or a few, and where its last chunk ends.
fn recording(has_all: bool) -> Outcome<(Vec<u8>, usize)> {
    let column = |name: &str, unit: &str| Column { name: name.into(), unit: unit.into() };
    let layout = Layout {
        title: "t".into(),
        rows: 1,
        columns: 2,
        readings: vec![column("a", ""), column("b", "")],
        outputs: vec![column("x", "mm"), column("z", "mm"), column("f", "N")],
        electrodes: vec![Electrode {
            name: "e".into(),
            place_mm: [1.0, 2.0, 3.0],
            outputs: [Some(0), None, Some(1)],
        }],
    };
    let extras = Extras {
        blob: Some(vec![1, 2]),
        scene: Some("s".into()),
        settings: [("k".into(), "v".into())].into(),
        ..Extras::default()
    };
    let path = std::env::temp_dir().join(format!("taxel-seed-{}.mcap", std::process::id()));
    let start = UNIX_EPOCH + Duration::from_secs(1);
    let mut writer = Writer::create(&path, &layout, &extras, start, Replace::Recordings)?;
    for number in 0..4 {
        let is_second = number % 2 == 1;
        let has_contact = has_all && is_second;
        writer.write(&Frame {
            time_us: 10_000 * u64::from(number),
            number,
            readings: vec![60.0, f32::NAN],
            outputs: Some(vec![0.5, 0.25, 1.0]),
            deviations: has_contact.then(|| vec![0.1; 3]),
            truth: has_contact.then(|| vec![0.5; 3]),
            contact: has_contact.then_some(Contact { place_mm: [1.0; 3], force_n: Some([0.5; 3]) }),
            status: has_all.then(|| Status {
                row_wires: vec![Health::Sound],
                column_wires: vec![Health::Open, Health::Noisy],
                is_novel: has_contact,
                ..Status::default()
            }),
        })?;
        if is_second {
            writer.flush()?;
        }
    }
    writer.finish()?;
    let mut whole = fs::read(&path)?;
    fs::remove_file(&path)?;
    // A record is its kind, the length of its body, and that. Chunks are of kind 6; two times and a length stand before
    // their checksum.
    let (mut at, mut last_end) = (8, 0);
    while let Some(length) = whole.get(at + 1..at + 9) {
        let end = at + 9 + u64::from_le_bytes(length.try_into()?) as usize;
        if whole[at] == 6 {
            whole[at + 33..at + 37].fill(0);
            last_end = end;
        }
        at = end;
    }
    Ok((whole, last_end))
}

/// Models of every format and with every section.
fn blobs() -> Outcome<Vec<Vec<u8>>> {
    let mut blobs = vec![
        blob(1, 2).to_vec(),
        blob_with_confidence(false).to_vec(),
        blob_with_confidence(true).to_vec(),
        blob_of_features(2).to_vec(),
    ];
    let outputs = ElectrodeOutputs { quantity: Quantity::Deformation, axes: vec![Axis::Z] };
    let mut world = World { outputs: outputs.into(), read_rows: vec![3, 4], ..World::press() };
    // A small sensor, so that corpora stay small.
    world.sensor.electrodes_per_row_wire = 2;
    world.sensor.upper_electrodes_mm.truncate(16);
    world.sensor.column_wires = 6;
    world.sensor.lower_electrodes_mm.truncate(18);
    let dataset = synthesise(&world, Stream::Training, 120);
    let baseline = dataset.inputs.mean_line();
    let ratios = relative::dataset(dataset.clone(), &baseline);
    for format in Format::ALL {
        let of_rows = Options { centres: 3, format, ..Options::default() };
        let whole = Options { whole_array: true, features: Some(4), spread: 0.5, ..of_rows };
        for (data, options) in [
            (&dataset, of_rows),
            (&dataset, Options { affine_tail: false, ..of_rows }),
            (&ratios, of_rows),
            (&dataset, whole),
        ] {
            let trained = train(data, &options, &Silent)?;
            let origin = Origin::of_data("m", 0, 1, data);
            let blob = pack(&trained, data, &origin)?;
            blobs.push(blob.bytes().to_vec());
            if options.whole_array {
                blobs.push(fill::add(&blob, &data.inputs)?.bytes().to_vec());
            }
        }
    }
    Ok(blobs)
}

/// Requests that a host may send.
fn requests(use_them: &mut dyn FnMut(&Request<'_>)) {
    let readings = [60.0_f32.to_le_bytes(); 6].concat();
    let filtering = Configuration { filter_time_constant_us: 5000, report_every: 2, ..quiet() };
    for request in [
        Request::Identify,
        Request::Statistics,
        Request::Configuration,
        Request::Configure(quiet()),
        Request::Configure(Configuration::DEFAULT),
        Request::Resume,
        Request::CaptureBaseline { frames: 1 },
        Request::Decode { frame: 1, start_us: 0, readings_ohm: Floats(&readings) },
        Request::Configure(filtering),
        Request::Decode { frame: 2, start_us: 1 << 40, readings_ohm: Floats(&readings) },
    ] {
        use_them(&request);
    }
    let model = blob(4, 3);
    upload_steps(&model, 60).into_iter().map(Request::Upload).for_each(|step| use_them(&step));
}

fn packets() -> Vec<Vec<u8>> {
    let mut packets = vec![b"\x02\x01\x00\x02".to_vec(), [&[2][..], &[7; 300]].concat()];
    requests(&mut |request| {
        let mut buffer = [0; 256];
        let Some(sealed) = packet::encode(3, request, &mut buffer) else { return };
        packets.push([&[1], &sealed[..sealed.len() - 4]].concat());
        let mut line = vec![0];
        cobs::encode(sealed, |byte| {
            line.push(byte);
            true
        });
        packets.push(line);
    });
    let mut buffer = [0; 256];
    if let Some(sealed) =
        packet::encode(3, &Report::Baseline { readings_ohm: Floats(&[0; 24]) }, &mut buffer)
    {
        packets.push([&[1], &sealed[..sealed.len() - 4]].concat());
    }
    packets
}

fn settings() -> Vec<Vec<u8>> {
    let mut kept = Flash::journal();
    let mut seeds = vec![vec![0], vec![1], vec![2]];
    for (setting, bytes) in Setting::ALL.into_iter().zip([&[1_u8; 20][..], &[2; 40], &[3; 60]]) {
        let _ = kept.keep(setting.into(), &[bytes]);
        seeds.push([&[1], bytes].concat());
    }
    seeds.push([&[0], &kept.pages()[0].bytes()[..512]].concat());
    // What a device keeps by itself.
    let model = blob(1, 3);
    let mut slots = Flash::slots_with(&model);
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let other = Configuration { frame_period_us: 20_000, ..quiet() };
    for request in [Request::Configure(other), Request::Keep(Setting::Configuration)] {
        ask(&mut session, &board, &request, |_| ());
    }
    let _ = session;
    let mut kept = bench.journal();
    let bytes = kept.read(Kind::Configuration).unwrap_or_default();
    seeds.push([&[1], bytes].concat());
    seeds.push([&[0], &kept.pages()[0].bytes()[..512]].concat());
    seeds
}

/// Steps of the link: operation, length, bytes.
fn links() -> Vec<Vec<u8>> {
    let step = |operation: u8, bytes: &[u8]| {
        let bytes = &bytes[..bytes.len().min(255)];
        [&[operation, bytes.len() as u8], bytes].concat()
    };
    let whole = |model: u8| step(5, &[model]);
    let mut seeds = vec![
        whole(1),
        [whole(1), step(10, &[]), whole(2)].concat(),
        [step(11, &[0, 0, 1, 0]), whole(1), step(10, &[]), whole(1)].concat(),
        [step(11, &[0, 0, 8, 0]), whole(2), step(11, &[0, 0, 2, 1]), whole(1)].concat(),
        [step(7, &[0, 1, 0, 0]), step(9, &[0; 24]), step(8, &[3]), step(5, &[1, 2, 9])].concat(),
    ];
    requests(&mut |request| {
        let line = request_bytes(5, request);
        seeds.push(step(0, &line));
        let mut buffer = [0; 256];
        if let Some(sealed) = packet::encode(1, request, &mut buffer) {
            seeds.push(step(1, &sealed[2..sealed.len() - 4]));
        }
    });
    seeds
}
