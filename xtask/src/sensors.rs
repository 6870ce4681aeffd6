//! Models of other sensors than the paper's, on the device: decoded as on the host, and what each takes.

mod list;

use std::fs;
use std::path::{Path, PathBuf};

use model_core::blob::ModelShape;
use taxel_learn::ModelBlob;
use taxel_learn::cost::{DecoderRam, Design};

use crate::cycles::Counted;
use crate::emulate::qemu;
use crate::firmware::{APP, BENCH, build_image};
use crate::process::{Outcome, capture, cargo, root, target_dir};
use crate::toolchain::{Toolchain, elf};
use list::{SENSORS, Sensor};

/// Name of the application's image.
const APP_IMAGE: &str = "qemu-app";

/// Capacity of the image for wide sensors, as `TAXEL_CAPACITY` has it.
const WIDE: &str = "16x32x18";

/// Number formats of the models.
const FORMATS: [&str; 2] = ["f32", "fixed16"];

/// Number of frames that host and device decode.
const FRAMES: usize = 1000;

/// Document, and the heading behind which the table goes to its end.
const DOCUMENT: &str = "docs/sensors.md";
const HEADING: &str = "## Figures\n";

/// A model of a sensor, and what it takes.
struct Figure {
    sensor: &'static str,
    format: &'static str,
    shape: ModelShape,
    blob_bytes: usize,
    ram_bytes: usize,
    predicted: Counted,
    counted: Counted,
}

/// Trains, decodes and measures every sensor in both formats, and prints a table. With `accept`, also writes it into
/// the document.
pub fn run(accept: bool) -> Outcome {
    qemu::present()?;
    let toolchain = Toolchain::find()?;
    build_image(&toolchain, APP)?;
    build_image(&toolchain, BENCH)?;
    let directory = target_dir().join("sensors");
    fs::create_dir_all(&directory).map_err(|cause| format!("{}: {cause}", directory.display()))?;
    // The image for wide sensors replaces the other.
    let usual = keep_image(&directory, "usual")?;
    let built = build_wide(&toolchain).and_then(|()| keep_image(&directory, "wide"));
    build_image(&toolchain, APP)?;
    let wide = built?;

    let mut figures = Vec::new();
    for sensor in SENSORS {
        let data = sensor.write(&directory)?;
        for format in FORMATS {
            let model = directory.join(format!("{}-{format}.bin", sensor.name));
            train(sensor, &data, format, &model)?;
            decode(&data, &model, if sensor.wide { &wide } else { &usual })?;
            figures.push(figure(sensor, format, &model)?);
        }
    }
    let table = table(&figures);
    print!("{table}");
    shrinks(&figures)?;
    if accept {
        let path = root().join(DOCUMENT);
        let failed = |cause: String| format!("{DOCUMENT}: {cause}");
        let text = fs::read_to_string(&path).map_err(|cause| failed(cause.to_string()))?;
        let start = text.find(HEADING).ok_or(failed(format!("it lacks {}", HEADING.trim())))?;
        let text = format!("{}\n{table}", &text[..start + HEADING.len()]);
        fs::write(path, text).map_err(|cause| failed(cause.to_string()))?;
    }
    Ok(())
}

fn build_wide(toolchain: &Toolchain) -> Outcome {
    let mut command = toolchain.build();
    command.env("TAXEL_CAPACITY", WIDE).args(crate::firmware::PROFILE).args(APP);
    crate::process::run(&mut command)
}

/// Copies the application's image to a file of its own.
fn keep_image(directory: &Path, name: &str) -> Outcome<PathBuf> {
    let path = directory.join(format!("{APP_IMAGE}-{name}"));
    fs::copy(elf(APP_IMAGE), &path).map_err(|cause| format!("{}: {cause}", path.display()))?;
    Ok(path)
}

fn host_sim(arguments: &[&str], paths: &[(&str, &Path)], data: &Path) -> Outcome<String> {
    let mut command = cargo(&["run", "--quiet", "--release", "--package=host-sim", "--"]);
    let (first, others) = arguments.split_first().ok_or("no command")?;
    command.arg(first).arg(data).args(others);
    for (option, path) in paths {
        command.arg(option).arg(path);
    }
    let said = capture(&mut command);
    said.outcome.map(|()| said.out).map_err(|cause| format!("{cause}\n{}", said.err))
}

fn train(sensor: &Sensor, data: &Path, format: &str, model: &Path) -> Outcome {
    eprintln!("training {} in {format}", sensor.name);
    let format = format!("--format={format}");
    let arguments = [&["train", "--no-refine", &format], sensor.training].concat();
    host_sim(&arguments, &[("--output", model)], data).map(drop)
}

/// Decodes frames on host and device, and fails if one differs.
fn decode(data: &Path, model: &Path, image: &Path) -> Outcome {
    let frames = FRAMES.to_string();
    let arguments = ["emulate", "-n", &frames];
    let out = host_sim(&arguments, &[("--model", model), ("--image", image)], data)?;
    let says = format!("{FRAMES} of {FRAMES} bit-identical");
    if out.contains(&says) { Ok(()) } else { Err(format!("it does not say {says:?}:\n{out}")) }
}

fn figure(sensor: &'static Sensor, format: &'static str, model: &Path) -> Outcome<Figure> {
    let blob = ModelBlob::read(model).map_err(|cause| cause.to_string())?;
    let design = Design::of(&blob);
    let costs = crate::cycles::frame_of(&design, model)?;
    let [predicted, counted] = costs.map(|cost| Counted {
        flash_cycles: cost.flash_cycles + design.least_waiting_for_weights(),
        ..cost
    });
    Ok(Figure {
        sensor: sensor.title,
        format,
        shape: design.shape,
        blob_bytes: blob.bytes().len(),
        ram_bytes: DecoderRam::of(&design).bytes(),
        predicted,
        counted,
    })
}

/// Checks that every sensor that leaves something of the paper's out takes less than it.
fn shrinks(figures: &[Figure]) -> Outcome {
    for format in FORMATS {
        let of_format = || figures.iter().filter(|it| it.format == format);
        let paper = of_format().find(|it| it.sensor == SENSORS[0].title);
        let paper = paper.ok_or("the paper's sensor was not measured")?;
        let sizes = |it: &Figure| {
            [it.blob_bytes as u64, it.ram_bytes as u64, it.counted.cycles, it.counted.flash_cycles]
        };
        let smaller = |shape: ModelShape| {
            let of = |shape: ModelShape| [shape.rows, shape.inputs, shape.outputs];
            of(shape) != of(paper.shape)
                && of(shape).iter().zip(of(paper.shape)).all(|(a, b)| *a <= b)
        };
        for other in of_format().filter(|it| smaller(it.shape)) {
            if sizes(other).iter().zip(sizes(paper)).any(|(a, b)| *a >= b) {
                return Err(format!(
                    "{} in {format} takes no less than {}",
                    other.sensor, paper.sensor
                ));
            }
        }
    }
    Ok(())
}

fn table(figures: &[Figure]) -> String {
    let line = |it: &Figure| {
        let ModelShape { rows, inputs, outputs } = it.shape;
        format!(
            "| {} | {rows} × ({inputs} → {outputs}) | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
            it.sensor,
            it.format,
            it.blob_bytes,
            it.ram_bytes,
            it.predicted.instructions,
            it.counted.instructions,
            it.predicted.cycles,
            it.counted.cycles,
            it.predicted.flash_cycles,
            it.counted.flash_cycles,
        )
    };
    format!(
        "| sensor | shape | format | blob, bytes | RAM, bytes | instructions predicted | counted | cycles predicted | counted | \
         from flash | counted |\n|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n{}",
        figures.iter().map(line).collect::<String>()
    )
}
