//! Files of other programs, known by their first bytes: they are refused with what converts them.

use std::path::Path;

use crate::error::{Error, Problem, Result};

/// Lines of Python that read a table by this call of pandas, and write it as CSV.
macro_rules! by_pandas {
    ($read:literal) => {
        concat!("import pandas as pd\npd.", $read, ".to_csv('OUT', index=False)")
    };
}

/// What a file is, by the bytes it begins with, and the lines of Python that convert it: `IN` and `OUT` stand for names.
const KINDS: [(&[u8], &str, &str); 16] = [
    (b"PAR1", "a Parquet file", by_pandas!("read_parquet('IN')")),
    (b"ARROW1", "a Feather file", by_pandas!("read_feather('IN')")),
    (b"FEA1", "a Feather file", by_pandas!("read_feather('IN')")),
    (b"MATLAB 5.0", "a MATLAB file", MATLAB_5),
    (b"MATLAB 7.3", "a MATLAB file of version 7.3", HDF5),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file", HDF5),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel file", EXCEL),
    (
        b"#ROSBAG",
        "a ROS bag",
        "from bagpy import bagreader\nbagreader('IN').message_by_topic('/TOPIC')  # writes CSV",
    ),
    (b"\x80\x03", "a pickle", PICKLE),
    (b"\x80\x04", "a pickle", PICKLE),
    (b"\x80\x05", "a pickle", PICKLE),
    (b"BZh", "packed by bzip2", PANDAS),
    (b"\xfd7zXZ", "packed by xz", PANDAS),
    (b"\x28\xb5\x2f\xfd", "packed by zstd", PANDAS),
    (b"{\"", "JSON", by_pandas!("read_json('IN', lines=True)")),
    (b"[{\"", "JSON", by_pandas!("read_json('IN')")),
];
const PANDAS: &str = by_pandas!("read_csv('IN')");
const PICKLE: &str = by_pandas!("read_pickle('IN')");
const EXCEL: &str = by_pandas!("read_excel('IN')");
const MATLAB_5: &str = "import numpy, scipy.io  # NAME is a variable of lines × columns\n\
                        numpy.savetxt('OUT', scipy.io.loadmat('IN')['NAME'], delimiter=',')";
const HDF5: &str = "import h5py, numpy  # NAME is an array of lines × columns; MATLAB's need .T behind [:]\n\
                    numpy.savetxt('OUT', h5py.File('IN')['NAME'][:], delimiter=',')";

/// Error for the `bytes` of the file at `path`, if they are another program's.
pub(super) fn check(path: &Path, bytes: &[u8]) -> Result<()> {
    let of_bytes = KINDS.iter().find(|(start, ..)| bytes.starts_with(start));
    let found = of_bytes.map(|(_, kind, python)| (*kind, *python)).or_else(|| in_zip(bytes));
    let Some((kind, python)) = found else { return Ok(()) };
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let name_of = |ending| Path::new(&*name).with_extension(ending);
    // Never the file itself, nor one that a file system takes for it.
    let is_itself = name_of("csv").to_string_lossy().eq_ignore_ascii_case(&name);
    let table = name_of(if is_itself { "converted.csv" } else { "csv" });
    let quoted = |name: &str| format!("'{}'", name.replace('\\', "\\\\").replace('\'', "\\'"));
    let python = python.replace("'OUT'", &quoted(&table.to_string_lossy()));
    let python = python.replace("'IN'", &quoted(&name));
    Err(Error::file(path, Problem::Foreign { kind, python }))
}

/// What a zip archive holds, by the names at its beginning.
fn in_zip(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let start = bytes.strip_prefix(b"PK\x03\x04")?;
    let start = &start[..start.len().min(4000)];
    let holds = |name: &[u8]| memchr::memmem::find(start, name).is_some();
    Some(if holds(b"xl/") || holds(b"opendocument.spreadsheet") {
        ("a spreadsheet", EXCEL)
    } else {
        ("a zip archive", PANDAS)
    })
}
