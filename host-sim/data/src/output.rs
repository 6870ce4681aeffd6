//! Output files that appear whole or not at all.
//!
//! A file is written to `.<name>.<16 characters>.tmp` beside it, made safe from loss of power, and renamed. An error or
//! a signal leaves the old file as it was and no temporary one. Only a program that is killed outright leaves its
//! temporary files, which are hidden and never read again.

use std::fs;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

mod step;
mod place;
mod temporary;

pub use step::{Step, watched};
pub use temporary::{Scratch, abandon};

use place::Place;
use temporary::Temporary;

/// Writes `path` through a temporary file beside it, renamed once all is written.
///
/// If writing fails, the temporary file is removed and whatever stood at `path` stays. A symbolic link is followed, and
/// an existing file's permissions are kept. `-` and `/dev/stdout` are the program's own stdout. That, a device or a pipe
/// is written to directly; a reader who has seen enough (`| head`) is no failure.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written, or whatever error `write` returns.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let error = |cause| Error::write(path, cause);
    let stream: Box<dyn Write> = match Place::new(path).map_err(error)? {
        Place::File(file) => {
            return temporary::put_in_place(vec![Temporary::written(file, write)?], &[]);
        }
        Place::Stdout => Box::new(std::io::stdout().lock()),
        Place::Stream(stream) => Box::new(place::open_stream(&stream).map_err(error)?),
    };
    let mut stream = BufWriter::new(stream);
    match write(&mut stream).and_then(|()| stream.flush().map_err(error)) {
        Err(Error::Write { cause, .. }) if cause.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// Writes `bytes` to `path`, whole or not at all, like [`write_whole`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |file| file.write_all(bytes).map_err(|cause| Error::write(path, cause)))
}

/// Checks before long work that [`write_whole`] can write to `path` and would not replace one of the
/// command's own `inputs`.
///
/// # Errors
/// [`Error::Write`] if `path` cannot be written, or [`Error::WrittenOverInput`] if it is an input.
pub fn check_writable(path: &Path, inputs: &[&Path]) -> Result<()> {
    let place = Place::new(path).map_err(|cause| Error::write(path, cause))?;
    let real = match &place {
        Place::File(file) => &file.real,
        Place::Stdout => Path::new("/dev/stdout"),
        Place::Stream(stream) => stream,
    };
    if let Some(own) = place::identity(real)
        && let Some(input) =
            inputs.iter().find(|input| place::identity(input).as_ref() == Some(&own))
    {
        return Err(Error::WrittenOverInput { output: path.into(), input: (*input).into() });
    }
    match place {
        Place::File(file) => Temporary::beside(file).map(drop),
        Place::Stdout | Place::Stream(_) => Ok(()),
    }
}

/// Whether [`write_whole`] writes to the program's own stdout: `-`, `/dev/stdout`, or a link to it.
pub fn is_stdout(path: &Path) -> bool {
    matches!(Place::new(path), Ok(Place::Stdout))
}

/// Files of a folder that belong together: those of one run.
///
/// All are written before the first one is renamed, so an error of writing leaves the old ones, and a signal waits until
/// all are renamed. A kill, a loss of power or an error between two renames leaves files that are whole: the first ones
/// of this run, the others of the one before.
#[derive(Debug, Clone, Copy)]
pub struct FileSet {
    /// Names of all files that there may be.
    pub files: &'static [&'static str],
    /// Files in a folder of the folder.
    pub inner: Inner,
}

/// Files of a set that stand in a folder of its folder, where others have theirs, too.
#[derive(Debug, Clone, Copy)]
pub struct Inner {
    pub folder: &'static str,
    /// Names of all files that there may be, without their endings. One that ends with `*` stands for all that begin so.
    pub names: &'static [&'static str],
    pub endings: &'static [&'static str],
}

impl Inner {
    /// Whether a file in this folder is of the set.
    fn has(&self, path: &Path) -> bool {
        let text =
            |part: Option<&std::ffi::OsStr>| part.and_then(|it| it.to_str()).map(str::to_owned);
        let (Some(stem), Some(ending)) = (text(path.file_stem()), text(path.extension())) else {
            return false;
        };
        let is_name = |name: &&str| match name.strip_suffix('*') {
            Some(start) => stem.starts_with(start),
            None => stem == **name,
        };
        self.endings.contains(&ending.as_str()) && self.names.iter().any(is_name)
    }
}

impl FileSet {
    /// Checks before long work that [`write`](Self::write) can write to `folder` and would not replace one of the
    /// command's own `inputs`. Nothing is changed.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written, or [`Error::WrittenOverInput`] if it is an input.
    pub fn check(&self, folder: &Path, inputs: &[&Path]) -> Result<()> {
        // A folder that is not there is made at the end: what is stopped before then leaves none.
        let is_missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        if let Some(first_to_make) = folder.ancestors().take_while(is_missing).last() {
            return check_writable(first_to_make, &[]).map_err(|error| match error {
                Error::Write { cause, .. } => Error::write(folder, cause),
                other => other,
            });
        }
        let inner = folder.join(self.inner.folder);
        let inner = inner.exists().then(|| inner.join("new"));
        for path in self.files.iter().map(|name| folder.join(name)).chain(inner) {
            place::file(&path)?;
            check_writable(&path, inputs)?;
        }
        Ok(())
    }

    /// Writes files, by name and content, to `folder`, which is made if it is not there. Other files of the set
    /// are removed: they are from an earlier run.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written.
    pub fn write(&self, folder: &Path, contents: &[(&str, &[u8])]) -> Result<()> {
        Written::put_in_place(vec![self.written(folder, contents)?])
    }

    /// Writes files like [`write`](Self::write), beside their places as yet.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written.
    pub fn written(&self, folder: &Path, contents: &[(&str, &[u8])]) -> Result<Written> {
        let is_of_set = |name: &str| {
            let inner =
                name.strip_prefix(self.inner.folder).and_then(|name| name.strip_prefix('/'));
            inner.map_or(self.files.contains(&name), |name| self.inner.has(Path::new(name)))
        };
        debug_assert!(contents.iter().all(|(name, _)| is_of_set(name)), "unknown file");
        let files = written_in(folder, contents)?;
        let mut earlier: Vec<PathBuf> = self.files.iter().map(|name| folder.join(name)).collect();
        let inner = fs::read_dir(folder.join(self.inner.folder)).into_iter().flatten().flatten();
        earlier.extend(inner.map(|entry| entry.path()).filter(|path| self.inner.has(path)));
        earlier.retain(|path| contents.iter().all(|(new, _)| folder.join(new) != *path));
        Ok(Written { files, earlier })
    }
}

/// Files of a folder, written beside their places. Dropped, they leave the old ones.
pub struct Written {
    files: Vec<Temporary>,
    /// Files of an earlier run, which go.
    earlier: Vec<PathBuf>,
}

impl Written {
    /// Renames the files of all folders to their places. A signal waits until all are renamed.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be renamed, or one of an earlier run cannot be removed.
    pub fn put_in_place(folders: Vec<Self>) -> Result<()> {
        let folders = folders.into_iter().map(|it| (it.files, it.earlier));
        let (files, earlier): (Vec<_>, Vec<_>) = folders.unzip();
        temporary::put_in_place(files.into_iter().flatten().collect(), &earlier.concat())
    }
}

/// Writes files that belong together, by their paths in `folder` and their texts. A folder that is not there appears whole or
/// not at all. In one that is there, all are written before the first one is renamed, and other files stay.
///
/// # Errors
/// [`Error::Write`] if a file cannot be written.
pub fn write_folder(folder: &Path, contents: &[(String, String)]) -> Result<()> {
    let contents: Vec<(&str, &[u8])> =
        contents.iter().map(|(path, text)| (path.as_str(), text.as_bytes())).collect();
    if folder.exists() {
        return temporary::put_in_place(written_in(folder, &contents)?, &[]);
    }
    let new = temporary::Folder::beside(folder)?;
    temporary::put_in_place(written_in(new.path(), &contents)?, &[])?;
    new.put_in_place()
}

/// Writes temporary files beside those of these paths in `folder`. It is made if it is not there, as are folders in it;
/// after an error those in it go again.
fn written_in(folder: &Path, contents: &[(&str, &[u8])]) -> Result<Vec<Temporary>> {
    let mut made = Vec::new();
    let write = |(name, bytes): &(&str, &[u8])| {
        let path = folder.join(name);
        let around = path.parent().unwrap_or(folder);
        if around != folder && !around.exists() {
            made.push(around.to_path_buf());
        }
        fs::create_dir_all(around).map_err(|cause| Error::write(around, cause))?;
        Temporary::written(place::file(&path)?, |file| {
            file.write_all(bytes).map_err(|cause| Error::write(&path, cause))
        })
    };
    let written: Result<Vec<Temporary>> = contents.iter().map(write).collect();
    if written.is_err() {
        // One that has a file of somebody else by now stays.
        made.iter().for_each(|inner| drop(fs::remove_dir(inner)));
    }
    written
}
