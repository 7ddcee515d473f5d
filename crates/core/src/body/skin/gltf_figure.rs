//! The joints of the figure in a glTF file: which of them move which segment, and where they are in the bind pose.
//!
//! A joint's bind pose is the inverse of its inverse bind matrix. Nodes are often left in a pose of an animation; then
//! the products of both differ from joint to joint, and the matrices count. VRM's map or the user says which joint is
//! which, else they are found by [`human_tree`].

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use gltf::accessor::{DataType, Dimensions};
use nalgebra::{Matrix3, Matrix4, Point3, Vector3};

use super::gltf_body::{BodyNodes, GivenNodes};
use super::gltf_document::GltfFile;
use super::gltf_numbers::{Buffers, rows};
use super::gltf_tree::NodeTree;
use super::mesh::SkinMesh;
use crate::body::upright::nearest_axis;
use crate::input::excerpt;

const MOST_JOINTS: usize = 10_000;
/// Greatest number of skins of a figure: one per garment.
const MOST_SKINS: usize = 100;
/// Differences between transforms that should be equal, as a share of their size: files have single precision.
const EQUAL: f64 = 0.01;
/// Accepted heights from ankle to crown, metres.
const HEIGHTS: std::ops::RangeInclusive<f64> = 0.3..=3.0;
/// Statures of adults, metres, as which a figure of another height is read if a unit explains it.
const STATURES: std::ops::RangeInclusive<f64> = 1.2..=2.3;
/// Lengths of units other than the metre, and their names.
const UNITS: [(f64, &str); 7] = [
    (0.01, "centimetres"),
    (0.001, "millimetres"),
    (0.1, "decimetres"),
    (0.0254, "inches"),
    (100.0, "units of 100 m (centimetres scaled twice)"),
    (10.0, "units of 10 m"),
    (1000.0, "kilometres (millimetres scaled twice)"),
];

pub(super) struct SkinJoint {
    pub(super) segment: String,
    /// Transform from the mesh's own frame to the bind pose: metres, Y up, facing +Z.
    pub(super) place_from_mesh: Matrix4<f64>,
}

/// A skin's joints, as nodes, and their inverse bind matrices.
pub(super) struct SkinNodes {
    pub(super) nodes: Vec<usize>,
    inverse: Option<Vec<Matrix4<f64>>>,
}

/// The joints of all skins of one figure.
pub(super) struct Figure {
    /// For every skin, by its index, its joints by their index in it.
    pub(super) of_skins: BTreeMap<usize, Vec<SkinJoint>>,
    body: BodyNodes,
    /// Places of all nodes in the bind pose, body axes, metres.
    places: Vec<Point3<f64>>,
    /// The map of landmarks to joints, as scenarios take it.
    pub(super) joint_map: BTreeMap<String, String>,
    pub(super) notes: Vec<String>,
}

impl Figure {
    /// The joints of these nodes' skins, which must belong to one skeleton.
    pub(super) fn of(
        gltf: &GltfFile,
        skinned: &[gltf::Node<'_>],
        joint_map: &BTreeMap<String, String>,
    ) -> Result<Self, String> {
        let mut skins: BTreeMap<usize, SkinNodes> = BTreeMap::new();
        for skin in skinned.iter().filter_map(gltf::Node::skin) {
            if skins.len() >= MOST_SKINS {
                return Err(format!("{MOST_SKINS} skins or more"));
            }
            if let Entry::Vacant(new) = skins.entry(skin.index()) {
                new.insert(SkinNodes::of(&skin, &gltf.buffers)?);
            }
        }
        let tree = NodeTree::of(&gltf.document)?;
        let mut notes = Vec::new();
        let bind = BindPose::of(&tree, &skins);
        if bind.is_posed {
            notes
                .push("its nodes are in another pose than that of its skin: the skin's (the bind pose) is read".into());
        }
        let given = GivenNodes::of(gltf, &tree, &skins, joint_map)?;
        let mut body = BodyNodes::find(&tree, &skins, &bind, &given, &mut notes)?;
        body.check_one_figure(&tree, &skins, skinned)?;
        // what the user says is as seen
        if bind.is_mirrored && body.are_sides_named && joint_map.is_empty() {
            body.exchange_sides();
            notes.push("its nodes mirror it: left and right are exchanged".into());
        }
        let upright = bind.upright(&body, gltf.is_vrm0, &mut notes);
        let segments = body.segments(&tree, &bind);
        let mut of_skins = BTreeMap::new();
        let carried = tree.nearest_segments(&segments);
        let mut unknown = BTreeSet::new();
        for (index, skin) in &skins {
            let transforms = bind.place_from_mesh(&tree, skin);
            let mut joints = Vec::new();
            for (node, place_from_mesh) in skin.nodes.iter().zip(transforms) {
                if !segments.contains_key(node) {
                    unknown.insert(tree.names[*node].as_str());
                }
                let segment = carried.get(*node).copied().flatten().unwrap_or("pelvis").to_owned();
                let place_from_mesh = if upright == Matrix3::identity() {
                    place_from_mesh
                } else {
                    upright.to_homogeneous() * place_from_mesh
                };
                joints.push(SkinJoint { segment, place_from_mesh });
            }
            of_skins.insert(*index, joints);
        }
        if !unknown.is_empty() {
            let unknown = excerpt(&unknown.into_iter().collect::<Vec<_>>().join(", "));
            notes.push(format!("joints that move with the nearest known joint above them: {unknown}"));
        }
        let place = |world: &Matrix4<f64>| forward(upright * world.column(3).xyz());
        let places = bind.world.iter().map(place).collect();
        let joint_map = body.joint_map(&tree);
        Ok(Self { of_skins, body, places, joint_map, notes })
    }

    pub(super) fn landmarks(&self, mesh: &SkinMesh) -> Result<BTreeMap<String, Point3<f64>>, String> {
        let mut landmarks: BTreeMap<String, Point3<f64>> = BTreeMap::new();
        for (landmark, node) in self.body.landmarks() {
            landmarks.insert(landmark, self.places[node]);
        }
        let middle = |part: &str, from: &BTreeMap<String, Point3<f64>>| {
            nalgebra::center(&from[&format!("left_{part}")], &from[&format!("right_{part}")])
        };
        landmarks.insert("pelvis".to_owned(), middle("hip", &landmarks));
        let head = self.places[self.body.head];
        if !landmarks.contains_key("thorax") {
            let shoulders = middle("shoulder", &landmarks);
            landmarks.insert("thorax".to_owned(), shoulders + (head - shoulders) * NECK_SHARE);
        }
        let own = mesh.weights.as_ref().and_then(|weights| weights.get("head"));
        let of_head = own.into_iter().flatten().filter(|(_, share)| *share > 0.5);
        let tops = of_head.filter_map(|(vertex, _)| mesh.vertices.get(*vertex as usize));
        let Some(top) = tops.max_by(|a, b| a.z.total_cmp(&b.z)) else {
            return Err("the head joint is recognised, but no vertex has more than half of its weight there, so the \
            position of the crown is unknown; give the head its weights, or export the mesh as OBJ and define \
            its landmarks in a .toml"
                .to_owned());
        };
        landmarks.insert("head_top".to_owned(), Point3::new(head.x, head.y, top.z));
        let height = top.z - landmarks["left_ankle"].z.min(landmarks["right_ankle"].z);
        if !HEIGHTS.contains(&height) {
            return Err(format!(
                "the body measures {height:.3} m from ankle to crown along Y; expected {} to {}: glTF uses metres with \
                 Y up; scale it when exporting",
                HEIGHTS.start(),
                HEIGHTS.end()
            ));
        }
        Ok(landmarks)
    }
}

/// The base of the neck on the way from the middle of the shoulders to the joint below the head.
const NECK_SHARE: f64 = 0.3;

/// Converts from Y up and facing +Z to X forward, Y left, Z up.
pub(super) fn forward(place: Vector3<f64>) -> Point3<f64> {
    Point3::new(place.z, place.x, place.y)
}

impl SkinNodes {
    fn of(skin: &gltf::Skin<'_>, buffers: &Buffers) -> Result<Self, String> {
        let nodes: Vec<usize> = skin.joints().take(MOST_JOINTS + 1).map(|joint| joint.index()).collect();
        if nodes.len() > MOST_JOINTS {
            return Err(format!("a skin has more than {MOST_JOINTS} joints"));
        }
        let Some(accessor) = skin.inverse_bind_matrices() else { return Ok(Self { nodes, inverse: None }) };
        let inverse: Vec<[f64; 16]> = rows(&accessor, buffers, (&[DataType::F32], Dimensions::Mat4), MOST_JOINTS)?;
        if inverse.len() < nodes.len() {
            let (joints, found) = (nodes.len(), inverse.len());
            return Err(format!("{joints} joints and {found} inverse bind matrices; expected equal numbers"));
        }
        let inverse = inverse.iter().map(|own| Matrix4::from_column_slice(own)).collect();
        Ok(Self { nodes, inverse: Some(inverse) })
    }
}

/// The pose in which the skins fit their joints.
pub(super) struct BindPose {
    /// World-from-node transforms.
    pub(super) world: Vec<Matrix4<f64>>,
    /// Whether the nodes are in another pose.
    is_posed: bool,
    /// Whether the nodes mirror the figure.
    is_mirrored: bool,
}

impl BindPose {
    fn of(tree: &NodeTree, skins: &BTreeMap<usize, SkinNodes>) -> Self {
        let posed: Vec<Matrix4<f64>> = tree.world.clone();
        let main = skins.values().filter(|skin| skin.inverse.is_some()).max_by_key(|skin| skin.nodes.len());
        let as_posed = |is_mirrored| Self { world: posed.clone(), is_posed: false, is_mirrored };
        let Some((skin, inverse)) = main.and_then(|skin| Some((skin, skin.inverse.as_ref()?))) else {
            return as_posed(false);
        };
        // from the mesh's frame to the world, by every joint
        let products: Vec<Matrix4<f64>> =
            skin.nodes.iter().zip(inverse).map(|(node, inverse)| tree.world[*node] * inverse).collect();
        let Some(first) = products.first() else { return as_posed(false) };
        let reach = skin.nodes.iter().map(|node| (tree.origin(*node) - tree.origin(skin.nodes[0])).norm());
        let reach = reach.fold(0.0, f64::max);
        let is_equal = |other: &Matrix4<f64>| {
            let turned = other.fixed_view::<3, 3>(0, 0) - first.fixed_view::<3, 3>(0, 0);
            let moved = other.column(3).xyz() - first.column(3).xyz();
            turned.norm() <= EQUAL * first.fixed_view::<3, 3>(0, 0).norm() && moved.norm() <= EQUAL * reach
        };
        if products.iter().all(is_equal) {
            return as_posed(first.fixed_view::<3, 3>(0, 0).determinant() < 0.0);
        }
        // columns may differ in length: positions are quantised to the extent of the mesh
        let mut scale = Vector3::zeros();
        for axis in 0..3 {
            let mut lengths: Vec<f64> = products.iter().map(|own| own.column(axis).xyz().norm()).collect();
            lengths.sort_by(f64::total_cmp);
            scale[axis] = lengths[lengths.len() / 2];
        }
        let scale = Matrix4::new_nonuniform_scaling(&scale);
        let mut world = posed.clone();
        let bound: BTreeMap<usize, &Matrix4<f64>> = skin.nodes.iter().copied().zip(inverse).collect();
        for &node in &tree.order {
            let own = bound.get(&node).and_then(|inverse| inverse.try_inverse());
            let parent = tree.parents[node];
            world[node] = match (own, parent) {
                (Some(own), _) => scale * own,
                (None, Some(parent)) => {
                    let local = posed[parent].try_inverse().unwrap_or_else(Matrix4::identity) * posed[node];
                    world[parent] * local
                }
                (None, None) => posed[node],
            };
        }
        // nodes above the skeleton are not where the bind pose is, and move nothing of it
        Self { world, is_posed: true, is_mirrored: false }
    }

    pub(super) fn origin(&self, node: usize) -> Vector3<f64> {
        self.world[node].column(3).xyz()
    }

    /// For every joint of a skin, the transform from the mesh's frame to the bind pose.
    fn place_from_mesh(&self, tree: &NodeTree, skin: &SkinNodes) -> Vec<Matrix4<f64>> {
        let inverse = |joint: usize| match &skin.inverse {
            Some(inverse) => inverse[joint],
            None => Matrix4::identity(),
        };
        if self.is_posed && skin.inverse.is_some() {
            // all joints place the mesh alike; the first of the tree is not below a joint that may be turned
            let first = (0..skin.nodes.len()).min_by_key(|joint| tree.depths[skin.nodes[*joint]]);
            let whole = first.map_or_else(Matrix4::identity, |joint| self.world[skin.nodes[joint]] * inverse(joint));
            return vec![whole; skin.nodes.len()];
        }
        skin.nodes.iter().enumerate().map(|(joint, node)| self.world[*node] * inverse(joint)).collect()
    }

    /// Turns the body to Y up and facing +Z, if it is not, and scales it to metres, if a unit explains its height.
    fn upright(&self, body: &BodyNodes, is_vrm0: bool, notes: &mut Vec<String>) -> Matrix3<f64> {
        let at = |node: usize| self.origin(node);
        let [hips, shoulders] = [&body.legs, &body.arms].map(|limbs| (at(limbs[0][0]) + at(limbs[1][0])) * 0.5);
        let up = shoulders - hips;
        let across = |limbs: &[[usize; 3]; 2]| at(limbs[0][0]) - at(limbs[1][0]);
        let ahead = (across(&body.legs) + across(&body.arms)).cross(&up);
        let up_axis = nearest_axis(&up);
        // the third axis is not along the trunk, however it leans
        let ahead_axis = nearest_axis(&(ahead - up_axis * ahead.dot(&up_axis)));
        let turn =
            Matrix3::from_rows(&[up_axis.cross(&ahead_axis).transpose(), up_axis.transpose(), ahead_axis.transpose()]);
        if turn != Matrix3::identity() && !is_vrm0 && !self.is_posed {
            let (along, faced) = (axis_name(&up_axis), axis_name(&ahead_axis));
            let found = format!("its trunk points along {along} and it faces {faced}");
            notes.push(format!("{found}: turned upright, as it is in glTF (Y up, facing +Z)"));
        }
        let length = |[a, b, c]: [usize; 3]| (at(a) - at(b)).norm() + (at(b) - at(c)).norm();
        // share of legs and trunk without feet, neck and head (`[Drillis 1966]`)
        let stature = (length(body.legs[0]) + up.norm()) / 0.771;
        if HEIGHTS.contains(&stature) {
            return turn;
        }
        match UNITS.iter().find(|(unit, _)| STATURES.contains(&(stature * unit))) {
            Some((unit, name)) => {
                notes.push(format!("it is {stature:.4} m tall: read as {name}, {:.2} m", stature * unit));
                turn * *unit
            }
            None => turn,
        }
    }
}

fn axis_name(axis: &Vector3<f64>) -> String {
    let name = ["X", "Y", "Z"][axis.iamax()];
    format!("{}{name}", if axis.sum() < 0.0 { "-" } else { "+" })
}
