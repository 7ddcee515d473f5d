//! Reads numbers from a glTF file's accessors. The `gltf` crate's own iterators assume that types, counts and offsets
//! are valid and panic otherwise; here they are checked.

use gltf::accessor::{DataType, Dimensions};

/// The bytes of every buffer of a file.
pub(super) type Buffers = Vec<Vec<u8>>;

/// The accessor's elements as rows of `N` numbers each.
///
/// # Errors
/// What is wrong with the accessor, and what was expected: numbers of one of `types`, `dimensions`, at most `most`
/// elements.
pub(super) fn rows<const N: usize>(
    accessor: &gltf::Accessor<'_>,
    buffers: &Buffers,
    (types, dimensions): (&[DataType], Dimensions),
    most: usize,
) -> Result<Vec<[f64; N]>, String> {
    let place = format!("accessor {}", accessor.index());
    let (found, kind) = (accessor.dimensions(), accessor.data_type());
    if found != dimensions || dimensions.multiplicity() != N || !types.contains(&kind) {
        return Err(format!("{place}: expected {dimensions:?} of {types:?}, found {found:?} of {kind:?}"));
    }
    let count = accessor.count();
    if count > most {
        return Err(format!("{place}: {count} elements; expected at most {most}: decimate the mesh"));
    }
    if accessor.sparse().is_some() {
        return Err(format!("{place} is sparse; save the file without sparse accessors"));
    }
    let view = accessor.view().ok_or_else(|| format!("{place} has no buffer view"))?;
    let bytes = buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
    let end = view.offset().checked_add(view.length());
    let bytes = end.and_then(|end| bytes.get(view.offset()..end));
    let bytes = bytes.ok_or_else(|| format!("buffer view {} reaches beyond its buffer", view.index()))?;
    let size = kind.size() * N;
    let stride = view.stride().unwrap_or(size);
    let element = |index: usize| {
        let start = accessor.offset().checked_add(index.checked_mul(stride)?)?;
        let own = bytes.get(start..start.checked_add(size)?)?;
        let mut row = [0.0; N];
        row.iter_mut().zip(own.chunks_exact(kind.size())).for_each(|(to, from)| *to = number(kind, from));
        Some(row)
    };
    let whole: Option<Vec<[f64; N]>> = (0..count).map(element).collect();
    let mut whole = whole.ok_or_else(|| format!("{place} reaches beyond its buffer view"))?;
    if accessor.normalized() {
        let greatest = greatest(kind);
        whole.as_flattened_mut().iter_mut().for_each(|number| *number /= greatest);
    }
    Ok(whole)
}

fn number(kind: DataType, bytes: &[u8]) -> f64 {
    let four = || bytes.first_chunk::<4>().copied().unwrap_or_default();
    let two = || bytes.first_chunk::<2>().copied().unwrap_or_default();
    let one = bytes.first().copied().unwrap_or_default();
    match kind {
        DataType::I8 => f64::from(one as i8),
        DataType::U8 => f64::from(one),
        DataType::I16 => f64::from(i16::from_le_bytes(two())),
        DataType::U16 => f64::from(u16::from_le_bytes(two())),
        DataType::U32 => f64::from(u32::from_le_bytes(four())),
        DataType::F32 => f64::from(f32::from_le_bytes(four())),
    }
}

/// The value that represents 1 in normalised numbers.
fn greatest(kind: DataType) -> f64 {
    match kind {
        DataType::I8 => f64::from(i8::MAX),
        DataType::U8 => f64::from(u8::MAX),
        DataType::I16 => f64::from(i16::MAX),
        DataType::U16 => f64::from(u16::MAX),
        DataType::U32 | DataType::F32 => 1.0,
    }
}
