//! Joint angles of estimates: converts declared degrees to radians, and detects undeclared degrees.

use super::rewriting::changed;
use skiagraph_core::npz::{Array, Npz};
use skiagraph_set::{Articulation, Estimates};

const NAME: &str = "estimate_angles";
/// No joint turns this far, radians: more than a whole turn.
const TOO_FAR: f64 = 7.0;
/// This many suspicious joint angles cannot be one joint that keeps turning.
const SEVERAL: usize = 3;
/// An angle is suspicious if it is too far in at least one of this many frames.
const ONE_OF: usize = 10;

/// An archive with its joint angles in radians; `declared` is the user's unit, radians per unit.
///
/// # Errors
/// A message if undeclared angles seem to be degrees, or if a unit is declared and there are no angles.
pub(super) fn in_radians(npz: Npz, file: &str, declared: Option<f64>) -> Result<Npz, String> {
    let Some(shape) = npz.get(NAME).map(|array| array.shape.clone()) else {
        return if declared.is_none() { Ok(npz) } else { Err(format!("has no {NAME}; leave out --angles")) };
    };
    // the axis of seeds is optional
    let columns = match shape.as_slice() {
        &[_, _, columns] | &[_, columns] => columns,
        _ => return Ok(npz),
    };
    let numbers = npz.numbers(file, NAME, &vec![None; shape.len()]).map_err(|e| e.detail)?;
    match declared {
        Some(1.0) => Ok(npz),
        Some(radians) => {
            let scaled = Array::new(&shape, numbers.iter().map(|angle| radians * angle).collect::<Vec<f64>>());
            changed(&npz, |name, _| Ok((name == NAME).then(|| scaled.clone())))
        }
        None => match seem_degrees(numbers.chunks_exact(columns.max(1))) {
            None => Ok(npz),
            Some(found) => {
                Err(format!("{NAME}: {found}; use --angles deg if they are degrees, or --angles rad if they are right"))
            }
        },
    }
}

/// Refuses the joint angles of a program's answers if they seem to be degrees, unless they are declared as radians.
///
/// # Errors
/// A message with the largest angle and what to do.
pub(crate) fn check_angles(estimates: &Estimates, declared: Option<f64>) -> Result<(), String> {
    match declared {
        Some(1.0) => return Ok(()),
        Some(_) => {
            let detail =
                "--angles deg is for .npz files that another program wrote; in the protocol, answer in radians";
            return Err(detail.to_owned());
        }
        None => {}
    }
    let poses = estimates.sequences.iter().filter_map(|sequence| match &sequence.articulation {
        Articulation::Poses(poses) => Some(poses),
        _ => None,
    });
    let found = seem_degrees(poses.flatten().flatten().map(|pose| pose.joint_angles.as_slice()));
    let detail =
        |found| format!("{found}; answer in radians if they are degrees, or use --angles rad if they are right");
    found.map_or(Ok(()), |found| Err(detail(found)))
}

/// A message about rows of joint angles if several are too far to be radians.
fn seem_degrees<'a>(rows: impl Iterator<Item = &'a [f64]>) -> Option<String> {
    let (mut too_far, mut given, mut largest): (Vec<usize>, _, f64) = (Vec::new(), 0, 0.0);
    for row in rows.filter(|row| row.iter().all(|angle| angle.is_finite())) {
        given += 1;
        too_far.resize(row.len(), 0);
        for (count, angle) in too_far.iter_mut().zip(row) {
            *count += usize::from(angle.abs() > TOO_FAR);
            largest = largest.max(angle.abs());
        }
    }
    let several = too_far.iter().filter(|count| **count > 0 && **count * ONE_OF >= given).count();
    (several >= SEVERAL).then(|| {
        format!(
            "{several} of {} joint angles exceed a whole turn, up to {largest:.1}, and seem to be degrees; expected \
             radians",
            too_far.len()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(rows: &[[f64; 4]]) -> Option<String> {
        seem_degrees(rows.iter().map(<[f64; 4]>::as_slice))
    }

    #[test]
    fn degrees_are_recognised_and_one_joint_that_keeps_turning_is_accepted() {
        let walk = [[40.0, -60.0, 3.0, 12.0], [f64::NAN; 4], [35.0, -20.0, 4.0, 8.0]];
        assert!(found(&walk).unwrap().starts_with("3 of 4 joint angles exceed a whole turn, up to 60.0"));
        assert_eq!(found(&walk.map(|row| row.map(f64::to_radians))), None);
        assert_eq!(found(&[[80.0, 0.1, 0.2, 9.0]]), None, "two joints may have lost count");
        let mut once = [[0.1; 4]; 30];
        once[7] = [90.0; 4];
        assert_eq!(found(&once), None, "one wild frame");
    }

    #[test]
    fn declared_degrees_become_radians_and_nothing_else_changes() {
        // with the axis of seeds and without it
        for shape in [&[1, 1, 3][..], &[1, 3]] {
            let archive = |angles: [f64; 3]| {
                Npz::from_iter([("fps", Array::new(&[], vec![60.0])), (NAME, Array::new(shape, angles.to_vec()))])
            };
            let given = archive([90.0, -45.0, 180.0]);
            let read = |declared: Option<f64>| in_radians(given.clone(), "theirs.npz", declared);
            let refused = read(None).unwrap_err();
            assert!(refused.contains("estimate_angles: 3 of 3") && refused.contains("--angles deg"), "{refused}");
            let degree = 1_f64.to_radians();
            let radians = archive([90.0, -45.0, 180.0].map(|angle: f64| degree * angle));
            assert_eq!(read(Some(degree)).unwrap(), radians);
            assert_eq!(read(Some(1.0)).unwrap(), given);
        }
        let points = Npz::from_iter([("fps", Array::new(&[], vec![60.0]))]);
        assert!(in_radians(points, "theirs.npz", Some(1.0)).unwrap_err().contains("leave out --angles"));
    }
}
