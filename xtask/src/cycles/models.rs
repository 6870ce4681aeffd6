//! The models that are measured: of the scene press, as `host-sim train` makes them, in every format.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use model_core::blob::{Model, ModelParts, encode, encoded_length_bound};
use model_core::rbf::{Format, Network, direct, expanded, fixed16};

use crate::process::{Outcome, cargo, run};

/// K.
const CENTRES: [usize; 5] = [16, 32, 64, 128, 256];

/// What is trained on: noise enough that widths and weights stay where every format holds them, and a few
/// more frames than there are centres.
const TRAINING: [&str; 7] = ["train", "press", "-n", "500", "--noise", "0.05", "--output"];

/// One network for the whole array, of a width at which every format holds it.
const OF_ARRAY: [&str; 3] = ["--whole-array", "--spread", "0.4"];

/// The largest blob that a device's slot holds, the image's like any other.
const SLOT_BYTES: usize = 131_072;

/// A model to be measured.
#[derive(Debug, PartialEq, Eq)]
pub struct Blob {
    pub path: PathBuf,
    /// Whether it has an affine tail.
    pub affine: bool,
    /// Whether all rows' networks have one format, number of centres, and tail or none.
    pub rows_alike: bool,
}

/// Trains models of every format and size in `directory`, of rows and of the whole array, and writes each
/// twice: with its affine tail and without. All rows have the first row's network, so that the largest fits the
/// image's slot; what does not is left out.
///
/// # Errors
/// `host-sim` fails, or makes another model than it is asked for.
pub fn train(directory: &Path) -> Outcome<Vec<Blob>> {
    fs::create_dir_all(directory).map_err(|cause| failed(directory, &cause))?;
    let mut blobs = Vec::new();
    for format in Format::ALL {
        for centres in CENTRES {
            for (array, options) in [("", &[][..]), ("-array", &OF_ARRAY[..])] {
                let stem = format!("{}-{centres}{array}", format.name());
                let trained = directory.join(format!("{stem}-trained.bin"));
                let mut command = cargo(&["run", "--quiet", "--package", "host-sim", "--"]);
                command.args(TRAINING).arg(&trained).args(options);
                command.args(["--format", format.name(), "--centres"]);
                // What it says of the model is not what this command prints.
                run(command.arg(centres.to_string()).stdout(Stdio::null()))?;
                let bytes = Bytes::read(&trained)?;
                if bytes.bytes().len() > SLOT_BYTES && !array.is_empty() {
                    eprintln!("left out: {} is larger than a slot", trained.display());
                    continue;
                }
                let model = bytes.model().map_err(|cause| failed(&trained, &cause))?;
                is_as_asked(&model, format, centres).map_err(|cause| failed(&trained, &cause))?;
                for (affine, suffix) in [(false, ""), (true, "-affine")] {
                    let path = directory.join(format!("{stem}{suffix}.bin"));
                    write(&path, &rewritten(&model, Rows::AsTheFirst, affine)?)?;
                    blobs.push(Blob { path, affine, rows_alike: true });
                }
            }
        }
    }
    Ok(blobs)
}

/// The blob at `path` and, if it has an affine tail, the same without it, written into `directory`.
///
/// # Errors
/// It is no sound blob.
pub fn of_file(path: &Path, directory: &Path) -> Outcome<Vec<Blob>> {
    let bytes = Bytes::read(path)?;
    let model = bytes.model().map_err(|cause| failed(path, &cause))?;
    let affine = model.networks().any(|network| network.has_affine_tail());
    let rows_alike = rows_alike(&model);
    let given = Blob { path: path.to_owned(), affine, rows_alike };
    if !affine {
        return Ok(vec![given]);
    }
    fs::create_dir_all(directory).map_err(|cause| failed(directory, &cause))?;
    let without = directory.join("without-tail.bin");
    write(&without, &rewritten(&model, Rows::AsTheyAre, false)?)?;
    Ok(vec![Blob { path: without, affine: false, rows_alike }, given])
}

fn rows_alike(model: &Model<'_>) -> bool {
    let kind = |network: Network<'_>| {
        (network.format(), network.shape().centres, network.has_affine_tail())
    };
    let mut kinds = model.networks().map(kind);
    let first = kinds.next();
    kinds.all(|other| Some(other) == first)
}

fn is_as_asked(model: &Model<'_>, format: Format, centres: usize) -> Outcome {
    let other = |network: &Network<'_>| {
        let found = (network.format(), network.shape().centres, network.has_affine_tail());
        (found != (format, centres, true)).then(|| (found.0.name(), found.1, found.2))
    };
    match model.networks().find_map(|network| other(&network)) {
        None => Ok(()),
        Some((found, found_centres, tail)) => Err(format!(
            "asked for {} with {centres} centres and an affine tail, host-sim made {found} with \
             {found_centres} centres, tail: {tail}",
            format.name()
        )),
    }
}

/// Which networks the rows have.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rows {
    AsTheyAre,
    AsTheFirst,
}

/// The same model with other rows, or without its affine tail.
fn rewritten(model: &Model<'_>, rows: Rows, affine: bool) -> Outcome<Vec<u8>> {
    let count = if rows == Rows::AsTheFirst { 1 } else { model.network_count() };
    let words: Vec<Vec<u32>> =
        model.networks().take(count).map(|network| words(&network, affine)).collect();
    let networks = model.networks().zip(&words);
    let networks: Vec<Network<'_>> = networks
        .map(|(network, words)| of_words(&network, affine, words))
        .collect::<Outcome<_>>()?;
    let row_network: Vec<u8> = (0..model.shape().rows)
        .map(|row| {
            if rows == Rows::AsTheFirst { 0 } else { model.network_of_row(row).unwrap_or(0) as u8 }
        })
        .collect();
    let parts = ModelParts {
        projection: model.projection(),
        networks: &networks,
        row_network: &row_network,
        metadata: *model.metadata(),
    };
    let mut room = Bytes::zeros(encoded_length_bound(&parts));
    encode(&parts, room.bytes_mut()).map(<[u8]>::to_vec).map_err(|cause| cause.to_string())
}

/// A network's block, with its tail only if `affine`.
fn words(network: &Network<'_>, affine: bool) -> Vec<u32> {
    match network {
        Network::F32Direct(network) => {
            let mut parameters = *network.parameters();
            parameters.affine = if affine { parameters.affine } else { &[] };
            parameters.words().collect()
        }
        Network::F32(network) => {
            let mut parameters = network.parameters();
            parameters.affine = if affine { parameters.affine } else { &[] };
            parameters.words().collect()
        }
        Network::Fixed16(network) => {
            let mut parameters = network.parameters();
            parameters.affine = if affine { parameters.affine } else { &[] };
            parameters.words().collect()
        }
    }
}

fn of_words<'w>(network: &Network<'_>, affine: bool, words: &'w [u32]) -> Outcome<Network<'w>> {
    let (shape, affine) = (network.shape(), affine && network.has_affine_tail());
    let network = match network {
        Network::F32Direct(network) => {
            let common_width = network.parameters().decay.len() == 1;
            direct::Network::of_words(shape, common_width, affine, words).map(Network::from)
        }
        Network::F32(_) => expanded::Network::try_new(shape, affine, words).map(Network::from),
        Network::Fixed16(_) => fixed16::Network::try_new(shape, affine, words).map(Network::from),
    };
    network.map_err(|cause| cause.to_string())
}

/// Bytes at a multiple of four, where a blob must lie.
struct Bytes {
    room: Vec<u8>,
    start: usize,
}

impl Bytes {
    fn zeros(length: usize) -> Self {
        let mut room = vec![0; length + 3];
        let start = room.as_ptr().align_offset(4).min(3);
        room.truncate(start + length);
        Self { room, start }
    }

    fn of(blob: &[u8]) -> Self {
        let mut bytes = Self::zeros(blob.len());
        bytes.bytes_mut().copy_from_slice(blob);
        bytes
    }

    fn read(path: &Path) -> Outcome<Self> {
        let blob = fs::read(path).map_err(|cause| failed(path, &cause))?;
        Ok(Self::of(&blob))
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        self.room.get_mut(self.start..).unwrap_or_default()
    }

    fn bytes(&self) -> &[u8] {
        self.room.get(self.start..).unwrap_or_default()
    }

    fn model(&self) -> Outcome<Model<'_>> {
        Model::decode(self.bytes()).map_err(|cause| cause.to_string())
    }
}

fn write(path: &Path, blob: &[u8]) -> Outcome {
    fs::write(path, blob).map_err(|cause| failed(path, &cause))
}

fn failed(path: &Path, cause: &impl ToString) -> String {
    format!("{}: {}", path.display(), cause.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_without_its_tail_is_otherwise_the_same() {
        let bytes = Bytes::read(&crate::process::root().join("testdata/hand-made.bin")).unwrap();
        let model = bytes.model().unwrap();
        let with = rewritten(&model, Rows::AsTheyAre, true).unwrap();
        assert_eq!(with, bytes.room[bytes.start..]);

        let without = Bytes::of(&rewritten(&model, Rows::AsTheFirst, false).unwrap());
        let without = without.model().unwrap();
        assert_eq!((model.network_count(), without.network_count()), (2, 1));
        assert_eq!(without.metadata(), model.metadata());
        let (Some(Network::F32Direct(before)), Some(Network::F32Direct(after))) =
            (model.networks().next(), without.networks().next())
        else {
            panic!("another format");
        };
        let expected = direct::Parameters { affine: &[], ..*before.parameters() };
        assert_eq!(*after.parameters(), expected);
    }

    #[test]
    fn a_model_of_another_kind_than_asked_for_is_refused() {
        let bytes = Bytes::read(&crate::process::root().join("testdata/hand-made.bin")).unwrap();
        let model = bytes.model().unwrap();
        assert_eq!(is_as_asked(&model, Format::F32Direct, 12), Ok(()));
        assert!(is_as_asked(&model, Format::F32Direct, 16).is_err());
        let error = is_as_asked(&model, Format::F32, 12).unwrap_err();
        assert!(error.starts_with("asked for f32 with 12 centres"), "{error}");
    }
}
