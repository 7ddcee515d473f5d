//! The observed outline and residuals of a model's outline.

use std::ops::RangeInclusive;

use super::{
    AGREEMENT_WIDTH, Density, LEAST_AGREEMENT_WIDTH_PX, MODEL_UNIT, NEAREST, OBSERVED_SPACING, OBSERVED_UNIT,
    OutlineSample, REACH, SAME_NORMAL, SAME_SIDE, SAMPLE_SPACING, SPECK, robust_weight,
};
use crate::tracker::mask_trust::MaskTrust;
use skiagraph_core::raster::{DistanceSample, Mask, SignedDistance, contour, without_specks};

#[derive(Debug)]
pub(in crate::tracker) struct ObservedOutline {
    field: SignedDistance,
    /// Sparse and dense points, [`OBSERVED_SPACING`] apart.
    points: [Vec<OutlinePoint>; 2],
}

#[derive(Clone, Copy, Debug)]
struct OutlinePoint {
    pixel: [f64; 2],
    /// Unit vector pointing out of the silhouette.
    normal: [f64; 2],
}

/// Distance of a sample from the observed outline.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracker) struct OutlineResidual {
    /// Lengths.
    pub(in crate::tracker) value: f64,
    /// Derivative of the distance in pixels with respect to the sample's pixel.
    pub(in crate::tracker) gradient: [f64; 2],
    /// How much outline it stands for.
    pub(in crate::tracker) outline: f64,
}

/// How far a body's outline agrees with the observed one.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::tracker) struct OutlineAgreement {
    samples: usize,
    near: f64,
}

impl OutlineAgreement {
    pub(in crate::tracker) fn add(&mut self, other: Self) {
        self.samples += other.samples;
        self.near += other.near;
    }

    /// Mean of a weight over the samples: 1 on the observed outline, decreasing with distance, 0 far from it; `None`
    /// without samples.
    pub(in crate::tracker) fn share(self) -> Option<f64> {
        (self.samples > 0).then(|| self.near / self.samples as f64)
    }
}

impl ObservedOutline {
    /// The outline of an observed mask without specks and pinholes; `length` is in pixels. `shown` marks the pixels
    /// that the camera shows, if not all. `None` for a mask without an outline.
    pub(in crate::tracker) fn new(mask: &Mask, shown: Option<&Mask>, length: f64) -> Option<Self> {
        let mask = without_specks(mask, (SPECK * length * length) as u64);
        let field = SignedDistance::new(&mask, shown, (REACH * length).ceil() as u32)?;
        let contour = contour(&mask);
        let points = OBSERVED_SPACING.map(|spacing| {
            let points = thinned(&contour, spacing * length).into_iter();
            points.filter_map(|(x, y)| on_the_outline(&field, x, y)).collect()
        });
        Some(Self { field, points })
    }

    /// Calls `add` with every residual of both directions: each sample against the distance field, and each observed
    /// point against the nearest sample with a similar normal. `length` is in pixels; `density` is that of the
    /// samples, and of the observed points.
    pub(in crate::tracker) fn each_residual(
        &self,
        samples: &[OutlineSample],
        density: Density,
        length: f64,
        trust: MaskTrust,
        mut add: impl FnMut(&OutlineSample, OutlineResidual),
    ) {
        let outline = SAMPLE_SPACING[density as usize] / MODEL_UNIT;
        for sample in samples {
            let Some(DistanceSample { distance, gradient }) = self.distance_of(sample) else { continue };
            let outline = outline * trust.in_residual(distance);
            add(sample, OutlineResidual { value: distance / length, gradient, outline });
        }
        if samples.is_empty() {
            return;
        }
        let grid = SampleGrid::new(samples, NEAREST * length);
        let outline = OBSERVED_SPACING[density as usize] / OBSERVED_UNIT;
        for point in &self.points[density as usize] {
            let Some(nearest) = grid.nearest(point) else { continue };
            let sample = &samples[nearest];
            let offset = [0, 1].map(|i| sample.pixel[i] - point.pixel[i]);
            let value = dot(point.normal, offset) / length;
            let outline = outline * trust.in_residual(value);
            add(sample, OutlineResidual { value, gradient: point.normal, outline });
        }
    }

    /// How far samples agree with the observed outline; `length` is in pixels.
    pub(in crate::tracker) fn agreement(&self, samples: &[OutlineSample], length: f64) -> OutlineAgreement {
        let width = (AGREEMENT_WIDTH * length).max(LEAST_AGREEMENT_WIDTH_PX);
        let weight = |sample| Some(robust_weight(self.distance_of(sample)?.distance, width));
        OutlineAgreement { samples: samples.len(), near: samples.iter().filter_map(weight).sum() }
    }

    /// Distance of a sample from the outline that it may belong to.
    fn distance_of(&self, sample: &OutlineSample) -> Option<DistanceSample> {
        let found = self.field.sample(sample.pixel[0], sample.pixel[1])?;
        // Inside, the nearest outline may be the other side of the limb.
        let is_same_side =
            || dot(found.gradient, sample.normal) >= SAME_SIDE * dot(found.gradient, found.gradient).sqrt();
        (found.distance >= 0.0 || is_same_side()).then_some(found)
    }
}

pub(in crate::tracker) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Pixels of a contour in row-major order, thinned so that none lies within `spacing` pixels of an earlier one.
fn thinned(contour: &Mask, spacing: f64) -> Vec<(u32, u32)> {
    // At most one pixel per cell: the diagonal of a cell is the spacing.
    let cell = (spacing / std::f64::consts::SQRT_2).max(1.0);
    let columns = (f64::from(contour.width()) / cell) as usize + 1;
    let rows = (f64::from(contour.height()) / cell) as usize + 1;
    let mut cells: Vec<Option<(u32, u32)>> = vec![None; columns * rows];
    let mut kept = Vec::new();
    for (x, y) in contour.pixels() {
        let (i, j) = ((f64::from(x) / cell) as usize, (f64::from(y) / cell) as usize);
        let near = |(a, b): (u32, u32)| {
            let (across, down) = (f64::from(a) - f64::from(x), f64::from(b) - f64::from(y));
            across * across + down * down < spacing * spacing
        };
        let around = (j.saturating_sub(2)..=(j + 2).min(rows - 1))
            .flat_map(|j| (i.saturating_sub(2)..=(i + 2).min(columns - 1)).map(move |i| j * columns + i));
        if !around.into_iter().any(|index| cells[index].is_some_and(near)) {
            cells[j * columns + i] = Some((x, y));
            kept.push((x, y));
        }
    }
    kept
}

/// The point of the outline next to the centre of contour pixel `(x, y)`.
fn on_the_outline(field: &SignedDistance, x: u32, y: u32) -> Option<OutlinePoint> {
    let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
    // The field has kinks: average the one-sided differences over the four cells that meet at the centre.
    let shifts = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
    let mut sum = [0.0; 2];
    for (du, dv) in shifts {
        let gradient = field.sample(centre[0] + du, centre[1] + dv)?.gradient;
        (0..2).for_each(|i| sum[i] += gradient[i]);
    }
    let norm = dot(sum, sum).sqrt();
    if norm < 1e-6 {
        return None;
    }
    let normal = sum.map(|s| s / norm);
    let distance = field.sample(centre[0], centre[1])?.distance;
    Some(OutlinePoint { pixel: [0, 1].map(|i| centre[i] - distance * normal[i]), normal })
}

/// Grid of samples for nearest-neighbour search.
struct SampleGrid {
    reach: f64,
    cell: f64,
    cells_per_pixel: f64,
    columns: usize,
    rows: usize,
    left: f64,
    top: f64,
    /// First entry of each cell in `entries`, plus the end of the last cell.
    starts: Vec<u32>,
    entries: Vec<GridEntry>,
}

/// The data of a sample that the search needs, stored next to those of the same cell.
#[derive(Clone, Copy, Default)]
struct GridEntry {
    pixel: [f64; 2],
    normal: [f64; 2],
    sample: usize,
}

/// Cells per reach: smaller cells hold fewer samples, but more rows of them must be searched.
const CELLS_PER_REACH: f64 = 8.0;
/// Margin, square pixels, by which a row must be farther away than the nearest sample to be skipped; far above
/// rounding errors.
const SLACK: f64 = 1e-6;
/// Index of no sample, greater than all.
const NO_SAMPLE: usize = usize::MAX;

impl SampleGrid {
    fn new(samples: &[OutlineSample], reach: f64) -> Self {
        let cell = reach / CELLS_PER_REACH;
        let ([mut left, mut top], [mut right, mut bottom]) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for OutlineSample { pixel: [x, y], .. } in samples {
            (left, top) = (if *x < left { *x } else { left }, if *y < top { *y } else { top });
            (right, bottom) = (if *x > right { *x } else { right }, if *y > bottom { *y } else { bottom });
        }
        // Samples lie at most one pixel outside the image, which bounds the number of cells.
        let count = |from: f64, to: f64| if to >= from { ((to - from) / cell) as usize + 1 } else { 0 };
        let (columns, rows) = (count(left, right), count(top, bottom));
        let starts = vec![0; columns * rows + 1];
        let (cells_per_pixel, entries) = (1.0 / cell, Vec::new());
        let mut grid = Self { reach, cell, cells_per_pixel, columns, rows, left, top, starts, entries };
        let cell_of = |sample: &OutlineSample| grid.row_at(sample.pixel[1]) * columns + grid.column_at(sample.pixel[0]);
        let cells: Vec<usize> = samples.iter().map(cell_of).collect();
        // the end of each cell first, then backwards to its start
        cells.iter().for_each(|cell| grid.starts[*cell] += 1);
        (1..grid.starts.len()).for_each(|i| grid.starts[i] += grid.starts[i - 1]);
        grid.entries = vec![GridEntry::default(); samples.len()];
        for (number, (cell, sample)) in cells.into_iter().zip(samples).enumerate().rev() {
            let OutlineSample { pixel, normal, .. } = *sample;
            grid.starts[cell] -= 1;
            grid.entries[grid.starts[cell] as usize] = GridEntry { pixel, normal, sample: number };
        }
        grid
    }

    /// Column of the cells at a coordinate, or the nearest column.
    fn column_at(&self, x: f64) -> usize {
        // conversion to an integer saturates at zero
        (((x - self.left) * self.cells_per_pixel) as u32 as usize).min(self.columns - 1)
    }

    /// Row of the cells at a coordinate, or the nearest row.
    fn row_at(&self, y: f64) -> usize {
        (((y - self.top) * self.cells_per_pixel) as u32 as usize).min(self.rows - 1)
    }

    /// Index of the sample nearest to `point` with a similar normal; the lower index if two are equally near.
    fn nearest(&self, point: &OutlinePoint) -> Option<usize> {
        let [x, y] = point.pixel;
        let (column, row) = (self.column_at(x), self.row_at(y));
        let mut best = (self.reach * self.reach, NO_SAMPLE);
        // a sample in the same cell leaves little to search
        self.search(point, row, column..=column, &mut best);
        let mut search_row = |row: usize| {
            let from = self.top + row as f64 * self.cell;
            let down = (from - y).max(y - from - self.cell).max(0.0);
            let rest = best.0 - down * down + SLACK;
            if rest >= 0.0 {
                let across = rest.sqrt();
                self.search(point, row, self.column_at(x - across)..=self.column_at(x + across), &mut best);
            }
            rest >= 0.0
        };
        (0..=row).rev().all(&mut search_row);
        (row + 1..self.rows).all(&mut search_row);
        (best.1 != NO_SAMPLE).then_some(best.1)
    }

    /// Searches cells of a row for a sample with a lower squared distance than the best, or the same and a lower index.
    fn search(&self, point: &OutlinePoint, row: usize, columns: RangeInclusive<usize>, best: &mut (f64, usize)) {
        let first = row * self.columns;
        let range = self.starts[first + columns.start()] as usize..self.starts[first + columns.end() + 1] as usize;
        for entry in &self.entries[range] {
            let offset = [0, 1].map(|i| entry.pixel[i] - point.pixel[i]);
            let candidate = (dot(offset, offset), entry.sample);
            if candidate < *best && dot(entry.normal, point.normal) > SAME_NORMAL {
                *best = candidate;
            }
        }
    }
}
