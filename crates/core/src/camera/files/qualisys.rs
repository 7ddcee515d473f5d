//! Qualisys' calibration in XML: all cameras of a system, intrinsics in units of 1/64 pixel, positions in millimetres.
//!
//! `r11` to `r33`, row by row, rotate the world into camera axes with y up and z backward; `x y z` is the camera
//! centre. Both are converted to OpenCV's convention.

use nalgebra::{Matrix3, Vector3};
use roxmltree::{Document, Node};

use super::{MOST_CAMERAS, PlainCamera};
use crate::input::{excerpt, unquoted};

/// Units of intrinsics per pixel.
const PARTS: f64 = 64.0;

pub(super) fn read(text: &str) -> Result<Vec<PlainCamera>, String> {
    let document = Document::parse(text).map_err(|e| format!("not XML: {}", unquoted(e)))?;
    let cameras: Vec<Node<'_, '_>> =
        document.descendants().filter(|node| node.has_tag_name("camera")).take(MOST_CAMERAS + 1).collect();
    if !(1..=MOST_CAMERAS).contains(&cameras.len()) {
        return Err(format!("expected 1 to {MOST_CAMERAS} <camera>s below <cameras>, found {}", cameras.len()));
    }
    cameras.into_iter().map(camera).collect()
}

fn camera(node: Node<'_, '_>) -> Result<PlainCamera, String> {
    let line = node.document().text_pos_at(node.range().start).row;
    let name = node.attribute("serial").unwrap_or("camera").to_owned();
    let of = |error: String| format!("line {line}: camera {:?}: {error}", excerpt(&name));
    if node.attribute("viewrotation").is_some_and(|turn| turn != "0") {
        return Err(of("viewrotation is not 0; rotate the images and calibrate again".to_owned()));
    }
    let child = |tag: &str| {
        node.children().find(|child| child.has_tag_name(tag)).ok_or_else(|| of(format!("<{tag}> is missing")))
    };
    let (transform, intrinsic, view) = (child("transform")?, child("intrinsic")?, child("fov_video")?);
    let number = |node: Node<'_, '_>, key: &str| {
        let text = node.attribute(key).ok_or_else(|| of(format!("{key} is missing")))?;
        let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| of(format!("{key}: expected a number, found {:?}", excerpt(text))))
    };
    let pixels = |key: &str| Ok::<f64, String>(number(intrinsic, key)? / PARTS);
    if intrinsic.has_attribute("skew") && number(intrinsic, "skew")? != 0.0 {
        return Err(of("skew is not 0; only cameras without skew are supported".to_owned()));
    }
    let (fx, fy) = (pixels("focalLengthU")?, pixels("focalLengthV")?);
    let (cx, cy) = (pixels("centerPointU")?, pixels("centerPointV")?);
    let lens =
        ["radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2", "radialDistortion3"];
    let mut distortion = [0.0; 5];
    for (coefficient, key) in distortion.iter_mut().zip(lens) {
        *coefficient = number(intrinsic, key)?;
    }
    let mut r = Matrix3::zeros();
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        r[(row, column)] = number(transform, &format!("r{}{}", row + 1, column + 1))?;
    }
    let centre = Vector3::new(number(transform, "x")?, number(transform, "y")?, number(transform, "z")?);
    let r = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)) * r;
    let size = |low: &str, high: &str| {
        let size = number(view, high)? - number(view, low)? + 1.0;
        if (1.0..=f64::from(crate::camera::MAX_IMAGE_SIZE)).contains(&size) {
            Ok(size as u32)
        } else {
            Err(of(format!("fov_video: {low} to {high} are {size} pixels")))
        }
    };
    Ok(PlainCamera {
        size: Some([size("left", "right")?, size("top", "bottom")?]),
        name: Some(name.clone()),
        k: [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]],
        distortion,
        r: r.transpose().into(),
        t: (-(r * centre)).into(),
        metres_per_unit: 0.001,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::files::{CameraFile, CameraFileFormat, read_cameras};
    use crate::test_data;
    use nalgebra::Point3;

    #[test]
    fn the_four_cameras_of_a_real_calibration_look_at_one_place() {
        let Some(path) = test_data::path("cameras/pose2sim_Calib.qca.txt") else { return };
        let text = crate::input::read_to_string(&path, 1 << 20).unwrap();
        let cameras = read_cameras(&[&text], CameraFileFormat::Qualisys, &CameraFile::default()).unwrap();
        assert_eq!(cameras.len(), 4);
        // the point nearest to all optical axes
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for camera in &cameras {
            let view = camera.camera_from_world.inverse_transform_vector(&Vector3::z());
            let across = Matrix3::identity() - view * view.transpose();
            a += across;
            b += across * camera.centre().coords;
        }
        let middle = Point3::from(a.try_inverse().unwrap() * b);
        assert!((0.3..1.6).contains(&middle.z) && middle.coords.xy().norm() < 2.0, "{middle}");
        for camera in &cameras {
            assert!(camera.sees(&middle), "{}", camera.name);
            assert!((camera.pinhole.focal[0] - 1681.0).abs() < 30.0, "{:?}", camera.pinhole);
            assert!((0.5..3.5).contains(&camera.centre().z), "{}", camera.centre());
            let up = camera.camera_from_world.transform_vector(&Vector3::z());
            assert!(up.y < -0.7, "up is upward in the image of {}: {up}", camera.name);
        }
    }

    const CAMERA: &str = r#"<camera serial="7" viewrotation="0"><fov_video left="0" right="639" top="0" bottom="479"/>
        <transform r11="1" r12="0" r13="0" r21="0" r22="0" r23="1" r31="0" r32="-1" r33="0" x="0" y="-4000" z="1000"/>
        <intrinsic focalLengthU="38400" focalLengthV="38400" centerPointU="20448" centerPointV="15328" skew="0"
        radialDistortion1="0.1" radialDistortion2="0.2" radialDistortion3="0.5" tangentalDistortion1="0.3"
        tangentalDistortion2="0.4"/></camera>"#;

    #[test]
    fn axes_are_converted_and_64ths_of_pixels_become_pixels() {
        let [camera] = &read(&format!("<calibration><cameras>{CAMERA}</cameras></calibration>")).unwrap()[..] else {
            panic!()
        };
        assert_eq!(camera.k, [[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]]);
        assert_eq!((camera.size, camera.distortion), (Some([640, 480]), [0.1, 0.2, 0.3, 0.4, 0.5]));
        // at y = -4 m, looking along +y, with z up in the image
        assert_eq!(camera.r, [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]);
        assert_eq!(camera.t, [0.0, 1000.0, 4000.0]);
    }

    #[test]
    fn missing_and_unsupported_items_are_reported_with_their_line() {
        let why = |text: &str| read(text).err().unwrap();
        assert!(why("<calibration/>").contains("found 0"));
        assert!(why("no").contains("not XML"));
        let twisted = CAMERA.replace("viewrotation=\"0\"", "viewrotation=\"90\"");
        assert!(why(&twisted).contains("line 1: camera \"7\": viewrotation"));
        assert!(why(&CAMERA.replace("r22=\"0\"", "r22=\"x\"")).contains("r22: expected a number, found \"x\""));
        assert!(why(&CAMERA.replace("focalLengthV=\"38400\"", "")).contains("focalLengthV is missing"));
        assert!(why(&CAMERA.replace("right=\"639\"", "right=\"1e9\"")).contains("fov_video"));
    }
}
