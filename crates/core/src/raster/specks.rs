//! Removal of specks and pinholes from a mask.

use std::collections::BTreeMap;

use super::Mask;

/// `mask` without segmentation noise: connected components (8-connectivity) of fewer than `least` pixels are cleared,
/// except the largest component, and holes are filled: connected components of the background (4-connectivity) of
/// fewer than `least` pixels that do not touch the image border.
pub fn without_specks(mask: &Mask, least: u64) -> Mask {
    let mut cleaned = mask.clone();
    let parts = Regions::new(mask, false, 1);
    let roots = (0..parts.runs.len()).filter(|i| parts.parents[*i] == *i);
    let largest = roots.map(|i| parts.parts[i].area).max().unwrap_or(0);
    for (part, run) in parts.runs() {
        if part.area < least.min(largest) {
            (run.from..run.to).for_each(|x| cleaned.set(x, run.y, false));
        }
    }
    let parts = Regions::new(mask, true, 0);
    for (part, run) in parts.runs() {
        if part.area < least && !part.at_border {
            cleaned.fill_span(run.y, run.from, run.to);
        }
    }
    cleaned
}

/// The connected regions of a mask (4-connectivity), each as the pixels `(x, y)` in it.
pub fn connected_regions(mask: &Mask) -> Vec<Vec<(u32, u32)>> {
    let mut regions = Regions::new(mask, false, 0);
    let mut of_root: BTreeMap<usize, Vec<(u32, u32)>> = BTreeMap::new();
    for index in 0..regions.runs.len() {
        let run = regions.runs[index];
        of_root.entry(regions.root(index)).or_default().extend((run.from..run.to).map(|x| (x, run.y)));
    }
    of_root.into_values().collect()
}

/// Pixels `from .. to` of a row.
#[derive(Clone, Copy, Debug)]
struct PixelRun {
    y: u32,
    from: u32,
    to: u32,
}

/// The runs of set pixels in a row, or of unset ones.
fn runs_of_row(mask: &Mask, y: u32, unset: bool) -> Vec<PixelRun> {
    let set = mask.runs(y).map(|run| PixelRun { y, from: run.start, to: run.end });
    if !unset {
        return set.collect();
    }
    let mut gaps = Vec::new();
    let mut from = 0;
    for run in set.chain([PixelRun { y, from: mask.width(), to: mask.width() }]) {
        if run.from > from {
            gaps.push(PixelRun { y, from, to: run.from });
        }
        from = run.to;
    }
    gaps
}

/// A connected component: its number of pixels, and whether it touches the image border.
#[derive(Clone, Copy, Debug)]
struct Region {
    area: u64,
    at_border: bool,
}

/// Runs and their components, as a disjoint-set forest.
struct Regions {
    runs: Vec<PixelRun>,
    /// `parents[i] <= i`: another run of the same component, or the run itself.
    parents: Vec<usize>,
    /// Valid for runs that are their own parents.
    parts: Vec<Region>,
}

impl Regions {
    /// Joins overlapping runs of set pixels, or of unset ones, in adjacent rows; `reach` is 1 if pixels that share only
    /// a corner are connected too.
    fn new(mask: &Mask, unset: bool, reach: u32) -> Self {
        let rows: Vec<_> = (0..mask.height()).map(|y| runs_of_row(mask, y, unset)).collect();
        let runs: Vec<PixelRun> = rows.iter().flatten().copied().collect();
        let part = |run: &PixelRun| Region {
            area: u64::from(run.to - run.from),
            at_border: run.from == 0 || run.y == 0 || run.to == mask.width() || run.y + 1 == mask.height(),
        };
        let mut all = Self { parents: (0..runs.len()).collect(), parts: runs.iter().map(part).collect(), runs };
        let mut begin = 0;
        for pair in rows.windows(2) {
            let middle = begin + pair[0].len();
            let (mut above, mut below) = (begin, middle);
            while above < middle && below < middle + pair[1].len() {
                let (a, b) = (all.runs[above], all.runs[below]);
                if a.from < b.to + reach && b.from < a.to + reach {
                    all.join(above, below);
                }
                if a.to < b.to { above += 1 } else { below += 1 }
            }
            begin = middle;
        }
        all
    }

    fn root(&mut self, mut run: usize) -> usize {
        while self.parents[run] != run {
            self.parents[run] = self.parents[self.parents[run]];
            run = self.parents[run];
        }
        run
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return;
        }
        let (kept, other) = (a.min(b), a.max(b));
        self.parents[other] = kept;
        let (p, q) = (self.parts[kept], self.parts[other]);
        self.parts[kept] = Region { area: p.area + q.area, at_border: p.at_border || q.at_border };
    }

    fn runs(mut self) -> Vec<(Region, PixelRun)> {
        let count = self.runs.len();
        let of_run = |run| {
            let root = self.root(run);
            (self.parts[root], self.runs[run])
        };
        (0..count).map(of_run).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::raster::mask::tests::noise;

    /// The component containing `(x, y)`, by flood fill: its number of pixels, and whether it touches the border.
    fn flooded(mask: &Mask, x: u32, y: u32) -> (u64, bool) {
        let value = mask.get(x, y);
        let (width, height) = (i64::from(mask.width()), i64::from(mask.height()));
        let (mut seen, mut waiting, mut area, mut border) =
            (Mask::new(mask.width(), mask.height()), vec![(x, y)], 0, false);
        seen.set(x, y, true);
        while let Some((x, y)) = waiting.pop() {
            area += 1;
            let (x, y) = (i64::from(x), i64::from(y));
            border |= x == 0 || y == 0 || x + 1 == width || y + 1 == height;
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                let (u, v) = (x + dx, y + dy);
                let connected = value || dx == 0 || dy == 0;
                let inside = u >= 0 && v >= 0 && u < width && v < height;
                if connected && inside && mask.get(u as u32, v as u32) == value && !seen.get(u as u32, v as u32) {
                    seen.set(u as u32, v as u32, true);
                    waiting.push((u as u32, v as u32));
                }
            }
        }
        (area, border)
    }

    proptest! {
        #[test]
        fn the_result_agrees_with_a_flood_fill_of_every_pixel(
            width in 1..90_u32, height in 1..14_u32, seed in any::<u64>(), share in 2..9_u64, least in 0..30_u64,
        ) {
            let mask = noise(width, height, seed, |number| number % 10 < share);
            let largest = mask.pixels().map(|(x, y)| flooded(&mask, x, y).0).max().unwrap_or(0);
            let expected = Mask::from_fn(width, height, |x, y| {
                let (area, border) = flooded(&mask, x, y);
                if mask.get(x, y) { area >= least.min(largest) } else { area < least && !border }
            });
            prop_assert_eq!(without_specks(&mask, least), expected);
        }
    }

    #[test]
    fn connected_regions_agree_with_a_flood_fill_and_have_all_pixels() {
        let is_set = |x: u32, y: u32| (x * 7 + y * 3) % 5 < 2 || y == 9;
        let (mask, unset) = (Mask::from_fn(70, 20, is_set), Mask::from_fn(70, 20, |x, y| !is_set(x, y)));
        let regions = connected_regions(&mask);
        let mut drawn = Mask::new(70, 20);
        for region in &regions {
            let ((x, y), part) = (region[0], Mask::from_fn(70, 20, |x, y| region.contains(&(x, y))));
            assert_eq!((flooded(&unset, x, y).0, part.count()), (region.len() as u64, region.len() as u64));
            drawn |= &part;
        }
        assert_eq!(drawn, mask);
        assert_eq!(regions.iter().map(Vec::len).sum::<usize>() as u64, mask.count());
        assert!(regions.len() > 3, "{}", regions.len());
    }

    #[test]
    fn holes_are_filled_and_specks_cleared_but_gaps_between_limbs_stay() {
        let mask = Mask::from_fn(100, 60, |x, y| {
            let body = (20..60).contains(&x) && (10..50).contains(&y);
            let (hole, gap) = (x == 30 && y == 20, (40..45).contains(&x) && (25..35).contains(&y));
            (body && !hole && !gap) || (x == 80 && y == 5)
        });
        let cleaned = without_specks(&mask, 9);
        assert!(cleaned.get(30, 20) && !cleaned.get(80, 5) && !cleaned.get(42, 30));
        assert_eq!(cleaned.count(), mask.count() + 1 - 1);
        let small = Mask::from_fn(30, 30, |x, y| x == 3 && y < 4);
        assert_eq!(without_specks(&small, 9), small, "the largest part is kept, however small");
        assert_eq!(without_specks(&Mask::new(0, 0), 9), Mask::new(0, 0));
    }
}
