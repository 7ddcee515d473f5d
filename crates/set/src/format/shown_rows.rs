//! Rows of a depth image with geometry, because most of an image is empty.

use skiagraph_core::body::DepthImage;

/// A row of an image with geometry, and its range of columns.
pub(crate) struct ShownRow {
    pub(crate) y: usize,
    pub(crate) first: usize,
    pub(crate) end: usize,
}

/// Every row with geometry, from the top.
pub(crate) fn shown_rows(image: &DepthImage) -> impl Iterator<Item = ShownRow> {
    let rows = image.part.chunks_exact(image.width.max(1) as usize).enumerate();
    rows.filter_map(|(y, row)| {
        // folding the whole row is faster than searching it
        let any = row.iter().fold(0, |any, part| any | part);
        let (first, end) = if any > 0 { ends(row, |part| *part > 0)? } else { return None };
        Some(ShownRow { y, first, end })
    })
}

/// Index of the first wanted value of a row, and one past the last.
pub(crate) fn ends<T>(row: &[T], is_wanted: impl Fn(&T) -> bool) -> Option<(usize, usize)> {
    let first = row.iter().position(&is_wanted)?;
    Some((first, row.iter().rposition(is_wanted)? + 1))
}
