//! COLMAP's text model: `cameras.txt` (lenses) and `images.txt` (poses, two lines an image).
//!
//! A camera here is a folder of images, if their names have several folders; else a lens with its images, or each image
//! of a lens whose images were taken from several places. Pixel (0, 0) is the outer corner of the top-left pixel.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};

use super::{CameraFile, MOST_CAMERAS, PlainCamera};
use crate::input::excerpt;

/// Images nearer than this share of the greatest distance of a camera from the origin, and turned by less radians, are
/// of one place;
const SAME_PLACE: f64 = 0.01;
/// nearer than this they are the same to the digits of the file.
const SAME_DIGITS: f64 = 1e-6;

const MOST_IMAGES: usize = 100_000;

/// Lenses that a camera can have, with their numbers of focal lengths and of OpenCV's coefficients.
const LENSES: [(&str, usize, usize); 6] = [
    ("SIMPLE_PINHOLE", 1, 0),
    ("PINHOLE", 2, 0),
    ("SIMPLE_RADIAL", 1, 1),
    ("RADIAL", 1, 2),
    ("OPENCV", 2, 4),
    ("FULL_OPENCV", 2, 8),
];

struct Image<'a> {
    lens: u64,
    name: &'a str,
    camera_from_world: Isometry3<f64>,
}

/// Whether a line is one of `cameras.txt` or `images.txt`.
pub(super) fn is_line(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let is_number = |word: &&str| word.parse::<f64>().is_ok();
    let is_model = |word: &&str| word.chars().all(|c| c.is_ascii_uppercase() || c == '_');
    match &words[..] {
        [id, model, size @ ..] if is_model(model) => size.len() > 2 && is_number(id) && size.iter().all(is_number),
        _ => words.len() > 9 && words[..9].iter().all(is_number) && !words.iter().all(is_number),
    }
}

pub(super) fn read(texts: &[&str], options: &CameraFile) -> Result<Vec<PlainCamera>, String> {
    let (mut lenses, mut images) = (Vec::new(), Vec::new());
    for text in texts {
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.starts_with('#')).peekable();
        while let Some((index, line)) = lines.next() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let of = |error: String| format!("line {}: {error}", index + 1);
            match words.get(1).map(|word| word.parse::<f64>().is_ok()) {
                None => {}
                Some(false) => lenses.push(lens(&words).map_err(of)?),
                Some(true) => {
                    images.push(image(line, &words).map_err(of)?);
                    // the image's points, which some programs leave out
                    // ten numbers are an image with a number as its name: points have three each
                    lines.next_if(|(_, line)| !is_line(line) && line.split_whitespace().count() != 10);
                }
            }
            if lenses.len() > MOST_CAMERAS || images.len() > MOST_IMAGES {
                return Err(of(format!("expected at most {MOST_CAMERAS} cameras and {MOST_IMAGES} images")));
            }
        }
    }
    if lenses.is_empty() || images.is_empty() {
        let missing = if lenses.is_empty() { "cameras.txt" } else { "images.txt" };
        return Err(format!(
            "{missing} of COLMAP's text model is missing beside this file, or empty (a binary model is converted by \
             colmap model_converter --output_type TXT)"
        ));
    }
    let several_folders = images.iter().any(|image| folder(image.name) != folder(images[0].name));
    let mut groups: Vec<(String, Vec<&Image<'_>>)> = Vec::new();
    for image in &images {
        let key = if several_folders { folder(image.name).replace('/', "_") } else { image.lens.to_string() };
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, of_group)) => of_group.push(image),
            None => groups.push((key, vec![image])),
        }
        if groups.len() > MOST_CAMERAS {
            return Err(format!("expected at most {MOST_CAMERAS} folders of images"));
        }
    }
    let farthest = images.iter().map(|image| image.camera_from_world.translation.vector.norm()).fold(0.0, f64::max);
    let near = SAME_DIGITS.max(SAME_PLACE * farthest);
    let mut cameras = Vec::new();
    for (folder, images) in groups {
        let first = &images[0].camera_from_world;
        let still = images.iter().all(|image| is_same_place(first, &image.camera_from_world, near));
        let chosen = match (options.view, still) {
            (Some(view), _) => images.get(view..=view),
            (None, true) => images.get(..1),
            (None, false) if several_folders => {
                return Err(format!(
                    "the camera of {:?} moves: it has {} images at several places; select one of each camera by \
                     `view`, from 0",
                    excerpt(&folder),
                    images.len()
                ));
            }
            (None, false) => images.get(..),
        };
        let none = || format!("view: expected 0 to {}", images.len() - 1);
        for image in chosen.ok_or_else(none)? {
            let unknown = || format!("images.txt: image {:?} has a camera that cameras.txt lacks", excerpt(image.name));
            let (_, lens) = lenses.iter().find(|(id, _)| *id == image.lens).ok_or_else(unknown)?;
            let Isometry3 { rotation, translation } = image.camera_from_world;
            cameras.push(PlainCamera {
                name: Some(if several_folders { folder.clone() } else { stem(image.name).to_owned() }),
                r: rotation.to_rotation_matrix().matrix().transpose().into(),
                t: translation.vector.into(),
                ..lens.clone()
            });
        }
    }
    Ok(cameras)
}

fn folder(name: &str) -> &str {
    name.rsplit_once('/').map_or("", |(folder, _)| folder)
}

fn stem(name: &str) -> &str {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

fn is_same_place(one: &Isometry3<f64>, other: &Isometry3<f64>, near: f64) -> bool {
    let centre = |place: &Isometry3<f64>| place.inverse_transform_point(&Point3::origin());
    (centre(one) - centre(other)).norm() <= near && one.rotation.angle_to(&other.rotation) <= SAME_PLACE
}

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS`: a camera without a pose, by its number.
fn lens(words: &[&str]) -> Result<(u64, PlainCamera), String> {
    let &[id, model, width, height, ref parameters @ ..] = words else {
        return Err("expected CAMERA_ID, MODEL, WIDTH, HEIGHT and PARAMS".to_owned());
    };
    let known = LENSES.iter().find(|(name, ..)| *name == model);
    let (_, focal, count) = known.ok_or_else(|| super::other_lens(&excerpt(model)))?;
    let (p, size) = (numbers(parameters)?, numbers(&[width, height])?);
    if p.len() != focal + 2 + count {
        return Err(format!("{model}: expected {} PARAMS, found {}", focal + 2 + count, p.len()));
    }
    let (fx, fy, cx, cy) = (p[0], p[focal - 1], p[*focal], p[focal + 1]);
    let camera = PlainCamera {
        name: None,
        size: Some(super::pixels([size[0], size[1]])?),
        k: [[fx, 0.0, cx - 0.5], [0.0, fy, cy - 0.5], [0.0, 0.0, 1.0]],
        distortion: super::coefficients(model, &p[focal + 2..])?,
        r: [[0.0; 3]; 3],
        t: [0.0; 3],
        metres_per_unit: 1.0,
    };
    Ok((id.parse().map_err(|_| "CAMERA_ID: expected a number".to_owned())?, camera))
}

/// `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`.
fn image<'a>(line: &'a str, words: &[&'a str]) -> Result<Image<'a>, String> {
    let &[_, qw, qx, qy, qz, tx, ty, tz, lens, name, ..] = words else {
        return Err("expected IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID and NAME".to_owned());
    };
    let n = numbers(&[qw, qx, qy, qz, tx, ty, tz])?;
    let quaternion = Quaternion::new(n[0], n[1], n[2], n[3]);
    let rotation = UnitQuaternion::try_new(quaternion, 1e-6).ok_or("QW, QX, QY, QZ are 0, which is no rotation")?;
    // a name may have spaces
    let start = name.as_ptr() as usize - line.as_ptr() as usize;
    Ok(Image {
        lens: lens.parse().map_err(|_| "CAMERA_ID: expected a number".to_owned())?,
        name: line.get(start..).unwrap_or(name).trim_end(),
        camera_from_world: Isometry3::from_parts(Translation3::new(n[4], n[5], n[6]), rotation),
    })
}

fn numbers(words: &[&str]) -> Result<Vec<f64>, String> {
    let number = |word: &&str| word.parse().ok().filter(|number: &f64| number.is_finite());
    let found: Option<Vec<f64>> = words.iter().map(number).collect();
    found.ok_or_else(|| "expected a number, found a word".to_owned())
}
