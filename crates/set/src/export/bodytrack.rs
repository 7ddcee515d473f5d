//! The folder of PARSEC's bodytrack: images and silhouettes as 8-bit BMP, calibration as `.cal`, its body and its
//! start.

use super::bodytrack_start::BodytrackStart;
use super::folder::Folder;
use super::humaneva;
use crate::observing::Image;
use crate::{BlindSet, SetError};

const README: &str = "\
CAMn/imageNNNN.bmp        8-bit images of camera n (from 1) and frame NNNN (from 0):
                          the silhouettes, because the set has no photographs
FGn/imageNNNN.bmp         silhouettes, 255 body, 0 background
CALIB/CameraN.cal         25 numbers in HumanEva's format, millimetres
BodyShapeParameters.txt   bodytrack's body: four numbers of each of ten tapered cylinders, and 18 lengths, millimetres
InitialPose.txt           31 numbers: its pose in frame 0, millimetres and radians
PoseParameters.txt        31 standard deviations of the change from frame to frame, and limits, which it does not use

All are made from what trackers are given (cameras, observations, start), and none from the truth. The body and its
pose are fitted to the tracker's body in its start pose.

Lengths, from 0: 0 torso; 1 to 3 left hip (from the middle), thigh, lower leg; 5 to 7 right ones; 9 to 11 left
clavicle, upper arm, forearm; 13 to 15 right ones; 17 head; the others are not used. Cylinders: radius at the start and
at the end, factors along x and y; torso, left thigh and lower leg, right ones, left upper arm and forearm, right ones, head.

A pose, from 0: 0 to 2 turn the torso about x, y and z (Rz Rx Ry), 3 to 5 are the pelvis. Then angles of joints: 6 to 8
left hip about x, y and z, 9 knee about y; 10 to 13 right ones; 14, 15 left clavicle about x and y, 16 to 18 shoulder
about x, y and z, 19 elbow about y; 20 to 25 right ones; 26, 27 thorax about y and z; 28 to 30 head about x, y and z. A
joint turns by the inverse of Rz Rx Ry of its angles. With all at 0 the legs hang down and the arms point backwards.

Build bodytrack with -DHAVE_STDINT_H=1, or it reads no BMP. Run it in this folder, and measure its poses.txt:

";

/// What the README says about the images, and what it says for a set with images.
const SILHOUETTES: &str = "the silhouettes, because the set has no photographs";
const IMAGES: &str = "the set's images, in grey";

/// Greatest number of frames with four digits.
const MOST_FRAMES: usize = 10_000;

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let frames = set.frame_count;
    if frames > MOST_FRAMES {
        let detail = format!("{frames} frames; bodytrack's file names allow at most {MOST_FRAMES}");
        return Err(SetError::malformed("bodytrack", detail));
    }
    let start = BodytrackStart::of(set)?;
    folder.readme(set, &readme(set, &start))?;
    for (name, text) in [
        ("BodyShapeParameters.txt", &start.shape),
        ("InitialPose.txt", &start.initial_pose),
        ("PoseParameters.txt", &start.pose_parameters),
    ] {
        folder.write(name, text.as_bytes())?;
    }
    for (index, camera) in set.rig.cameras.iter().enumerate() {
        folder.write(&format!("CALIB/Camera{}.cal", index + 1), humaneva::text(camera).as_bytes())?;
    }
    folder.for_each_picture(set, |picture| {
        let mask = &picture.mask;
        let silhouette = bmp([mask.width(), mask.height()], |x, y| if mask.get(x, y) { 255 } else { 0 });
        let seen = set.colour(picture.camera, picture.frame)?;
        let image = seen.map_or_else(|| silhouette.clone(), |image| grey_bmp(&image));
        let (camera, frame) = (picture.camera + 1, picture.frame);
        [("CAM", image), ("FG", silhouette)]
            .iter()
            .try_for_each(|(kind, bytes)| folder.write(&format!("{kind}{camera}/image{frame:04}.bmp"), bytes))
    })
}

/// An image as a bitmap; colours become grey by their luma (ITU-R BT.601).
fn grey_bmp(image: &Image) -> Vec<u8> {
    let at = |plane: &[u8], x: u32, y: u32| u32::from(plane[(y * image.width() + x) as usize]);
    bmp([image.width(), image.height()], |x, y| match image.planes() {
        [red, green, blue] => ((299 * at(red, x, y) + 587 * at(green, x, y) + 114 * at(blue, x, y) + 500) / 1000) as u8,
        planes => planes.first().map_or(0, |grey| at(grey, x, y) as u8),
    })
}

fn readme(set: &BlindSet, start: &BodytrackStart) -> String {
    let (cameras, frames) = (set.rig.cameras.len(), set.frame_count);
    let farthest = 1000.0 * start.farthest_m;
    let files = if set.has_colour() { README.replace(SILHOUETTES, IMAGES) } else { README.to_owned() };
    format!(
        "{files}    bodytrack . {cameras} {frames} 1000 5
    skiagraph evaluate SET poses.txt --from bodytrack

The arguments are the folder, {cameras} cameras, {frames} frames, 1000 particles and 5 layers. In the initial pose
every joint is within {farthest:.1} mm of the start pose's."
    )
}

/// An 8-bit Windows bitmap with a grey palette, bottom row first.
fn bmp([width, height]: [u32; 2], grey: impl Fn(u32, u32) -> u8) -> Vec<u8> {
    const HEADER: u32 = 14 + 40 + 4 * 256;
    let stride = width.div_ceil(4) * 4;
    let size = stride * height;
    let mut bytes = Vec::with_capacity((HEADER + size) as usize);
    bytes.extend(b"BM");
    for word in [HEADER + size, 0, HEADER, 40, width, height] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend([1, 0, 8, 0]);
    // no compression, size, 72 dots an inch, 256 colours
    for word in [0, size, 2835, 2835, 256, 0] {
        bytes.extend(u32::to_le_bytes(word));
    }
    bytes.extend((0..=255_u8).flat_map(|grey| [grey, grey, grey, 0]));
    for y in (0..height).rev() {
        bytes.extend((0..stride).map(|x| if x < width { grey(x, y) } else { 0 }));
    }
    bytes
}
