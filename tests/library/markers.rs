//! Recordings of markers: a known motion is written as C3D and TRC, read, retargeted and compared with the original.

use std::collections::BTreeMap;

use crate::c3d::Numbers;
use nalgebra::{Point3, Rotation3, Vector3};
use skiagraph_core::body::{Humanoid, LANDMARKS, Landmark, Markers, Motion, shipped, shipped_skin};
use skiagraph_truth::mocap::{ReadOptions, UpAxis, parse_deepmimic, parse_markers};
use skiagraph_truth::retarget::{RetargetOptions, Retargeted, retarget, with_skin};

const WALK: &str = include_str!("../../scenarios/motions/humanoid3d_walk.txt");

/// A walk of the actor in the skin `person`: two cycles.
fn walk() -> (Humanoid, Motion) {
    let clip = parse_deepmimic(WALK, "walk.txt", &ReadOptions::default()).unwrap().looped(2.4).unwrap();
    let actor = with_skin(&shipped("actor").unwrap(), &shipped_skin("person").unwrap()).unwrap();
    let retargeted = retarget(&clip, &actor, &RetargetOptions::default()).unwrap();
    (retargeted.humanoid, retargeted.motion)
}

fn landmarks(body: &Humanoid, motion: &Motion) -> Vec<Markers> {
    motion.poses.iter().map(|pose| body.markers(&body.link_frames(pose))).collect()
}

type Frames = Vec<Vec<Option<[f64; 3]>>>;

fn millimetres(place: &Point3<f64>) -> Option<[f64; 3]> {
    Some([1000.0 * place.x, 1000.0 * place.y, 1000.0 * place.z])
}

/// The fifteen landmarks as points of a file.
fn centres(truth: &[Markers]) -> (Vec<String>, Frames) {
    let labels = LANDMARKS.map(|landmark| landmark.name().to_owned()).to_vec();
    let frames = truth.iter().map(|markers| markers.iter().map(|place| millimetres(&place.unwrap())).collect());
    (labels, frames.collect())
}

/// A marker on the skin: a vertex, the link that moves it most, and the outward direction in the link's frame.
struct SkinMarker {
    label: String,
    vertex: usize,
    link: usize,
    outwards: Vector3<f64>,
}

/// Distance from the skin to the centre of a marker, metres.
const MARKER_RADIUS: f64 = 0.007;

/// The markers of Plug-in Gait on the standing body: for each, the vertex that lies in some direction from a joint's
/// centre. None of the reader's breadths and offsets is used.
fn skin_markers(body: &Humanoid) -> Vec<SkinMarker> {
    let frames = body.link_frames(&body.zero_pose());
    let own = body.markers(&frames);
    let skin = body.skin.as_ref().unwrap();
    let mut vertices = Vec::new();
    skin.deform_into(&frames, &mut vertices);
    let at = |landmark: Landmark| own[landmark as usize].unwrap();
    let beside = |label: &str, from: Point3<f64>, direction: Vector3<f64>, links: &[&str]| {
        let far = |index: &usize| (vertices[*index] - from).dot(&direction);
        let carrier = |index: usize| skin.parts()[index] as usize;
        let aside = |index: &usize| {
            let away = vertices[*index] - from;
            (away - direction * away.dot(&direction)).norm()
        };
        let is_of = |index: &usize| links.iter().any(|word| body.links[carrier(*index)].name.contains(word));
        let on_the_way = |index: &usize| (0.005..0.25).contains(&far(index)) && is_of(index);
        let vertex = (0..vertices.len()).filter(on_the_way).min_by(|a, b| aside(a).total_cmp(&aside(b)));
        let vertex = vertex.unwrap_or_else(|| panic!("no vertex for {label}"));
        let link = carrier(vertex);
        let outwards = frames[link].rotation.inverse() * direction;
        SkinMarker { label: format!("Subject:{label}"), vertex, link, outwards }
    };
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let (pelvis, thorax, top) = (at(Landmark::Pelvis), at(Landmark::Thorax), at(Landmark::HeadTop));
    let (trunk, chest) = (["pelvis", "abdomen", "thorax", "thigh"], ["thorax", "neck", "clavicle"]);
    let mut markers = vec![
        beside("C7", thorax, -x, &chest),
        beside("CLAV", thorax - z * 0.06, x, &chest),
        beside("T10", thorax - z * 0.24, -x, &trunk),
        beside("STRN", thorax - z * 0.24, x, &trunk),
    ];
    use Landmark as L;
    let left = [L::LeftShoulder, L::LeftElbow, L::LeftWrist, L::LeftHip, L::LeftKnee, L::LeftAnkle];
    let right = [L::RightShoulder, L::RightElbow, L::RightWrist, L::RightHip, L::RightKnee, L::RightAnkle];
    for (sign, letter, joints) in [(1.0, "L", left), (-1.0, "R", right)] {
        let aside = y * sign;
        let [shoulder, elbow, wrist, hip, knee, ankle] = joints.map(at);
        let band = top - z * 0.10;
        let (arm, leg) = (["upper_arm", "forearm"], ["thigh", "shank"]);
        let name = |marker: &str| format!("{letter}{marker}");
        markers.extend([
            beside(&name("FHD"), band + aside * 0.04, x, &["head"]),
            beside(&name("BHD"), band + aside * 0.04, -x, &["head"]),
            beside(&name("SHO"), shoulder, z, &["clavicle", "upper_arm", "thorax"]),
            beside(&name("ELB"), elbow, aside, &arm),
            beside(&name("WRA"), wrist, x, &["forearm", "hand"]),
            beside(&name("WRB"), wrist, -x, &["forearm", "hand"]),
            beside(&name("ASI"), pelvis + z * 0.09 + aside * 0.115, x, &trunk),
            beside(&name("PSI"), pelvis + z * 0.105 + aside * 0.045, -x, &trunk),
            beside(&name("THI"), nalgebra::center(&hip, &knee), aside, &leg),
            beside(&name("KNE"), knee, aside, &leg),
            beside(&name("TIB"), nalgebra::center(&knee, &ankle), aside, &leg),
            beside(&name("ANK"), ankle, aside, &["shank", "foot"]),
            beside(&name("HEE"), ankle - z * 0.04, -x, &["foot"]),
            beside(&name("TOE"), ankle + x * 0.12 - z * 0.04, z, &["foot", "toes"]),
        ]);
    }
    markers
}

fn markers_during(body: &Humanoid, motion: &Motion) -> (Vec<String>, Frames) {
    let markers = skin_markers(body);
    let mut skin = Vec::new();
    let frames = motion.poses.iter().map(|pose| {
        let frames = body.link_frames(pose);
        body.skin.as_ref().unwrap().deform_into(&frames, &mut skin);
        let place =
            |marker: &SkinMarker| skin[marker.vertex] + frames[marker.link].rotation * marker.outwards * MARKER_RADIUS;
        markers.iter().map(|marker| millimetres(&place(marker))).collect()
    });
    (markers.iter().map(|marker| marker.label.clone()).collect(), frames.collect())
}

/// Mean distance of each landmark of a retargeted clip from the truth, millimetres, and of all.
fn errors(found: &Retargeted, truth: &[Markers]) -> (Vec<f64>, f64) {
    let own = landmarks(&found.humanoid, &found.motion);
    assert_eq!(own.len(), truth.len());
    let mean = |landmark: usize| {
        let distances = own.iter().zip(truth).map(|(a, b)| (a[landmark].unwrap() - b[landmark].unwrap()).norm());
        1000.0 * distances.sum::<f64>() / truth.len() as f64
    };
    let each: Vec<f64> = (0..LANDMARKS.len()).map(mean).collect();
    let all = each.iter().sum::<f64>() / each.len() as f64;
    (each, all)
}

fn on_actor(bytes: &[u8], file: &str, options: &ReadOptions) -> Retargeted {
    let clip = parse_markers(bytes, file, options).unwrap();
    let as_recorded =
        RetargetOptions { ground: skiagraph_truth::retarget::Ground::Recorded, ..RetargetOptions::default() };
    retarget(&clip, &shipped("actor").unwrap(), &as_recorded).unwrap()
}

#[test]
fn joint_centres_in_a_c3d_restore_the_motion_to_a_few_millimetres_in_every_number_format() {
    let (body, motion) = walk();
    let truth = landmarks(&body, &motion);
    let (labels, frames) = centres(&truth);
    let mut first = None;
    for numbers in [Numbers::IntelFloats, Numbers::IntelWhole, Numbers::DecFloats, Numbers::SgiFloats] {
        let bytes = crate::c3d::bytes(&labels, &frames, 60.0, Some("+Z"), numbers);
        let clip = parse_markers(&bytes, "walk.c3d", &ReadOptions::default()).unwrap();
        assert_eq!(clip.frames_per_second, 60.0);
        let knee = clip.skeleton.find("left_knee").unwrap();
        for (frame, markers) in truth.iter().enumerate() {
            let distance = (clip.joint_positions(frame)[knee] - markers[Landmark::LeftKnee as usize].unwrap()).norm();
            assert!(distance < 2e-4, "{distance}");
        }
        first.get_or_insert(bytes);
    }
    let found = on_actor(&first.unwrap(), "walk.c3d", &ReadOptions::default());
    let (each, all) = errors(&found, &truth);
    eprintln!("joint centres: {all:.2} mm, each {each:.1?}");
    assert!(all < 8.0, "{all} mm: {each:?}");
}

#[test]
fn plug_in_gait_markers_on_a_skin_restore_the_joints_to_a_few_centimetres() {
    let (body, motion) = walk();
    let truth = landmarks(&body, &motion);
    let (labels, frames) = markers_during(&body, &motion);
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, None, Numbers::IntelFloats);
    let clip = parse_markers(&bytes, "walk.c3d", &ReadOptions::default()).unwrap();
    for joint in ["left_hip", "left_knee", "left_ankle", "left_shoulder", "left_elbow", "left_wrist", "neck"] {
        let index = clip.skeleton.find(joint).unwrap();
        let landmark = LANDMARKS.iter().position(|l| l.name() == joint.replace("neck", "thorax")).unwrap();
        let off = |frame: usize| {
            let heading = motion.poses[frame].world_from_root.rotation.inverse();
            heading * (clip.joint_positions(frame)[index] - truth[frame][landmark].unwrap())
        };
        let mean = (0..truth.len()).map(off).sum::<Vector3<f64>>() * 1000.0 / truth.len() as f64;
        eprintln!("{joint}: the centre is off by {:.0?} mm in the pelvis's axes", mean.as_slice());
    }
    let found = on_actor(&bytes, "walk.c3d", &ReadOptions::default());
    let (each, all) = errors(&found, &truth);
    let named: BTreeMap<&str, f64> = LANDMARKS.iter().map(|l| l.name()).zip(each.iter().copied()).collect();
    eprintln!("Plug-in Gait: {all:.1} mm on average, {named:.0?}");
    // the hips, estimated by regression from markers on the skin, are the worst; confusing two markers would cause 100
    // mm
    assert!(all < 40.0, "{all} mm: {named:?}");
    assert!(found.report.notes.iter().any(|note| note.contains("up axis guessed: Z")));
}

#[test]
fn a_trc_with_y_up_in_metres_is_the_same_motion_as_the_c3d() {
    let (body, motion) = walk();
    let (labels, frames) = markers_during(&body, &motion);
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, Some("+Z"), Numbers::IntelFloats);
    let c3d = parse_markers(&bytes, "a.c3d", &ReadOptions::default()).unwrap();
    let names: Vec<String> = labels.iter().map(|label| format!("{label}\t\t")).collect();
    let mut trc = format!(
        "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n60\t{}\t{}\tm\nFrame#\tTime\t{}\n\t\tX1\tY1\tZ1\n",
        frames.len(),
        labels.len(),
        names.join("\t")
    );
    for (index, frame) in frames.iter().enumerate() {
        let places = frame.iter().flatten().map(|[x, y, z]| format!("{}\t{}\t{}", y / 1000.0, z / 1000.0, x / 1000.0));
        trc.push_str(&format!("{}\t{}\t{}\n", index + 1, index as f64 / 60.0, places.collect::<Vec<_>>().join("\t")));
    }
    let trc = parse_markers(trc.as_bytes(), "a.trc", &ReadOptions::default()).unwrap();
    // the file's axes were X left, Y up, Z forward: turned to Z up, only the heading differs
    for frame in [0, 35, 70] {
        let (a, b) = (c3d.joint_positions(frame), trc.joint_positions(frame));
        for (a, b) in a.iter().zip(&b) {
            assert!((Point3::new(b.y, -b.x, b.z) - Point3::new(-a.x, -a.y, a.z)).norm() < 1e-5, "{a} {b}");
        }
    }
}

#[test]
fn gaps_are_filled_and_noted_and_markers_without_data_are_dropped() {
    let (body, motion) = walk();
    let (labels, mut frames) = markers_during(&body, &motion);
    let whole = parse_markers(
        &crate::c3d::bytes(&labels, &frames, 60.0, None, Numbers::IntelFloats),
        "a.c3d",
        &ReadOptions::default(),
    );
    let column = |name: &str| labels.iter().position(|label| label.ends_with(name)).unwrap();
    let (knee, ankle, thigh) = (column("LKNE"), column("RANK"), column("LTHI"));
    (40..43).for_each(|frame| frames[frame][knee] = None);
    (20..46).for_each(|frame| frames[frame][ankle] = None);
    frames.iter_mut().for_each(|frame| frame[thigh] = None);
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, None, Numbers::IntelFloats);
    let clip = parse_markers(&bytes, "a.c3d", &ReadOptions::default()).unwrap();
    let notes = clip.notes.join("\n");
    assert!(notes.contains("interpolated: LKNE 3 (at most 3 in a row)"), "{notes}");
    assert!(notes.contains("guess: RANK 26 (at most 26 in a row)"), "{notes}");
    assert!(notes.contains(&format!("LTHI is not seen in {0} of {0} frames: dropped", frames.len())), "{notes}");
    let whole = whole.unwrap();
    let knee = clip.skeleton.find("left_knee").unwrap();
    let moved = (clip.joint_positions(41)[knee] - whole.joint_positions(41)[knee]).norm();
    assert!(moved < 0.03, "{moved}");
}

/// Markers of the feet were lost in the second half: their bones changed, and `joint_map` was offered.
#[test]
fn half_a_take_names_the_whole_frames() {
    let (body, motion) = walk();
    let (labels, mut frames) = markers_during(&body, &motion);
    let count = frames.len();
    for frame in &mut frames[count * 11 / 20..] {
        let lost = labels.iter().zip(frame).filter(|(label, _)| ["ANK", "TIB"].iter().any(|end| label.ends_with(end)));
        lost.for_each(|(_, place)| *place = None);
    }
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, None, Numbers::IntelFloats);
    let refused = parse_markers(&bytes, "a.c3d", &ReadOptions::default()).unwrap_err().to_string();
    let remedy = format!("set `first_frame = 1` and `last_frame = {}`", count * 11 / 20);
    assert!(refused.contains(&remedy) && !refused.contains("_map"), "{refused}");
    let options = ReadOptions { used_frames: Some(0..count * 11 / 20), ..ReadOptions::default() };
    assert!(parse_markers(&bytes, "a.c3d", &options).is_ok());
}

/// A trunk that leans was made upright if only the neck had no marker.
#[test]
fn a_leaning_trunk_without_a_neck_leans() {
    let body = shipped("actor").unwrap();
    let mut truth = body.markers(&body.link_frames(&body.standing_pose()));
    let hips = truth[Landmark::Pelvis as usize].unwrap();
    let lean = Rotation3::from_axis_angle(&Vector3::y_axis(), 1.0);
    for place in truth.iter_mut().flatten().filter(|place| place.z > hips.z + 0.2) {
        *place = hips + lean * (*place - hips);
    }
    let (mut labels, mut frames) = centres(&[truth]);
    labels.remove(Landmark::Thorax as usize);
    frames[0].remove(Landmark::Thorax as usize);
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, Some("+Z"), Numbers::IntelFloats);
    let clip = parse_markers(&bytes, "a.c3d", &ReadOptions::default()).unwrap();
    let neck = clip.joint_positions(0)[clip.skeleton.find("neck").unwrap()];
    let off = (neck - truth[Landmark::Thorax as usize].unwrap()).norm();
    assert!(off < 0.04, "{off}");
}

/// Files differ in how high above the ball of the foot the ankle is: a foot was tilted, and its heel lifted the body.
#[test]
fn one_standing_pose_keeps_its_height() {
    let body = shipped("actor").unwrap();
    let pose = body.standing_pose();
    let links = body.link_frames(&pose);
    let truth = body.markers(&links);
    let (mut labels, mut frames) = centres(&[truth]);
    for toes in ["left_toes", "right_toes"] {
        let ball = links[body.find_link(toes).unwrap()] * Point3::origin() + 0.02 * Vector3::z();
        labels.push(toes.to_owned());
        frames[0].push(millimetres(&ball));
    }
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, Some("+Z"), Numbers::IntelFloats);
    let clip = parse_markers(&bytes, "a.c3d", &ReadOptions::default()).unwrap();
    let found = retarget(&clip, &body, &RetargetOptions::default()).unwrap();
    let markers = found.humanoid.markers(&found.humanoid.link_frames(&found.motion.poses[0]));
    let [found, truth] = [markers, truth].map(|markers| markers[Landmark::Pelvis as usize].unwrap().z);
    let sole = body.lowest_point(&links, &body.foot_links().concat()).unwrap().z;
    assert!((found - (truth - sole)).abs() < 0.005, "{found} {truth} {sole}");
}

#[test]
fn unknown_labels_are_listed_and_a_marker_map_resolves_them() {
    let (body, motion) = walk();
    let truth = landmarks(&body, &motion);
    let (mut labels, frames) = centres(&truth);
    let knee = labels.iter().position(|label| label == "left_knee").unwrap();
    labels[knee] = "Point 7".to_owned();
    let bytes = crate::c3d::bytes(&labels, &frames, 60.0, Some("+Z"), Numbers::IntelFloats);
    let message = parse_markers(&bytes, "a.c3d", &ReadOptions::default()).unwrap_err().to_string();
    assert!(
        message.contains("cannot locate left_knee") && message.contains("unrecognised points: Point 7"),
        "{message}"
    );
    assert!(message.contains("`marker_map` of `[motion]`, for example left_knee = \"LABEL\""), "{message}");
    let markers = BTreeMap::from([("left_knee".to_owned(), "Point 7".to_owned())]);
    let options = ReadOptions { markers, ..ReadOptions::default() };
    assert!(parse_markers(&bytes, "a.c3d", &options).is_ok());
}

#[test]
fn errors_of_damaged_files_say_what_was_expected() {
    let (body, motion) = walk();
    let (labels, frames) = centres(&landmarks(&body, &motion));
    let good = crate::c3d::bytes(&labels, &frames, 60.0, Some("+Z"), Numbers::IntelFloats);
    let message = |bytes: &[u8]| parse_markers(bytes, "a.c3d", &ReadOptions::default()).unwrap_err().to_string();
    assert!(message(b"").contains("second byte is 0x50"));
    assert!(message(&good[..600]).contains("a.c3d: "));
    let cut = message(&good[..1024]);
    assert!(cut.contains("a.c3d: "), "{cut}");
    let half = parse_markers(&good[..good.len() / 2], "a.c3d", &ReadOptions::default()).unwrap();
    assert!(half.notes.iter().any(|note| note.contains("frames are declared, but the file has")), "{:?}", half.notes);
    let mut other = good.clone();
    other[512 + 3] = 7;
    assert!(message(&other).contains("processor type 84, 85 or 86, found 7"));
    let options = ReadOptions { up: Some(UpAxis::Y), ..ReadOptions::default() };
    let lying = parse_markers(&good, "a.c3d", &options).unwrap();
    assert!(lying.stature() > 1.0);
    let one = crate::c3d::bytes(&labels, &frames[..1], 60.0, Some("+Z"), Numbers::IntelFloats);
    let pose = parse_markers(&one, "a.c3d", &ReadOptions::default()).unwrap();
    assert!(pose.notes.iter().any(|note| note.contains("one pose only")), "{:?}", pose.notes);
    // a file cut after its first frame is no pose
    let frame = (good.len() - 1024) / frames.len();
    assert!(message(&good[..1024 + frame]).contains("found 1: the file is truncated"));
}
