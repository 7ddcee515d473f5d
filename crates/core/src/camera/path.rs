//! The path of a moving camera.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::look_at::placement;
use super::{Camera, CameraError};

/// Position and view of a camera at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraKeyframe {
    /// Seconds from the first frame.
    pub time_s: f64,
    /// Camera centre in the world, metres.
    pub position: [f64; 3],
    /// Point on the optical axis, in the world, metres.
    pub look_at: [f64; 3],
    /// Rotation about the optical axis, clockwise as seen from behind the camera, radians; at 0 the world's Z is
    /// upwards in the image.
    pub roll: f64,
}

/// A smooth path through keyframes.
///
/// Each of the seven coordinates (position, target, roll) is a piecewise cubic Hermite interpolation with the slopes
/// of `[Fritsch 1984]`: with `h` the times between keyframes and `d` the slopes of the chords, an inner slope is `3
/// (h0 + h1) / ((2 h1 + h0) / d0 + (h1 + 2 h0) / d1)`, or 0 where the chords' signs differ; the slope at an end is
/// that of the parabola through the three nearest keyframes, limited to prevent overshoot. A coordinate therefore
/// never leaves the range of the two keyframes around it, and uniform keyframes give a uniform motion. The camera is
/// static before the first keyframe and after the last.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keyframes: Vec<CameraKeyframe>,
    /// Slopes of the coordinates per second, one entry per keyframe.
    slopes: Vec<Coordinates>,
}

type Coordinates = [f64; 7];

impl CameraKeyframe {
    fn coordinates(&self) -> Coordinates {
        let ([x, y, z], [u, v, w]) = (self.position, self.look_at);
        [x, y, z, u, v, w, self.roll]
    }
}

impl CameraPath {
    /// A path through keyframes in chronological order.
    ///
    /// # Errors
    /// [`CameraError`] naming `camera` if there are no keyframes, times are not increasing, numbers are not finite, or
    /// a keyframe has an impossible view.
    pub fn new(camera: &str, keyframes: Vec<CameraKeyframe>) -> Result<Self, CameraError> {
        if keyframes.is_empty() {
            return Err(CameraError::of(camera, "motion requires keyframes; give at least one"));
        }
        for keyframe in &keyframes {
            let numbers = [&keyframe.coordinates()[..], &[keyframe.time_s]].concat();
            super::error::all_within(f64::MAX, camera, "a keyframe", &numbers)?;
        }
        if let Some(pair) = keyframes.windows(2).find(|pair| pair[1].time_s <= pair[0].time_s) {
            let [before, after] = [pair[0].time_s, pair[1].time_s];
            let problem = format!("keyframes are not in chronological order: {after} s follows {before} s");
            return Err(CameraError::of(camera, problem));
        }
        let path = Self { slopes: slopes(&keyframes), keyframes };
        path.keyframes.iter().try_for_each(|keyframe| path.camera_from_world(camera, keyframe.time_s).map(drop))?;
        Ok(path)
    }

    /// The keyframes, in chronological order.
    pub fn keyframes(&self) -> &[CameraKeyframe] {
        &self.keyframes
    }

    /// World-to-camera transform at a time.
    ///
    /// # Errors
    /// [`CameraError::Refused`] naming `camera` if it is at its target then, or looks straight up or down.
    pub fn camera_from_world(&self, camera: &str, time_s: f64) -> Result<Isometry3<f64>, CameraError> {
        let [x, y, z, u, v, w, roll] = self.coordinates(time_s);
        let upright = placement(camera, Point3::new(x, y, z), Point3::new(u, v, w), Vector3::z())?;
        if roll == 0.0 {
            return Ok(upright);
        }
        let (sin, cos) = libm::sincos(-0.5 * roll);
        let turn = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(cos, 0.0, 0.0, sin));
        let rotation = turn * upright.rotation;
        Ok(Isometry3::from_parts(Translation3::from(-(rotation * Vector3::new(x, y, z))), rotation))
    }

    fn coordinates(&self, time_s: f64) -> Coordinates {
        let after = self.keyframes.partition_point(|keyframe| keyframe.time_s <= time_s);
        let (Some(before), Some(next)) = (after.checked_sub(1), self.keyframes.get(after)) else {
            return self.keyframes[after.min(self.keyframes.len() - 1)].coordinates();
        };
        let from = &self.keyframes[before];
        let width = next.time_s - from.time_s;
        let share = (time_s - from.time_s) / width;
        let (a, b) = (from.coordinates(), next.coordinates());
        let (slope_a, slope_b) = (&self.slopes[before], &self.slopes[after]);
        std::array::from_fn(|i| hermite(share, width, [a[i], b[i]], [slope_a[i], slope_b[i]]))
    }
}

/// Cubic Hermite interpolation from `a` to `b` with these slopes over an interval of `width`; exactly `a` at share 0.
fn hermite(share: f64, width: f64, [a, b]: [f64; 2], [slope_a, slope_b]: [f64; 2]) -> f64 {
    let (s, rest) = (share, 1.0 - share);
    let towards = s * s * (3.0 - 2.0 * s);
    a + towards * (b - a) + width * s * rest * (rest * slope_a - s * slope_b)
}

fn slopes(keyframes: &[CameraKeyframe]) -> Vec<Coordinates> {
    let widths: Vec<f64> = keyframes.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
    let places: Vec<Coordinates> = keyframes.iter().map(CameraKeyframe::coordinates).collect();
    let chord = |i: usize, c: usize| (places[i + 1][c] - places[i][c]) / widths[i];
    let slope = |i: usize, c: usize| match widths.len() {
        0 => 0.0,
        1 => chord(0, c),
        _ if i == 0 => end_slope([widths[0], widths[1]], [chord(0, c), chord(1, c)]),
        last if i == last => end_slope([widths[i - 1], widths[i - 2]], [chord(i - 1, c), chord(i - 2, c)]),
        _ => inner_slope([widths[i - 1], widths[i]], [chord(i - 1, c), chord(i, c)]),
    };
    (0..places.len()).map(|i| std::array::from_fn(|c| slope(i, c))).collect()
}

/// Weighted harmonic mean of the slopes of the adjacent chords; 0 at a turning point.
fn inner_slope([h0, h1]: [f64; 2], [d0, d1]: [f64; 2]) -> f64 {
    if d0 * d1 <= 0.0 {
        return 0.0;
    }
    3.0 * (h0 + h1) / ((2.0 * h1 + h0) / d0 + (h1 + 2.0 * h0) / d1)
}

/// The slope at an end; arguments start with the interval and chord nearest to it.
fn end_slope([h0, h1]: [f64; 2], [d0, d1]: [f64; 2]) -> f64 {
    let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    if slope * d0 <= 0.0 {
        0.0
    } else if d0 * d1 <= 0.0 && slope.abs() > 3.0 * d0.abs() {
        3.0 * d0
    } else {
        slope
    }
}

impl Camera {
    /// The same camera at another position.
    pub fn placed(&self, camera_from_world: Isometry3<f64>) -> Self {
        Self { camera_from_world, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::FieldOfView;

    fn keyframe(time_s: f64, position: [f64; 3], roll: f64) -> CameraKeyframe {
        CameraKeyframe { time_s, position, look_at: [0.0, 0.0, 1.0], roll }
    }

    fn centre(path: &CameraPath, time_s: f64) -> Point3<f64> {
        path.camera_from_world("c", time_s).unwrap().inverse_transform_point(&Point3::origin())
    }

    #[test]
    fn a_path_passes_through_its_keyframes_without_overshoot_and_ends_at_the_last() {
        let xs = [4.0, 5.0, 5.0, 3.0, 3.5];
        let times = [0.0, 0.5, 1.5, 2.0, 4.0];
        let keyframes = times.iter().zip(xs).map(|(t, x)| keyframe(*t, [x, 1.0, 1.5], 0.0)).collect();
        let path = CameraPath::new("c", keyframes).unwrap();
        for (time, x) in times.iter().zip(xs) {
            assert!((centre(&path, *time).x - x).abs() < 1e-12);
        }
        for pair in [0, 1, 2, 3].map(|i| (i, i + 1)) {
            let (low, high) = (xs[pair.0].min(xs[pair.1]), xs[pair.0].max(xs[pair.1]));
            for step in 0..=50 {
                let time = times[pair.0] + (times[pair.1] - times[pair.0]) * f64::from(step) / 50.0;
                let x = centre(&path, time).x;
                assert!(x >= low - 1e-12 && x <= high + 1e-12, "{x} at {time}");
            }
        }
        assert!((centre(&path, -7.0).x - 4.0).abs() < 1e-12 && (centre(&path, 99.0).x - 3.5).abs() < 1e-12);
    }

    #[test]
    fn speed_is_continuous_at_keyframes_and_uniform_for_uniform_keyframes() {
        let bent = [0.0, 0.3, 0.5, 1.2].map(|t| keyframe(t, [3.0 + t * t, 2.0 - t, 1.5], t));
        let path = CameraPath::new("c", bent.to_vec()).unwrap();
        let speed = |from: f64, to: f64| (centre(&path, to) - centre(&path, from)) / (to - from);
        for knot in [0.3, 0.5] {
            assert!((speed(knot - 1e-5, knot) - speed(knot, knot + 1e-5)).norm() < 1e-3);
        }
        let steady = [0.0, 0.3, 0.5, 1.2].map(|t| keyframe(t, [3.0 + 2.0 * t, 2.0 - t, 1.5], 0.0));
        let path = CameraPath::new("c", steady.to_vec()).unwrap();
        for step in 0..=60 {
            let time = f64::from(step) / 50.0;
            assert!((centre(&path, time) - Point3::new(3.0 + 2.0 * time, 2.0 - time, 1.5)).norm() < 1e-12);
        }
    }

    #[test]
    fn slopes_match_scipys_documentation() {
        // by hand, from the formulas of scipy.interpolate.PchipInterpolator: h = 1, 2; d = 2, 0.5
        assert!((inner_slope([1.0, 2.0], [2.0, 0.5]) - 9.0 / (5.0 / 2.0 + 4.0 / 0.5)).abs() < 1e-15);
        assert!((end_slope([1.0, 2.0], [2.0, 0.5]) - (4.0 * 2.0 - 0.5) / 3.0).abs() < 1e-15);
        assert_eq!(end_slope([1.0, 1.0], [1.0, 9.0]), 0.0);
        assert_eq!(end_slope([1.0, 0.1], [1.0, -30.0]), 3.0);
    }

    #[test]
    fn a_camera_on_a_path_looks_at_its_target_and_roll_turns_it_clockwise() {
        let path = CameraPath::new("c", vec![keyframe(0.0, [3.0, 1.0, 2.0], 0.0)]).unwrap();
        let (eye, target) = (Point3::new(3.0, 1.0, 2.0), Point3::new(0.0, 0.0, 1.0));
        let camera = Camera::look_at("c", eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 320, 240).unwrap();
        assert_eq!(path.camera_from_world("c", 5.0).unwrap(), camera.camera_from_world);
        let rolled = CameraPath::new("c", vec![keyframe(0.0, [3.0, 1.0, 2.0], 0.2)]).unwrap();
        let rolled = camera.placed(rolled.camera_from_world("c", 0.0).unwrap());
        assert!((rolled.project(&target).unwrap() - camera.project(&target).unwrap()).norm() < 1e-9);
        // the camera turns clockwise, so the world's up direction tilts left in its image
        let top = rolled.project(&Point3::new(0.0, 0.0, 1.5)).unwrap();
        assert!(top.x < 159.0 && top.y < 120.0, "{top}");
        assert!((rolled.centre() - eye).norm() < 1e-12);
    }

    #[test]
    fn impossible_paths_are_refused_with_the_cameras_name() {
        let why = |keyframes: Vec<CameraKeyframe>| CameraPath::new("cam07", keyframes).unwrap_err().to_string();
        assert!(why(Vec::new()).contains("cam07") && why(Vec::new()).contains("keyframe"));
        let at = |time_s| keyframe(time_s, [3.0, 1.0, 2.0], 0.0);
        assert!(why(vec![at(1.0), at(1.0)]).contains("1 s follows 1 s"), "{}", why(vec![at(1.0), at(1.0)]));
        assert!(why(vec![at(f64::NAN)]).contains("finite"));
        assert!(why(vec![keyframe(0.0, [0.0, 0.0, 1.0], 0.0)]).contains("the target is at the eye"));
        assert!(why(vec![keyframe(0.0, [0.0, 0.0, 3.0], 0.0)]).contains("along the view"));
    }
}
