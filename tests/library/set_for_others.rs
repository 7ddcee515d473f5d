//! A benchmark set used with only its files, without this program.

use std::fs;
use std::path::Path;
use std::process::Command;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use skiagraph_core::body::shipped;
use skiagraph_core::npz::{Array, Npz};
use skiagraph_set::{BenchmarkSet, EstimatedSequence, Estimates};

const FRAMES: usize = 5;

/// The body turns, moves forward and swings every joint a little.
fn write_set(directory: &Path) -> BenchmarkSet {
    let camera = |name, eye, distortion| crate::made_up_set::camera(name, eye, distortion, [320, 240]);
    let ideal = camera("ideal", [3.5, 0.4, 1.3], [0.0; 5]);
    let lens = camera("lens", [-1.0, 3.2, 1.6], [-0.18, 0.06, 0.002, -0.001, -0.01]);
    let near = camera("near", [1.5, -1.3, 0.7], [0.1, -0.02, 0.0, 0.0, 0.0]);
    let root = |frame: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.5 * frame as f64);
        Isometry3::from_parts(Translation3::new(0.05 * frame as f64, 0.0, 1.0), turn)
    };
    let angle = |frame: usize, i: usize| 0.15 * f64::from(i as u32 * 7 + frame as u32 * 3).sin();
    let motion = crate::made_up_set::motion(&shipped("actor").unwrap(), FRAMES, 60.0, root, angle);
    let set = crate::made_up_set::assemble("for others", vec![ideal, lens, near], &motion);
    set.write(directory).unwrap();
    set
}

#[test]
fn numpy_reads_a_set_and_what_numpy_writes_is_read() {
    let Some(python) = crate::support::python_with_numpy() else { return };
    let (set_directory, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let set = write_set(set_directory.path());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/read_set.py");
    let answer = Command::new(python).arg(script).arg(set_directory.path()).arg(out.path()).output().unwrap();
    assert!(answer.status.success(), "{}", String::from_utf8_lossy(&answer.stderr));

    let read = |name: &str| fs::read(out.path().join(name)).unwrap();
    let body = &set.blind.start.body;
    let poses = Estimates::from_bytes("poses.npz", &read("poses.npz"), body).unwrap();
    assert_eq!(poses.seeds, [7]);
    assert_eq!(poses.sequences, [EstimatedSequence::from_poses(body, set.truth.refitted.clone().unwrap().poses)]);
    for name in ["stored.npz", "compressed.npz"] {
        let npz = Npz::from_bytes(name, &read(name)).unwrap();
        let whole = |kind: &str| npz.get(&format!("as_{kind}")).unwrap();
        for kind in ["<i4", ">i2", "|i1", "<u2", "<u8"] {
            assert_eq!(*whole(kind), Array::new(&[2, 3, 4], (0..24_i64).collect::<Vec<_>>()), "{name}, {kind}");
        }
        assert_eq!(*whole("|u1"), Array::new(&[2, 3, 4], (0..24_u8).collect::<Vec<_>>()));
        assert_eq!(*whole("<f4"), Array::new(&[2, 3, 4], (0..24_u8).map(f32::from).collect::<Vec<_>>()));
        let doubles = Array::new(&[2, 3, 4], (0..24_u8).map(f64::from).collect::<Vec<_>>());
        assert_eq!((whole(">f8"), npz.get("fortran")), (&doubles, Some(&doubles)));
        assert_eq!(npz.get("names"), Some(&Array::names(["é", "knee"])));
        assert_eq!(
            npz.get("joints"),
            Npz::from_bytes("truth", &fs::read(set_directory.path().join("truth/truth.npz")).unwrap())
                .unwrap()
                .get("joints")
        );
    }
    let refused = Npz::from_bytes("pickled.npz", &read("pickled.npz")).unwrap_err().to_string();
    assert!(refused.contains("pickled"), "{refused}");
}
