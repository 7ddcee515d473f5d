//! The animations of a glTF file: a skeleton and its transforms at equal intervals.
//!
//! Keyframes are interpolated as the format defines (linearly, held, or by cubic splines) at the rate of the channel
//! with the most keys. Scales move joints, but turn none.

use std::collections::{BTreeMap, BTreeSet};

use gltf::accessor::{DataType, Dimensions};
use gltf::animation::{Interpolation, Property};
use nalgebra::{Isometry3, Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::gltf_document::{GltfFile, file_of};
use super::gltf_numbers::{Buffers, rows};
use super::gltf_tree::NodeTree;
use super::mesh::SkinError;
use crate::input::excerpt;

/// Greatest number of keys of all channels of an animation.
const MOST_KEYS: usize = 10_000_000;
/// Greatest coordinate, as of other recordings.
const FARTHEST: f64 = 1e7;
/// Rates at which animations are sampled, Hz: keys are farther apart where a curve is drawn by hand.
const RATES: std::ops::RangeInclusive<f64> = 20.0..=1000.0;
/// The rate if the keys do not tell one.
const USUAL_RATE: f64 = 30.0;

/// What is wanted of a file's animations.
#[derive(Clone, Copy, Debug, Default)]
pub struct MotionChoice<'a> {
    /// The animation's name, if the file has several.
    pub name: Option<&'a str>,
    /// Frames per second instead of the keys' own.
    pub rate: Option<f64>,
    /// Greatest number of joints times frames.
    pub most_joint_frames: usize,
}

/// A sampled animation. Y up, units of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfMotion {
    /// Names of the joints, VRM's if the file has its map; parents come before children, the first is the root.
    pub names: Vec<String>,
    /// The parent of each joint.
    pub parents: Vec<Option<usize>>,
    /// Offset of each joint from its parent in the pose of the file's nodes.
    pub rest_offsets: Vec<Vector3<f64>>,
    /// Frames per second.
    pub frames_per_second: f64,
    /// For every frame and joint, `parent_from_joint`; rotations are the identity in the pose of the file's nodes.
    pub frames: Vec<Vec<Isometry3<f64>>>,
    /// How it was read.
    pub notes: Vec<String>,
}

/// What a glTF file has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GltfContents {
    /// Number of animations.
    pub animations: usize,
    /// Number of meshes with a skin. Animations that are exported without them may still list a skin.
    pub skins: usize,
    /// Its buffer files, relative to its folder.
    pub files: Vec<String>,
}

/// What the file has; nothing if it is not glTF.
pub fn gltf_contents(bytes: &[u8]) -> GltfContents {
    let Ok((gltf, _)) = GltfFile::without_buffers("", bytes) else { return GltfContents::default() };
    GltfContents {
        animations: gltf.document.animations().len(),
        skins: gltf.document.nodes().filter(|node| node.mesh().is_some() && node.skin().is_some()).count(),
        files: gltf.document.buffers().filter_map(|buffer| file_of(&buffer)).collect(),
    }
}

/// Reads an animation; `read` returns the contents of referenced buffer files.
pub fn gltf_motion(
    file: &str,
    bytes: &[u8],
    choice: &MotionChoice<'_>,
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<GltfMotion, SkinError> {
    let gltf = GltfFile::open(file, bytes, read)?;
    sampled(&gltf, choice).map_err(|detail| SkinError::Malformed { file: file.to_owned(), detail })
}

/// The keys of one property of a node.
struct Channel {
    times: Vec<f64>,
    /// One row per key; three for cubic splines: incoming tangent, value, outgoing tangent.
    values: Vec<[f64; 4]>,
    interpolation: Interpolation,
}

/// Translation, rotation (x y z w) and scale.
type Properties = [[f64; 4]; 3];

fn sampled(gltf: &GltfFile, choice: &MotionChoice<'_>) -> Result<GltfMotion, String> {
    let tree = NodeTree::of(&gltf.document)?;
    let animation = chosen(gltf, choice.name)?;
    let channels = channels(&animation, &gltf.buffers)?;
    if channels.is_empty() {
        return Err("the animation moves no node".to_owned());
    }
    let bones: BTreeMap<usize, &str> = gltf.humanoid.iter().map(|(name, node)| (*node, name.as_str())).collect();
    let nodes = joints(&tree, &channels, &bones)?;
    let mut notes = Vec::new();
    let (start, end) = channels
        .values()
        .flat_map(|channel| &channel.times)
        .fold((f64::MAX, f64::MIN), |(low, high), t| (low.min(*t), high.max(*t)));
    let rate = choice.rate.unwrap_or_else(|| own_rate(&channels, &mut notes));
    // a key may be rounded to just before its frame
    let count = ((end - start) * rate + 0.01).floor() + 1.0;
    if !(count >= 1.0 && count * tree.names.len() as f64 <= choice.most_joint_frames as f64) {
        return Err(format!("{count} frames of {} nodes at {rate} Hz are too many", tree.names.len()));
    }
    let mut rest = vec![[[0.0; 4]; 3]; tree.names.len()];
    for (node, rest) in gltf.document.nodes().zip(&mut rest) {
        let (translation, rotation, scale) = node.transform().decomposed();
        let three = |own: [f32; 3]| [own[0], own[1], own[2], 0.0].map(f64::from);
        *rest = [three(translation), rotation.map(f64::from), three(scale)];
    }
    let at_rest = world(&tree, &rest);
    let mut frames = Vec::with_capacity(count as usize);
    for frame in 0..count as usize {
        let time = start + frame as f64 / rate;
        let mut posed = rest.clone();
        for ((node, property), channel) in &channels {
            posed[*node][*property] = channel.at(time, *property == 1);
        }
        let posed = world(&tree, &posed);
        let mut placed: Vec<Isometry3<f64>> = Vec::with_capacity(nodes.len());
        for &node in &nodes {
            let turn = posed[node].1 * at_rest[node].1.inverse();
            placed.push(Isometry3::from_parts(Translation3::from(posed[node].0.column(3).xyz()), turn));
        }
        if placed
            .iter()
            .any(|own| !own.translation.vector.iter().chain(own.rotation.coords.iter()).all(|c| c.abs() <= FARTHEST))
        {
            return Err(format!("frame {}: expected numbers of at most {FARTHEST:e}", frame + 1));
        }
        frames.push(placed);
    }
    let index: BTreeMap<usize, usize> = nodes.iter().copied().zip(0..).collect();
    let parents: Vec<Option<usize>> =
        nodes.iter().map(|node| tree.upwards(*node).skip(1).find_map(|above| index.get(&above).copied())).collect();
    for frame in &mut frames {
        let placed = frame.clone();
        for (joint, parent) in parents.iter().enumerate() {
            frame[joint] = parent.map_or(placed[joint], |parent| placed[parent].inv_mul(&placed[joint]));
        }
    }
    let origin = |node: usize| at_rest[node].0.column(3).xyz();
    let offset = |(node, parent): (&usize, &Option<usize>)| {
        origin(*node) - parent.map_or_else(Vector3::zeros, |parent| origin(nodes[parent]))
    };
    let name = |node: &usize| bones.get(node).copied().unwrap_or_else(|| tree.names[*node].as_str()).to_owned();
    Ok(GltfMotion {
        names: nodes.iter().map(name).collect(),
        rest_offsets: nodes.iter().zip(&parents).map(offset).collect(),
        parents,
        frames_per_second: rate,
        frames,
        notes,
    })
}

/// The animation with this name, or the only one.
fn chosen<'a>(gltf: &'a GltfFile, name: Option<&str>) -> Result<gltf::Animation<'a>, String> {
    let mut all: Vec<gltf::Animation<'_>> = gltf.document.animations().collect();
    let title = |own: &gltf::Animation<'_>| own.name().map_or_else(|| own.index().to_string(), str::to_owned);
    let known = excerpt(&all.iter().map(title).collect::<Vec<_>>().join(", "));
    if let Some(name) = name {
        let found = all.iter().position(|own| title(own) == name);
        return found
            .map(|at| all.swap_remove(at))
            .ok_or_else(|| format!("no animation `{}`; `subject` chooses one of: {known}", excerpt(name)));
    }
    match all.len() {
        0 => Err("expected an animation, found none; export it with its animation".to_owned()),
        1 => Ok(all.swap_remove(0)),
        number => Err(format!("{number} animations; set `subject` to the name of one: {known}")),
    }
}

/// Channels by node and property (0 to 2: translation, rotation, scale).
fn channels(animation: &gltf::Animation<'_>, buffers: &Buffers) -> Result<BTreeMap<(usize, usize), Channel>, String> {
    let mut channels = BTreeMap::new();
    let mut keys = 0;
    for own in animation.channels() {
        let property = match own.target().property() {
            Property::Translation => 0,
            Property::Rotation => 1,
            Property::Scale => 2,
            Property::MorphTargetWeights => continue,
        };
        let sampler = own.sampler();
        let spare = MOST_KEYS - keys;
        let times: Vec<[f64; 1]> = rows(&sampler.input(), buffers, (&[DataType::F32], Dimensions::Scalar), spare / 3)?;
        let types = [DataType::F32, DataType::I8, DataType::U8, DataType::I16, DataType::U16];
        let values: Vec<[f64; 4]> = if property == 1 {
            rows(&sampler.output(), buffers, (&types, Dimensions::Vec4), spare)?
        } else {
            let three: Vec<[f64; 3]> = rows(&sampler.output(), buffers, (&types, Dimensions::Vec3), spare)?;
            three.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect()
        };
        keys += values.len();
        let per_key = if sampler.interpolation() == Interpolation::CubicSpline { 3 } else { 1 };
        let times: Vec<f64> = times.into_iter().map(|[time]| time).collect();
        let is_ordered = times.windows(2).all(|pair| pair[0] < pair[1]) && times.iter().all(|t| t.abs() < 1e6);
        if times.is_empty() || !is_ordered || values.len() != per_key * times.len() {
            let (node, number) = (own.target().node().index(), values.len());
            return Err(format!(
                "the channel of node {node} has {} times and {number} values; expected ascending times, {per_key} \
                 values for each",
                times.len()
            ));
        }
        let channel = Channel { times, values, interpolation: sampler.interpolation() };
        channels.insert((own.target().node().index(), property), channel);
    }
    Ok(channels)
}

/// The nodes that are animated or bones, those between, and the ends below; without what is above all of them.
fn joints(
    tree: &NodeTree,
    channels: &BTreeMap<(usize, usize), Channel>,
    bones: &BTreeMap<usize, &str>,
) -> Result<Vec<usize>, String> {
    // VRM animates expressions and the gaze by nodes that hang on no bone
    let top = |node: usize| tree.upwards(node).last();
    let bones_top = bones.keys().copied().find(|node| *node < tree.names.len()).map(top);
    let own: BTreeSet<usize> = channels
        .keys()
        .map(|(node, _)| *node)
        .filter(|node| bones_top.is_none_or(|bones_top| top(*node) == bones_top))
        .chain(bones.keys().copied().filter(|node| *node < tree.names.len()))
        .collect();
    let mut root: Option<usize> = None;
    for &node in &own {
        root = match root {
            None => Some(node),
            Some(root) => {
                Some(tree.common_ancestor(root, node).ok_or("its animated nodes have no common ancestor".to_owned())?)
            }
        };
    }
    let mut is_used = vec![false; tree.names.len()];
    for &node in &own {
        for above in tree.upwards(node) {
            if std::mem::replace(&mut is_used[above], true) || Some(above) == root {
                break;
            }
        }
    }
    let is_end = |node: usize| !tree.has_mesh[node] && tree.parents[node].is_some_and(|parent| is_used[parent]);
    Ok(tree.order.iter().copied().filter(|node| is_used[*node] || is_end(*node)).collect())
}

/// The rate of the channel with the most keys.
fn own_rate(channels: &BTreeMap<(usize, usize), Channel>, notes: &mut Vec<String>) -> f64 {
    let longest = channels.values().max_by_key(|channel| channel.times.len());
    let mut gaps: Vec<f64> =
        longest.iter().flat_map(|own| own.times.windows(2)).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    let rate = gaps.get(gaps.len() / 2).map_or(0.0, |gap| 1.0 / gap);
    if !RATES.contains(&rate) {
        notes.push(format!(
            "its keys are not at equal intervals: sampled at {USUAL_RATE} Hz; set `source_hz` for another"
        ));
        return USUAL_RATE;
    }
    // times have single precision
    if (rate / rate.round() - 1.0).abs() < 2e-3 { rate.round() } else { rate }
}

/// World transforms, and rotations without scales.
fn world(tree: &NodeTree, own: &[Properties]) -> Vec<(Matrix4<f64>, UnitQuaternion<f64>)> {
    let mut world = vec![(Matrix4::identity(), UnitQuaternion::identity()); own.len()];
    for &node in &tree.order {
        let [translation, [x, y, z, w], scale] = own[node];
        let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let three = |[x, y, z, _]: [f64; 4]| Vector3::new(x, y, z);
        let local = Matrix4::new_translation(&three(translation))
            * turn.to_homogeneous()
            * Matrix4::new_nonuniform_scaling(&three(scale));
        world[node] = match tree.parents[node] {
            Some(parent) => (world[parent].0 * local, world[parent].1 * turn),
            None => (local, turn),
        };
    }
    world
}

impl Channel {
    /// The value at a time: the first key's before it, the last key's after it.
    fn at(&self, time: f64, is_rotation: bool) -> [f64; 4] {
        let per_key = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let key = |index: usize, part: usize| Quaternion::from(self.values[per_key * index + part]);
        let middle = per_key / 2;
        let next = self.times.partition_point(|own| *own <= time);
        let (Some(before), true) = (next.checked_sub(1), next < self.times.len()) else {
            return key(next.min(self.times.len() - 1), middle).coords.into();
        };
        let span = self.times[next] - self.times[before];
        let share = (time - self.times[before]) / span;
        let (a, b) = (key(before, middle), key(next, middle));
        let value = match self.interpolation {
            Interpolation::Step => a,
            Interpolation::Linear if is_rotation => {
                let [a, b] = [a, b].map(UnitQuaternion::new_normalize);
                (a * (a.inverse() * b).powf(share)).into_inner()
            }
            Interpolation::Linear => a * (1.0 - share) + b * share,
            Interpolation::CubicSpline => {
                let (leaving, arriving) = (key(before, 2) * span, key(next, 0) * span);
                let (square, cube) = (share * share, share * share * share);
                a * (2.0 * cube - 3.0 * square + 1.0)
                    + leaving * (cube - 2.0 * square + share)
                    + b * (3.0 * square - 2.0 * cube)
                    + arriving * (cube - square)
            }
        };
        value.coords.into()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// An arm of two nodes below a node that scales: the upper turns about Z in two keys, the lower moves.
    fn read(interpolation: &str, values: &[f32], choice: &MotionChoice<'_>) -> Result<GltfMotion, String> {
        let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.6_f32.sqrt(), 0.4_f32.sqrt()];
        let floats = [&[0.0, 0.1][..], &turn, values].concat();
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        let root = json!({
            "asset": {"version": "2.0"},
            "nodes": [{"name": "upper", "scale": [2, 2, 2], "children": [1]}, {"name": "lower", "translation": [1, 0, 0]}],
            "buffers": [{"uri": "b.bin", "byteLength": bytes.len()}],
            "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR"},
                {"bufferView": 0, "byteOffset": 8, "componentType": 5126, "count": 2, "type": "VEC4"},
                {"bufferView": 0, "byteOffset": 40, "componentType": 5126, "count": values.len() / 3, "type": "VEC3"}],
            "animations": [
                {"name": "wave", "channels": [
                    {"sampler": 0, "target": {"node": 0, "path": "rotation"}},
                    {"sampler": 1, "target": {"node": 1, "path": "translation"}}],
                 "samplers": [
                    {"input": 0, "output": 1},
                    {"input": 0, "output": 2, "interpolation": interpolation}]},
                {"name": "rest", "channels": [], "samplers": []}],
        });
        let read = |_: &str| Ok(bytes.clone());
        gltf_motion("a.gltf", root.to_string().as_bytes(), choice, &read).map_err(|error| error.to_string())
    }

    // Mixamo's animations without skin: they were refused as skins without a mesh.
    #[test]
    fn a_skin_without_a_mesh_is_none() {
        let of_nodes = |nodes: serde_json::Value| {
            let root = json!({"asset": {"version": "2.0"}, "nodes": nodes, "skins": [{"joints": [0]}],
                "buffers": [{"uri": "b.bin", "byteLength": 12}], "bufferViews": [{"buffer": 0, "byteLength": 12}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC3",
                    "min": [0, 0, 0], "max": [0, 0, 0]}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]});
            gltf_contents(root.to_string().as_bytes()).skins
        };
        assert_eq!(of_nodes(json!([{"name": "hips"}])), 0);
        assert_eq!(of_nodes(json!([{"name": "hips"}, {"mesh": 0, "skin": 0}])), 1);
    }

    #[test]
    fn keys_are_interpolated_as_the_format_defines() {
        let choice = MotionChoice { name: Some("wave"), rate: Some(40.0), most_joint_frames: 100 };
        // of a cubic spline, every key has a tangent before and after it, per second
        let spline = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let ends = [1.0, 0.0, 0.0, 3.0, 0.0, 0.0];
        // at a quarter of the interval
        let hermite = (2.0 / 64.0 - 3.0 / 16.0 + 1.0) + 3.0 * (3.0 / 16.0 - 2.0 / 64.0) + (1.0 / 64.0 - 0.125 + 0.25);
        for (name, values, expected) in
            [("LINEAR", &ends[..], 1.5), ("STEP", &ends, 1.0), ("CUBICSPLINE", &spline, hermite)]
        {
            let motion = read(name, values, &choice).unwrap();
            assert_eq!((motion.frames.len(), motion.frames_per_second), (5, 40.0));
            assert_eq!(motion.parents, [None, Some(0)]);
            let place = motion.frames[1][1].translation.vector;
            assert!((place - Vector3::new(2.0 * expected, 0.0, 0.0)).norm() < 1e-6, "{name}: {place}");
            let angle = motion.frames[1][0].rotation.angle();
            assert!((angle - 0.25 * 2.0 * 0.6_f64.sqrt().asin()).abs() < 1e-6, "{name}: {angle}");
        }
        assert!(read("LINEAR", &spline, &choice).unwrap_err().contains("2 times and 6 values"));
    }

    #[test]
    fn one_of_several_animations_is_chosen_and_too_many_frames_are_refused() {
        let ends = [1.0, 0.0, 0.0, 3.0, 0.0, 0.0];
        let found = read("LINEAR", &ends, &MotionChoice::default()).unwrap_err();
        assert!(found.contains("2 animations; set `subject` to the name of one: wave, rest"), "{found}");
        let choice = MotionChoice { name: Some("wave"), rate: Some(1e5), most_joint_frames: 100 };
        assert!(read("LINEAR", &ends, &choice).unwrap_err().contains("are too many"));
    }
}
