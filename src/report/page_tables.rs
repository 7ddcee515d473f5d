//! Tables of a report: errors by camera and by groups of markers.

use serde::Serialize;

use super::displayed::{between, number, signed_to};
use crate::evaluation::{BreakdownSummary, PerCameraError, Summary, Unit};

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
    has_interval: bool,
    rows: Vec<BreakdownRow<'a>>,
}

#[derive(Serialize)]
struct BreakdownRow<'a> {
    group: &'a str,
    /// How much larger the errors of its markers are than those of the same markers in other groups.
    difference: Option<String>,
    /// Interval of the difference.
    interval: Option<String>,
    mean: String,
    share: String,
}

/// One row per camera.
pub(super) fn camera_rows(summary: &Summary) -> Vec<CameraRow<'_>> {
    let share = |value: Option<f64>| value.map_or("–".to_owned(), |value| number(value, Unit::Fraction));
    let row = |camera: &'_ PerCameraError| -> [String; 4] {
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
    let mut tables: Vec<BreakdownTable<'_>> = Vec::new();
    for group in groups {
        let row = BreakdownRow {
            group: &group.group,
            difference: group.same_marker_mm.map(|difference| signed_to(difference, Unit::Millimetre, difference)),
            interval: group.same_marker_ci95.map(|ends| between(ends.low, ends.high, Unit::Millimetre)),
            mean: number(group.mean_mm, Unit::Millimetre),
            share: number(group.share, Unit::Fraction),
        };
        match tables.iter_mut().find(|table| table.by == group.by) {
            Some(table) => table.rows.push(row),
            None => tables.push(BreakdownTable { by: &group.by, has_interval: false, rows: vec![row] }),
        }
    }
    for table in &mut tables {
        table.has_interval = table.rows.iter().any(|row| row.interval.is_some());
    }
    tables
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Interval;

    #[test]
    fn groups_of_one_kind_share_a_table_with_differences_between_equal_markers() {
        let group = |by: &str, group: &str, mean_mm: f64| BreakdownSummary {
            by: by.into(),
            group: group.into(),
            mean_mm,
            ci95: None,
            same_marker_mm: (mean_mm < 15.0).then_some(-2.5),
            same_marker_ci95: (mean_mm > 30.0).then_some(Interval { low: 1.0, high: 2.0 }),
            share: 0.25,
        };
        let groups = [group("speed", "slow", 10.0), group("speed", "fast", 40.0), group("cameras", "none", 20.0)];
        let tables = breakdown_tables(&groups);
        assert_eq!(
            tables.iter().map(|table| (table.by, table.rows.len())).collect::<Vec<_>>(),
            [("speed", 2), ("cameras", 1)]
        );
        assert_eq!(tables.iter().map(|table| table.has_interval).collect::<Vec<_>>(), [true, false]);
        let differences = tables.iter().flat_map(|table| &table.rows).map(|row| row.difference.as_deref());
        assert_eq!(differences.collect::<Vec<_>>(), [Some("-2.5"), None, None]);
        assert_eq!((tables[0].rows[0].mean.as_str(), tables[0].rows[0].share.as_str()), ("10.0", "25.0"));
    }
}
