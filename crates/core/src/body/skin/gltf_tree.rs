//! Hierarchy and world transforms of a glTF file's nodes.

use std::collections::BTreeMap;

use nalgebra::Matrix4;

/// The nodes of a file.
pub(super) struct NodeTree {
    parents: Vec<Option<usize>>,
    /// World-from-node transform, by the node's index.
    world: Vec<Matrix4<f64>>,
    /// Parents before their children.
    order: Vec<usize>,
}

impl NodeTree {
    /// Number of nodes.
    pub(super) fn count(&self) -> usize {
        self.parents.len()
    }

    /// World-from-node transform.
    pub(super) fn world(&self, node: usize) -> Matrix4<f64> {
        self.world.get(node).copied().unwrap_or_else(Matrix4::identity)
    }

    /// For every node the topmost `marked` node among itself and its ancestors.
    pub(super) fn tops(&self, marked: &[bool]) -> Vec<Option<usize>> {
        let mut tops = vec![None; self.parents.len()];
        for &node in &self.order {
            tops[node] = self.parents[node].and_then(|parent| tops[parent]).or_else(|| marked[node].then_some(node));
        }
        tops
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
        let mut order = Vec::with_capacity(nodes.len());
        while let Some(node) = waiting.pop() {
            order.push(node);
            let own = nodes[node].transform().matrix();
            let own = Matrix4::from_fn(|row, column| f64::from(own[column][row]));
            world[node] = parents[node].map_or(own, |parent: usize| world[parent] * own);
            waiting.extend(&below[node]);
        }
        if order.len() == nodes.len() {
            Ok(Self { parents, world, order })
        } else {
            Err("some nodes are their own ancestors".to_owned())
        }
    }
}
