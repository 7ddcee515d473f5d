//! OpenCV's `FileStorage` in YAML: `camera_matrix`, `distortion_coefficients`, and `R` with `T`, or `rvec` with `tvec`,
//! or a row of `extrinsic_parameters`.

use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;

use super::{CameraFileOptions, PlainCamera, rows, rows_of};
use crate::input::foreign;

/// A `!!opencv-matrix`.
#[derive(Deserialize)]
struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

/// The keys written by OpenCV's calibration program and most others; other keys are ignored.
#[derive(Deserialize)]
struct Storage {
    name: Option<String>,
    #[serde(alias = "width")]
    image_width: Option<u32>,
    #[serde(alias = "height")]
    image_height: Option<u32>,
    #[serde(alias = "K", alias = "cameraMatrix", alias = "Camera_Matrix")]
    camera_matrix: Option<Matrix>,
    #[serde(alias = "D", alias = "distCoeffs", alias = "dist_coeffs", alias = "Distortion_Coefficients")]
    distortion_coefficients: Option<Matrix>,
    #[serde(alias = "r")]
    #[serde(rename = "R")]
    rotation: Option<Matrix>,
    #[serde(rename = "T", alias = "t", alias = "tvec")]
    translation: Option<Matrix>,
    rvec: Option<Matrix>,
    extrinsic_parameters: Option<Matrix>,
    fisheye_model: Option<u32>,
    distortion_model: Option<String>,
}

impl Matrix {
    /// The numbers, if their count is one of these.
    fn numbers(&self, key: &str, counts: &[usize]) -> Result<&[f64], String> {
        let whole = self.rows.checked_mul(self.cols) == Some(self.data.len());
        if whole && counts.contains(&self.data.len()) {
            Ok(&self.data)
        } else {
            Err(format!(
                "{key}: expected {counts:?} numbers, found {} in {} rows and {} columns",
                self.data.len(),
                self.rows,
                self.cols
            ))
        }
    }

    fn exactly<const N: usize>(&self, key: &str) -> Result<[f64; N], String> {
        let numbers = self.numbers(key, &[N])?;
        Ok(std::array::from_fn(|i| numbers.get(i).copied().unwrap_or_default()))
    }
}

pub(super) fn read(text: &str, options: &CameraFileOptions) -> Result<PlainCamera, String> {
    // OpenCV writes its directive with a colon, which is not valid YAML
    let rest = text.trim_start_matches('\u{feff}').trim_start();
    let body = match rest.strip_prefix("%YAML") {
        Some(after) => after.split_once('\n').map_or("", |(_, body)| body),
        None => rest,
    };
    let storage: Storage =
        serde_saphyr::from_str(body).map_err(|e| format!("not YAML of OpenCV: {}", parser_message(body, &e)))?;
    if storage.fisheye_model.is_some_and(|model| model != 0)
        || storage.distortion_model.as_deref().is_some_and(|model| !["plumb_bob", "radtan", "opencv"].contains(&model))
    {
        return Err("the lens is a fisheye or of another model; only OpenCV's k1 k2 p1 p2 k3 are supported".to_owned());
    }
    let missing = |key: &str| format!("{key} is missing");
    let k = storage.camera_matrix.ok_or_else(|| missing("camera_matrix"))?.exactly("camera_matrix")?;
    let distortion = storage.distortion_coefficients.map_or(Ok([0.0; 5]), |matrix| coefficients(&matrix))?;
    let (r, t) = match (storage.rotation, storage.rvec, storage.translation, storage.extrinsic_parameters) {
        (Some(r), _, Some(t), _) if r.data.len() == 9 => (rows(&r.exactly("R")?), t.exactly("T")?),
        (Some(r), _, Some(t), _) | (None, Some(r), Some(t), _) => (turned(r.exactly("rvec")?), t.exactly("T")?),
        (_, _, _, Some(all)) => of_view(&all, options.view)?,
        _ => return Err("the file has K but no pose; add R and T, or rvec and tvec".to_owned()),
    };
    let size = storage.image_width.zip(storage.image_height).map(|(width, height)| [width, height]);
    Ok(PlainCamera { name: storage.name, size, k: rows(&k), distortion, r, t })
}

/// The parser's message; only the line number for a file without OpenCV matrices, which is not quoted.
fn parser_message(body: &str, error: &serde_saphyr::Error) -> String {
    if body.contains("!!opencv-matrix") {
        foreign(error)
    } else {
        error.location().map_or_else(String::new, |at| format!("line {}", at.line()))
    }
}

/// k1 k2 p1 p2 k3 of 4, 5, 8, 12 or 14 coefficients; those beyond the fifth must be 0.
fn coefficients(matrix: &Matrix) -> Result<[f64; 5], String> {
    let numbers = matrix.numbers("distortion_coefficients", &[4, 5, 8, 12, 14])?;
    if numbers.iter().skip(5).any(|number| *number != 0.0) {
        let count = numbers.len();
        return Err(format!(
            "distortion_coefficients: a lens of {count} coefficients; only k1 k2 p1 p2 k3 are supported"
        ));
    }
    Ok(std::array::from_fn(|i| numbers.get(i).copied().unwrap_or_default()))
}

fn turned(rvec: [f64; 3]) -> [[f64; 3]; 3] {
    rows_of(Rotation3::from_scaled_axis(Vector3::from(rvec)).matrix())
}

/// Rotation and translation of a row of `extrinsic_parameters`.
fn of_view(all: &Matrix, view: Option<usize>) -> Result<([[f64; 3]; 3], [f64; 3]), String> {
    let count = all.data.len() / 6;
    if all.cols != 6 || all.rows.checked_mul(6) != Some(all.data.len()) {
        return Err(format!("extrinsic_parameters: expected rows of 6 numbers, found {} x {}", all.rows, all.cols));
    }
    let Some(view) = view else {
        return Err(format!("the file has {count} views in extrinsic_parameters; select one by `view`, from 0"));
    };
    let row = all.data.chunks_exact(6).nth(view);
    let row = row.ok_or_else(|| format!("view: expected 0 to {}, found {view}", count.saturating_sub(1)))?;
    Ok((turned([row[0], row[1], row[2]]), [row[3], row[4], row[5]]))
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

    fn why(text: &str) -> String {
        read(text, &CameraFileOptions::default()).err().unwrap()
    }

    #[test]
    fn opencvs_own_layout_is_read() {
        let camera = read(SAMPLE, &CameraFileOptions::default()).unwrap();
        assert_eq!((camera.name.as_deref(), camera.size), (Some("left"), Some([640, 480])));
        assert_eq!(camera.k, [[600.0, 0.0, 319.5], [0.0, 610.0, 239.5], [0.0, 0.0, 1.0]]);
        assert_eq!((camera.distortion, camera.t), ([-0.25, 0.1, 0.001, 0.0, 0.0], [0.5, 1.0, 4.0]));
        assert_eq!(camera.r[1], [0.0, 0.0, -1.0]);
    }

    #[test]
    fn other_lenses_and_missing_numbers_are_refused_with_their_key() {
        assert!(why(&SAMPLE.replace("T: !!", "U: !!")).contains("R and T"));
        assert!(why(&SAMPLE.replace("camera_matrix", "matrix")).contains("camera_matrix is missing"));
        assert!(why(&format!("{SAMPLE}fisheye_model: 1\n")).contains("fisheye"));
        assert!(why(&SAMPLE.replace("0.5, 1., 4.", "0.5, 1.")).contains("T: expected [3] numbers, found 2"));
        let wide = SAMPLE.replace("rows: 5", "rows: 8").replace("0., 0. ]\nR", "0., 0., 0.1, 0., 0. ]\nR");
        assert!(why(&wide).contains("a lens of 8 coefficients"));
        assert!(why("camera_matrix: [").contains("not YAML"));
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
        let camera = read(&text, &CameraFileOptions { view: Some(0), ..CameraFileOptions::default() }).unwrap();
        assert_eq!((camera.size, camera.k[0][0]), (Some([640, 480]), 535.915_733_961_632));
        assert_eq!(camera.distortion[4], 0.23839153080878486);
        assert_eq!(camera.t, [-0.07521791126691821, -0.10895943925991841, 0.399_702_069_499_072_7]);
        let beyond = CameraFileOptions { view: Some(13), ..CameraFileOptions::default() };
        assert!(read(&text, &beyond).err().unwrap().contains("view: expected 0 to 12"));
    }
}
