//! Sizes up to which files are read.

use std::io::{self, Read};
use std::path::Path;

use taxel_data::DataFile;
use taxel_data::data_file::Reading;
use taxel_data::input::{read, read_text};

#[test]
fn a_file_is_read_up_to_the_size_that_is_allowed() {
    let name = format!("taxel-input-{}", std::process::id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, b"12345").unwrap();
    assert_eq!(read(&path, 5).unwrap(), b"12345");
    let refused = read(&path, 4).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    assert!(refused.ends_with("more than 4 bytes; check the path"), "{refused}");
    let refused = read(&std::env::temp_dir(), 4).unwrap_err().to_string();
    assert!(refused.contains("it is a folder; give the path of a file"), "{refused}");
}

#[test]
fn what_unpacks_to_far_more_than_readings_do_is_refused() {
    let mut packed = flate2::write::GzEncoder::new(vec![], flate2::Compression::fast());
    io::copy(&mut io::repeat(b'1').take(64_000_001), &mut packed).unwrap();
    let packed = packed.finish().unwrap();
    let refused = DataFile::parse(Path::new("log.csv.gz"), &packed, &Reading::default());
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("more than 64 MB unpacked"), "{refused}");
}

#[cfg(unix)]
#[test]
fn a_file_without_end_is_refused() {
    let refused = read(Path::new("/dev/zero"), 1_000_000).unwrap_err().to_string();
    assert!(refused.contains("/dev/zero") && refused.contains("1 MB"), "{refused}");
    let refused = read_text(Path::new("/dev/zero")).unwrap_err().to_string();
    assert!(refused.contains("16 MB"), "{refused}");
}
