//! The models that are measured: trained on the scene `press`, as by `host-sim train`, in every number format.

use std::fs;
use std::path::{Path, PathBuf};

use model_core::blob::{Model, ModelParts, encode_to_vec};
use model_core::rbf::{Format, Network, direct, expanded, fixed16};

use super::training::{self, Wanted};
use crate::process::Outcome;

/// Numbers of centres K.
const CENTRES: [usize; 5] = [16, 32, 64, 128, 256];

/// Largest blob in bytes that a slot holds, in the image as on every device.
const SLOT_BYTES: usize = 131_072;

/// A model to be measured.
#[derive(Debug, PartialEq, Eq)]
pub struct Blob {
    pub path: PathBuf,
    pub affine: bool,
}

/// Trains models of every format and size, with a network a row and with one for the whole array. Writes each into
/// `directory` twice: with its affine tail and without.
///
/// All rows get the first row's network, so that the largest model fits the image's slot. A model that does not
/// fit is left out.
///
/// With a `kernel`, only its number format is trained; with one that no format has, all are.
pub fn train(directory: &Path, kernel: Option<&str>) -> Outcome<Vec<Blob>> {
    fs::create_dir_all(directory).map_err(|cause| failed(directory, &cause))?;
    let only = kernel.and_then(format_of);
    let wanted: Vec<Wanted> = Format::ALL
        .into_iter()
        .filter(|format| only.is_none_or(|only| only == *format))
        .flat_map(|format| CENTRES.map(|centres| (format, centres)))
        .flat_map(|(format, centres)| {
            [false, true].map(|whole_array| Wanted { format, centres, whole_array })
        })
        .collect();
    let mut blobs = Vec::new();
    for (wanted, trained) in wanted.iter().zip(training::train(&wanted)?) {
        let array = if wanted.whole_array { "-array" } else { "" };
        let stem = format!("{}-{}{array}", wanted.format.name(), wanted.centres);
        if trained.bytes().len() > SLOT_BYTES && wanted.whole_array {
            eprintln!("left out: {stem} is larger than a slot");
            continue;
        }
        let refused = |cause: String| format!("{stem}: {cause}");
        let model = trained.parse();
        is_as_asked(&model, wanted.format, wanted.centres).map_err(refused)?;
        for (affine, suffix) in [(false, ""), (true, "-affine")] {
            let path = directory.join(format!("{stem}{suffix}.bin"));
            write(&path, &of_first_network(&model, affine)?)?;
            blobs.push(Blob { path, affine });
        }
    }
    Ok(blobs)
}

/// The number format of a `kernel`, whose name starts with the format's.
fn format_of(kernel: &str) -> Option<Format> {
    let named = |format: &Format| {
        let rest = kernel.strip_prefix(format.name());
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
    };
    Format::ALL.into_iter().filter(named).max_by_key(|format| format.name().len())
}

fn is_as_asked(model: &Model<'_>, format: Format, centres: usize) -> Outcome {
    let other = |network: &Network<'_>| {
        let found = (network.format(), network.shape().centres, network.has_affine_tail());
        (found != (format, centres, true)).then(|| (found.0.name(), found.1, found.2))
    };
    match model.networks().find_map(|network| other(&network)) {
        None => Ok(()),
        Some((found, found_centres, tail)) => Err(format!(
            "asked for {} with {centres} centres and an affine tail, training made {found} with \
             {found_centres} centres, tail: {tail}",
            format.name()
        )),
    }
}

/// A blob of the model in which every row has the first network, with its affine tail or without.
fn of_first_network(model: &Model<'_>, affine: bool) -> Outcome<Vec<u8>> {
    let first = model.networks().next().ok_or("a model without networks")?;
    let words = words(&first, affine);
    let parts = ModelParts {
        projection: model.projection(),
        expansion: model.expansion(),
        confidence: None,
        fill: None,
        networks: &[of_words(&first, affine, &words)?],
        row_network: &vec![0; model.shape().rows],
        metadata: *model.metadata(),
    };
    encode_to_vec(&parts).map(|bytes| bytes.to_vec()).map_err(|cause| cause.to_string())
}

/// The network's block of words, with its tail only if `affine`.
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

fn write(path: &Path, blob: &[u8]) -> Outcome {
    fs::write(path, blob).map_err(|cause| failed(path, &cause))
}

fn failed(path: &Path, cause: &impl ToString) -> String {
    format!("{}: {}", path.display(), cause.to_string())
}

#[cfg(test)]
mod tests {
    use taxel_learn::ModelBlob;

    use super::*;

    #[test]
    fn a_kernels_name_tells_its_format() {
        for (kernel, format) in [
            ("f32", Some(Format::F32)),
            ("f32-portable", Some(Format::F32)),
            ("f32-direct", Some(Format::F32Direct)),
            ("f32-direct-libm", Some(Format::F32Direct)),
            ("fixed16-portable", Some(Format::Fixed16)),
            ("fixed", None),
            ("f32x", None),
        ] {
            assert_eq!(format_of(kernel), format, "{kernel}");
        }
    }

    #[test]
    fn a_model_without_its_tail_is_otherwise_the_same() {
        let blob = ModelBlob::read(&crate::process::root().join("testdata/hand-made.bin")).unwrap();
        let model = blob.parse();
        let with = ModelBlob::of_bytes(&of_first_network(&model, true).unwrap()).unwrap();
        assert_eq!(with.parse().networks().next(), model.networks().next());

        let without = of_first_network(&model, false).unwrap();
        let without = ModelBlob::of_bytes(&without).unwrap();
        let without = without.parse();
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
        let blob = ModelBlob::read(&crate::process::root().join("testdata/hand-made.bin")).unwrap();
        let model = blob.parse();
        assert_eq!(is_as_asked(&model, Format::F32Direct, 12), Ok(()));
        assert!(is_as_asked(&model, Format::F32Direct, 16).is_err());
        let error = is_as_asked(&model, Format::F32, 12).unwrap_err();
        assert!(error.starts_with("asked for f32 with 12 centres"), "{error}");
    }
}
