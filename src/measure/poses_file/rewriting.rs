//! Converts the arrays of another program's estimates to this program's units, axes, sides and frames.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::read_as::ReadAs;
use skiagraph_core::body::{Humanoid, LANDMARKS};
use skiagraph_core::npz::{Array, Npz};

pub(super) const POINTS: [&str; 2] = ["estimate_markers", "estimate_joints"];
const NAMES: [&str; 3] = ["marker_names", "estimate_joint_names", "estimate_angle_names"];
const ROOT: &str = "estimate_root";
const ANGLES: &str = "estimate_angles";
/// Greatest shift, and greatest number of frames of a set.
const MOST_FRAMES: usize = 10_000_000;

/// The transform from a file's units, axes and origin to the set's.
struct SetFromFile {
    metres: f64,
    matrix: Matrix3<f64>,
    offset: Vector3<f64>,
}

impl SetFromFile {
    fn place(&self, place: &mut [f64; 3]) {
        *place = (self.metres * (self.matrix * Vector3::from(*place)) + self.offset).into();
    }

    fn root(&self, rotation: &UnitQuaternion<f64>, row: &mut [f64; 7]) {
        let [x, y, z, qw, qx, qy, qz] = *row;
        let mut place = [x, y, z];
        self.place(&mut place);
        // the quaternion's length is kept, and checked by the reader
        let turned = rotation.quaternion() * Quaternion::new(qw, qx, qy, qz);
        *row = [place[0], place[1], place[2], turned.w, turned.i, turned.j, turned.k];
    }
}

/// An archive, whose arrays have the axis of seeds, with all numbers in this program's conventions. `frames` is the
/// number of frames of the set.
pub(super) fn rewritten(npz: Npz, file: &str, read_as: &ReadAs, body: &Humanoid, frames: usize) -> Result<Npz, String> {
    let mut npz = npz;
    let matrix = read_as.order.set_from_file();
    let to_set = SetFromFile { metres: read_as.metres_per_unit.unwrap_or(1.0), matrix, offset: read_as.offset() };
    if to_set.metres != 1.0 || matrix != Matrix3::identity() || to_set.offset != Vector3::zeros() {
        if npz.get(ROOT).is_some() && read_as.order.is_mirrored() {
            return Err(format!(
                "{ROOT}: poses cannot be mirrored, and the axes {} are left-handed; give positions of markers or joints",
                read_as.axes
            ));
        }
        npz = map_numbers(&npz, file, &|name, numbers| match name {
            ROOT => {
                let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
                numbers.as_chunks_mut::<7>().0.iter_mut().for_each(|row| to_set.root(&rotation, row));
            }
            _ if POINTS.contains(&name) => {
                numbers.as_chunks_mut::<3>().0.iter_mut().for_each(|place| to_set.place(place));
            }
            _ => {}
        })?;
    }
    if read_as.swapped_sides {
        npz = with_names_of_other_sides(npz, file, body)?;
    }
    match read_as.shift_frames {
        Some(shift) => shifted(&npz, file, shift, frames),
        None => Ok(npz),
    }
}

pub(super) fn changed(
    npz: &Npz,
    change: impl Fn(&str, &Array) -> Result<Option<Array>, String>,
) -> Result<Npz, String> {
    let mut found = Npz::default();
    for (name, array) in npz.iter() {
        found.push(name, change(name, array)?.unwrap_or_else(|| array.clone()));
    }
    Ok(found)
}

/// The numbers of an array of any shape and precision.
pub(super) fn numbers_of(npz: &Npz, file: &str, name: &str, array: &Array) -> Result<Vec<f64>, String> {
    npz.numbers(file, name, &vec![None; array.shape.len()]).map_err(|e| e.detail)
}

/// Changes the numbers of the arrays of positions and poses; single precision becomes double.
fn map_numbers(npz: &Npz, file: &str, change: &dyn Fn(&str, &mut [f64])) -> Result<Npz, String> {
    changed(npz, |name, array| {
        if name != ROOT && !POINTS.contains(&name) {
            return Ok(None);
        }
        let mut numbers = numbers_of(npz, file, name, array)?;
        change(name, &mut numbers);
        Ok(Some(Array::new(&array.shape, numbers)))
    })
}

fn with_names_of_other_sides(mut npz: Npz, file: &str, body: &Humanoid) -> Result<Npz, String> {
    let degrees = || body.degrees_of_freedom.iter().map(|degree| degree.name.as_str());
    if npz.get(ANGLES).is_some() && npz.get("estimate_angle_names").is_none() {
        npz.push("estimate_angle_names", Array::names(degrees()));
    }
    let markers = LANDMARKS.iter().map(|landmark| landmark.name());
    let joints = body.joints.iter().map(|joint| joint.name.as_str());
    let known: Vec<&str> = markers.chain(joints).chain(degrees()).collect();
    changed(&npz, |name, _| {
        if !NAMES.contains(&name) {
            return Ok(None);
        }
        let names = npz.names(file, name).map_err(|e| e.detail)?.unwrap_or_default();
        let swapped: Vec<String> = names.iter().map(|name| other_side(name, &known)).collect();
        Ok(Some(Array::names(swapped.iter().map(String::as_str))))
    })
}

/// The name of the same part on the other side, if it is among the `known` names, else the name itself.
pub(crate) fn other_side(name: &str, known: &[&str]) -> String {
    let exchanged = |one: &str, other: &str| name.contains(one).then(|| name.replacen(one, other, 1));
    let at_ends = |one: char, other: char| {
        let first = name.strip_prefix(one).map(|rest| format!("{other}{rest}"));
        let last = name.strip_suffix(one).map(|rest| format!("{rest}{other}"));
        [first, last]
    };
    let words = [("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT")];
    let words = words.iter().flat_map(|(left, right)| [exchanged(left, right), exchanged(right, left)]);
    let ends =
        [('l', 'r'), ('r', 'l'), ('L', 'R'), ('R', 'L')].into_iter().flat_map(|(one, other)| at_ends(one, other));
    let found = words.chain(ends).flatten().find(|other| known.contains(&other.as_str()));
    found.unwrap_or_else(|| name.to_owned())
}

/// Moves frame f to frame f + shift. The result has as many frames as the set; frames without a source have no
/// estimate.
fn shifted(npz: &Npz, file: &str, shift: i64, frames: usize) -> Result<Npz, String> {
    if shift.unsigned_abs() as usize > MOST_FRAMES || frames > MOST_FRAMES {
        return Err(format!("--shift: expected at most {MOST_FRAMES} frames either way"));
    }
    let is_of_frames = |name: &str| [ROOT, ANGLES].contains(&name) || POINTS.contains(&name);
    let given = npz.iter().filter(|(name, _)| is_of_frames(name)).find_map(|(_, array)| array.shape.get(1).copied());
    // frame 0 is the start pose, and is not measured if there are others
    let first_scored = usize::from(frames > 1);
    let is_left = |given: usize| {
        (0..given)
            .any(|row| row.checked_add_signed(shift as isize).is_some_and(|to| (first_scored..frames).contains(&to)))
    };
    if let Some(given) = given.filter(|given| *given > 0 && !is_left(*given)) {
        return Err(format!(
            "--shift {shift} leaves nothing to measure: the file's {given} frames would be frames {shift} to {} of the set, \
             which has frames 0 (the start pose) to {}",
            shift + given as i64 - 1,
            frames - 1
        ));
    }
    changed(npz, |name, array| {
        let (true, [seeds, given, rest @ ..]) = (is_of_frames(name), array.shape.as_slice()) else { return Ok(None) };
        if *given == 0 {
            return Ok(None);
        }
        let width: usize = rest.iter().product();
        let numbers = numbers_of(npz, file, name, array)?;
        let mut moved = vec![f64::NAN; seeds * frames * width];
        for (seed, row) in (0..*seeds).flat_map(|seed| (0..*given).map(move |row| (seed, row))) {
            let to = row.checked_add_signed(shift as isize).filter(|to| *to < frames);
            let from = (seed * given + row) * width;
            if let (Some(to), Some(values)) = (to, numbers.get(from..from + width)) {
                let start = (seed * frames + to) * width;
                moved[start..start + width].copy_from_slice(values);
            }
        }
        Ok(Some(Array::new(&[&[*seeds, frames], rest].concat(), moved)))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::{ASSUMED, PosesDeclared};
    use super::*;
    use crate::test_bodies::{person, walk};
    use skiagraph_eval::AxisOrder;
    use skiagraph_set::{EstimatedSequence, Estimates};

    fn estimates() -> Estimates {
        let sequences = vec![EstimatedSequence::from_poses(&person(), walk(5).poses)];
        Estimates { frames_per_second: 60.0, seeds: vec![0], sequences, bodies: Vec::new(), notes: Vec::new() }
    }

    fn archive() -> Npz {
        Npz::from_bytes("p", &estimates().to_bytes("p", &person(), None).unwrap()).unwrap()
    }

    fn read(npz: Npz, declared: &PosesDeclared) -> Result<Estimates, String> {
        let read_as = ReadAs::new(Path::new("p"), ASSUMED, declared);
        let npz = rewritten(npz, "p", &read_as, &person(), 5)?;
        Estimates::from_npz("p", npz, &person(), Vec::new()).map_err(|e| e.to_string())
    }

    /// The archive of a program with other axes and millimetres; of its poses, the root alone.
    fn in_other_axes(order: AxisOrder) -> Npz {
        let file_from_set = order.set_from_file().transpose();
        let to_file = SetFromFile { metres: 1000.0, matrix: file_from_set, offset: Vector3::zeros() };
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(file_from_set));
        map_numbers(&archive(), "p", &|name, numbers| match name {
            ROOT => numbers.as_chunks_mut::<7>().0.iter_mut().for_each(|row| to_file.root(&rotation, row)),
            _ => numbers.as_chunks_mut::<3>().0.iter_mut().for_each(|place| to_file.place(place)),
        })
        .unwrap()
    }

    #[test]
    fn poses_and_positions_in_other_axes_and_units_are_converted_consistently() {
        for order in AxisOrder::all().into_iter().take(24) {
            let declared =
                PosesDeclared { axes: Some(order), metres_per_unit: Some(0.001), ..PosesDeclared::default() };
            // positions and poses must agree to a millimetre, or they would be refused
            let found = read(in_other_axes(order), &declared).unwrap();
            for (found, truth) in found.sequences[0].markers.iter().zip(&estimates().sequences[0].markers) {
                for (found, truth) in found.iter().zip(truth) {
                    assert!((found.unwrap() - truth.unwrap()).norm() < 1e-9, "{order}");
                }
            }
        }
        let left_handed = PosesDeclared { axes: Some("x,-y,z".parse().unwrap()), ..PosesDeclared::default() };
        assert!(read(archive(), &left_handed).unwrap_err().contains("poses cannot be mirrored"));
    }

    #[test]
    fn a_shift_moves_every_frame_and_frames_outside_are_lost() {
        for shift in [2_i64, 0, -3] {
            let found = read(archive(), &PosesDeclared { shift: Some(shift), ..PosesDeclared::default() }).unwrap();
            for (frame, markers) in found.sequences[0].markers.iter().enumerate() {
                let from = frame.checked_add_signed(-shift as isize).filter(|from| *from < 5);
                let expected = from.map_or([None; 15], |from| estimates().sequences[0].markers[from]);
                assert_eq!(*markers, expected, "{shift}, frame {frame}");
            }
        }
    }

    #[test]
    fn exchanging_sides_twice_is_the_identity_and_once_exchanges_names_and_angles() {
        let body = person();
        let once = with_names_of_other_sides(archive(), "p", &body).unwrap();
        assert_eq!(with_names_of_other_sides(once.clone(), "p", &body).unwrap(), archive());
        let names = once.names("p", "estimate_angle_names").unwrap().unwrap();
        let at = |name: &str| names.iter().position(|other| other == name).unwrap();
        let was = body.degrees_of_freedom.iter().position(|degree| degree.name == "left_upper_arm").unwrap();
        assert_eq!(at("right_upper_arm"), was);
        assert_eq!(other_side("neck", &["neck"]), "neck");
        assert_eq!(other_side("hip_l", &["hip_r"]), "hip_r");
    }

    #[test]
    fn the_description_has_declared_and_assumed_properties() {
        let line = ReadAs::new(Path::new("a/mine.npz"), ASSUMED, &PosesDeclared::default()).describe();
        assert_eq!(line, "read mine.npz: metres (assumed); Z up, axes x,y,z (assumed)");
        let declared = PosesDeclared {
            metres_per_unit: Some(0.001),
            axes: Some("y,z,x".parse().unwrap()),
            shift: Some(-3),
            swap_sides: true,
            offset_m: Some([1.0, 0.0, 0.5]),
            ..PosesDeclared::default()
        };
        let line = ReadAs::new(Path::new("mine.npz"), ASSUMED, &declared).describe();
        assert_eq!(
            line,
            "read mine.npz: millimetres (--units); Y up, axes y,z,x (--axes); left and right exchanged (--swap-sides); \
             frame 0 is the set's frame -3 (--shift); moved by 1, 0, 0.5 m (--offset)"
        );
    }
}
