//! Worked examples: errors of known size and the value of every convention, computed by hand. `docs/metrics.md` has the
//! same table.

use std::collections::BTreeMap;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::evaluate::MetricValue;
use super::limb_swaps::LEGS;
use super::limb_swaps::tests::exchanged;
use super::{PARTS, PartRotations, Sequence, SilhouetteOutline, Views, evaluate};
use crate::test_figure::evaluate_markers;
use skiagraph_core::body::{Landmark, Markers};
use skiagraph_core::camera::{Camera, FieldOfView};
use skiagraph_core::raster::Mask;

/// Pelvis at the origin, all others half a metre away: along x, -x, y, -y, z in turn.
fn star() -> Markers {
    let directions = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z()];
    let mut markers: Markers = std::array::from_fn(|index| Some(Point3::from(0.5 * directions[index % 5])));
    markers[Landmark::Pelvis as usize] = Some(Point3::origin());
    // hips on both sides, so that their midpoint is the pelvis
    markers[Landmark::LeftHip as usize] = Some(Point3::new(0.0, 0.5, 0.0));
    markers[Landmark::RightHip as usize] = Some(Point3::new(0.0, -0.5, 0.0));
    markers
}

fn every_marker(change: impl Fn(usize, usize, Point3<f64>) -> Point3<f64>) -> Vec<Markers> {
    let of = |frame: usize| {
        let mut markers = star();
        markers.iter_mut().enumerate().for_each(|(index, m)| *m = m.map(|place| change(frame, index, place)));
        markers
    };
    (0..5).map(of).collect()
}

/// Description of the error, the estimate, and the value of every convention.
type ConventionCase = (&'static str, Vec<Markers>, Vec<(&'static str, f64)>);

fn cases() -> Vec<ConventionCase> {
    let wrist = Landmark::LeftWrist as usize;
    vec![
        (
            "every marker 51 mm away, in one direction",
            every_marker(|_, _, place| place + Vector3::new(0.024, 0.0, 0.045)),
            vec![
                ("humaneva_mm", 51.0),
                ("humaneva_official_mm", 51.0),
                ("humaneva_relative_official_mm", 0.0),
                ("mpjpe_mm", 51.0),
                ("humaneva_relative_mm", 0.0),
                ("mpjpe_root_mm", 0.0),
                ("n_mpjpe_mm", 0.0),
                ("pa_mpjpe_mm", 0.0),
                ("w_mpjpe100_mm", 0.0),
                ("wa_mpjpe100_mm", 0.0),
                ("pck150", 1.0),
                // thresholds 55, 60, ... 150 of 0, 5, ... 150
                ("auc150", 20.0 / 31.0),
                ("pck50_3dpw", 1.0),
                ("auc200_3dpw", 1.0),
                ("coverage", 1.0),
                ("lost_limb", 0.0),
            ],
        ),
        (
            "5 % too large about the pelvis: 14 markers 25 mm away, the pelvis right",
            every_marker(|_, _, place| Point3::from(1.05 * place.coords)),
            vec![
                ("humaneva_mm", 25.0 * 14.0 / 15.0),
                ("mpjpe_mm", 25.0 * 14.0 / 15.0),
                ("humaneva_relative_mm", 25.0),
                ("mpjpe_root_mm", 25.0 * 14.0 / 15.0),
                ("n_mpjpe_mm", 0.0),
                ("pa_mpjpe_mm", 0.0),
                ("pck50_3dpw", 1.0),
                // a step at 25 mm: 199 - 25 + 1/2 of 199
                ("auc200_3dpw", 174.5 / 199.0),
            ],
        ),
        (
            "the left wrist 160 mm away, all others right",
            every_marker(|_, index, place| if index == wrist { place + Vector3::new(0.0, 0.0, 0.16) } else { place }),
            vec![
                ("humaneva_mm", 160.0 / 15.0),
                ("mpjpe_root_mm", 160.0 / 15.0),
                ("humaneva_relative_mm", 160.0 / 14.0),
                // thorax, elbows and knees have no error and are left out: 15 - 5 and 14 - 5 terms
                ("humaneva_official_mm", 160.0 / 10.0),
                ("humaneva_relative_official_mm", 160.0 / 9.0),
                ("pck150", 14.0 / 15.0),
                // true of every frame
                ("lost_limb", 1.0),
                ("auc150", 14.0 / 15.0),
                ("pck50_3dpw", 11.0 / 12.0),
                // eleven joints of 1, one with a step at 160 mm
                ("auc200_3dpw", (11.0 + 39.5 / 199.0) / 12.0),
            ],
        ),
        (
            "drift: frame f is f mm away",
            every_marker(|frame, _, place| place + Vector3::new(0.001 * frame as f64, 0.0, 0.0)),
            vec![
                // frames 1 to 4
                ("humaneva_mm", 2.5),
                ("pa_mpjpe_mm", 0.0),
                // aligned with frames 1 and 2, by 1.5 mm: 0.5, 0.5, 1.5, 2.5
                ("w_mpjpe100_mm", 1.25),
                // aligned with all, by 2.5 mm: 1.5, 0.5, 0.5, 1.5
                ("wa_mpjpe100_mm", 1.0),
            ],
        ),
        (
            "left and right knees and ankles exchanged, all others right",
            vec![exchanged(&star(), &LEGS); 5],
            vec![
                // knees are 1/sqrt(2) m apart, ankles too: (2 x 707.11 + 2 x 707.11) / 15
                ("humaneva_mm", 4.0 * 500.0 * std::f64::consts::SQRT_2 / 15.0),
                ("limb_swaps", 1.0),
                ("limbs_exchanged", 1.0),
                ("lost_limb", 1.0),
            ],
        ),
    ]
}

#[test]
fn every_convention_gives_the_value_worked_by_hand_which_the_docs_have_too() {
    let page = include_str!("../../../docs/metrics.md");
    let truth = vec![star(); 5];
    for (case, estimate, expected) in cases() {
        let metrics = evaluate_markers(&truth, &estimate).metrics;
        let section = page.split("### ").find(|section| section.starts_with(case)).expect(case);
        for (name, value) in expected {
            let found = metrics[name].mean;
            // alignment takes a small part of the drift for a scale: (0.5 mm / 0.5 m)^2
            assert!((found - value).abs() < 1e-3, "{case}: {name} is {found}, by hand {value}");
            let row = format!("| `{name}` | {value:.4} |");
            assert!(section.contains(&row), "{case}: {row}");
        }
    }
}

/// A metric, its value, and its derivation as given in the docs.
type Derived = (&'static str, f64, &'static str);

/// Metrics that need more than markers: 20 mm beside the truth along y, seen from 4 and 8 m along x.
fn with_more_than_markers() -> (BTreeMap<String, MetricValue>, Vec<Derived>) {
    let truth = vec![star(); 3];
    let estimate: Vec<Markers> =
        truth.iter().map(|markers| markers.map(|m| m.map(|p| p + Vector3::new(0.0, 0.02, 0.0)))).collect();
    let camera = |x: f64| {
        let (eye, view) = (Point3::new(x, 0.0, 0.0), FieldOfView::Vertical(2.0 * libm::atan(0.5)));
        Camera::look_at("c", eye, Point3::origin(), Vector3::z(), view, 640, 480).unwrap()
    };
    let cameras = [4.0, 8.0].map(camera);
    // only the pelvis, whose depth is the camera's distance
    let mut seen = [[false; 15]; 2];
    seen.iter_mut().for_each(|camera| camera[Landmark::Pelvis as usize] = true);
    let views = vec![seen.as_slice(); 3];
    let turned = Some(UnitQuaternion::new(Vector3::x() * std::f64::consts::FRAC_PI_2));
    let mut parts = [[[Some(UnitQuaternion::identity()); PARTS]; 3]; 2];
    parts[1].iter_mut().for_each(|frame| frame[4] = turned);
    let block = |left: u32| Mask::from_fn(64, 64, |x, y| (left..left + 20).contains(&x) && (20..40).contains(&y));
    let agreement = SilhouetteOutline::new(&block(23)).agreement(&SilhouetteOutline::new(&block(20)));
    let boundaries = vec![vec![agreement]; 3];
    let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
    sequence.views = Some(Views { cameras: &cameras, moved: &[], in_view: &views, visible: &views });
    sequence.parts = Some(PartRotations { truth: &parts[0], estimate: &parts[1] });
    sequence.view_boundaries = Some(&boundaries);
    let expected = vec![
        ("error_2d_px", 1.8, "focal length 480 px: (480 x 0.02/4 + 480 x 0.02/8) / 2"),
        ("mpjae_deg", 10.0, "one of nine parts turned by 90 degrees"),
        ("pa_mpjae_deg", 10.0, "the markers need no turn"),
        (
            "boundary_f",
            0.5526,
            "squares of 20 px, 3 px apart: 42 of the 76 px of either outline are within 2 px of the other",
        ),
    ];
    (evaluate(&sequence).unwrap().metrics, expected)
}

#[test]
fn metrics_of_images_and_angles_give_the_values_worked_by_hand() {
    let page = include_str!("../../../docs/metrics.md");
    let (metrics, expected) = with_more_than_markers();
    for (name, value, why) in expected {
        let found = metrics[name].mean;
        assert!((found - value).abs() < 1e-3, "{name} is {found}, by hand {value}");
        let row = format!("| `{name}` | {value:.4} | {why} |");
        assert!(page.contains(&row), "docs/metrics.md: {row}");
    }
}

#[test]
fn a_mirrored_pose_is_not_aligned_away() {
    let truth = vec![star(); 5];
    let mut mirrored = star();
    mirrored.iter_mut().enumerate().for_each(|(index, marker)| {
        *marker = marker.map(|p| Point3::new(-p.x, p.y + 0.01 * index as f64, p.z));
    });
    assert!(evaluate_markers(&truth, &vec![mirrored; 5]).metrics["pa_mpjpe_mm"].mean > 10.0);
}
