//! A release: everything that is given away, in one folder, with checksums.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use object::read::elf::ProgramHeader;

use crate::process::{Outcome, cargo, root, run as run_command, target_dir};
use crate::structure::metadata;
use crate::toolchain::elf;
use crate::{ci, docs, images, python};

/// Target whose programs need no library of the system.
const STATIC: &str = "x86_64-unknown-linux-musl";

/// Oldest glibc that the wheel runs with: 2.17, that of CentOS 7 and all since.
const WHEEL: [&str; 3] = ["--zig", "--compatibility", "manylinux2014"];

/// Images for a device.
const IMAGES: [&str; 2] = [images::NUCLEO_IMAGE, images::APPLICATION];

/// Runs what CI does not wait for, then, unless `checks` alone are wanted, builds everything into target/release-files and
/// prints sizes.
pub fn run(checks: bool) -> Outcome {
    ci::run_before_release()?;
    if checks {
        return Ok(());
    }
    let folder = target_dir().join("release-files");
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|cause| failed(&folder, &cause))?;
    }
    for inner in ["crates", "images"] {
        fs::create_dir_all(folder.join(inner)).map_err(|cause| failed(&folder, &cause))?;
    }
    about("about.hbs", &folder.join("THIRD-PARTY.html"))?;
    about("sbom.hbs", &folder.join("sbom.cdx.json"))?;
    docs::site::build(&folder.join("site"))?;
    crates(&folder.join("crates"))?;
    for image in IMAGES {
        images::run(Some(image))?;
        keep_image(image, &folder.join("images"))?;
    }
    program(&folder)?;
    let python = python::environment(&["maturin>=1.9,<2", "ziglang"])?;
    run_command(python::maturin(&python, "build", &folder).arg("--release").args(WHEEL))?;
    run_command(&mut python::maturin(&python, "sdist", &folder))?;
    checksums(&folder)
}

fn failed(path: &Path, cause: &dyn std::fmt::Display) -> String {
    format!("{}: {cause}", path.display())
}

/// Packs the crates that are published (docs/c.md).
fn crates(folder: &Path) -> Outcome {
    let metadata = metadata()?;
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let published = packages.filter(|package| package["publish"].is_null());
    let published: Vec<(&str, &str)> = published
        .filter_map(|package| Some((package["name"].as_str()?, package["version"].as_str()?)))
        .collect();
    let mut pack = cargo(&["package", "--no-verify", "--allow-dirty", "--quiet"]);
    for (name, _) in &published {
        pack.args(["--package", name]);
    }
    run_command(&mut pack)?;
    for (name, version) in published {
        let file = format!("{name}-{version}.crate");
        let built = target_dir().join("package").join(&file);
        fs::copy(&built, folder.join(file)).map_err(|cause| failed(&built, &cause))?;
    }
    Ok(())
}

/// Keeps an image as ELF, for debuggers and QEMU, and as plain bytes, which a board's drive takes.
fn keep_image(image: &str, folder: &Path) -> Outcome {
    let built = elf(image);
    let bytes = fs::read(&built).map_err(|cause| failed(&built, &cause))?;
    let plain = flat(&bytes).map_err(|cause| failed(&built, &cause))?;
    for (end, bytes) in [("elf", &bytes), ("bin", &plain)] {
        let file = folder.join(format!("{image}.{end}"));
        fs::write(&file, bytes).map_err(|cause| failed(&file, &cause))?;
    }
    Ok(())
}

/// Bytes of an image from its first address in flash on; gaps are erased flash.
fn flat(elf: &[u8]) -> Outcome<Vec<u8>> {
    let file = object::read::elf::ElfFile32::<object::Endianness>::parse(elf);
    let file = file.map_err(|cause| cause.to_string())?;
    let endian = file.endian();
    let loaded = file.elf_program_headers().iter().filter(|header| {
        header.p_type(endian) == object::elf::PT_LOAD && header.p_filesz(endian) > 0
    });
    let parts = loaded.map(|header| {
        let data =
            header.data(endian, elf).map_err(|()| "a segment lies outside the file".to_owned());
        data.map(|data| (header.p_paddr(endian) as usize, data))
    });
    let mut parts = parts.collect::<Outcome<Vec<_>>>()?;
    parts.sort_by_key(|(address, _)| *address);
    let first = parts.first().map_or(0, |(address, _)| *address);
    let mut plain = Vec::new();
    for (address, data) in parts {
        plain.resize(address - first, 0xFF);
        plain.extend_from_slice(data);
    }
    Ok(plain)
}

/// Builds the static program.
fn program(folder: &Path) -> Outcome {
    let stripped = ["--config", "profile.release.strip=true"];
    let build = ["build", "--release", "--package", "host-sim", "--target", STATIC];
    run_command(cargo(&build).args(stripped)).map_err(|cause| {
        format!("{cause}; the target is installed by: rustup target add {STATIC}")
    })?;
    let built = target_dir().join(STATIC).join("release/taxel");
    let kept = folder.join("taxel-x86_64-linux");
    fs::copy(&built, &kept).map_err(|cause| failed(&built, &cause))?;
    Ok(())
}

/// Writes what a template of cargo-about says of all crates that the program and the wheel hold; the module of Python holds
/// the program's.
fn about(template: &str, file: &Path) -> Outcome {
    let settings = root().join("xtask/notices");
    let mut about = Command::new("cargo");
    about.args(["about", "generate", "--locked", "--fail", "--manifest-path", "python/Cargo.toml"]);
    about.arg("--config").arg(settings.join("about.toml")).arg(settings.join(template));
    run_command(about.arg("--output-file").arg(file).current_dir(root())).map_err(|cause| {
        format!("{cause}; it takes cargo-about: cargo install cargo-about --locked --features cli")
    })
}

/// Writes SHA256SUMS, and prints all files but the site's with their sizes.
fn checksums(folder: &Path) -> Outcome {
    let mut files = Vec::new();
    list(folder, folder, &mut files).map_err(|cause| failed(folder, &cause))?;
    files.sort();
    let sums = folder.join("SHA256SUMS");
    let output = Command::new("sha256sum").args(&files).current_dir(folder).output();
    let output = output.map_err(|cause| format!("sha256sum cannot be started: {cause}"))?;
    fs::write(&sums, output.stdout).map_err(|cause| failed(&sums, &cause))?;
    for file in files.iter().filter(|file| !file.starts_with("site")) {
        let bytes = fs::metadata(folder.join(file)).map_or(0, |about| about.len());
        println!("{:8.2} MB  {}", bytes as f64 / 1e6, file.display());
    }
    println!("{} files in {}; SHA256SUMS has their checksums", files.len(), folder.display());
    if output.status.success() { Ok(()) } else { Err("sha256sum failed".into()) }
}

/// Lists the files below `folder`, by their paths from `root` on.
fn list(root: &Path, folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            list(root, &path, files)?;
        } else {
            files.extend(path.strip_prefix(root).ok().map(Path::to_path_buf));
        }
    }
    Ok(())
}
