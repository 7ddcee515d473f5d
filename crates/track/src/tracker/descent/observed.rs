//! The observed outline and residuals of a model's outline.

use super::{
    AGREEMENT_WIDTH, Density, LEAST_AGREEMENT_WIDTH_PX, MODEL_UNIT, NEAREST, OBSERVED_SPACING, OBSERVED_UNIT,
    OutlineSample, REACH, SAME_NORMAL, SAME_SIDE, SAMPLE_SPACING, SPECK, robust_weight,
};
use crate::raster::{Mask, SignedDistance, contour, without_specks};

/// One view's observed outline.
#[derive(Debug)]
pub(in crate::tracker) struct ObservedOutline {
    field: SignedDistance,
    /// Sparse and dense points, [`OBSERVED_SPACING`] apart.
    points: [Vec<OutlinePoint>; 2],
}

/// A point on an observed outline.
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
    /// Adds the samples of another view.
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
    /// samples, and of the observed points. Returns how far the samples agree.
    pub(in crate::tracker) fn each_residual(
        &self,
        samples: &[OutlineSample],
        density: Density,
        length: f64,
        mut add: impl FnMut(&OutlineSample, OutlineResidual),
    ) -> OutlineAgreement {
        let outline = SAMPLE_SPACING[density as usize] / MODEL_UNIT;
        let mut near = 0.0;
        let width = (AGREEMENT_WIDTH * length).max(LEAST_AGREEMENT_WIDTH_PX);
        for sample in samples {
            let Some(found) = self.field.sample(sample.pixel[0], sample.pixel[1]) else { continue };
            let agreement = dot(found.gradient, sample.normal);
            let steepness = dot(found.gradient, found.gradient).sqrt();
            // Inside, the nearest outline may be the other side of the limb.
            if found.distance < 0.0 && agreement < SAME_SIDE * steepness {
                continue;
            }
            let value = found.distance / length;
            near += robust_weight(found.distance, width);
            add(sample, OutlineResidual { value, gradient: found.gradient, outline });
        }
        let agreement = OutlineAgreement { samples: samples.len(), near };
        if samples.is_empty() {
            return agreement;
        }
        let grid = SampleGrid::new(samples, NEAREST * length);
        let outline = OBSERVED_SPACING[density as usize] / OBSERVED_UNIT;
        for point in &self.points[density as usize] {
            let Some(nearest) = grid.nearest(point) else { continue };
            let sample = &samples[nearest];
            let offset = [0, 1].map(|i| sample.pixel[i] - point.pixel[i]);
            let value = dot(point.normal, offset) / length;
            add(sample, OutlineResidual { value, gradient: point.normal, outline });
        }
        agreement
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
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
    /// Index of the sample.
    sample: usize,
}

/// Cells per reach: smaller cells hold fewer samples, but more of them must be searched.
const CELLS_PER_REACH: f64 = 5.0;
/// Margin, square pixels, by which a cell must be farther away than the nearest sample to be skipped; far above
/// rounding errors.
const SLACK: f64 = 1e-6;

impl SampleGrid {
    fn new(samples: &[OutlineSample], reach: f64) -> Self {
        let cell = reach / CELLS_PER_REACH;
        let fold = |i: usize, from: f64, f: fn(f64, f64) -> f64| samples.iter().map(|s| s.pixel[i]).fold(from, f);
        let (left, top) = (fold(0, f64::INFINITY, f64::min), fold(1, f64::INFINITY, f64::min));
        let (right, bottom) = (fold(0, f64::NEG_INFINITY, f64::max), fold(1, f64::NEG_INFINITY, f64::max));
        // Samples lie at most one pixel outside the image, which bounds the number of cells.
        let count = |from: f64, to: f64| if to >= from { ((to - from) / cell) as usize + 1 } else { 0 };
        let (columns, rows) = (count(left, right), count(top, bottom));
        let mut grid =
            Self { reach, cell, columns, rows, left, top, starts: vec![0; columns * rows + 1], entries: Vec::new() };
        let cells: Vec<usize> = samples.iter().map(|sample| grid.cell_of(sample)).collect();
        cells.iter().for_each(|cell| grid.starts[cell + 1] += 1);
        (1..grid.starts.len()).for_each(|i| grid.starts[i] += grid.starts[i - 1]);
        let mut next = grid.starts.clone();
        grid.entries = vec![GridEntry::default(); samples.len()];
        for (number, (cell, sample)) in cells.into_iter().zip(samples).enumerate() {
            let OutlineSample { pixel, normal, .. } = *sample;
            grid.entries[next[cell] as usize] = GridEntry { pixel, normal, sample: number };
            next[cell] += 1;
        }
        grid
    }

    fn cell_of(&self, sample: &OutlineSample) -> usize {
        let column = ((sample.pixel[0] - self.left) / self.cell) as usize;
        let row = ((sample.pixel[1] - self.top) / self.cell) as usize;
        row * self.columns + column
    }

    /// Index of the sample nearest to `point` with a similar normal; the lower index if two are equally near.
    fn nearest(&self, point: &OutlinePoint) -> Option<usize> {
        let column = ((point.pixel[0] - self.left) / self.cell).floor() as i64;
        let row = ((point.pixel[1] - self.top) / self.cell).floor() as i64;
        let mut best: Option<(f64, usize)> = None;
        for ring in 0..=(CELLS_PER_REACH as i64 + 1) {
            // Lower bound of the distance to this ring.
            let least = (ring - 1).max(0) as f64 * self.cell;
            if best.is_some_and(|(square, _)| square < least * least) {
                break;
            }
            self.search_ring(point, [column, row], ring, &mut best);
        }
        best.map(|(_, sample)| sample)
    }

    /// Searches the cells at Chebyshev distance `ring` from the `middle` cell that are near enough.
    fn search_ring(&self, point: &OutlinePoint, middle: [i64; 2], ring: i64, best: &mut Option<(f64, usize)>) {
        let [column, row] = middle;
        for j in (row - ring).max(0)..=(row + ring).min(self.rows as i64 - 1) {
            // the first and last rows of a ring are complete, the others have only their two ends
            let step = if (j - row).abs() == ring { 1 } else { 2 * ring };
            let mut i = column - ring;
            while i <= column + ring {
                let inside = i >= 0 && i < self.columns as i64;
                if inside && best.is_none_or(|(square, _)| self.square_to_cell(point, i, j) <= square) {
                    self.search(point, j as usize * self.columns + i as usize, best);
                }
                i += step;
            }
        }
    }

    /// Squared distance from a point to a cell, minus the margin.
    fn square_to_cell(&self, point: &OutlinePoint, column: i64, row: i64) -> f64 {
        let apart = |x: f64, corner: f64, cell: i64| {
            let from = corner + cell as f64 * self.cell;
            (from - x).max(x - from - self.cell).max(0.0)
        };
        let (across, down) = (apart(point.pixel[0], self.left, column), apart(point.pixel[1], self.top, row));
        across * across + down * down - SLACK
    }

    fn search(&self, point: &OutlinePoint, cell: usize, best: &mut Option<(f64, usize)>) {
        let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
        for entry in &self.entries[range] {
            let offset = [0, 1].map(|i| entry.pixel[i] - point.pixel[i]);
            let square = dot(offset, offset);
            let candidate = (square, entry.sample);
            let nearer = square <= self.reach * self.reach && best.is_none_or(|best| candidate < best);
            if nearer && dot(entry.normal, point.normal) > SAME_NORMAL {
                *best = Some(candidate);
            }
        }
    }
}
