//! Says where two files of the same name differ.

use skiagraph_core::input::{excerpt, foreign};
use skiagraph_core::npz::{Array, Npz, Values};

/// Describes the first difference of a file from the `expected` one.
pub(super) fn difference(path: &str, expected: &[u8], found: &[u8]) -> String {
    let described = match path.rsplit_once('.') {
        Some((_, "npz")) => of_arrays(path, expected, found),
        Some((_, "json" | "toml" | "txt")) => of_lines(expected, found),
        Some((_, "png")) => of_pixels(expected, found),
        _ => None,
    };
    let of_bytes = || {
        let at = expected.iter().zip(found).take_while(|(a, b)| a == b).count();
        format!("first differs at byte {at} of {}, expected {} bytes", found.len(), expected.len())
    };
    described.unwrap_or_else(of_bytes)
}

fn of_lines(expected: &[u8], found: &[u8]) -> Option<String> {
    let (expected, found) = (String::from_utf8_lossy(expected), String::from_utf8_lossy(found));
    let (mut expected, mut found) = (expected.lines(), found.lines());
    for line in 1.. {
        match (expected.next(), found.next()) {
            (None, None) => return None,
            (a, b) if a == b => {}
            (a, b) => {
                let [a, b] =
                    [a, b].map(|text| text.map_or("nothing".to_owned(), |text| format!("{:?}", excerpt(text))));
                return Some(format!("line {line} is {b}, expected {a}"));
            }
        }
    }
    None
}

fn of_arrays(path: &str, expected: &[u8], found: &[u8]) -> Option<String> {
    let expected = Npz::from_bytes(path, expected).ok()?;
    let found = match Npz::from_bytes(path, found) {
        Ok(found) => found,
        Err(error) => return Some(format!("cannot be read: {}", error.detail)),
    };
    for (name, array) in expected.iter() {
        let Some(own) = found.get(name) else { return Some(format!("the array {name} is missing")) };
        if let Some(detail) = of_values(array, own) {
            return Some(format!("{name}: {detail}"));
        }
    }
    let other = found.iter().find(|(name, _)| expected.get(name).is_none());
    other.map(|(name, _)| format!("the array {:?} does not belong to this file", excerpt(name)))
}

fn of_values(expected: &Array, found: &Array) -> Option<String> {
    if expected.shape != found.shape {
        return Some(format!("has shape {:?}, expected {:?}", found.shape, expected.shape));
    }
    match (&expected.values, &found.values) {
        (Values::F64(a), Values::F64(b)) => first(a, b, |a, b| a.to_bits() == b.to_bits()),
        (Values::F32(a), Values::F32(b)) => first(a, b, |a, b| a.to_bits() == b.to_bits()),
        (Values::I64(a), Values::I64(b)) => first(a, b, |a, b| a == b),
        (Values::U8(a), Values::U8(b)) => first(a, b, |a, b| a == b),
        (Values::Bool(a), Values::Bool(b)) => first(a, b, |a, b| a == b),
        (Values::Text(a), Values::Text(b)) => {
            let [a, b] = [a, b].map(|texts| texts.iter().map(|text| excerpt(text)).collect::<Vec<_>>());
            first(&a, &b, |a, b| a == b)
        }
        _ => Some("has elements of another type".to_owned()),
    }
}

fn first<T: std::fmt::Debug>(expected: &[T], found: &[T], same: impl Fn(&T, &T) -> bool) -> Option<String> {
    let wrong = expected.iter().zip(found).filter(|(a, b)| !same(a, b)).count();
    let at = expected.iter().zip(found).position(|(a, b)| !same(a, b))?;
    let of = expected.len();
    Some(format!("{wrong} of {of} elements differ, first [{at}]: {:?}, expected {:?}", found[at], expected[at]))
}

/// Pixels that differ; `None` for the same pixels in other bytes.
fn of_pixels(expected: &[u8], found: &[u8]) -> Option<String> {
    let mut known = png::Decoder::new(std::io::Cursor::new(expected)).read_info().ok()?;
    let Ok(mut own) = png::Decoder::new(std::io::Cursor::new(found)).read_info() else {
        return Some("cannot be decoded".to_owned());
    };
    let form = |info: &png::Info<'_>| (info.width, info.height, info.color_type, info.bit_depth);
    let (expected, found) = (form(known.info()), form(own.info()));
    // the size of the expected image is known, so that no claimed size decides about memory
    if expected != found {
        return Some(format!("has (width, height, colours, bits) {found:?}, expected {expected:?}"));
    }
    let mut pixels = [(); 2].map(|()| vec![0; known.output_buffer_size().unwrap_or(0)]);
    known.next_frame(&mut pixels[0]).ok()?;
    if let Err(error) = own.next_frame(&mut pixels[1]) {
        return Some(format!("cannot be decoded: {}", foreign(error)));
    }
    let wrong = pixels[0].iter().zip(&pixels[1]).filter(|(a, b)| a != b).count();
    (wrong > 0).then(|| format!("{wrong} of {} values of its pixels differ", pixels[0].len()))
}
