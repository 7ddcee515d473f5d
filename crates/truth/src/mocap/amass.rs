//! Recordings of AMASS, SMPL, SMPL-H and SMPL-X: NumPy archives with the rotations of a body model's joints, as axis
//! times angle, and a position.
//!
//! At rest these bodies have Y up, face +Z, and stretch their arms sideways; `poses` turn every joint against its
//! parent, the first against the world, whose up axis is Z in AMASS and Y in other sets. The first 22 joints are the
//! same in all models; hands and face are not read. The pelvis is at `trans` plus its place at rest. Lengths follow
//! from `betas` and the model's file, which is not free: without it the body has the proportions of [`JOINTS`].

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::clip::clip_name;
use super::options::{MAX_RATE, ReadOptions, UpAxis, UpSource};
use super::points::malformed;
use super::recording::{MAX_JOINT_FRAMES, ParsedRecording};
use super::text_cursor::is_plausible;
use super::{Clip, MocapError, Skeleton, SkeletonJoint};
use skiagraph_core::npz::{Npz, NpzError, Values};

/// Name, parent, and offset from the parent at rest, metres. Y up, left at +X.
type RestJoint = (&'static str, Option<usize>, [f64; 3]);

/// An adult's joints, in whole half centimetres; the pelvis is given relative to the origin of SMPL.
#[rustfmt::skip]
const JOINTS: [RestJoint; 22] = [
    ("pelvis",         None,     [0.0, -0.22, 0.03]),
    ("left_hip",       Some(0),  [0.07, -0.09, -0.005]),
    ("right_hip",      Some(0),  [-0.07, -0.09, -0.005]),
    ("spine1",         Some(0),  [0.0, 0.11, -0.025]),
    ("left_knee",      Some(1),  [0.035, -0.38, -0.005]),
    ("right_knee",     Some(2),  [-0.035, -0.38, -0.005]),
    ("spine2",         Some(3),  [0.0, 0.135, 0.0]),
    ("left_ankle",     Some(4),  [-0.015, -0.4, -0.04]),
    ("right_ankle",    Some(5),  [0.015, -0.4, -0.04]),
    ("spine3",         Some(6),  [0.0, 0.055, 0.025]),
    ("left_toes",      Some(7),  [0.025, -0.055, 0.12]),
    ("right_toes",     Some(8),  [-0.025, -0.055, 0.12]),
    ("neck",           Some(9),  [0.0, 0.215, -0.045]),
    ("left_collar",    Some(9),  [0.08, 0.12, -0.035]),
    ("right_collar",   Some(9),  [-0.08, 0.12, -0.035]),
    ("head",           Some(12), [0.0, 0.075, 0.05]),
    ("left_shoulder",  Some(13), [0.095, 0.03, -0.01]),
    ("right_shoulder", Some(14), [-0.095, 0.03, -0.01]),
    ("left_elbow",     Some(16), [0.255, -0.015, -0.025]),
    ("right_elbow",    Some(17), [-0.255, -0.015, -0.025]),
    ("left_wrist",     Some(18), [0.25, 0.01, 0.0]),
    ("right_wrist",    Some(19), [-0.25, 0.01, 0.0]),
];
const HEAD: usize = 15;

/// The crown above the head's joint, metres.
const CROWN: f64 = 0.19;

/// Stature of the body of [`JOINTS`], metres.
const STATURE: f64 = 1.7;

/// Mean statures of adult women and men of the United States (`[Brainard 1992]`), metres.
const STATURES: [(&str, f64); 2] = [("female", 1.62), ("male", 1.757)];

/// Greatest number of `betas` that are used.
const MOST_BETAS: usize = 300;

const POSES: [&str; 3] = ["poses", "pose", "smpl_poses"];
const PLACES: [&str; 3] = ["trans", "transl", "smpl_trans"];
const RATES: [&str; 4] = ["mocap_framerate", "mocap_frame_rate", "framerate", "fps"];

/// Parses the bytes of a motion, and of the body model's file if there is one; `file` is the motion's name, used for
/// messages and the clip's name.
pub fn parse_amass(bytes: &[u8], model: Option<&[u8]>, file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    let read = read(bytes, model, file, options).map_err(|error| malformed(file, error.detail))?;
    let mut clip = read.into_clip(file, options)?;
    if options.up.is_none() {
        clip.up.1 = UpSource::Guess;
    }
    Ok(clip)
}

fn read(bytes: &[u8], model: Option<&[u8]>, file: &str, options: &ReadOptions) -> Result<ParsedRecording, NpzError> {
    let fail = |detail: String| NpzError::new(file, detail);
    let wanted = [&POSES[..], &PLACES, &RATES, &["root_orient", "pose_body"]].concat();
    let npz = Npz::some_from_bytes(file, bytes, &wanted)?;
    let find = |names: &[&'static str]| names.iter().copied().find(|name| npz.get(name).is_some());
    let Some(place) = find(&PLACES) else {
        return Err(fail("expected the arrays `poses` and `trans` of AMASS or SMPL, found no `trans`".to_owned()));
    };
    let places = npz.numbers(file, place, &[None, Some(3)])?;
    let frames = places.len() / 3;
    if frames.saturating_mul(JOINTS.len()) > MAX_JOINT_FRAMES {
        return Err(fail(format!("expected at most {} frames, found {frames}", MAX_JOINT_FRAMES / JOINTS.len())));
    }
    let turns = match find(&POSES) {
        Some(name) => rows(file, &npz, name, frames)?,
        None if find(&["root_orient"]).is_some() && find(&["pose_body"]).is_some() => {
            let [mut turns, body] = [rows(file, &npz, "root_orient", frames)?, rows(file, &npz, "pose_body", frames)?];
            turns.iter_mut().zip(body).for_each(|(turn, body)| turn.extend(body));
            turns
        }
        None => return Err(fail("expected the array `poses` of AMASS or SMPL, found none".to_owned())),
    };
    let least = 3 * JOINTS.len();
    if let Some(row) = turns.first().filter(|row| row.len() < least) {
        let width = row.len();
        return Err(fail(format!("poses: expected rotations of at least 22 joints, {least} numbers, found {width}")));
    }
    let wrong = turns.iter().flatten().chain(&places).position(|number| !is_plausible(*number));
    if wrong.is_some() {
        return Err(fail("expected finite numbers in `poses` and `trans`".to_owned()));
    }
    let rate = match (options.frames_per_second, find(&RATES)) {
        (Some(rate), _) => rate,
        (None, Some(name)) => *one_row(file, &npz, name)?.first().unwrap_or(&0.0),
        (None, None) => 0.0,
    };
    if !(1e-3..=MAX_RATE).contains(&rate) {
        return Err(fail(
            "expected the frame rate in `mocap_framerate` or `mocap_frame_rate`; set `source_hz`".to_owned(),
        ));
    }
    let mut notes = Vec::new();
    let body = match model {
        Some(model) => RestBody::of_model(model, bytes, file, &mut notes)?,
        None => RestBody::of_adult(bytes, file, options, &mut notes),
    };
    let mut clip = Clip {
        name: clip_name(file),
        skeleton: body.skeleton(),
        frames_per_second: rate,
        frames: Vec::with_capacity(frames),
        notes,
        ..Clip::default()
    };
    for (row, place) in turns.iter().zip(places.as_chunks::<3>().0) {
        let mut pose = Vec::with_capacity(JOINTS.len());
        for (turn, offset) in row.as_chunks::<3>().0.iter().zip(&body.offsets) {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(*turn));
            pose.push(Isometry3::from_parts(Translation3::from(*offset), rotation));
        }
        pose[0].translation.vector += Vector3::from(*place);
        clip.frames.push(pose);
    }
    let up = Some(up(&mut clip));
    let rest_offsets = body.offsets;
    Ok(ParsedRecording { clip, rest_offsets, empty_frames: Vec::new(), metres_per_unit: Some(1.0), up })
}

/// The numbers of every frame of an array, whether joints are an axis of their own or not.
fn rows(file: &str, npz: &Npz, name: &str, frames: usize) -> Result<Vec<Vec<f64>>, NpzError> {
    let shape: Vec<usize> = npz.get(name).map(|array| array.shape.clone()).unwrap_or_default();
    let is_right = shape.first() == Some(&frames) && (shape.len() == 2 || shape.len() == 3 && shape[2] == 3);
    let width = shape.get(1).copied().unwrap_or(0) * if shape.len() == 3 { 3 } else { 1 };
    if !is_right || width == 0 || !width.is_multiple_of(3) {
        let detail =
            format!("{name}: shape {shape:?}, expected three numbers (axis times angle) per joint in {frames} rows");
        return Err(NpzError::new(file, detail));
    }
    let all = npz.numbers(file, name, &shape.iter().map(|length| Some(*length)).collect::<Vec<_>>())?;
    Ok(all.chunks(width).map(|row| row[..width.min(3 * JOINTS.len())].to_vec()).collect())
}

/// The numbers of an array, or of its first row.
fn one_row(file: &str, npz: &Npz, name: &str) -> Result<Vec<f64>, NpzError> {
    let shape: Vec<usize> = npz.get(name).map(|array| array.shape.clone()).unwrap_or_default();
    let mut all = npz.numbers(file, name, &shape.iter().map(|length| Some(*length)).collect::<Vec<_>>())?;
    all.truncate(shape.last().copied().unwrap_or(1));
    Ok(all)
}

/// The axis along which the trunk points in most frames.
fn up(clip: &mut Clip) -> UpAxis {
    let sum: Vector3<f64> = clip.frames.iter().map(|frame| frame[0].rotation * Vector3::y()).sum();
    let up = if sum.y.abs() > sum.z.abs() { UpAxis::Y } else { UpAxis::Z };
    if sum.norm() < 0.5 * clip.frames.len() as f64 || sum[1 + usize::from(up == UpAxis::Z)] < 0.0 {
        clip.notes
            .push(format!("up axis: {up:?}, but the trunk is seldom upright along it; set `up` if this is wrong"));
    }
    up
}

struct RestBody {
    /// In the order of [`JOINTS`], metres.
    offsets: Vec<Vector3<f64>>,
    crown: f64,
}

impl RestBody {
    /// An adult's proportions, with the stature that the user gives, or of the subject's sex.
    fn of_adult(bytes: &[u8], file: &str, options: &ReadOptions, notes: &mut Vec<String>) -> Self {
        // some files have it in a form that is not read
        let gender = Npz::some_from_bytes(file, bytes, &["gender"]).ok();
        let gender = match gender.as_ref().and_then(|npz| npz.get("gender")).map(|array| &array.values) {
            Some(Values::Text(texts)) => texts.first().map(|text| text.to_lowercase()),
            _ => None,
        };
        let of_sex = STATURES.iter().find(|(sex, _)| gender.as_deref() == Some(*sex)).map(|(_, stature)| *stature);
        let stature = options.stature_m.or(of_sex).unwrap_or(STATURE);
        notes.push(format!(
            "the body has an adult's proportions and a stature of {stature} m; set `stature_m`, or `skeleton` to the file of \
             the body model"
        ));
        let scale = stature / STATURE;
        Self {
            offsets: JOINTS.iter().map(|(_, _, offset)| Vector3::from(*offset) * scale).collect(),
            crown: CROWN * scale,
        }
    }

    /// The joints of a body model, a `.npz` file, for the `betas` of the motion.
    fn of_model(model: &[u8], motion: &[u8], file: &str, notes: &mut Vec<String>) -> Result<Self, NpzError> {
        let betas = Npz::some_from_bytes(file, motion, &["betas"])?;
        let betas = if betas.get("betas").is_some() { one_row(file, &betas, "betas")? } else { Vec::new() };
        let of_model = |error: NpzError| NpzError::new(file, format!("skeleton: {}", error.detail));
        let npz = Npz::some_from_bytes(file, model, &["v_template", "shapedirs", "J_regressor"]).map_err(of_model)?;
        let mut vertices = npz.numbers(file, "v_template", &[None, Some(3)]).map_err(of_model)?;
        let count = vertices.len() / 3;
        let shapes = npz.numbers(file, "shapedirs", &[Some(count), Some(3), None]).map_err(of_model)?;
        let width = shapes.len() / vertices.len().max(1);
        if width > 0 {
            for (number, shape) in vertices.iter_mut().zip(shapes.chunks(width)) {
                *number += shape.iter().zip(&betas).take(MOST_BETAS).map(|(shape, beta)| shape * beta).sum::<f64>();
            }
        }
        let weights = npz.numbers(file, "J_regressor", &[None, Some(count)]).map_err(of_model)?;
        let vertices = vertices.as_chunks::<3>().0;
        let joint = |weights: &[f64]| -> Vector3<f64> {
            weights.iter().zip(vertices).map(|(weight, vertex)| Vector3::from(*vertex) * *weight).sum()
        };
        let joints: Vec<Vector3<f64>> = weights.chunks(count.max(1)).take(JOINTS.len()).map(joint).collect();
        let is_far = |joint: &Vector3<f64>| !joint.iter().all(|c| c.abs() < 10.0);
        if joints.len() < JOINTS.len() || joints.iter().any(is_far) {
            return Err(NpzError::new(file, "skeleton: expected the joints of a body model, in metres"));
        }
        let top = vertices.iter().map(|vertex| vertex[1]).fold(joints[HEAD].y, f64::max);
        notes.push(format!("lengths of the body model, with {} betas", betas.len().min(width)));
        let offset = |(joint, (_, parent, _)): (&Vector3<f64>, &RestJoint)| {
            joint - parent.map_or(Vector3::zeros(), |p| joints[p])
        };
        Ok(Self { offsets: joints.iter().zip(&JOINTS).map(offset).collect(), crown: (top - joints[HEAD].y).min(1.0) })
    }

    fn skeleton(&self) -> Skeleton {
        let joint = |(index, (name, parent, _)): (usize, &RestJoint)| SkeletonJoint {
            name: (*name).to_owned(),
            parent: *parent,
            tip: (index == HEAD).then(|| Vector3::y() * self.crown),
        };
        Skeleton { joints: JOINTS.iter().enumerate().map(joint).collect() }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use core::f64::consts::FRAC_PI_2;
    use nalgebra::Point3;
    use skiagraph_core::npz::Array;

    use super::*;

    /// Three frames of a body that stands with Z up, turned by `turn` at its root, its left knee bent by 1 rad.
    fn motion(width: usize, turn: [f64; 3]) -> Npz {
        let mut row = vec![0.0; width];
        row[..3].copy_from_slice(&turn);
        row[12] = 1.0;
        let mut npz = Npz::from_iter([("poses", Array::new(&[3, width], row.repeat(3)))]);
        npz.push("trans", Array::new(&[3, 3], [1.0, 2.0, 0.9].repeat(3)));
        npz
    }

    fn upright() -> [f64; 3] {
        [FRAC_PI_2, 0.0, 0.0]
    }

    fn parse(npz: &Npz, options: &ReadOptions) -> Result<Clip, MocapError> {
        parse_amass(&npz.to_bytes("f").unwrap(), None, "walk.npz", options)
    }

    fn at(clip: &Clip, joint: &str) -> Point3<f64> {
        clip.joint_positions(0)[clip.skeleton.find(joint).unwrap()]
    }

    #[test]
    fn every_model_is_read_with_its_rate_and_up_axis() {
        for (width, rate) in [(72, "fps"), (156, "mocap_framerate"), (165, "mocap_frame_rate")] {
            let mut npz = motion(width, upright());
            npz.push(rate, Array::new(&[], vec![120.0]));
            npz.push("gender", Array::names(["female"]));
            let clip = parse(&npz, &ReadOptions::default()).unwrap();
            assert_eq!((clip.frames.len(), clip.frames_per_second, clip.skeleton.joints.len()), (3, 120.0, 22));
            let (hip, knee, ankle) = (at(&clip, "left_hip"), at(&clip, "left_knee"), at(&clip, "left_ankle"));
            assert!(hip.z - knee.z > 0.3 && (hip.x - 1.0) > 0.05, "{hip} {knee}");
            assert!(ankle.y - knee.y > 0.25, "a bent knee moves the ankle backwards, to +Y: {knee} {ankle}");
            assert!(clip.notes.iter().any(|note| note.contains("stature of 1.62 m")), "{:?}", clip.notes);
            // Y up: the same body, turned by the reader
            let mut lying = motion(width, [0.0; 3]);
            lying.push("fps", Array::new(&[1], vec![30_i64]));
            let y_up = parse(&lying, &ReadOptions::default()).unwrap();
            let found = at(&y_up, "left_hip") - at(&y_up, "pelvis");
            assert_relative_eq!(found, (hip - at(&clip, "pelvis")) * (1.7 / 1.62), epsilon = 1e-9);
        }
    }

    #[test]
    fn a_model_or_a_stature_gives_the_lengths() {
        let mut npz = motion(66, upright());
        npz.push("betas", Array::new(&[2], vec![2.0, 0.0]));
        let options = ReadOptions { frames_per_second: Some(60.0), stature_m: Some(1.36), ..ReadOptions::default() };
        let small = parse(&npz, &options).unwrap();
        assert_relative_eq!((at(&small, "left_knee") - at(&small, "left_hip")).norm(), 0.8 * 0.3816, epsilon = 1e-4);
        // one vertex for each joint, at our own places; the first beta lowers the left knee by 0.1 m
        let own = RestBody::of_adult(&[], "f", &options, &mut Vec::new());
        let mut places: Vec<Vector3<f64>> = Vec::new();
        for ((_, parent, _), offset) in JOINTS.iter().zip(&own.offsets) {
            places.push(parent.map_or(Vector3::zeros(), |parent| places[parent]) + offset);
        }
        let mut shapes = vec![0.0; 22 * 3 * 4];
        shapes[(4 * 3 + 1) * 4] = -0.05;
        let identity = (0..22 * 22).map(|index| if index % 23 == 0 { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let model = Npz::from_iter([
            (
                "v_template",
                Array::new(&[22, 3], places.iter().flat_map(|place| [place.x, place.y, place.z]).collect::<Vec<f64>>()),
            ),
            ("shapedirs", Array::new(&[22, 3, 4], shapes)),
            ("J_regressor", Array::new(&[22, 22], identity)),
        ]);
        let bytes = npz.to_bytes("f").unwrap();
        let longer = parse_amass(&bytes, Some(&model.to_bytes("f").unwrap()), "f", &options).unwrap();
        assert_relative_eq!(at(&longer, "left_knee"), at(&small, "left_knee") - Vector3::z() * 0.1, epsilon = 1e-9);
        assert_relative_eq!(at(&longer, "right_ankle"), at(&small, "right_ankle"), epsilon = 1e-9);
        let error = parse_amass(&bytes, Some(&bytes), "f", &options).unwrap_err().to_string();
        assert_eq!(error, "f: skeleton: has no array \"v_template\"");
    }

    #[test]
    fn an_archive_of_something_else_is_refused_with_what_is_missing() {
        let message = |npz: &Npz| parse(npz, &ReadOptions::default()).unwrap_err().to_string();
        assert!(message(&Npz::default()).ends_with("of AMASS or SMPL, found no `trans`"));
        assert!(message(&motion(63, upright())).contains("rotations of at least 22 joints, 66 numbers, found 63"));
        assert!(message(&motion(67, upright())).contains("shape [3, 67], expected three numbers"));
        assert!(message(&motion(66, upright())).contains("set `source_hz`"));
        assert!(message(&motion(66, [f64::NAN; 3])).contains("finite numbers"));
    }
}
