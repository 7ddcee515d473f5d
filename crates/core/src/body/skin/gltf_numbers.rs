//! Reads numbers from a glTF file's accessors. The `gltf` crate's own iterators assume that types, counts and offsets
//! are valid and panic otherwise; here they are checked.

use gltf::accessor::sparse::IndexType;
use gltf::accessor::{DataType, Dimensions};

pub(super) type Buffers = Vec<Vec<u8>>;

/// Greatest number of elements that no bytes of the file are of.
const MOST_ZEROS: usize = 1_000_000;

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
        return Err(format!("{place}: {count} elements; expected at most {most}"));
    }
    let mut whole = match accessor.view() {
        Some(view) => {
            let stride = view.stride().unwrap_or(kind.size() * N);
            let bytes = view_bytes(&view, buffers)?;
            elements(bytes, accessor.offset(), stride, kind, count)
                .ok_or_else(|| format!("{place} reaches beyond its buffer view"))?
        }
        // without a view, all that a sparse accessor does not state is zero
        None if accessor.sparse().is_some() && count <= MOST_ZEROS => vec![[0.0; N]; count],
        None => return Err(format!("{place} has no buffer view")),
    };
    if let Some(sparse) = accessor.sparse() {
        let beyond = || format!("the sparse values of {place} reach beyond their buffer views");
        let (indices, values) = (sparse.indices(), sparse.values());
        let index_kind = match indices.index_type() {
            IndexType::U8 => DataType::U8,
            IndexType::U16 => DataType::U16,
            IndexType::U32 => DataType::U32,
        };
        let number = sparse.count();
        if number > count {
            return Err(format!("{place}: {number} sparse values of {count} elements"));
        }
        let at: Option<Vec<[f64; 1]>> =
            elements(view_bytes(&indices.view(), buffers)?, indices.offset(), index_kind.size(), index_kind, number);
        let own = elements(view_bytes(&values.view(), buffers)?, values.offset(), kind.size() * N, kind, number);
        for ([index], row) in at.ok_or_else(beyond)?.into_iter().zip(own.ok_or_else(beyond)?) {
            *whole.get_mut(index as usize).ok_or_else(beyond)? = row;
        }
    }
    // what is no integer is as it is
    if accessor.normalized() && !matches!(kind, DataType::F32 | DataType::U32) {
        let greatest = greatest(kind);
        whole.as_flattened_mut().iter_mut().for_each(|number| *number = (*number / greatest).max(-1.0));
    }
    Ok(whole)
}

fn view_bytes<'a>(view: &gltf::buffer::View<'_>, buffers: &'a Buffers) -> Result<&'a [u8], String> {
    let bytes = buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
    let end = view.offset().checked_add(view.length());
    end.and_then(|end| bytes.get(view.offset()..end))
        .ok_or_else(|| format!("buffer view {} reaches beyond its buffer", view.index()))
}

/// `None` if the elements reach beyond the bytes.
fn elements<const N: usize>(
    bytes: &[u8],
    offset: usize,
    stride: usize,
    kind: DataType,
    count: usize,
) -> Option<Vec<[f64; N]>> {
    let size = kind.size() * N;
    let element = |index: usize| {
        let start = offset.checked_add(index.checked_mul(stride)?)?;
        let own = bytes.get(start..start.checked_add(size)?)?;
        let mut row = [0.0; N];
        row.iter_mut().zip(own.chunks_exact(kind.size())).for_each(|(to, from)| *to = number(kind, from));
        Some(row)
    };
    (0..count).map(element).collect()
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
