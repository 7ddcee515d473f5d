//! Where in a depth image something is to be seen: most of an image is empty.

use crate::body::DepthImage;

/// A row of an image in which something is shown, and from where to where in it.
pub(super) struct ShownRow {
    pub(super) y: usize,
    pub(super) first: usize,
    pub(super) end: usize,
}

/// Every row in which a part is shown, from the top.
pub(super) fn shown_rows(image: &DepthImage) -> impl Iterator<Item = ShownRow> {
    let rows = image.part.chunks_exact(image.width.max(1) as usize).enumerate();
    rows.filter_map(|(y, row)| {
        // all at once is faster than one after another
        let any = row.iter().fold(0, |any, part| any | part);
        let (first, end) = if any > 0 { ends(row, |part| *part > 0)? } else { return None };
        Some(ShownRow { y, first, end })
    })
}

/// Where the first value of a row is that is wanted, and where the last one ends.
pub(super) fn ends<T>(row: &[T], is_wanted: impl Fn(&T) -> bool) -> Option<(usize, usize)> {
    let first = row.iter().position(&is_wanted)?;
    Some((first, row.iter().rposition(is_wanted)? + 1))
}
