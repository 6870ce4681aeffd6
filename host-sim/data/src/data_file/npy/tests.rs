use std::io::Write;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::*;

/// Order in which an array's elements are stored.
#[derive(Clone, Copy)]
enum Order {
    C,
    Fortran,
}

/// Element of an array: numpy's name of its type, and its bytes.
trait Element {
    const KIND: &str;
    fn bytes(&self) -> Vec<u8>;
}

macro_rules! elements {
    ($($kind:literal $name:ty),*) => {$(
        impl Element for $name {
            const KIND: &str = $kind;
            fn bytes(&self) -> Vec<u8> {
                self.to_le_bytes().to_vec()
            }
        }
    )*};
}

elements!("<f8" f64, "<f4" f32, "<i8" i64, "<i4" i32, "<i2" i16, "<u4" u32, "|u1" u8);

impl Element for bool {
    const KIND: &str = "|b1";
    fn bytes(&self) -> Vec<u8> {
        vec![u8::from(*self)]
    }
}

/// Bytes of a `.npy` file of this shape, as numpy 2 writes it.
fn array<T: Element>(shape: &[u64], order: Order, elements: &[T]) -> Vec<u8> {
    let sizes: Vec<String> = shape.iter().map(|size| format!("{size},")).collect();
    let order = if matches!(order, Order::C) { "False" } else { "True" };
    let mut bytes = header(T::KIND, order, &format!("({})", sizes.join(" ")));
    bytes.extend(elements.iter().flat_map(Element::bytes));
    bytes
}

fn archive(arrays: &[(&str, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(vec![]));
    for (name, bytes) in arrays {
        let options = SimpleFileOptions::default().compression_method(method);
        zip.start_file(format!("{name}.npy"), options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn lines(file: &DataFile) -> Vec<Vec<f64>> {
    file.rows().map(<[f64]>::to_vec).collect()
}

#[test]
fn arrays_of_either_order_and_of_any_number_are_read_line_by_line() {
    let path = Path::new("test.npy");
    let expected = vec![vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]];
    for bytes in [
        array(&[2, 3], Order::C, &[1.0_f64, 2.0, 3.0, 4.0, 5.0, 6.0]),
        array(&[2, 3], Order::Fortran, &[1.0_f64, 4.0, 2.0, 5.0, 3.0, 6.0]),
        array(&[2, 3], Order::C, &[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0]),
        array(&[2, 3], Order::C, &[1_i64, 2, 3, 4, 5, 6]),
        array(&[2, 3], Order::C, &[1_i16, 2, 3, 4, 5, 6]),
        array(&[2, 3], Order::C, &[1_u8, 2, 3, 4, 5, 6]),
        array(&[2, 3], Order::C, &[1_u32, 2, 3, 4, 5, 6]),
    ] {
        let file = parse_array(path, &bytes).unwrap();
        assert_eq!(file.header, ["c1", "c2", "c3"]);
        assert!(!file.names_columns);
        assert_eq!(lines(&file), expected);
        assert_eq!(file.line_number(1), 2);
    }
    let time = [1_743_486_221.590_758, f64::NAN];
    let column = parse_array(path, &array(&[2], Order::C, &time)).unwrap();
    assert_eq!(column.header, ["c1"]);
    assert_eq!(column.value(0, 0).to_bits(), time[0].to_bits());
    assert!(column.value(1, 0).is_nan());
    // Bytes in the order of another machine.
    let swapped = [header(">f8", "False", "(1,)"), 2.5_f64.to_be_bytes().to_vec()].concat();
    assert_eq!(lines(&parse_array(path, &swapped).unwrap()), [[2.5]]);
    let flags = parse_array(path, &array(&[2], Order::C, &[true, false])).unwrap();
    assert_eq!(lines(&flags), [[1.0], [0.0]]);
}

#[test]
fn arrays_of_an_archive_stand_side_by_side() {
    let arrays = [
        ("time_s", array(&[2], Order::C, &[0.5_f64, 1.5])),
        ("ch", array(&[2, 2], Order::C, &[1_i32, 2, 3, 4])),
    ];
    for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
        let file = parse_archive(Path::new("test.npz"), &archive(&arrays, method)).unwrap();
        assert_eq!(file.header, ["time_s", "ch1", "ch2"]);
        assert!(file.names_columns);
        assert_eq!(lines(&file), [[0.5, 1.0, 2.0], [1.5, 3.0, 4.0]]);
    }
}

#[test]
fn what_is_no_table_of_numbers_is_refused() {
    let path = Path::new("test.npy");
    let whole = array(&[2, 2], Order::C, &[1.0_f64, 2.0, 3.0, 4.0]);
    let infinite = [1.0, 2.0, 3.0, f64::INFINITY];
    for (bytes, says) in [
        (b"a,b\n1,2\n".to_vec(), "not a .npy file"),
        (whole[..whole.len() - 1].to_vec(), "cannot be read to its end"),
        (array(&[1, 2, 2], Order::C, &[1.0_f64; 4]), "3 dimensions"),
        (array(&[], Order::C, &[1.0_f64]), "0 dimensions"),
        (array(&[0, 2], Order::C, &[0.0_f64; 0]), "holds no number"),
        (array(&[2, 2], Order::C, &infinite), "line 2, column \"c2\": the value is infinite"),
    ] {
        let message = parse_array(path, &bytes).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
    let stored = |arrays: &[(&str, Vec<u8>)]| archive(arrays, CompressionMethod::Stored);
    let one = array(&[2], Order::C, &[1.0_f64, 2.0]);
    for (bytes, says) in [
        (whole.clone(), "not a .npz file"),
        (stored(&[]), "holds no number"),
        (stored(&[("a", one.clone()), ("b", b"text".to_vec())]), "array \"b\": not a .npy file"),
        (stored(&[("a1", one.clone()), ("a", whole.clone())]), "column \"a1\" stands twice"),
        (
            stored(&[("a", whole), ("b", array(&[3], Order::C, &[1_u8, 2, 3]))]),
            "array \"b\" has 3 lines, and the first array 2",
        ),
    ] {
        let message = parse_archive(Path::new("test.npz"), &bytes).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}

/// Header of a `.npy` file that says this.
fn header(descr: &str, order: &str, shape: &str) -> Vec<u8> {
    let text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    let text = format!("{text:<117}\n");
    let length = u16::try_from(text.len()).unwrap().to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes()].concat()
}

/// Bytes of a `.npy` file whose header says this, followed by one f64.
fn with_header(descr: &str, order: &str, shape: &str) -> Vec<u8> {
    [header(descr, order, shape), 1.0_f64.to_le_bytes().to_vec()].concat()
}

#[test]
fn shapes_that_the_elements_cannot_fill_are_refused_at_once() {
    let path = Path::new("test.npy");
    let fits = parse_array(path, &with_header("<f8", "False", "(1, 1)")).unwrap();
    assert_eq!(lines(&fits), [[1.0]]);
    for (shape, says) in [
        ("(4294967296, 4294967296)", "more elements than any memory"),
        ("(9223372036854775808, 2)", "more elements than any memory"),
        ("(9223372036854775809, 2)", "more elements than any memory"),
        ("(0, 9223372036854775808, 2)", "more elements than any memory"),
        ("(1000000000000, 0)", "holds no number"),
        ("(0, 1000000000000)", "holds no number"),
        ("(2, 1000000000000)", "2000000000000 numbers and not at most 500000000"),
        ("(2, 1000000)", "cannot be read to its end"),
    ] {
        for order in ["False", "True"] {
            let array = with_header("<f8", order, shape);
            let message = parse_array(path, &array).unwrap_err().to_string();
            assert!(message.contains(says), "{shape}: {message}");
            let archive = archive(&[("a", array)], CompressionMethod::Stored);
            let message = parse_archive(path, &archive).unwrap_err().to_string();
            assert!(message.contains(says), "{shape}: {message}");
        }
    }
    for kind in ["<f2", "<c16", "<U2"] {
        let array = with_header(kind, "False", "(1, 1)");
        let message = parse_array(path, &array).unwrap_err().to_string();
        assert!(message.contains(kind) && message.contains("float32 and float64"), "{message}");
    }
}

/// Header of a `.npy` file of version 2 that claims so many bytes.
fn claiming(length: u32, text: &[u8]) -> Vec<u8> {
    [b"\x93NUMPY\x02\x00", &length.to_le_bytes()[..], text].concat()
}

#[test]
fn what_a_header_claims_is_checked_before_memory_is_taken_for_it() {
    let path = Path::new("test.npy");
    for (bytes, says) in [
        (claiming(u32::MAX, b"{"), "claims 4294967295 bytes"),
        (claiming(9_000, &[b'['; 9_000]), "not a .npy file"),
        (
            with_header("<f8", "False", &format!("({}, 1)", "9".repeat(8_000))),
            "more elements than any memory",
        ),
        (with_header("<f8", "False", "[4294967296, 4294967296]"), "not a .npy file"),
        (with_header("<f8", "False", "(0xffffffffffffffff, 2)"), "plain decimal"),
        (with_header("<f8", "False", "(9223372036854775807 + 1, 2)"), "plain decimal"),
        (with_header("|u1", "False", "(1, 500000001)"), "500000001 numbers and not at most"),
    ] {
        let message = parse_array(path, &bytes).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
        let packed = archive(&[("a", bytes)], CompressionMethod::Deflated);
        let message = parse_archive(path, &packed).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn an_archive_that_would_unpack_to_far_more_is_refused_by_its_headers() {
    let path = Path::new("test.npz");
    let refused = |arrays: &[(&str, Vec<u8>)]| {
        let packed = archive(arrays, CompressionMethod::Deflated);
        parse_archive(path, &packed).unwrap_err().to_string()
    };
    // The numbers themselves are not there: nobody looks for them.
    let message = refused(&[("c", with_header("|i1", "False", "(160000000, 3)"))]);
    assert!(message.contains("480000000 numbers together"), "{message}");
    assert!(message.contains("may have 20000000"), "{message}");
    let half = || with_header("|i1", "False", "(6000000, 2)");
    let message = refused(&[("a", half()), ("b", half())]);
    assert!(message.contains("24000000 numbers together"), "{message}");
    let message = refused(&[("a", with_header("|u1", "False", "(1, 1000001)"))]);
    assert!(message.contains("1000001 columns"), "{message}");
    let wide = || with_header("|u1", "False", "(1, 600000)");
    let message = refused(&[("a", wide()), ("b", wide())]);
    assert!(message.contains("1200000 columns"), "{message}");
    let name = "n".repeat(60_000);
    let message = refused(&[(&name, with_header("|u1", "False", "(1, 1000000)"))]);
    assert!(message.contains("1 to 200") && message.len() < 400, "{message}");
}

#[test]
fn an_archive_is_read_to_its_end() {
    let path = Path::new("test.npz");
    let more = [array(&[2], Order::C, &[1.0_f64, 2.0]), vec![0]].concat();
    let packed = archive(&[("a", more)], CompressionMethod::Stored);
    let message = parse_archive(path, &packed).unwrap_err().to_string();
    assert!(message.contains("more bytes than its shape"), "{message}");
    let mut packed =
        archive(&[("a", array(&[2], Order::C, &[1.0_f64, 2.0]))], CompressionMethod::Stored);
    let place = packed.windows(8).position(|bytes| bytes == 2.0_f64.to_le_bytes()).unwrap();
    packed[place] ^= 1;
    let message = parse_archive(path, &packed).unwrap_err().to_string();
    assert!(message.contains("cannot be read to its end"), "{message}");
}

#[test]
fn texts_of_integers_that_f64_rounds_are_refused_and_others_have_every_digit() {
    let large = (1_i64 << 53) + 1;
    let arrays = [
        ("time", array(&[2], Order::C, &[1_i64, large])),
        ("count", array(&[2, 2], Order::C, &[1_i64, 2, large - 2, 4])),
        ("real", array(&[2], Order::C, &[0.1_f64, 1e17])),
    ];
    let packed = archive(&arrays.map(|(name, array)| (name, array)), CompressionMethod::Stored);
    let file = parse_archive(Path::new("log.npz"), &packed).unwrap();
    let texts = |column: usize| file.texts(column).map(|texts| texts.at(1).into_owned());
    let refused = texts(0).unwrap_err().to_string();
    assert!(refused.contains("log.npz: column \"time\"") && refused.contains("2^53"), "{refused}");
    let texts = [1, 2, 3].map(|column| texts(column).unwrap());
    assert_eq!(texts, [&(large - 2).to_string(), "4", "100000000000000000"]);
    let single = parse_array(Path::new("log.npy"), &array(&[1, 2], Order::C, &[2_i64, large]));
    let single = single.unwrap();
    assert!(single.texts(0).is_ok() && single.texts(1).is_err());
}
