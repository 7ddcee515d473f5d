//! COLMAP's text model: cameras, one image of each, and the markers of that frame as points.

use std::fmt::Write as _;

use super::folder::{Folder, camera_files};
use crate::format::rigid;
use crate::{BenchmarkSet, SetError};
use skiagraph_core::camera::Camera;

const README: &str = "\
cameras.txt, images.txt, points3D.txt: the rig, one image a camera, and the actor's markers in frame 0 with the pixels where
they are visible. Moving cameras have an image of every frame, those after the first without points. Images are
NAME/000000.png: copy camNN/silhouette of the set's observations/ to these names.

COLMAP's own conventions: world to camera as qw qx qy qz tx ty tz, metres, x right, y down, z forward; the world's Z is up; pixel
(0.5, 0.5) is the centre of the top-left pixel. Cameras without distortion are PINHOLE, with it OPENCV, or FULL_OPENCV where
k3 is not 0.";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(&set.blind, README)?;
    let rig = &set.blind.rig;
    let Some(frame) = set.truth.ground_truth.frames.first() else { return Ok(()) };
    let mut cameras = String::from("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    let mut images = String::from("# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# X, Y, POINT3D_ID\n");
    let mut tracks: Vec<Vec<(usize, usize)>> = vec![Vec::new(); frame.markers.len()];
    for (index, (camera, name)) in rig.cameras.iter().zip(camera_files(&set.blind)).enumerate() {
        let id = index + 1;
        writeln!(cameras, "{id} {}", model(camera)).ok();
        let [x, y, z, qw, qx, qy, qz] = rigid::to_row(&camera.camera_from_world);
        writeln!(images, "{id} {qw} {qx} {qy} {qz} {x} {y} {z} {id} {name}/000000.png").ok();
        let mut points = Vec::new();
        for (marker, place) in frame.markers.iter().enumerate() {
            let pixel = place.filter(|_| frame.visible[index][marker]).and_then(|place| camera.project(&place));
            let Some(pixel) = pixel else { continue };
            tracks[marker].push((id, points.len()));
            points.push(format!("{} {} {}", pixel.x, pixel.y, marker + 1));
        }
        writeln!(images, "{}", points.join(" ")).ok();
    }
    let mut points = String::from("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n");
    for (marker, place) in frame.markers.iter().enumerate() {
        let Some(place) = place.filter(|_| !tracks[marker].is_empty()) else { continue };
        let track: String = tracks[marker].iter().map(|(image, point)| format!(" {image} {point}")).collect();
        writeln!(points, "{} {} {} {} 255 255 255 0{track}", marker + 1, place.x, place.y, place.z).ok();
    }
    images += &other_frames(set);
    [("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", points)]
        .iter()
        .try_for_each(|(name, text)| folder.write(name, text.as_bytes()))
}

/// Images of the frames after the first, without points, for sets with moving cameras.
fn other_frames(set: &BenchmarkSet) -> String {
    let (names, cameras) = (camera_files(&set.blind), set.blind.rig.cameras.len());
    let mut images = String::new();
    let moments = set.blind.moments.iter().flat_map(|moments| moments.frames.iter().enumerate().skip(1));
    for (frame, moment) in moments {
        for (index, placement) in moment.camera_from_world.iter().enumerate() {
            if moment.exposed_s[index].is_some() {
                let (id, [x, y, z, qw, qx, qy, qz]) = (frame * cameras + index + 1, rigid::to_row(placement));
                let (camera, name) = (index + 1, &names[index]);
                writeln!(images, "{id} {qw} {qx} {qy} {qz} {x} {y} {z} {camera} {name}/{frame:06}.png\n").ok();
            }
        }
    }
    images
}

/// Model, size and parameters of a camera.
fn model(camera: &Camera) -> String {
    let ([fx, fy], [cx, cy]) = (camera.pinhole.focal, camera.pinhole.principal_point);
    let (width, height) = (camera.pinhole.width, camera.pinhole.height);
    let [k1, k2, p1, p2, k3] = camera.distortion.coefficients();
    let pinhole = format!("{width} {height} {fx} {fy} {cx} {cy}");
    if camera.distortion.is_none() {
        format!("PINHOLE {pinhole}")
    } else if k3 == 0.0 {
        format!("OPENCV {pinhole} {k1} {k2} {p1} {p2}")
    } else {
        format!("FULL_OPENCV {pinhole} {k1} {k2} {p1} {p2} {k3} 0 0 0")
    }
}
