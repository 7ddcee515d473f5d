//! A benchmark set used with only its files and OpenCV's formulas, without this program.

use std::fs;
use std::path::Path;
use std::process::Command;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use skiagraph_core::body::shipped;
use skiagraph_core::npz::{Array, Npz, Values};
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

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

/// OpenCV's `projectPoints`, from its documentation: pixel (0, 0) is the centre of the top-left pixel.
fn project(camera: &Value, point: &[f64]) -> (f64, f64) {
    let (k, r) = (numbers(&camera["K"]), numbers(&camera["R"]));
    let (t, d) = (numbers(&camera["t"]), numbers(&camera["distortion"]));
    let row = |i: usize| r[3 * i] * point[0] + r[3 * i + 1] * point[1] + r[3 * i + 2] * point[2] + t[i];
    let (x, y) = (row(0) / row(2), row(1) / row(2));
    let r2 = x * x + y * y;
    let radial = 1.0 + d[0] * r2 + d[1] * r2.powi(2) + d[4] * r2.powi(3);
    let distorted_x = x * radial + 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x);
    let distorted_y = y * radial + d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y;
    (k[0] * distorted_x + k[2], k[4] * distorted_y + k[5])
}

#[test]
fn joints_projected_by_opencvs_formula_land_in_the_silhouette_files() {
    let directory = tempfile::tempdir().unwrap();
    write_set(directory.path());
    let cameras: Value = serde_json::from_slice(&fs::read(directory.path().join("cameras.json")).unwrap()).unwrap();
    let npz = Npz::from_bytes("truth.npz", &fs::read(directory.path().join("truth/truth.npz")).unwrap()).unwrap();
    let Some(Values::F64(joints)) = npz.get("joints").map(|array| array.values.clone()) else { panic!() };
    let per_frame = joints.len() / FRAMES;
    let mut seen = 0;
    for camera in cameras["cameras"].as_array().unwrap() {
        for (frame, joints) in joints.chunks(per_frame).enumerate() {
            let file = format!("{}/silhouette/{frame:06}.png", camera["observations"].as_str().unwrap());
            let file = fs::File::open(directory.path().join(file)).unwrap();
            let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            for joint in joints.chunks(3) {
                let (u, v) = project(camera, joint);
                let (column, row) = (u.round(), v.round());
                if (0.0..320.0).contains(&column) && (0.0..240.0).contains(&row) {
                    let value = pixels[row as usize * 320 + column as usize];
                    assert_eq!(value, 255, "{} frame {frame}: joint at ({u}, {v})", camera["name"]);
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > FRAMES * 3 * 10, "only {seen} joints lie in the images");
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
