//! Element types of NumPy arrays, and decoding of their values.

use super::Values;
use crate::input::excerpt;

/// An element type: `<f8`, `>i4`, `|u1`, `<U12`.
pub(super) struct Element {
    kind: NumberKind,
    /// Size of one element in bytes, at least 1.
    size: usize,
    big_endian: bool,
}

#[derive(Clone, Copy)]
enum NumberKind {
    Float,
    Signed,
    Unsigned,
    Bool,
    /// UTF-32.
    Text,
}

impl Element {
    /// Parses a `descr`; the error lists the supported types.
    pub(super) fn parse(descr: &str) -> Result<Self, String> {
        Self::supported(descr).ok_or_else(|| {
            format!(
                "element type {:?} is not supported; expected floats of 4 or 8 bytes, integers, booleans or \
                 strings (no pickled objects)",
                excerpt(descr)
            )
        })
    }

    /// The type of a `descr`; `None` if it is not supported.
    fn supported(descr: &str) -> Option<Self> {
        let (order, rest) = descr.split_at_checked(1)?;
        let (kind, size) = rest.split_at_checked(1)?;
        let size = size.parse::<usize>().ok().filter(|size| *size > 0)?;
        let kind = match (kind, size) {
            ("f", 4 | 8) => NumberKind::Float,
            ("i", 1 | 2 | 4 | 8) => NumberKind::Signed,
            ("u", 1 | 2 | 4 | 8) => NumberKind::Unsigned,
            ("b", 1) => NumberKind::Bool,
            ("U", _) => NumberKind::Text,
            _ => return None,
        };
        let size = if let NumberKind::Text = kind { size.checked_mul(4)? } else { size };
        let big_endian = match order {
            "<" => false,
            ">" => true,
            "|" if size == 1 => false,
            _ => return None,
        };
        Some(Self { kind, size, big_endian })
    }

    /// `count` elements, which must fill `bytes` exactly; this is checked before memory is allocated.
    pub(super) fn values(&self, count: usize, bytes: &[u8]) -> Result<Values, String> {
        if count.checked_mul(self.size) != Some(bytes.len()) {
            return Err(format!("found {} bytes of values, expected {count} elements of {}", bytes.len(), self.size));
        }
        let too_large = || "an integer is above 2^63 - 1".to_string();
        Ok(match (self.kind, self.size) {
            (NumberKind::Float, 8) => Values::F64(self.each(bytes, f64::from_le_bytes)),
            (NumberKind::Float, _) => Values::F32(self.each(bytes, f32::from_le_bytes)),
            (NumberKind::Signed, 1) => Values::I64(self.each(bytes, |b| i8::from_le_bytes(b).into())),
            (NumberKind::Signed, 2) => Values::I64(self.each(bytes, |b| i16::from_le_bytes(b).into())),
            (NumberKind::Signed, 4) => Values::I64(self.each(bytes, |b| i32::from_le_bytes(b).into())),
            (NumberKind::Signed, _) => Values::I64(self.each(bytes, i64::from_le_bytes)),
            (NumberKind::Unsigned, 1) => Values::U8(bytes.to_vec()),
            (NumberKind::Unsigned, 2) => Values::I64(self.each(bytes, |b| u16::from_le_bytes(b).into())),
            (NumberKind::Unsigned, 4) => Values::I64(self.each(bytes, |b| u32::from_le_bytes(b).into())),
            (NumberKind::Unsigned, _) => {
                let numbers = self.each(bytes, u64::from_le_bytes).into_iter().map(i64::try_from);
                Values::I64(numbers.collect::<Result<_, _>>().map_err(|_| too_large())?)
            }
            (NumberKind::Bool, _) => Values::Bool(bytes.iter().map(|b| *b != 0).collect()),
            (NumberKind::Text, size) => {
                Values::Text(bytes.chunks_exact(size).map(|text| self.text(text)).collect::<Result<_, _>>()?)
            }
        })
    }

    /// One value for every `N` bytes; `from` receives them in little-endian order.
    fn each<const N: usize, T>(&self, bytes: &[u8], from: impl Fn([u8; N]) -> T) -> Vec<T> {
        let in_order = |mut element: [u8; N]| {
            if self.big_endian {
                element.reverse();
            }
            from(element)
        };
        bytes.as_chunks().0.iter().map(|element| in_order(*element)).collect()
    }

    fn text(&self, bytes: &[u8]) -> Result<String, String> {
        let text: Option<String> = self.each(bytes, u32::from_le_bytes).into_iter().map(char::from_u32).collect();
        Ok(text.ok_or("a string contains an invalid code point")?.trim_end_matches('\0').to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(descr: &str, count: usize, bytes: &[u8]) -> Result<Values, String> {
        Element::parse(descr)?.values(count, bytes)
    }

    #[test]
    fn both_byte_orders_and_all_integer_widths_are_read() {
        for (descr, bytes) in [
            ("<i2", vec![0xfe, 0xff, 7, 0]),
            (">i2", vec![0xff, 0xfe, 0, 7]),
            ("|i1", vec![0xfe, 7]),
            ("<i4", [(-2_i32).to_le_bytes(), 7_i32.to_le_bytes()].concat()),
            (">i8", [(-2_i64).to_be_bytes(), 7_i64.to_be_bytes()].concat()),
        ] {
            assert_eq!(read(descr, 2, &bytes), Ok(Values::I64(vec![-2, 7])), "{descr}");
        }
        assert_eq!(read(">u4", 1, &u32::MAX.to_be_bytes()), Ok(Values::I64(vec![u32::MAX.into()])));
        assert_eq!(read("<u8", 1, &7_u64.to_le_bytes()), Ok(Values::I64(vec![7])));
        assert!(read("<u8", 1, &u64::MAX.to_le_bytes()).unwrap_err().contains("2^63"));
        assert_eq!(read(">f8", 1, &1.5_f64.to_be_bytes()), Ok(Values::F64(vec![1.5])));
        assert_eq!(read(">f4", 1, &1.5_f32.to_be_bytes()), Ok(Values::F32(vec![1.5])));
        let text: Vec<u8> = "aé".chars().flat_map(|c| u32::from(c).to_be_bytes()).chain([0; 4]).collect();
        assert_eq!(read(">U3", 1, &text), Ok(Values::Text(vec!["aé".to_string()])));
    }

    #[test]
    fn unsupported_types_are_refused_by_name() {
        for descr in
            ["|O", "<f2", "<f16", "<c8", "<M8[s]", "|S5", "<U0", "<U99999999999999999999", "|f8", "é8", "<", ""]
        {
            assert!(read(descr, 0, &[]).is_err_and(|e| e.contains(&format!("{descr:?} is not supported"))), "{descr}");
        }
        assert!(read("<i4", 3, &[0; 8]).unwrap_err().contains("expected 3 elements of 4"));
        assert!(read("<U4611686018427387904", 1, &[]).is_err(), "the width in bytes overflows");
    }
}
