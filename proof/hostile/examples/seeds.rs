//! Writes the seeds of all corpora: `cargo run -p hostile --example seeds` from the root of the repository.

use std::error::Error;
use std::fs;
use std::path::Path;

use firmware::app::Session;
use firmware::link::cobs;
use firmware::link::message::{Configuration, Report, Request, Setting};
use firmware::link::packet;
use hostile::seal;
use mock_board::{
    Bench, Flash, SharedSettings, ask, blob, blob_of_components, blob_with_confidence, configure,
    quiet, request_bytes, upload_steps,
};
use model_core::blob::Floats;
use model_core::rbf::Format;
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_evaluate::experiment::EMBEDDED;
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, fill, pack, relative};
use taxel_simulate::outputs::{ElectrodeOutputs, Quantity};
use taxel_simulate::sensor::Axis;
use taxel_simulate::{World, synthesise};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

fn main() -> Outcome {
    for (index, blob) in blobs()?.iter().enumerate() {
        write("blob", index, seal::body(blob))?;
    }
    for (index, bytes) in packets().iter().enumerate() {
        write("packet", index, bytes)?;
    }
    for (index, bytes) in settings().iter().enumerate() {
        write("settings", index, bytes)?;
    }
    for (index, bytes) in links().iter().enumerate() {
        write("link", index, bytes)?;
    }
    for (index, text) in csv_files().iter().enumerate() {
        write("csv", index, &[&[(index % 2) as u8], text.as_bytes()].concat())?;
    }
    for (index, bytes) in arrays().iter().enumerate() {
        write("npy", index, bytes)?;
    }
    for (index, text) in scenes().iter().enumerate() {
        write("scene", index, text.as_bytes())?;
    }
    Ok(())
}

fn write(target: &str, index: usize, bytes: &[u8]) -> Outcome {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target);
    fs::create_dir_all(&folder)?;
    Ok(fs::write(folder.join(format!("seed-{index:02}")), bytes)?)
}

/// Models of every format and with every section.
fn blobs() -> Outcome<Vec<Vec<u8>>> {
    let mut blobs = vec![
        blob(1, 2).to_vec(),
        blob_with_confidence(false).to_vec(),
        blob_with_confidence(true).to_vec(),
        blob_of_components(2).to_vec(),
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
            (&dataset, Options { output_rank: Some(2), ..whole }),
        ] {
            let trained = train(data, &options, &Silent)?;
            let origin = Origin::of_data("m", 0, 1, data);
            let blob = pack(&trained, data, &origin)?;
            blobs.push(blob.bytes().to_vec());
            if options.whole_array && options.output_rank.is_none() {
                blobs.push(fill::add(&blob, &data.inputs)?.bytes().to_vec());
            }
        }
    }
    Ok(blobs)
}

/// Requests that a host may send.
fn requests(use_them: &mut dyn FnMut(&Request<'_>)) {
    let readings = [60.0_f32.to_le_bytes(); 6].concat();
    for request in [
        Request::Identify,
        Request::Statistics,
        Request::Configuration,
        Request::Configure { configuration: quiet(), lease_ms: 0 },
        Request::Configure { configuration: Configuration::DEFAULT, lease_ms: 20 },
        Request::Resume,
        Request::CaptureBaseline { frames: 1 },
        Request::Decode { frame: 1, readings_ohm: Floats(&readings) },
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
    let mut kept = SharedSettings::default();
    let mut seeds = vec![vec![0], vec![1], vec![2]];
    for (setting, bytes) in Setting::ALL.into_iter().zip([&[1_u8; 20][..], &[2; 40], &[3; 60]]) {
        let _ = kept.keep_bytes(setting, bytes);
        seeds.push([&[1], bytes].concat());
    }
    let [page, _] = kept.bytes();
    seeds.push([&[0], &page[..512.min(page.len())]].concat());
    // What a device keeps by itself.
    let mut kept = SharedSettings::default();
    let model = blob(1, 3);
    let mut slots = Flash::slots_with(&model);
    let mut bench = Bench::with_settings(quiet(), &kept);
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let other = Configuration { frame_period_us: 20_000, ..quiet() };
    for request in [configure(other), Request::Keep(Setting::Configuration)] {
        ask(&mut session, &board, &request, |_| ());
    }
    let bytes = kept.read_owned(Setting::Configuration).unwrap_or_default();
    seeds.push([&[1], &bytes[..]].concat());
    let [page, _] = kept.bytes();
    seeds.push([&[0], &page[..512.min(page.len())]].concat());
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

fn csv_files() -> Vec<String> {
    [
        "a,b\n1,2\n3,4\n",
        "a,b\r\n1,2\r\n3,4\r\n",
        "a,b\r1,2\r3,4\r",
        "\n\na,b\n1,2\n",
        "\r\ra,b\n1,2\n",
        "\"a\",b\n-1e-3,+2.5E7\n.5,7.\n",
        "a,b\n,\nNaN,\nnan,-nan\n",
        "a,b\n 1 ,\t2\n  ,3\n",
        "a\n1\n2\n",
        "a,b\n4.9406564584124654e-324,1.7976931348623157e308\n",
        "a,b\n\"1\",2\n\n3,4\n",
        "\u{feff}a,b\n1,2\n",
        "1,2\n3,4\n",
        "a,b\n123456789012345678901234567890,0.1000000000000000055511151231257827\n",
        "r1c1_ohm,r1e1_dz_mm\n60.25,0.5\n61.5,\n",
        "a;b\n1;2\n",
        "a,b\n\u{a0}1,2\n",
        "a,a\n1,2\n",
        "a,b\n1,2,3\n",
    ]
    .map(str::to_owned)
    .to_vec()
}

/// Arrays with the header that numpy writes.
fn arrays() -> Vec<Vec<u8>> {
    let array = |version: u8, descr: &str, order: &str, shape: &str, data: &[u8]| {
        let text =
            format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let length = (text.len() as u32).to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        [&[0], &b"\x93NUMPY"[..], &[version, 0], length, text.as_bytes(), data].concat()
    };
    let data: Vec<u8> = (1..=6).flat_map(|number| f64::from(number).to_le_bytes()).collect();
    let mut seeds = vec![
        array(1, "<f8", "False", "(3, 2)", &data),
        array(1, "<f8", "True", "(3, 2)", &data),
        array(2, ">f4", "False", "(12,)", &data),
        array(3, "|u1", "False", "(48,)", &data),
        array(1, "<i8", "False", "(2, 3)", &data),
        array(1, "<i2", "False", "(2, 12)", &data),
        array(1, "|b1", "False", "(4,)", &data[..4]),
        array(1, "<f8", "False", "(9223372036854775807, 2)", &data),
        array(1, "<f8", "False", "()", &data),
    ];
    seeds.push([&[1][..], include_bytes!("archive.npz")].concat());
    seeds
}

/// The scenes that are part of the program, without their comments, and some of their fields changed.
fn scenes() -> Vec<String> {
    let is_kept = |line: &&str| !line.starts_with('#') && !line.is_empty();
    let plain = |text: &str| text.lines().filter(is_kept).collect::<Vec<_>>().join("\n");
    let mut texts: Vec<String> = EMBEDDED.iter().map(|(_, text)| plain(text)).collect();
    let small = texts[1]
        .replace("row_wires = 8", "row_wires = 1")
        .replace("column_wires = 18", "column_wires = 1")
        .replace("electrodes_per_row_wire = 6", "electrodes_per_row_wire = 1")
        .replace("electrodes_per_column_wire = 3", "electrodes_per_column_wire = 1");
    texts.push(small.clone());
    texts.push(
        small.replace(
            "electrodes_per_row_wire = 1",
            "electrodes_per_row_wire = 6666666666666666662",
        ),
    );
    texts.push(
        small.replace("[deformation]", "lower_electrodes_mm = [[1.0, 2.0, 0.0]]\n[deformation]"),
    );
    texts.push(small.replace("[outputs]", "[drift]\ngain = 0.02\n[outputs]"));
    texts
}
