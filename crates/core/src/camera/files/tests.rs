//! The layouts of other programs, from their own documentation and files.

use nalgebra::{Matrix3, Point3, UnitQuaternion};

use super::*;
use crate::camera::UpAxis;

/// `R` of a camera at (3, -4, 1.6) that looks at (0, 0, 0.9), by cross products, and its t.
fn pose() -> ([[f64; 3]; 3], [f64; 3]) {
    let eye = Vector3::new(3.0, -4.0, 1.6);
    let forward = (Vector3::new(0.0, 0.0, 0.9) - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = [right, forward.cross(&right), forward];
    (axes.map(Into::into), axes.map(|axis| -axis.dot(&eye)))
}

const LENS: [f64; 5] = [-0.2, 0.05, 0.002, -0.001, 0.0];

fn expected() -> Camera {
    let (r, t) = pose();
    let k = [[600.0, 0.0, 310.5], [0.0, 610.0, 245.25], [0.0, 0.0, 1.0]];
    Camera::from_opencv("left", k, r, t, LENS, 640, 480).unwrap()
}

fn read(texts: &[&str], options: &CameraFile) -> Result<Vec<Camera>, String> {
    read_cameras(texts, CameraFileFormat::from_texts(texts).ok_or("unknown")?, options)
}

fn sized() -> CameraFile {
    CameraFile { size_px: Some([640, 480]), ..CameraFile::default() }
}

fn why(texts: &[&str]) -> String {
    read(texts, &sized()).unwrap_err()
}

fn assert_expected(found: &Camera, what: &str) {
    let known = expected();
    let difference = found.camera_from_world.to_homogeneous() - known.camera_from_world.to_homogeneous();
    assert!(difference.amax() < 1e-9, "{what}: {difference}");
    assert!((found.opencv_matrix()[0][2] - 310.5).abs() < 1e-9 && found.distortion == known.distortion, "{what}");
}

fn matrix(key: &str, rows: usize, numbers: &[f64]) -> String {
    format!(
        "{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {}\n   dt: d\n   data: {numbers:?}\n",
        numbers.len() / rows
    )
}

fn scaled(factor: f64) -> [f64; 3] {
    pose().1.map(|t| t * factor)
}

fn rvec() -> [f64; 3] {
    Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(pose().0.as_flattened())).scaled_axis().into()
}

fn k() -> [[f64; 3]; 3] {
    expected().opencv_matrix()
}

fn opencv() -> String {
    let (r, t) = pose();
    ["%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n".to_owned(), matrix("K", 3, k().as_flattened())].concat()
        + &matrix("D", 1, &LENS)
        + &matrix("R", 3, r.as_flattened())
        + &matrix("tvec", 3, &t)
}

fn toml(head: &str, tail: &str) -> String {
    let (k, t) = (k(), pose().1);
    format!("{head}\nsize = [640.0, 480]\nmatrix = {k:?}\ndistortions = {LENS:?}\ntranslation = {t:?}\n{tail}\n")
}

#[test]
fn each_program_has_the_same_camera() {
    let (r, t) = pose();
    let k = k();
    let easymocap = "names:\n  - \"left\"\n";
    let intri = format!("%YAML:1.0\r\n---\r\n{easymocap}")
        + &matrix("K_left", 3, k.as_flattened())
        + &matrix("dist_left", 1, &LENS);
    let extri = format!("%YAML:1.0\n---\n{easymocap}") + &matrix("R_left", 3, &rvec()) + &matrix("T_left", 3, &t);
    let with_matrix = extri.clone() + &matrix("Rot_left", 3, r.as_flattened());
    let jarvis = matrix("intrinsicMatrix", 3, transposed(k).as_flattened())
        + &matrix("distortionCoefficients", 1, &LENS)
        + &matrix("R", 3, transposed(r).as_flattened())
        + &matrix("T", 3, &scaled(1000.0));
    let anipose = toml("[cam_0]\nname = \"left\"", &format!("rotation = {:?}\n[metadata]\nadjusted = false", rvec()));
    let freemocap =
        anipose.replace(&format!("{t:?}"), &format!("{:?}", scaled(1000.0))) + "charuco_square_size = 51.0\n";
    let pairs = "\n[stereo_0_1]\nrotation = [0.1, 0.0, 0.0]\ntranslation = [1.0, 0.0, 0.0]\n";
    let with_pairs = anipose.clone() + pairs;
    let caliscope = toml(
        "[cameras.0]\ncam_id = 0\nignore = true\nsize = [64, 48]\n[cameras.3]\ncam_id = 3\nrotation_count = 1",
        &format!("rotation = {r:?}"),
    );
    let column = scaled(1000.0).map(|t| [t]);
    let human = format!(
        "{{\"intrinsics\": {{\"left\": {{\"calibration_matrix\": {k:?}, \"distortion\": {LENS:?}}}}}, \
        \"extrinsics\": {{\"S1\": {{\"left\": {{\"R\": {r:?}, \"t\": {column:?}}}}}}}}}"
    );
    let turn = UnitQuaternion::from_matrix(&Matrix3::from_row_slice(r.as_flattened()));
    let cameras = "# lenses\n7 OPENCV 640 480 600 610 311 245.75 -0.2 0.05 0.002 -0.001\n";
    let images = format!(
        "1 {} {} {} {} {} {} {} 7 left.png\n1.5 2.5 -1 3 4 -1\n",
        turn.w, turn.i, turn.j, turn.k, t[0], t[1], t[2]
    );
    for (what, texts) in [
        ("OpenCV", vec![&opencv()[..]]),
        ("EasyMocap", vec![&intri, &extri]),
        ("EasyMocap, matrices", vec![&with_matrix, &intri]),
        ("JARVIS", vec![&jarvis]),
        ("anipose", vec![&anipose]),
        ("FreeMoCap", vec![&freemocap]),
        ("Caliscope", vec![&caliscope]),
        ("Caliscope before 0.7", vec![&with_pairs]),
        ("Human3.6M", vec![&human]),
        ("COLMAP", vec![cameras, &images]),
        ("COLMAP, images first", vec![&images, cameras]),
    ] {
        let found = read(&texts, &sized()).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(found.len(), 1, "{what}");
        assert_expected(&found[0], what);
    }
    let beside = [
        (vec![&intri[..]], "extri.yml"),
        (vec![&extri], "intri.yml"),
        (vec![cameras], "images.txt"),
        (vec![&images], "cameras.txt"),
    ];
    for (texts, file) in beside {
        assert!(why(&texts).contains(file), "{}", why(&texts));
    }
    let two = human.replace("{\"S1\"", "{\"S5\": {}, \"S1\"");
    assert!(why(&[&two]).contains("`subject`: S5, S1"), "{}", why(&[&two]));
    let subject = CameraFile { subject: Some("S1".to_owned()), ..sized() };
    assert_expected(&read(&[&two], &subject).unwrap()[0], "S1");
    let of_subject = format!(
        "{{\"1\": {{\"R\": {r:?}, \"t\": {:?}, \"f\": [600.0, 610.0], \"c\": [310.5, 245.25]}}}}",
        scaled(1000.0)
    );
    assert!((read(&[&of_subject], &sized()).unwrap()[0].centre() - Point3::new(3.0, -4.0, 1.6)).norm() < 1e-9);
}

#[test]
fn stereo_pairs_need_the_place_of_the_first_camera() {
    let intrinsics =
        matrix("M1", 3, k().as_flattened()) + &matrix("D1", 1, &LENS) + &matrix("M2", 3, k().as_flattened());
    // the second camera is 0.3 m to the right of the first
    let extrinsics =
        matrix("R", 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]) + &matrix("T", 3, &[-0.3, 0.0, 0.0]);
    let refused = why(&[&intrinsics, &extrinsics]);
    assert!(refused.contains("stereo pair") && refused.contains("first_camera = {"), "{refused}");
    let first_camera = Some(FirstCamera { position_m: [3.0, -4.0, 1.6], look_at_m: [0.0, 0.0, 0.9] });
    let options = CameraFile { first_camera, ..sized() };
    let [left, right] = &read(&[&extrinsics, &intrinsics], &options).unwrap()[..] else { panic!() };
    assert_expected(left, "left");
    let right_axis = Vector3::from(pose().0[0]);
    assert!((right.centre() - (left.centre() + 0.3 * right_axis)).norm() < 1e-9, "{}", right.centre());
}

/// A key of another format was ignored.
#[test]
fn keys_of_other_formats_are_refused() {
    let cal = "584.1 583.2 320.5 240.25 0 0 0 0 0 0 1 0 0 0 0 -1 0 1 0 10 20 4500";
    let refused = |options: CameraFile| read(&[cal], &options).unwrap_err();
    assert!(refused(CameraFile { view: Some(1), ..sized() }).contains("view: only valid"));
    assert!(refused(CameraFile { subject: Some("S1".to_owned()), ..sized() }).contains("subject: only valid"));
}

#[test]
fn colmaps_images_become_cameras() {
    let pinhole = "1 SIMPLE_RADIAL 640 480 600 320 240 -0.1\n2 RADIAL 640 480 600 320 240 -0.1 0.2\n";
    let names = |lenses: &str, images: &str, view: Option<usize>| {
        let found = read(&[lenses, images], &CameraFile { view, ..CameraFile::default() });
        found.map(|cameras| cameras.into_iter().map(|camera| camera.name).collect::<Vec<_>>())
    };
    // a folder a camera, two images of each at one place; blank lines for points
    let still =
        "1 1 0 0 0 0 0 3 1 left/000 a.png\n\n2 1 0 0 0 0 0 3 1 left/001.png\n\n3 1 0 0 0 1 0 3 2 right/000.png\n\n";
    assert_eq!(names(pinhole, still, None).unwrap(), ["left", "right"]);
    let moving = still.replace("2 1 0 0 0 0 0 3", "2 1 0 0 0 2 0 3");
    let refused = names(pinhole, &moving, None).unwrap_err();
    assert!(refused.contains("\"left\" moves") && refused.contains("`view`"), "{refused}");
    let alone = moving.replace("3 1 0 0 0 1 0 3 2 right/000.png\n\n", "");
    assert_eq!(names(pinhole, &alone, None).unwrap(), ["000 a", "001"]);
    // one lens, three places, no lines of points
    let shared = "1 1 0 0 0 0 0 3 1 a.png\n2 1 0 0 0 2 0 3 1 b.png\n3 1 0 0 0 4 0 3 1 c.png\n";
    assert_eq!(names(pinhole, shared, None).unwrap(), ["a", "b", "c"]);
    assert_eq!(names(pinhole, shared, Some(1)).unwrap(), ["b"]);
    let fisheye = "1 OPENCV_FISHEYE 640 480 600 600 320 240 0.1 0.1 0 0\n";
    assert!(names(fisheye, shared, None).unwrap_err().starts_with("line 1: OPENCV_FISHEYE: the lens"));
    assert!(names("1 PINHOLE 640 480 600 320\n", shared, None).unwrap_err().contains("PINHOLE: expected 4 PARAMS"));
    let rational = "1 FULL_OPENCV 640 480 600 600 320 240 0.1 0.1 0 0 0 0.2 0 0\n";
    assert!(names(rational, shared, None).unwrap_err().contains("a lens of 8 coefficients"));
}

#[test]
fn tables_of_toml_are_refused_with_their_line_and_key() {
    let whole = toml("[a]\nname = \"a\"", "rotation = [0, 0, 0]");
    for (from, to, said) in [
        ("matrix", "# matrix", "line 1: camera \"a\": matrix is missing"),
        ("rotation = [0, 0, 0]", "rotation = \"null\"", "ignore = true"),
        ("rotation = [0, 0, 0]", "fisheye = true", "fisheye = true: the lens is a fisheye"),
        ("480]", "480.5]", "size: expected whole numbers"),
        ("rotation = [0, 0, 0]", "rotation = [0, nan, 0]", "rotation: expected [9, 3] numbers"),
        ("rotation = [0, 0, 0]", "rotation = [[1, 0, 0], [0, 2, 0], [0, 0, 1]]", "R is not a rotation"),
        ("translation = [", "translation = [1e19, ", "translation: expected [3] numbers, found 4"),
        ("[a]", "[a", "not TOML"),
    ] {
        let refused = why(&[&whole.replace(from, to)]);
        assert!(refused.contains(said), "{from} {to}: {refused}");
    }
    // in the order of the file, and by the names of Caliscope
    let two = [10, 2].map(|id| toml(&format!("[cameras.{id}]\nport = {id}"), "rotation = [0, 0, 0]")).concat();
    let names: Vec<String> = read(&[&two], &sized()).unwrap().into_iter().map(|camera| camera.name).collect();
    assert_eq!(names, ["port_10", "port_2"]);
}

// "duplicate field `T`", for a file that has both
#[test]
fn translations_given_twice_must_agree() {
    let (t, off) = (pose().1, scaled(2.0));
    assert_expected(&read(&[&(opencv() + &matrix("T", 3, &t))], &sized()).unwrap()[0], "T and tvec");
    assert_eq!(why(&[&(opencv() + &matrix("T", 3, &off))]), "T and tvec are different: remove the wrong one");
}

#[test]
fn a_world_with_y_up_is_converted() {
    let text = "fx 1";
    assert!(read_cameras(&[text], CameraFileFormat::HumanEva, &CameraFile::default()).is_err());
    // looks along -z of a world with y up
    let cal = "500 500 319.5 239.5 0 0 0 0 0 0 1 0 0 0 -1 0 0 0 -1 0 0 0";
    let options = CameraFile { up: Some(UpAxis::Y), ..sized() };
    let [camera] = &read_cameras(&[cal], CameraFileFormat::HumanEva, &options).unwrap()[..] else { panic!() };
    // its up is the world's Z, its view the world's +Y
    let up = camera.camera_from_world.inverse_transform_vector(&-Vector3::y());
    let view = camera.camera_from_world.inverse_transform_vector(&Vector3::z());
    assert!((up - Vector3::z()).norm() < 1e-12 && (view - Vector3::y()).norm() < 1e-12, "{up} {view}");
    assert!(camera.sees(&Point3::new(0.0, 3.0, 0.5)));
}

#[test]
fn the_size_is_required_and_must_not_contradict_the_file() {
    let cal = "500 500 319.5 239.5 0 0 0 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0";
    let read = |options: &CameraFile| read_cameras(&[cal], CameraFileFormat::HumanEva, options);
    assert!(read(&CameraFile::default()).unwrap_err().contains("size_px"));
    let yaml = super::opencv_yaml::tests::SAMPLE;
    let options = CameraFile { size_px: Some([3, 4]), ..CameraFile::default() };
    let refused = read_cameras(&[yaml], CameraFileFormat::OpenCv, &options).unwrap_err();
    assert!(refused.contains("[640, 480]") && refused.contains("remove this key"), "{refused}");
}

// k3 = 1e19 of a file passed check, render and verify, while [[rig.camera]] refused it
#[test]
fn absurd_numbers_of_a_file_are_refused() {
    for (numbers, what) in [
        ("500 500 319.5 239.5 0 0 0 0 0 1e19 1 0 0 0 1 0 0 0 1 0 0 0", "distortion contains 1e19"),
        ("500 1e9 319.5 239.5 0 0 0 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0", "focal length, principal point or near plane"),
        ("500 500 319.5 239.5 0 0 0 0 0 0 1 0 0 0 1 0 0 0 1 0 0 1e9", "t, in metres, contains 1000000.0"),
    ] {
        let refused = read_cameras(&[numbers], CameraFileFormat::HumanEva, &sized()).unwrap_err();
        assert!(refused.contains(what) && refused.contains("of at most 10000"), "{refused}");
    }
}

#[test]
fn formats_are_recognised_by_file_names() {
    let of = CameraFileFormat::from_name;
    assert_eq!(of("a/left.YML"), Some(CameraFileFormat::OpenCv));
    assert_eq!(of("C1.cal"), Some(CameraFileFormat::HumanEva));
    assert_eq!((of("Calib.qca.txt"), of("notes.txt")), (Some(CameraFileFormat::Qualisys), None));
}
