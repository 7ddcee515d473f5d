use super::*;
use crate::mocap::{ReadOptions, read};

fn walk() -> Clip {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/motions/01_01.bvh");
    read(path.as_ref(), &ReadOptions::default()).unwrap().crop(0..120).unwrap()
}

#[test]
fn a_shipped_recording_has_the_landmarks_of_its_names() {
    let clip = walk();
    let anatomy = Anatomy::from_clip(&clip, &BTreeMap::new()).unwrap();
    let map = anatomy.joint_map(&clip.skeleton);
    let expected =
        [("head_top", "Head:tip"), ("thorax", "Neck1"), ("left_shoulder", "LeftArm"), ("right_wrist", "RightHand")];
    for (landmark, joint) in expected {
        assert_eq!(map[landmark], joint);
    }
    assert_eq!((map.len(), anatomy.notes()), (LANDMARKS.len(), &[][..]));
}

/// An End Site at 0 0 0 under the head made the crown the head's joint, 0.1 m above the neck.
#[test]
fn a_head_without_an_end_gets_a_crown() {
    let mut clip = walk();
    let head = clip.skeleton.find("Head").unwrap();
    clip.skeleton.joints[head].tip = Some(Vector3::zeros());
    let anatomy = Anatomy::from_clip(&clip, &BTreeMap::new()).unwrap();
    assert!(anatomy.notes()[0].contains("no point at the top of the head"), "{:?}", anatomy.notes());
    assert!(!anatomy.joint_map(&clip.skeleton).contains_key("head_top"));
    let markers = anatomy.observe(&clip, 60).markers;
    let [neck, crown] = [Landmark::Thorax, Landmark::HeadTop].map(|landmark| markers[landmark as usize].unwrap());
    let above = crown - neck;
    assert!((0.2..0.3).contains(&above.norm()) && above.z > 0.8 * above.norm(), "{above}");
}

/// What the user says holds, and the rest is found in accordance with it.
#[test]
fn a_part_of_a_joint_map_is_enough() {
    let clip = walk();
    let given = BTreeMap::from([("left_wrist".to_owned(), "LeftFingerBase".to_owned())]);
    let map = Anatomy::from_clip(&clip, &given).unwrap().joint_map(&clip.skeleton);
    assert_eq!((map["left_wrist"].as_str(), map["left_elbow"].as_str()), ("LeftFingerBase", "LeftForeArm"));
}
