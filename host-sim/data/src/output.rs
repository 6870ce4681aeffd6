//! Output files that appear whole or not at all.
//!
//! Only killing the program during a write leaves a temporary file behind, `.<name>.<process>.tmp`,
//! which may be removed.

use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Writes `path` through a temporary file beside it, renamed once all is written.
///
/// If writing fails, the temporary file is removed and whatever stood at `path` stays. A symbolic link
/// is followed, and an existing file's permissions are kept. A device or a pipe, such as `/dev/stdout`,
/// is written to directly.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written, or whatever error `write` returns.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    let error = |cause| Error::write(path, cause);
    match Place::of(path)? {
        Place::Stream => {
            let file = OpenOptions::new().write(true).open(path).map_err(error)?;
            let mut writer = BufWriter::new(file);
            write(&mut writer)?;
            writer.flush().map_err(error)
        }
        Place::File { real, permissions } => {
            let temporary = Temporary::beside(&real);
            let mut writer = BufWriter::new(File::create(&temporary.0).map_err(error)?);
            write(&mut writer)?;
            let file = writer.into_inner().map_err(|e| error(e.into_error()))?;
            if let Some(permissions) = permissions {
                file.set_permissions(permissions).map_err(error)?;
            }
            file.sync_all().map_err(error)?;
            drop(file);
            fs::rename(&temporary.0, &real).map_err(error)
        }
    }
}

/// Writes `bytes` to `path`, whole or not at all, like [`write_whole`].
///
/// # Errors
/// [`Error::Write`] if the file cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |file| file.write_all(bytes).map_err(|cause| Error::write(path, cause)))
}

/// Removes the file at `path`, if there is one.
///
/// # Errors
/// [`Error::Write`] if there is a file and it cannot be removed.
pub fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::write(path, cause))
        }
        _ => Ok(()),
    }
}

/// Checks before long work that [`write_whole`] can write to `path` and would not replace one of the
/// command's own `inputs`.
///
/// # Errors
/// [`Error::Write`] if `path` cannot be written, or [`Error::WrittenOverInput`] if it is an input.
pub fn check_writable(path: &Path, inputs: &[&Path]) -> Result<()> {
    let Place::File { real, .. } = Place::of(path)? else { return Ok(()) };
    let same = |input: &&&Path| fs::canonicalize(input).is_ok_and(|input| input == real);
    if let Some(input) = inputs.iter().find(same) {
        let (output, input) = (path.into(), (*input).into());
        return Err(Error::WrittenOverInput { output, input });
    }
    let temporary = Temporary::beside(&real);
    File::create(&temporary.0).map(drop).map_err(|cause| Error::write(path, cause))
}

/// Runs `work`, which writes to `folder`; the folder is made first. If the work fails, folders made here
/// are removed, unless something was written to them.
///
/// # Errors
/// [`Error::Write`] for a folder that cannot be made, or whatever error `work` returns.
pub fn in_folder<T, E: From<Error>>(
    folder: &Path,
    work: impl FnOnce() -> std::result::Result<T, E>,
) -> std::result::Result<T, E> {
    let is_new = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
    let made: Vec<&Path> = folder.ancestors().take_while(is_new).collect();
    let outcome = fs::create_dir_all(folder)
        .map_err(|cause| E::from(Error::write(folder, cause)))
        .and_then(|()| work());
    if outcome.is_err() {
        for path in made {
            // Only an empty folder can be removed: what was written stays.
            let _ = fs::remove_dir(path);
        }
    }
    outcome
}

/// Kind of place that an output's path names.
enum Place {
    /// A file, or nothing yet; links are resolved.
    File { real: PathBuf, permissions: Option<fs::Permissions> },
    /// A device or a pipe.
    Stream,
}

impl Place {
    fn of(path: &Path) -> Result<Self> {
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => {
                let cause = std::io::Error::from(std::io::ErrorKind::IsADirectory);
                Err(Error::write(path, cause))
            }
            Ok(found) if found.is_file() => {
                let real = fs::canonicalize(path).map_err(|cause| Error::write(path, cause))?;
                Ok(Self::File { real, permissions: Some(found.permissions()) })
            }
            Ok(_) => Ok(Self::Stream),
            Err(_) => Ok(Self::File { real: path.into(), permissions: None }),
        }
    }
}

/// Path of a temporary file, removed on drop (unless it was renamed before).
struct Temporary(PathBuf);

impl Temporary {
    fn beside(path: &Path) -> Self {
        let mut name = std::ffi::OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(format!(".{}.tmp", std::process::id()));
        Self(path.with_file_name(name))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // Nothing to remove is the good case.
        let _ = fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Problem;

    #[test]
    fn a_folder_made_for_work_that_fails_goes_again_unless_something_is_in_it() {
        let root = std::env::temp_dir().join(format!("taxel-in-folder-{}", std::process::id()));
        let folder = root.join("scene");
        let fail = || Err(Error::file(&root, Problem::Empty));
        assert!(in_folder::<(), Error>(&folder, fail).is_err() && !root.exists());
        let written = folder.join("file");
        let write_and_fail = || write_bytes(&written, b"whole").and_then(|()| fail());
        assert!(in_folder::<(), Error>(&folder, write_and_fail).is_err() && written.exists());
        fs::remove_file(&written).unwrap();
        // A folder that was there stays, empty or not.
        assert!(in_folder::<(), Error>(&folder, fail).is_err() && folder.exists());
        assert_eq!(in_folder::<_, Error>(&folder, || Ok(folder.exists())).ok(), Some(true));
        fs::remove_dir_all(&root).unwrap();
    }
}
