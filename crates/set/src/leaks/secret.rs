//! Data that no file for trackers may contain, and how it is recognised.

use super::NumberSequence;
use super::likeness::{Feature, NoisySecret};
use crate::body::{Humanoid, Landmark, Pose};
use crate::npz::Npz;
use crate::{TruthSet, rigid};

/// Tolerance of an angle (rad), a coordinate (m) or a quaternion's component.
const TOLERANCE: f64 = 1e-3;

/// The same for data of few numbers.
const TOLERANCE_OF_FEW: f64 = 1e-4;

/// The same for a root's position, which has only three numbers.
const TOLERANCE_OF_POSITION: f64 = 1e-6;

/// Tolerance of numbers in any order: the rounding of single precision.
const EXACT: f64 = 2e-7;

/// How many angles must differ from frame 0 for a frame to be recognised by its angles in any order.
const LEAST_DISTINCT: usize = 6;

/// Share of these angles that must be found.
const FOUND_SHARE: f64 = 0.9;

/// Tolerance of the root mean square of all angles of a frame (rad), of points (m), and of points in images (px).
const NOISE: f64 = 2.5e-3;
const NOISE_PX: f64 = 0.5;

/// Factors from radians and degrees, and from metres, centimetres and millimetres.
const ANGLES: [f64; 2] = [1.0, std::f64::consts::PI / 180.0];
const LENGTHS: [f64; 3] = [1.0, 0.01, 0.001];

/// Factors of the units that a file may use: metres and radians, degrees, centimetres, millimetres.
const UNITS: [f64; 4] = [1.0, std::f64::consts::PI / 180.0, 0.01, 0.001];

/// A vector of numbers per frame that must not appear outside the truth.
pub(super) struct Secret {
    /// Description of the data.
    pub(super) what: String,
    /// Magnitudes per frame: a mirrored pose differs in its signs.
    rows: Vec<Vec<f64>>,
    tolerance: f64,
    /// Whether the numbers may be in any order.
    unordered: bool,
    /// Frames that differ from frame 0, sorted by the magnitude of the anchor.
    by_anchor: Vec<(f64, usize)>,
    /// Index of the number that varies most.
    anchor: usize,
}

/// All identifying data of the true frames; `body` is the tracker's.
pub(super) fn secrets(truth: &TruthSet, body: &Humanoid) -> Vec<Secret> {
    let frames = &truth.ground_truth.frames;
    let poses: Vec<&Pose> = frames.iter().map(|frame| &frame.pose).collect();
    let mut all = of_poses("actor", &truth.ground_truth.actor, &poses);
    if let Some(refitted) = &truth.refitted {
        all.extend(of_poses("tracker's body", body, &refitted.poses.iter().collect::<Vec<_>>()));
    }
    let markers = |relative: bool| {
        let of_frame = |frame: &crate::scene::TruthFrame| -> Vec<f64> {
            let pelvis = frame.markers[Landmark::Pelvis as usize].filter(|_| relative).unwrap_or_default();
            frame.markers.iter().flatten().flat_map(|marker| <[f64; 3]>::from(marker - pelvis)).collect()
        };
        frames.iter().map(of_frame).collect()
    };
    let joints = frames.iter().map(|f| f.joint_positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect()).collect();
    let links = frames.iter().map(|f| f.link_frames.0.iter().flat_map(rigid::to_row).collect()).collect();
    all.push(Secret::new("markers of the actor", markers(false), TOLERANCE));
    all.push(Secret::new("markers of the actor relative to its pelvis", markers(true), TOLERANCE));
    all.push(Secret::new("joints of the actor", joints, TOLERANCE));
    all.push(Secret::new("link frames of the actor", links, TOLERANCE));
    all
}

/// True poses and points that are recognised in spite of noise, the points at any position; `views` is
/// `truth/views.npz` and `body` the tracker's.
pub(super) fn noisy_secrets(truth: &TruthSet, views: Option<&Npz>, body: &Humanoid) -> Vec<NoisySecret> {
    let frames = &truth.ground_truth.frames;
    let own: Vec<&Pose> = frames.iter().map(|frame| &frame.pose).collect();
    let refitted: Vec<&Pose> = truth.refitted.iter().flat_map(|motion| &motion.poses).collect();
    let mut all = noisy_angles("actor", &truth.ground_truth.actor, &own);
    all.extend(noisy_angles("tracker's body", body, &refitted));
    let markers = frames.iter().map(|f| f.markers.iter().flatten().flat_map(|p| [p.x, p.y, p.z]).collect()).collect();
    let joints = frames.iter().map(|f| f.joint_positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect()).collect();
    for (what, rows) in [("markers", markers), ("joints", joints)] {
        all.extend(points(format!("{what} of the actor, at any position"), rows, 3, NOISE, &LENGTHS));
    }
    for (array, what) in [("markers_2d", "markers"), ("joints_2d", "joints")] {
        all.extend(views.into_iter().flat_map(|views| in_images(views, array, what)));
    }
    all
}

/// Joint angles and mirrored joint angles of a body.
fn noisy_angles(whose: &str, body: &Humanoid, poses: &[&Pose]) -> Vec<NoisySecret> {
    let order = mirrored_order(body);
    let rows: Vec<Vec<f64>> = poses.iter().map(|pose| pose.joint_angles.iter().copied().collect()).collect();
    let mirrored = rows.iter().map(|row| order.iter().filter_map(|i| row.get(*i).copied()).collect()).collect();
    let secret = |(rows, what): (Vec<Vec<f64>>, &str)| {
        let features = (0..rows.first().map_or(0, Vec::len)).map(Feature::Number).collect();
        NoisySecret::new(format!("{what} of the {whose}, with noise"), &rows, features, NOISE, &ANGLES)
    };
    [(rows, "joint angles"), (mirrored, "mirrored joint angles")].into_iter().filter_map(secret).collect()
}

/// Points of the actor, recognised by the distances between them.
fn points(
    what: String,
    rows: Vec<Vec<f64>>,
    dimensions: usize,
    noise: f64,
    units: &'static [f64],
) -> Option<NoisySecret> {
    let width = rows.first()?.len();
    let features = Feature::distances(width / dimensions, dimensions);
    // a marker that the body lacks is missing in all frames
    if rows.iter().all(|row| row.len() == width) { NoisySecret::new(what, &rows, features, noise, units) } else { None }
}

/// Points of the actor in the images of every camera.
fn in_images(views: &Npz, array: &str, what: &str) -> Vec<NoisySecret> {
    let shape = views.get(array).map(|array| array.shape.clone()).unwrap_or_default();
    let Ok(&[frames, cameras, points_of_frame, 2]) = <&[usize; 4]>::try_from(&shape[..]) else { return Vec::new() };
    let Ok(pixels) = views.f64s("views.npz", array, &[None, None, None, Some(2)]) else { return Vec::new() };
    let width = 2 * points_of_frame;
    let of_camera = |camera: usize| {
        let row = |frame: usize| pixels.get((frame * cameras + camera) * width..)?.get(..width).map(<[f64]>::to_vec);
        let rows = (0..frames).filter_map(row).collect();
        points(format!("{what} of the actor in the images of camera {camera}"), rows, 2, NOISE_PX, &[1.0])
    };
    (0..cameras).filter_map(of_camera).collect()
}

fn of_poses(whose: &str, body: &Humanoid, poses: &[&Pose]) -> Vec<Secret> {
    let angles = |order: &[usize]| -> Vec<Vec<f64>> {
        poses.iter().map(|pose| order.iter().filter_map(|i| pose.joint_angles.get(*i).copied()).collect()).collect()
    };
    let roots: Vec<[f64; 7]> = poses.iter().map(|pose| rigid::to_row(&pose.world_from_root)).collect();
    let unchanged: Vec<usize> = (0..body.degrees_of_freedom.len()).collect();
    let mirrored = mirrored_order(body);
    let mut all = vec![
        Secret::new(&format!("joint angles of the {whose}"), angles(&unchanged), TOLERANCE).in_any_order(),
        Secret::new(&format!("root of the {whose}"), roots.iter().map(|r| r.to_vec()).collect(), TOLERANCE_OF_FEW),
        Secret::new(
            &format!("position of the root of the {whose}"),
            roots.iter().map(|r| r[..3].to_vec()).collect(),
            TOLERANCE_OF_POSITION,
        ),
    ];
    if mirrored != unchanged {
        all.push(Secret::new(&format!("mirrored joint angles of the {whose}"), angles(&mirrored), TOLERANCE));
    }
    all
}

/// For every degree of freedom its counterpart on the other side of the body, by name.
fn mirrored_order(body: &Humanoid) -> Vec<usize> {
    let names: Vec<&str> = body.degrees_of_freedom.iter().map(|dof| dof.name.as_str()).collect();
    mirrored_indices(&names)
}

/// For every name the index of its counterpart on the other side of the body; its own index if there is none.
pub(crate) fn mirrored_indices<S: AsRef<str>>(names: &[S]) -> Vec<usize> {
    let other_side =
        |name: &str| if name.contains("left") { name.replace("left", "right") } else { name.replace("right", "left") };
    let index = |(own, name): (usize, &S)| {
        let other = other_side(name.as_ref());
        names.iter().position(|name| name.as_ref() == other).unwrap_or(own)
    };
    names.iter().enumerate().map(index).collect()
}

impl Secret {
    fn new(what: &str, rows: Vec<Vec<f64>>, tolerance: f64) -> Self {
        let rows: Vec<Vec<f64>> = rows.into_iter().map(|row| row.into_iter().map(f64::abs).collect()).collect();
        let width = rows.first().map_or(0, Vec::len);
        let range = |i: usize| {
            let values = || rows.iter().filter_map(|row| row.get(i).copied());
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let anchor = (0..width).max_by(|a, b| range(*a).total_cmp(&range(*b))).unwrap_or(0);
        let given = |row: &[f64]| row.iter().zip(&rows[0]).all(|(a, b)| (a - b).abs() <= 2.0 * tolerance);
        let secret = rows.iter().enumerate().filter(|(_, row)| !row.is_empty() && !given(row));
        let mut by_anchor: Vec<(f64, usize)> = secret.map(|(frame, row)| (row[anchor], frame)).collect();
        by_anchor.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { what: what.to_owned(), rows, tolerance, unordered: false, by_anchor, anchor }
    }

    fn in_any_order(self) -> Self {
        Self { unordered: true, ..self }
    }

    /// A frame that the sequence contains.
    pub(super) fn found_in(&self, sequence: &NumberSequence) -> Option<usize> {
        let in_order = sequence.strides.iter().find_map(|stride| self.at_stride(&sequence.numbers, *stride));
        in_order.or_else(|| if self.unordered { self.in_some_order(&sequence.numbers) } else { None })
    }

    fn at_stride(&self, numbers: &[f64], stride: usize) -> Option<usize> {
        let width = self.rows.first().map_or(0, Vec::len);
        let reach = width.saturating_sub(1).checked_mul(stride)?;
        let starts = numbers.len().checked_sub(reach)?;
        (0..starts).find_map(|start| {
            let number = numbers[start + self.anchor * stride].abs();
            UNITS.iter().find_map(|unit| {
                let first = self.by_anchor.partition_point(|(value, _)| *value < number * unit - self.tolerance);
                let near = self.by_anchor[first..].iter().take_while(|(v, _)| *v <= number * unit + self.tolerance);
                near.map(|(_, frame)| *frame).find(|frame| {
                    let row = self.rows[*frame].iter().enumerate();
                    row.map(|(i, v)| numbers[start + i * stride].abs() * unit - v).all(|d| d.abs() <= self.tolerance)
                })
            })
        })
    }

    fn in_some_order(&self, numbers: &[f64]) -> Option<usize> {
        let mut sorted: Vec<f64> = numbers.iter().map(|n| n.abs()).filter(|n| n.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let has = |value: f64, unit: f64| {
            let least = (value - EXACT) / unit;
            let at = sorted.partition_point(|n| *n < least);
            sorted.get(at).is_some_and(|n| *n <= (value + EXACT) / unit)
        };
        let is_found = |frame: usize, unit: f64| {
            let row = self.rows[frame].iter().zip(&self.rows[0]);
            let distinct: Vec<f64> =
                row.filter(|(v, given)| (*v - *given).abs() > TOLERANCE).map(|(v, _)| *v).collect();
            let found = distinct.iter().filter(|value| has(**value, unit)).count();
            distinct.len() >= LEAST_DISTINCT && found as f64 >= FOUND_SHARE * distinct.len() as f64
        };
        let frames = self.by_anchor.iter().map(|(_, frame)| *frame);
        UNITS[..2].iter().find_map(|unit| frames.clone().find(|frame| is_found(*frame, *unit)))
    }
}
