//! NumPy's array format (NEP 1): a header holding a Python dictionary, then the values.
//!
//! Written little-endian and in C order. Read in either byte order, in C or Fortran order, with any element type that
//! [`super::element`] supports.

use super::element::Element;
use super::{Array, Values};
use crate::input::excerpt;

const MOST_DIMENSIONS: usize = 8;
/// Greatest length of one axis, even of an empty array: 2 GiB of bytes.
const LONGEST_AXIS: usize = 1 << 31;

const MAGIC: &[u8] = b"\x93NUMPY";

impl Array {
    /// The bytes of a `.npy` file (version 1.0), or the reason why the array is invalid.
    pub(super) fn to_npy(&self) -> Result<Vec<u8>, String> {
        if element_count(&self.shape) != Some(self.values.len()) {
            return Err(format!("{} values do not fill shape {:?}", self.values.len(), self.shape));
        }
        let widest = self.values.widest_text();
        let descr = match &self.values {
            Values::F64(_) => "<f8".to_string(),
            Values::F32(_) => "<f4".to_string(),
            Values::I64(_) => "<i8".to_string(),
            Values::U8(_) => "|u1".to_string(),
            Values::Bool(_) => "|b1".to_string(),
            Values::Text(_) => format!("<U{widest}"),
        };
        let shape: String = self.shape.iter().map(|n| format!("{n}, ")).collect();
        let shape = if self.shape.len() == 1 { shape.trim_end() } else { shape.trim_end_matches(", ") };
        let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
        // the values start at a multiple of 64 bytes, and the header ends in a newline
        let unpadded = MAGIC.len() + 4 + header.len() + 1;
        header.extend(std::iter::repeat_n(' ', unpadded.next_multiple_of(64) - unpadded));
        header.push('\n');
        let length = u16::try_from(header.len()).map_err(|_| "too many dimensions".to_string())?;

        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend(length.to_le_bytes());
        bytes.extend(header.as_bytes());
        self.values.append_to(&mut bytes, widest);
        Ok(bytes)
    }

    /// Reads the array of a `.npy` file.
    #[doc(hidden)]
    pub fn from_npy(bytes: &[u8]) -> Result<Self, String> {
        let rest = bytes.strip_prefix(MAGIC).ok_or("not a .npy array: it does not begin with \\x93NUMPY")?;
        let (length, rest) = match rest {
            [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
            [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
            _ => return Err("unknown .npy version, expected 1, 2 or 3".to_string()),
        };
        let (header, body) = rest.split_at_checked(length).ok_or("the .npy header is truncated")?;
        let header = std::str::from_utf8(header).map_err(|_| "the .npy header is not text")?;
        let Header { element, fortran_order, shape } = parse_header(header)?;
        let count = element_count(&shape).ok_or_else(|| "the shape is too large".to_string())?;
        let values = element.values(count, body)?;
        let values = if fortran_order { values.in_c_order(&shape) } else { values };
        Ok(Self { shape, values })
    }
}

/// `None` if there are more elements or dimensions than supported.
fn element_count(shape: &[usize]) -> Option<usize> {
    if shape.len() > MOST_DIMENSIONS || shape.iter().any(|n| *n > LONGEST_AXIS) {
        return None;
    }
    shape.iter().try_fold(1_usize, |product, n| product.checked_mul(*n))
}

struct Header {
    element: Element,
    fortran_order: bool,
    shape: Vec<usize>,
}

fn parse_header(header: &str) -> Result<Header, String> {
    let value = |key: &str| {
        let (_, after) = header.split_once(key)?;
        Some(after.trim_start().strip_prefix(':')?.trim_start())
    };
    let missing = |key: &str| format!("the .npy header has no readable {key}: {}", excerpt(header.trim()));
    let descr = value("'descr'").ok_or_else(|| missing("'descr'"))?;
    let descr = descr.strip_prefix('\'').and_then(|d| d.split_once('\'')).map(|(d, _)| d);
    let descr = descr.ok_or("a structured or pickled array; expected plain numbers, booleans or strings")?;
    let order = value("'fortran_order'").ok_or_else(|| missing("'fortran_order'"))?;
    let fortran_order = order.starts_with("True");
    if !fortran_order && !order.starts_with("False") {
        return Err(missing("'fortran_order'"));
    }
    let shape = value("'shape'").and_then(|s| s.strip_prefix('(')?.split_once(')')).map(|(s, _)| s);
    let shape = shape.ok_or_else(|| missing("'shape'"))?;
    let lengths = shape.split(',').map(str::trim).filter(|n| !n.is_empty());
    let shape = lengths.map(|n| n.parse().map_err(|_| missing("'shape'"))).collect::<Result<_, _>>()?;
    Ok(Header { element: Element::parse(descr)?, fortran_order, shape })
}

/// Reorders values from Fortran order (first index fastest) to C order (last index fastest). Their number matches
/// `shape`.
fn in_c_order<T: Clone>(values: &[T], shape: &[usize]) -> Vec<T> {
    let mut index = vec![0; shape.len()];
    let place = |index: &[usize]| index.iter().zip(shape).rev().fold(0, |place, (i, length)| place * length + i);
    let mut ordered = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        ordered.push(values[place(&index)].clone());
        for (i, length) in index.iter_mut().zip(shape).rev() {
            *i = (*i + 1) % length;
            if *i > 0 {
                break;
            }
        }
    }
    ordered
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::F64(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::Bool(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }

    /// Characters of the longest string, at least 1 (NumPy has no strings of width 0).
    fn widest_text(&self) -> usize {
        match self {
            Self::Text(texts) => texts.iter().map(|t| t.chars().count()).max().unwrap_or(0).max(1),
            _ => 0,
        }
    }

    fn append_to(&self, bytes: &mut Vec<u8>, text_width: usize) {
        match self {
            Self::F64(v) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
            Self::F32(v) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
            Self::I64(v) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
            Self::U8(v) => bytes.extend(v),
            Self::Bool(v) => bytes.extend(v.iter().map(|b| u8::from(*b))),
            Self::Text(v) => {
                for text in v {
                    let characters = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(text_width);
                    bytes.extend(characters.flat_map(u32::to_le_bytes));
                }
            }
        }
    }

    /// Converts values from Fortran order to C order.
    fn in_c_order(self, shape: &[usize]) -> Self {
        match self {
            Self::F64(v) => Self::F64(in_c_order(&v, shape)),
            Self::F32(v) => Self::F32(in_c_order(&v, shape)),
            Self::I64(v) => Self::I64(in_c_order(&v, shape)),
            Self::U8(v) => Self::U8(in_c_order(&v, shape)),
            Self::Bool(v) => Self::Bool(in_c_order(&v, shape)),
            Self::Text(v) => Self::Text(in_c_order(&v, shape)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_match_numpys_and_values_start_at_a_multiple_of_64_bytes() {
        let bytes = Array::new(&[3], vec![1.0, 2.0, 3.0]).to_npy().unwrap();
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }";
        assert_eq!(&bytes[10..10 + header.len()], header.as_bytes());
        assert_eq!(bytes.len(), 128 + 24);
        assert_eq!(&bytes[128..136], &1.0_f64.to_le_bytes());
        let scalar = Array::new(&[], vec![60.0]).to_npy().unwrap();
        assert!(String::from_utf8_lossy(&scalar).contains("'shape': ()"));
    }

    #[test]
    fn an_array_whose_values_do_not_fill_its_shape_is_not_written() {
        assert!(Array::new(&[2, 2], vec![1.0]).to_npy().unwrap_err().contains("shape"));
    }

    #[test]
    fn invalid_headers_cause_specific_errors_and_no_allocation() {
        let with_header = |header: &str| {
            let mut bytes = MAGIC.to_vec();
            bytes.extend([1, 0]);
            bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
            bytes.extend(header.as_bytes());
            Array::from_npy(&bytes).unwrap_err()
        };
        let huge = "{'descr': '<f8', 'fortran_order': False, 'shape': (999999999,)}";
        assert!(with_header(huge).contains("expected 999999999 elements"));
        let overflow = "{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999999999, 9999999999999999)}";
        assert!(with_header(overflow).contains("too large"));
        let nothing_wide = "{'descr': '<U0', 'fortran_order': False, 'shape': (999999999,)}";
        assert!(with_header(nothing_wide).contains("not supported"));
        assert!(with_header("{'descr': '|O', 'fortran_order': False, 'shape': (1,)}").contains("pickled"));
        assert!(with_header("{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': ()}").contains("structured"));
        assert!(with_header("{'descr': '<f8', 'fortran_order': Maybe, 'shape': (1,)}").contains("'fortran_order'"));
        let huge = "{'descr': '<f8', 'fortran_order': True, 'shape': (999999999,)}";
        assert!(with_header(huge).contains("expected 999999999 elements"));
        assert!(with_header("{}").contains("'descr'"));
    }

    #[test]
    fn fortran_order_is_converted_to_c_order() {
        let c = Array::new(&[2, 3, 4], (0..24_i64).collect::<Vec<_>>());
        let at = |i: usize, j: usize, k: usize| ((i * 3 + j) * 4 + k) as i64;
        let mut fortran = Vec::new();
        for k in 0..4 {
            for j in 0..3 {
                fortran.extend((0..2).map(|i| at(i, j, k)));
            }
        }
        let bytes = Array::new(&[2, 3, 4], fortran).to_npy().unwrap();
        let text = String::from_utf8_lossy(&bytes[10..128]).replace("False", "True ");
        let bytes = [&bytes[..10], text.as_bytes(), &bytes[128..]].concat();
        assert_eq!(Array::from_npy(&bytes).unwrap(), c);
        let nothing = Array::new(&[3, 0], Vec::<f64>::new());
        let bytes = nothing.to_npy().unwrap();
        let text = String::from_utf8_lossy(&bytes[10..]).replace("False", "True ");
        assert_eq!(Array::from_npy(&[&bytes[..10], text.as_bytes()].concat()).unwrap(), nothing);
    }
}
