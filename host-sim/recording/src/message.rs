//! Messages of ROS 2, in CDR, to and from the parts of a frame. Lengths are in m.
//!
//! Readers return `None` for a message that is not one of this layout.

use crate::bytes::{Bytes, Message};
use crate::layout::Layout;

/// Frame of ROS that places are in.
const FRAME: &str = "taxel";
/// Axes, as they stand in names of fields.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Bytes of a point's place, with those that align what follows.
const PLACE_BYTES: u32 = 16;
const FLOAT32: u8 = 7;
const FLOAT64: u8 = 8;

/// Length in m of one in mm. It comes back by [`mm`] to the bit: two roundings of `f64` are far below half a step of `f32`.
fn metres(mm: f32) -> f64 {
    f64::from(mm) / 1000.0
}

/// Length in mm of one in m.
fn mm(metres: f64) -> f32 {
    (metres * 1000.0) as f32
}

/// Begins a message with a header of time `ns`, and the name of a frame.
pub fn header(message: &mut Message, ns: u64, frame: &str) {
    // ROS counts seconds in 31 bits, up to 2038.
    message.u32(u32::try_from(ns / 1_000_000_000).unwrap_or(u32::MAX).min(i32::MAX as u32));
    message.u32((ns % 1_000_000_000) as u32);
    message.text(frame);
}

/// Passes over a header.
pub fn skip_header(bytes: &mut Bytes<'_>) -> Option<()> {
    bytes.u32()?;
    bytes.u32()?;
    bytes.text().map(drop)
}

/// Readings as a picture of one channel.
pub fn image(ns: u64, layout: &Layout, readings: &[f32]) -> Vec<u8> {
    let mut message = Message::new();
    header(&mut message, ns, FRAME);
    message.u32(layout.rows as u32);
    message.u32(layout.columns as u32);
    message.text("32FC1");
    message.u8(0);
    message.u32(layout.columns as u32 * 4);
    let pixels: Vec<u8> = readings.iter().flat_map(|reading| reading.to_le_bytes()).collect();
    message.sequence(&pixels);
    message.into_bytes()
}

/// Readings of a picture.
pub fn read_image(bytes: &[u8], layout: &Layout) -> Option<Vec<f32>> {
    let mut bytes = Bytes::message(bytes)?;
    skip_header(&mut bytes)?;
    let (rows, columns) = (bytes.u32()? as usize, bytes.u32()? as usize);
    let (encoding, is_bigendian, _) = (bytes.text()?, bytes.u8()?, bytes.u32()?);
    let pixels = bytes.sequence()?;
    let is_fit = (rows, columns) == (layout.rows, layout.columns)
        && encoding == "32FC1"
        && is_bigendian == 0
        && pixels.len() == layout.readings.len() * 4;
    let value = |pixel: &[u8]| f32::from_le_bytes(pixel.try_into().unwrap_or_default());
    is_fit.then(|| pixels.chunks_exact(4).map(value).collect())
}

/// Axes along which the layout's outputs move any electrode.
fn moved_axes(layout: &Layout) -> Vec<usize> {
    let is_moved = |&axis: &usize| layout.electrodes.iter().any(|it| it.outputs[axis].is_some());
    (0..AXES.len()).filter(is_moved).collect()
}

/// Electrodes where `outputs` move them, with their deformations and deviations.
pub fn points(ns: u64, layout: &Layout, outputs: &[f32], deviations: Option<&[f32]>) -> Vec<u8> {
    let axes = moved_axes(layout);
    let tables: Vec<(&str, &[f32])> = [("d", Some(outputs)), ("s", deviations)]
        .into_iter()
        .filter_map(|(name, it)| Some((name, it?)))
        .collect();
    let step = PLACE_BYTES + (8 * axes.len() * tables.len()) as u32;
    let count = layout.electrodes.len() as u32;
    let mut is_dense = true;
    let mut data = Vec::with_capacity((step * count) as usize);
    for electrode in &layout.electrodes {
        for (axis, output) in electrode.outputs.iter().enumerate() {
            let moved = output.map_or(0.0, |output| metres(outputs[output]));
            let place = (electrode.place_mm[axis] / 1000.0 - moved) as f32;
            is_dense &= place.is_finite();
            data.extend(place.to_le_bytes());
        }
        data.extend([0; 4]);
        for (_, values) in &tables {
            for &axis in &axes {
                let value =
                    electrode.outputs[axis].map_or(f64::NAN, |output| metres(values[output]));
                is_dense &= value.is_finite();
                data.extend(value.to_le_bytes());
            }
        }
    }
    let places =
        AXES.iter().zip([0, 4, 8]).map(|(axis, offset)| (axis.to_string(), offset, FLOAT32));
    let names = tables
        .iter()
        .flat_map(|(table, _)| axes.iter().map(move |&axis| format!("{table}{}", AXES[axis])));
    let values =
        names.zip((PLACE_BYTES..).step_by(8)).map(|(name, offset)| (name, offset, FLOAT64));
    let fields: Vec<(String, u32, u8)> = places.chain(values).collect();

    let mut message = Message::new();
    header(&mut message, ns, FRAME);
    message.u32(1);
    message.u32(count);
    message.length(fields.len());
    for (name, offset, kind) in fields {
        message.text(&name);
        message.u32(offset);
        message.u8(kind);
        message.u32(1);
    }
    message.u8(0);
    message.u32(step);
    message.u32(step * count);
    message.sequence(&data);
    message.u8(is_dense.into());
    message.into_bytes()
}

/// Takes the outputs that belong to electrodes from points, and their deviations if there are any. Whether there are.
pub fn read_points(
    bytes: &[u8],
    layout: &Layout,
    outputs: &mut [f32],
    deviations: &mut [f32],
) -> Option<bool> {
    let mut bytes = Bytes::message(bytes)?;
    skip_header(&mut bytes)?;
    let points = bytes.u32()?.checked_mul(bytes.u32()?)?;
    let mut offsets = [[None; 3]; 2];
    for _ in 0..bytes.u32()? {
        let (name, offset) = (bytes.text()?, bytes.u32()? as usize);
        let is_number = (bytes.u8()?, bytes.u32()?) == (FLOAT64, 1);
        let table = match name.as_bytes().first() {
            Some(b'd') => 0,
            Some(b's') => 1,
            _ => continue,
        };
        let axis = AXES.iter().position(|axis| *axis == &name[1..]);
        if let Some(axis) = axis.filter(|_| is_number) {
            offsets[table][axis] = Some(offset);
        }
    }
    let (is_bigendian, step, _) = (bytes.u8()?, bytes.u32()? as usize, bytes.u32()?);
    let data = bytes.sequence()?;
    if points as usize != layout.electrodes.len() || is_bigendian != 0 || step == 0 {
        return None;
    }
    let has_deviations = offsets[1].iter().any(Option::is_some);
    let tables = [Some(outputs), has_deviations.then_some(deviations)];
    for (values, offsets) in tables.into_iter().zip(offsets) {
        let Some(values) = values else { continue };
        for (electrode, point) in layout.electrodes.iter().zip(0..) {
            for (output, offset) in electrode.outputs.iter().zip(offsets) {
                let Some(output) = *output else { continue };
                let offset = offset.filter(|offset| offset + 8 <= step)?;
                let value = Bytes::record(data.get(point * step + offset..)?).f64()?;
                values[output] = mm(value);
            }
        }
    }
    Some(has_deviations)
}

/// Outputs that belong to no electrode, in the units of their columns; then their deviations.
pub fn array(
    layout: &Layout,
    free: &[usize],
    outputs: &[f32],
    deviations: Option<&[f32]>,
) -> Vec<u8> {
    let names: Vec<&str> =
        free.iter().map(|&output| layout.outputs[output].name.as_str()).collect();
    let names = names.join(",");
    let rows = 1 + usize::from(deviations.is_some());
    let dimensions =
        [("output,deviation", rows, rows * free.len()), (&names, free.len(), free.len())];
    let dimensions = &dimensions[2 - rows..];
    let mut message = Message::new();
    message.length(dimensions.len());
    for (label, size, stride) in dimensions {
        message.text(label);
        message.length(*size);
        message.length(*stride);
    }
    message.u32(0);
    message.length(rows * free.len());
    let tables = [Some(outputs), deviations];
    for values in tables.into_iter().flatten() {
        free.iter().for_each(|&output| message.f64(values[output].into()));
    }
    message.into_bytes()
}

/// Takes the outputs that belong to no electrode, and their deviations if there are any. Whether there are.
pub fn read_array(
    bytes: &[u8],
    free: &[usize],
    outputs: &mut [f32],
    deviations: &mut [f32],
) -> Option<bool> {
    let mut bytes = Bytes::message(bytes)?;
    for _ in 0..bytes.u32()? {
        bytes.text()?;
        bytes.u32()?;
        bytes.u32()?;
    }
    (bytes.u32()? == 0).then_some(())?;
    let count = bytes.u32()? as usize;
    let has_deviations = count == 2 * free.len();
    if !has_deviations && count != free.len() {
        return None;
    }
    let tables = [Some(outputs), has_deviations.then_some(deviations)];
    for values in tables.into_iter().flatten() {
        for &output in free {
            values[output] = bytes.f64()? as f32;
        }
    }
    Some(has_deviations)
}

/// Place in m of a contact on the sheet, which it presses in from `surface_mm`; on the surface if its depth is not known.
fn place_m([x, y, depth]: [f32; 3], surface_mm: f64) -> [f64; 3] {
    let depth = if depth.is_nan() { 0.0 } else { f64::from(depth) };
    [metres(x), metres(y), (surface_mm - depth) / 1000.0]
}

/// Place of a contact on the sheet.
pub fn point(ns: u64, contact_mm: [f32; 3], surface_mm: f64) -> Vec<u8> {
    let mut message = Message::new();
    header(&mut message, ns, FRAME);
    place_m(contact_mm, surface_mm).iter().for_each(|&place| message.f64(place));
    message.into_bytes()
}

/// Place of a contact in mm, x and y, and its depth below `surface_mm`.
pub fn read_point(bytes: &[u8], surface_mm: f64) -> Option<[f32; 3]> {
    let mut bytes = Bytes::message(bytes)?;
    skip_header(&mut bytes)?;
    let (x, y, depth) = (mm(bytes.f64()?), mm(bytes.f64()?), surface_mm - bytes.f64()? * 1000.0);
    Some([x, y, if depth == 0.0 { f32::NAN } else { depth as f32 }])
}

/// Force `force_n` on the sensor, and the torque of a contact about the origin of the sensor's frame; 0 without a contact.
pub fn wrench(
    ns: u64,
    contact_mm: Option<[f32; 3]>,
    surface_mm: f64,
    force_n: [f32; 3],
) -> Vec<u8> {
    let place_m = contact_mm.map_or([0.0; 3], |contact_mm| place_m(contact_mm, surface_mm));
    let ([x, y, z], [fx, fy, fz]) = (place_m, force_n.map(f64::from));
    let torque = [y * fz - z * fy, z * fx - x * fz, x * fy - y * fx];
    let mut message = Message::new();
    header(&mut message, ns, FRAME);
    [fx, fy, fz].into_iter().chain(torque).for_each(|value| message.f64(value));
    message.into_bytes()
}

/// Force in N.
pub fn read_wrench(bytes: &[u8]) -> Option<[f32; 3]> {
    let mut bytes = Bytes::message(bytes)?;
    skip_header(&mut bytes)?;
    Some([bytes.f64()? as f32, bytes.f64()? as f32, bytes.f64()? as f32])
}

/// Text alone.
pub fn text(text: &str) -> Vec<u8> {
    let mut message = Message::new();
    message.text(text);
    message.into_bytes()
}

/// Text of a message.
pub fn read_text(bytes: &[u8]) -> Option<String> {
    Bytes::message(bytes)?.text().map(String::from)
}

/// The sensor's frame in its `parent`.
pub fn transform(ns: u64, parent: &str) -> Vec<u8> {
    let mut message = Message::new();
    message.length(1);
    header(&mut message, ns, parent);
    message.text(FRAME);
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into_iter().for_each(|value| message.f64(value));
    message.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_comes_back_from_metres_to_the_bit() {
        let edges = [f32::MIN_POSITIVE, f32::MAX, f32::EPSILON, f32::INFINITY, 0.0, 1.0, 0.1];
        // Every exponent with many fractions, and numbers below the least normal one.
        let all = (0..=u32::MAX / 2 + 1).step_by(9973).map(f32::from_bits);
        for value in all.chain(edges).chain((0..5000).map(f32::from_bits)) {
            for value in [value, -value] {
                let back = mm(metres(value));
                let is_same = back.to_bits() == value.to_bits();
                assert!(
                    is_same || back.is_nan() && value.is_nan(),
                    "{value:e} came back as {back:e}"
                );
            }
        }
    }

    #[test]
    fn a_wrench_turns_about_the_origin() {
        let values = |bytes: Vec<u8>| -> Vec<f64> {
            let mut read = Bytes::message(&bytes).unwrap();
            skip_header(&mut read).unwrap();
            std::iter::from_fn(|| read.f64()).collect()
        };
        let bytes = wrench(0, Some([1000.0, 0.0, f32::NAN]), 5.0, [0.0, 0.0, 2.0]);
        assert_eq!(values(bytes), [0.0, 0.0, 2.0, 0.0, -2.0, 0.0]);
        // y·Fz − z·Fy, z·Fx − x·Fz and x·Fy − y·Fx at 2, 4 and 0.5 m.
        let bytes = wrench(0, Some([2000.0, 4000.0, 500.0]), 1000.0, [1.0, 3.0, 8.0]);
        assert_eq!(values(bytes)[3..], [32.0 - 1.5, 0.5 - 16.0, 6.0 - 4.0]);
        // A contact is where the sheet is, pressed in from the electrodes at rest.
        assert_eq!(values(point(0, [0.0, 0.0, 0.5], 5.0)), [0.0, 0.0, 0.0045]);
        let unknown = point(0, [0.0, 0.0, f32::NAN], 5.0);
        assert!(read_point(&unknown, 5.0).is_some_and(|[.., depth]| depth.is_nan()));
        assert_eq!(values(unknown), [0.0, 0.0, 0.005]);
    }

    #[test]
    fn points_are_displaced_electrodes_and_pictures_have_rows() {
        let column = |name: &str| crate::Column { name: name.into(), unit: "mm".into() };
        let outputs = [Some(1), None, Some(0)];
        let place_mm = [1000.0, 2000.0, 500.0];
        let layout = Layout {
            title: String::new(),
            rows: 1,
            columns: 2,
            readings: ["a", "b"].map(column).into(),
            outputs: ["dz_mm", "dx_mm"].map(column).into(),
            electrodes: vec![crate::Electrode { name: "e".into(), place_mm, outputs }],
        };
        let bytes = points(3_000_000_007, &layout, &[250.0, -500.0], Some(&[125.0, 62.5]));
        let data = |of: &[f64], floats: &[f32]| -> Vec<u8> {
            let floats = floats.iter().flat_map(|it| it.to_le_bytes());
            floats.chain(of.iter().flat_map(|it| it.to_le_bytes())).collect()
        };
        // A press moves an electrode down, and what is decoded and its deviations follow along x and z.
        let point = data(&[-0.5, 0.25, 0.0625, 0.125], &[1.5, 2.0, 0.25, 0.0]);
        assert!(bytes.windows(point.len()).any(|found| found == point), "{bytes:?}");
        assert_eq!(bytes.last(), Some(&1), "nothing is missing");
        assert_eq!(points(0, &layout, &[f32::NAN, 0.0], None).last(), Some(&0));
        let mut picture = Bytes::message(&bytes).unwrap();
        assert_eq!([picture.u32(), picture.u32()], [Some(3), Some(7)], "s and ns");
        let bytes = image(0, &layout, &[1.0, 2.0]);
        let mut picture = Bytes::message(&bytes).unwrap();
        skip_header(&mut picture).unwrap();
        assert_eq!([picture.u32(), picture.u32()], [Some(1), Some(2)], "height and width");
        assert_eq!(
            (picture.text(), picture.u8(), picture.u32()),
            (Some("32FC1"), Some(0), Some(8))
        );
    }
}
