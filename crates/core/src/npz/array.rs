//! Arrays of numbers and strings.

/// An n-dimensional array in C order (the last index varies fastest).
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Length along every axis; empty for a scalar.
    pub shape: Vec<usize>,
    /// The values; as many as the product of `shape`.
    pub values: Values,
}

/// The values of an [`Array`] by element type.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// `<f8`.
    F64(Vec<f64>),
    /// `<f4`.
    F32(Vec<f32>),
    /// `<i8`; integers of other widths are converted to it.
    I64(Vec<i64>),
    /// `|u1`.
    U8(Vec<u8>),
    /// `|b1`.
    Bool(Vec<bool>),
    /// `<U n`: UTF-32, padded with zeros (so a string cannot end in NUL).
    Text(Vec<String>),
}

macro_rules! values_from {
    ($($element:ty => $variant:ident),*) => {$(
        impl From<Vec<$element>> for Values {
            fn from(values: Vec<$element>) -> Self {
                Self::$variant(values)
            }
        }
    )*};
}
values_from!(f64 => F64, f32 => F32, i64 => I64, u8 => U8, bool => Bool, String => Text);

impl Array {
    /// An array of this shape.
    pub fn new(shape: &[usize], values: impl Into<Values>) -> Self {
        Self { shape: shape.to_vec(), values: values.into() }
    }

    /// A one-dimensional array of strings.
    pub fn names<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let names: Vec<String> = names.into_iter().map(String::from).collect();
        Self::new(&[names.len()], names)
    }
}
