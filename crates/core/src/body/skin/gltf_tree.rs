//! Hierarchy and world transforms of a glTF file's nodes.

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Vector3};

/// Greatest number of ancestors of a node; a hand has about twenty.
const MOST_DEPTH: usize = 1_000;

pub(super) struct NodeTree {
    /// Names, or `node 7` without one.
    pub(super) names: Vec<String>,
    pub(super) parents: Vec<Option<usize>>,
    /// Number of ancestors.
    pub(super) depths: Vec<usize>,
    pub(super) has_mesh: Vec<bool>,
    /// World-from-node transform, by the node's index.
    pub(super) world: Vec<Matrix4<f64>>,
    /// Parents before their children.
    pub(super) order: Vec<usize>,
}

impl NodeTree {
    pub(super) fn origin(&self, node: usize) -> Vector3<f64> {
        self.world[node].column(3).xyz()
    }

    /// The node and its ancestors.
    pub(super) fn upwards(&self, node: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(node), |&node| self.parents[node])
    }

    pub(super) fn is_below(&self, node: usize, above: usize) -> bool {
        self.upwards(node).any(|other| other == above)
    }

    pub(super) fn common_ancestor(&self, a: usize, b: usize) -> Option<usize> {
        self.upwards(a).find(|&node| self.is_below(b, node))
    }

    /// For every node its own segment, or that of the nearest ancestor that has one.
    pub(super) fn nearest_segments<'a>(&self, own: &'a BTreeMap<usize, String>) -> Vec<Option<&'a str>> {
        let mut segments = vec![None; self.parents.len()];
        for &node in &self.order {
            let above = || self.parents[node].and_then(|parent| segments[parent]);
            segments[node] = own.get(&node).map(String::as_str).or_else(above);
        }
        segments
    }

    /// The tree of a file; an error for a node with two parents or a cycle.
    pub(super) fn of(document: &gltf::Document) -> Result<Self, String> {
        let nodes: Vec<gltf::Node<'_>> = document.nodes().collect();
        let mut parents = vec![None; nodes.len()];
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
        for node in &nodes {
            for child in node.children().map(|child| child.index()) {
                if parents[child].replace(node.index()).is_some() {
                    return Err(format!("node {child} has two parents"));
                }
                below[node.index()].push(child);
            }
        }
        let mut world = vec![Matrix4::identity(); nodes.len()];
        let mut waiting: Vec<usize> = (0..nodes.len()).filter(|node| parents[*node].is_none()).collect();
        // the first root and the first child first
        waiting.reverse();
        let mut order = Vec::with_capacity(nodes.len());
        let mut depths = vec![0; nodes.len()];
        while let Some(node) = waiting.pop() {
            order.push(node);
            let own = nodes[node].transform().matrix();
            let own = Matrix4::from_fn(|row, column| f64::from(own[column][row]));
            world[node] = parents[node].map_or(own, |parent: usize| world[parent] * own);
            depths[node] = parents[node].map_or(0, |parent: usize| depths[parent] + 1);
            if depths[node] > MOST_DEPTH {
                return Err(format!("nodes are nested more than {MOST_DEPTH} deep"));
            }
            waiting.extend(below[node].iter().rev());
        }
        if order.len() == nodes.len() {
            let name = |node: &gltf::Node<'_>| node.name().filter(|name| !name.is_empty()).map(str::to_owned);
            let names = nodes.iter().map(|node| name(node).unwrap_or_else(|| format!("node {}", node.index())));
            let has_mesh = nodes.iter().map(|node| node.mesh().is_some()).collect();
            Ok(Self { names: names.collect(), parents, depths, has_mesh, world, order })
        } else {
            Err("some nodes are their own ancestors".to_owned())
        }
    }
}
