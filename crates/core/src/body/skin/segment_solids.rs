//! The part of a skin that belongs to every link: volume, centre and second moments.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Point3, Vector3};

use super::Skin;

/// Volume, and first and second moments about a common point, of the inside of a closed surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SegmentMoments {
    /// Cubic metres.
    pub(super) volume: f64,
    /// Integral of the position, m^4.
    pub(super) first: Vector3<f64>,
    /// Integral of the outer product of the position with itself, m^5.
    pub(super) second: Matrix3<f64>,
}

impl SegmentMoments {
    /// Adds the tetrahedron of a triangle and the common point; negative if the triangle faces towards that point.
    fn add(&mut self, [a, b, c]: [Vector3<f64>; 3]) {
        let determinant = a.dot(&b.cross(&c));
        let sum = a + b + c;
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
        self.volume += determinant / 6.0;
        self.first += sum * (determinant / 24.0);
        self.second += squares * (determinant / 120.0);
    }

    /// The moments of the surface turned inside out.
    pub(super) fn reversed(self) -> Self {
        Self { volume: -self.volume, first: -self.first, second: -self.second }
    }
}

/// The moments of every link's part of a skin in the bind pose, and the point that they are about.
///
/// A triangle belongs to the link that carries most of it ([`Skin::part_of`]). Where triangles of two links meet, the
/// body is cut: every loop of such edges is closed by a cone to the loop's middle, with opposite orientations for the
/// two links, so that nothing is lost or counted twice. Where three links meet, the connected loops share one middle.
/// Holes are closed in the same way.
pub(super) fn moments_of_links(skin: &Skin, links: usize) -> (Vec<SegmentMoments>, Point3<f64>) {
    let count = skin.vertices.len().max(1) as f64;
    let about = Point3::from(skin.vertices.iter().map(|vertex| vertex.coords).sum::<Vector3<f64>>() / count);
    let place = |vertex: u32| skin.vertices[vertex as usize] - about;
    let mut moments = vec![SegmentMoments::default(); links];
    for (number, corners) in skin.triangles.iter().enumerate() {
        moments[skin.part_of(number) as usize].add(corners.map(place));
    }
    for seam in seams(skin) {
        let vertices: BTreeSet<u32> = seam.iter().flat_map(|cut| cut.ends).collect();
        let middle = vertices.iter().map(|vertex| place(*vertex)).sum::<Vector3<f64>>() / vertices.len().max(1) as f64;
        for Cut { link, ends: [from, to], .. } in seam {
            moments[link as usize].add([place(to), place(from), middle]);
        }
    }
    (moments, about)
}

/// An edge where a link's triangles end.
#[derive(Clone, Copy)]
struct Cut {
    link: u32,
    /// The link with the adjacent triangles; the link itself at a hole.
    other: u32,
    /// In the direction of the link's triangle.
    ends: [u32; 2],
}

/// The cuts, grouped by shared middles.
fn seams(skin: &Skin) -> Vec<Vec<Cut>> {
    let mut between: BTreeMap<[u32; 2], Vec<Cut>> = BTreeMap::new();
    for cut in cuts(skin) {
        between.entry([cut.link.min(cut.other), cut.link.max(cut.other)]).or_default().push(cut);
    }
    let (mut loops, mut rest) = (Vec::new(), Vec::new());
    for seam in between.into_values().flat_map(connected) {
        if is_closed(&seam) { loops.push(seam) } else { rest.extend(seam) }
    }
    loops.extend(connected(rest));
    loops
}

/// Edges of triangles whose counterpart belongs to another link or is missing.
fn cuts(skin: &Skin) -> Vec<Cut> {
    let mut open: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    let mut cuts = Vec::new();
    let edges = |triangle: &[u32; 3]| [0, 1, 2].map(|side| [triangle[side], triangle[(side + 1) % 3]]);
    for (number, triangle) in skin.triangles.iter().enumerate() {
        let link = skin.part_of(number);
        for [from, to] in edges(triangle) {
            match open.get_mut(&[to, from]).and_then(Vec::pop) {
                Some(other) if other == link => {}
                Some(other) => {
                    cuts.push(Cut { link, other, ends: [from, to] });
                    cuts.push(Cut { link: other, other: link, ends: [to, from] });
                }
                None => open.entry([from, to]).or_default().push(link),
            }
        }
    }
    let holes =
        open.into_iter().flat_map(|(ends, links)| links.into_iter().map(move |link| Cut { link, other: link, ends }));
    cuts.extend(holes);
    cuts
}

/// Whether the cuts of each link form closed loops.
fn is_closed(seam: &[Cut]) -> bool {
    let mut balance: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    for Cut { link, ends: [from, to], .. } in seam {
        *balance.entry((*link, *from)).or_default() += 1;
        *balance.entry((*link, *to)).or_default() -= 1;
    }
    balance.values().all(|count| *count == 0)
}

/// Groups of cuts connected by vertices.
fn connected(cuts: Vec<Cut>) -> Vec<Vec<Cut>> {
    let mut root: BTreeMap<u32, u32> = cuts.iter().flat_map(|cut| cut.ends).map(|vertex| (vertex, vertex)).collect();
    let find = |root: &BTreeMap<u32, u32>, mut vertex: u32| {
        while root[&vertex] != vertex {
            vertex = root[&vertex];
        }
        vertex
    };
    for cut in &cuts {
        let [a, b] = cut.ends.map(|end| find(&root, end));
        root.insert(a.max(b), a.min(b));
    }
    let mut groups: BTreeMap<u32, Vec<Cut>> = BTreeMap::new();
    for cut in cuts {
        groups.entry(find(&root, cut.ends[0])).or_default().push(cut);
    }
    groups.into_values().collect()
}
