//! Tables of a report: errors by camera and by groups of markers.

use serde::Serialize;

use super::displayed::{between, number};
use crate::evaluation::{BreakdownSummary, PerCameraSummary, Summary, Unit};

/// A camera and its errors, as text.
#[derive(Serialize)]
pub(super) struct CameraRow<'a> {
    camera: &'a str,
    error_px: String,
    overlap: String,
    boundary_f: String,
    visible: String,
}

/// Groups of markers of one kind.
#[derive(Serialize)]
pub(super) struct BreakdownTable<'a> {
    by: &'a str,
    rows: Vec<BreakdownRow<'a>>,
}

#[derive(Serialize)]
struct BreakdownRow<'a> {
    group: &'a str,
    mean: String,
    interval: Option<String>,
    share: String,
    /// Length of a bar, per cent of the longest.
    bar: f64,
}

/// One row a camera.
pub(super) fn camera_rows(summary: &Summary) -> Vec<CameraRow<'_>> {
    let share = |value: Option<f64>| value.map_or("–".to_owned(), |value| number(value, Unit::Fraction));
    let row = |camera: &'_ PerCameraSummary| -> [String; 4] {
        let error_px = camera.error_px.map_or("–".to_owned(), |error| number(error, Unit::Pixel));
        [error_px, share(camera.overlap), share(camera.boundary_f), share(camera.visible)]
    };
    let rows = summary.per_camera.iter().map(|camera| (camera.camera.as_str(), row(camera)));
    rows.map(|(camera, [error_px, overlap, boundary_f, visible])| CameraRow {
        camera,
        error_px,
        overlap,
        boundary_f,
        visible,
    })
    .collect()
}

/// One table for each way of grouping.
pub(super) fn breakdown_tables(groups: &[BreakdownSummary]) -> Vec<BreakdownTable<'_>> {
    let longest = groups.iter().map(|group| group.mean_mm).fold(1e-9, f64::max);
    let mut tables: Vec<BreakdownTable<'_>> = Vec::new();
    for group in groups {
        let row = BreakdownRow {
            group: &group.group,
            mean: number(group.mean_mm, Unit::Millimetre),
            interval: group.ci95.map(|ends| between(ends.low, ends.high, Unit::Millimetre)),
            share: number(group.share, Unit::Fraction),
            bar: (1000.0 * group.mean_mm / longest).round() / 10.0,
        };
        match tables.iter_mut().find(|table| table.by == group.by) {
            Some(table) => table.rows.push(row),
            None => tables.push(BreakdownTable { by: &group.by, rows: vec![row] }),
        }
    }
    tables
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_of_one_kind_share_a_table_and_the_longest_bar_is_whole() {
        let group = |by: &str, group: &str, mean_mm: f64| BreakdownSummary {
            by: by.into(),
            group: group.into(),
            mean_mm,
            ci95: None,
            share: 0.25,
        };
        let groups = [group("speed", "slow", 10.0), group("speed", "fast", 40.0), group("cameras", "none", 20.0)];
        let tables = breakdown_tables(&groups);
        assert_eq!(
            tables.iter().map(|table| (table.by, table.rows.len())).collect::<Vec<_>>(),
            [("speed", 2), ("cameras", 1)]
        );
        let bars: Vec<f64> = tables.iter().flat_map(|table| table.rows.iter().map(|row| row.bar)).collect();
        assert_eq!(bars, [25.0, 100.0, 50.0]);
        assert_eq!((tables[0].rows[0].mean.as_str(), tables[0].rows[0].share.as_str()), ("10.0", "25.0"));
    }
}
