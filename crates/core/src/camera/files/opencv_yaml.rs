//! Cameras in the YAML of OpenCV's `FileStorage`: of OpenCV and most other programs (`camera_matrix`,
//! `distortion_coefficients`, and `R` with `T`, or `rvec` with `tvec`, or a row of `extrinsic_parameters`), of JARVIS
//! (matrices in MATLAB's layout), of EasyMocap (keys that end in the camera's name), and of `stereo_calib`.

use serde_json::{Map, Value};

use super::storage::{Names, Storage, matrix_of};
use super::{CameraFile, PlainCamera, transposed};
use crate::input::{excerpt, plain};

const NAMES: Names<'_> = Names {
    matrix: &["camera_matrix", "K", "cameraMatrix", "Camera_Matrix", "intrinsicMatrix"],
    lens: &[
        "distortion_coefficients",
        "D",
        "distCoeffs",
        "dist_coeffs",
        "Distortion_Coefficients",
        "distortionCoefficients",
    ],
    rotation: &["R", "r", "rvec"],
    translation: &["T", "t", "tvec"],
    size: [&["image_width", "width"], &["image_height", "height"]],
};
/// Names of OpenCV's lens model in other programs.
const OPENCV_LENSES: [&str; 3] = ["plumb_bob", "radtan", "opencv"];

fn is_fisheye(word: &str) -> bool {
    ["fisheye", "equidistant", "kannala"].iter().any(|name| word.to_lowercase().contains(name))
}

/// One camera, of a file or of two.
pub(super) fn read(texts: &[&str], options: &CameraFile, metres_per_unit: f64) -> Result<PlainCamera, String> {
    let mut storage = Storage::read(texts)?;
    for (key, value) in &storage.0 {
        let is_other = match value {
            Value::String(model) if key == "distortion_model" => !OPENCV_LENSES.contains(&&model[..]),
            Value::String(model) => key.contains("model") && is_fisheye(model),
            Value::Number(number) => number.as_f64() != Some(0.0) && is_fisheye(key),
            other => *other != Value::Bool(false) && is_fisheye(key),
        };
        if is_other {
            return Err(super::other_lens(&excerpt(key)));
        }
    }
    let has_pose = storage.entry(NAMES.rotation).is_some() && storage.entry(NAMES.translation).is_some();
    match storage.entry(&["extrinsic_parameters"]).filter(|_| !has_pose) {
        Some(all) => {
            let (rvec, tvec) = of_view(all, options.view)?;
            storage.0.retain(|key, _| !NAMES.rotation.contains(&&key[..]) && !NAMES.translation.contains(&&key[..]));
            storage.0.extend(Map::from_iter([("rvec".to_owned(), rvec), ("tvec".to_owned(), tvec)]));
        }
        None if !has_pose && storage.entry(NAMES.matrix).is_some() => {
            return Err("the file has K but no pose; add R and T, or rvec and tvec".to_owned());
        }
        None => {}
    }
    let mut camera = storage.camera(NAMES, metres_per_unit)?;
    // row vectors, as MATLAB has them: the principal point is below, and a matrix R is transposed too
    if let [[_, _, 0.0], [_, _, 0.0], [x, y, 1.0]] = camera.k
        && (x != 0.0 || y != 0.0)
    {
        camera.k = transposed(camera.k);
        if storage.entry(&["R", "r"]).is_some() {
            camera.r = transposed(camera.r);
        }
    }
    camera.name = match storage.entry(&["name", "camera_name"]) {
        Some(Value::String(name)) => Some(name.clone()),
        Some(Value::Number(name)) => Some(name.to_string()),
        _ => None,
    };
    Ok(camera)
}

/// The cameras of EasyMocap's `intri.yml` (`K_NAME`, `dist_NAME`) and `extri.yml` (`R_NAME`, `Rot_NAME`, `T_NAME`).
pub(super) fn read_easymocap(texts: &[&str]) -> Result<Vec<PlainCamera>, String> {
    let storage = Storage::read(texts)?;
    let listed = storage.entry(&["names"]).and_then(Value::as_array);
    let listed: Option<Vec<&str>> = listed.and_then(|names| names.iter().map(Value::as_str).collect());
    // names that are not in quotes are numbers, which have lost their leading zeros
    let names = listed.unwrap_or_else(|| storage.0.keys().filter_map(|key| key.strip_prefix("K_")).collect());
    let mut cameras = Vec::new();
    for name in names.into_iter().take(super::MOST_CAMERAS + 1) {
        let key = |start: &str| format!("{start}_{name}");
        let camera = storage.camera(
            Names {
                matrix: &[&key("K")],
                lens: &[&key("dist"), &key("D")],
                rotation: &[&key("Rot"), &key("R")],
                translation: &[&key("T")],
                size: [&[&key("W")], &[&key("H")]],
            },
            1.0,
        );
        // names may be as long as the file
        let camera =
            camera.map_err(|e| plain(format!("{e}; K is in intri.yml, R and T are in extri.yml beside it")))?;
        cameras.push(PlainCamera { name: Some(name.to_owned()), ..camera });
    }
    Ok(cameras)
}

/// The pair of files of OpenCV's `stereo_calib`: `M1 D1 M2 D2`, and `R` and `T` from the first camera to the second.
pub(super) fn read_stereo(texts: &[&str], options: &CameraFile) -> Result<Vec<PlainCamera>, String> {
    let storage = Storage::read(texts)?;
    let of = |matrix: &str, lens: &str, name: &str| {
        let camera = storage.camera(Names { matrix: &[matrix], lens: &[lens], ..NAMES }, 1.0);
        let camera =
            camera.map_err(|e| format!("{e}; M1 is in intrinsics.yml, R and T are in extrinsics.yml beside it"))?;
        Ok::<_, String>(PlainCamera { name: Some(name.to_owned()), ..camera })
    };
    let (left, right) = (of("M1", "D1", "left")?, of("M2", "D2", "right")?);
    if options.first_camera.is_none() {
        return Err(
            "M1 D1 M2 D2 R T of a stereo pair tell where the second camera is relative to the first, not where \
                    the first is in the world; say that, for example first_camera = { position_m = [0.0, -4.0, 1.5], \
                    look_at_m = [0.0, 0.0, 1.0] }"
                .to_owned(),
        );
    }
    let facing = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Ok(vec![PlainCamera { r: facing, t: [0.0; 3], ..left }, right])
}

/// Rotation and translation of a row of `extrinsic_parameters`.
fn of_view(all: &Value, view: Option<usize>) -> Result<(Value, Value), String> {
    let matrix =
        matrix_of(all).filter(|(rows, cols, data)| *cols == 6 && rows.checked_mul(6) == Some(data.len() as u64));
    let Some((count, _, data)) = matrix else {
        return Err("extrinsic_parameters: expected a matrix with rows of 6 numbers".to_owned());
    };
    let Some(view) = view else {
        return Err(format!("the file has {count} views in extrinsic_parameters; select one by `view`, from 0"));
    };
    let row = data.chunks_exact(6).nth(view);
    let row = row.ok_or_else(|| format!("view: expected 0 to {}, found {view}", count.saturating_sub(1)))?;
    Ok((row[..3].into(), row[3..].into()))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::test_data;

    pub(crate) const SAMPLE: &str = "%YAML:1.0\n---\nname: \"left\"\nimage_width: 640\nimage_height: 480\n\
        camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 600., 0., 319.5, 0.,\n       \
        610., 239.5, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   \
        data: [ -2.5e-01, 0.1, 1.0e-03, 0., 0. ]\nR: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1, 0, 0, \
        0, 0, -1, 0, 1, 0 ]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0.5, 1., 4. ]\n";

    fn one(text: &str, options: &CameraFile) -> Result<PlainCamera, String> {
        read(&[text], options, 1.0)
    }

    fn why(text: &str) -> String {
        one(text, &CameraFile::default()).err().unwrap()
    }

    #[test]
    fn opencvs_own_layout_is_read() {
        let camera = one(SAMPLE, &CameraFile::default()).unwrap();
        assert_eq!((camera.name.as_deref(), camera.size), (Some("left"), Some([640, 480])));
        assert_eq!(camera.k, [[600.0, 0.0, 319.5], [0.0, 610.0, 239.5], [0.0, 0.0, 1.0]]);
        assert_eq!((camera.distortion, camera.t), ([-0.25, 0.1, 0.001, 0.0, 0.0], [0.5, 1.0, 4.0]));
        assert_eq!(camera.r[1], [0.0, 0.0, -1.0]);
    }

    #[test]
    fn other_lenses_and_missing_numbers_are_refused_with_their_key() {
        assert!(why(&SAMPLE.replace("T: !!", "U: !!")).contains("R and T"));
        assert!(why(&SAMPLE.replace("camera_matrix", "matrix")).contains("camera_matrix is missing"));
        for words in
            ["fisheye_model: 1", "distortion_model: equidistant", "camera_model: \"Kannala-Brandt\"", "fisheye: true"]
        {
            assert!(why(&format!("{SAMPLE}{words}\n")).contains("the lens is a fisheye"), "{words}");
        }
        assert!(why(&SAMPLE.replace("0.5, 1., 4.", "0.5, 1.")).contains("T: expected [3] numbers, found 2"));
        let wide = SAMPLE.replace("rows: 5", "rows: 8").replace("0., 0. ]\nR", "0., 0., 0.1, 0., 0. ]\nR");
        assert!(why(&wide).contains("a lens of 8 coefficients"));
        assert!(why("camera_matrix: [").contains("not YAML"));
    }

    /// A matrix and a vector of different rotations were accepted, and the matrix was used.
    #[test]
    fn two_rotations_that_disagree_are_refused() {
        let rvec = |x: f64| format!("{SAMPLE}rvec: !!opencv-matrix\n  rows: 3\n  cols: 1\n  data: [ {x}, 0, 0 ]\n");
        assert!(why(&rvec(-1.5)).contains("R and rvec are different"), "{}", why(&rvec(-1.5)));
        assert!(one(&rvec(1.571), &CameraFile::default()).is_ok(), "90 degrees in four digits");
    }

    /// A rotation vector in degrees turned the camera by any number of turns, and it was used.
    #[test]
    fn rotation_vectors_in_degrees_are_refused() {
        let (before, after) = SAMPLE.split_once("R:").unwrap();
        let rest = after.split_once("T:").unwrap().1;
        let rvec =
            |x: f64| format!("{before}rvec: !!opencv-matrix\n  rows: 3\n  cols: 1\n  data: [ {x}, 0, 0 ]\nT:{rest}");
        assert!(one(&rvec(1.5), &CameraFile::default()).is_ok());
        assert!(why(&rvec(93.5)).contains("seems to be in degrees"), "{}", why(&rvec(93.5)));
    }

    #[test]
    fn an_endlessly_expanding_document_is_refused() {
        let mut bomb = String::from("a: &a [x, x, x, x, x, x, x, x, x, x]\n");
        for i in 0..12 {
            let (from, to) = ((b'a' + i) as char, (b'b' + i) as char);
            bomb += &format!("{to}: &{to} [*{from}, *{from}, *{from}, *{from}, *{from}, *{from}, *{from}, *{from}]\n");
        }
        assert!(!why(&bomb).is_empty());
    }

    #[test]
    fn one_view_of_opencvs_sample_calibration_is_read() {
        let Some(path) = test_data::path("cameras/opencv/left_intrinsics.yml") else { return };
        let text = crate::input::read_to_string(&path, 1 << 20).unwrap();
        assert!(why(&text).contains("13 views"));
        let camera = one(&text, &CameraFile { view: Some(0), ..CameraFile::default() }).unwrap();
        assert_eq!((camera.size, camera.k[0][0]), (Some([640, 480]), 535.915_733_961_632));
        assert_eq!(camera.distortion[4], 0.23839153080878486);
        assert_eq!(camera.t, [-0.07521791126691821, -0.10895943925991841, 0.399_702_069_499_072_7]);
        let beyond = CameraFile { view: Some(13), ..CameraFile::default() };
        assert!(one(&text, &beyond).err().unwrap().contains("view: expected 0 to 12"));
    }
}
