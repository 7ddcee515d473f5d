//! Appearance of ground, walls, props and clothing, and their illumination.

use nalgebra::{Point3, Vector3};
use rand::RngExt;

use super::settings::ImageSettings;
use super::texture::Textures;
use skiagraph_core::body::Humanoid;
use skiagraph_core::rng::{KeyedSeed, Purpose, normal};

/// Red, green and blue, 0 to 255.
pub(super) type Rgb = [f32; 3];

/// Mean colours of ground and walls; the contrast of clothing is relative to their mean.
const GROUND: Rgb = [138.0, 128.0, 112.0];
const WALL: Rgb = [150.0, 148.0, 140.0];
const AMBIENT: f32 = 0.5;

/// Illumination of a surface with this normal, as a share of the maximum; `sunny` outside shadows.
pub(super) fn light(normal: &Vector3<f64>, towards_sun: &Vector3<f64>, sunny: bool) -> f32 {
    let direct = if sunny { normal.dot(towards_sun).max(0.0) as f32 } else { 0.0 };
    AMBIENT + (1.0 - AMBIENT) * direct
}

/// Colour of the ground at a point: slabs of one metre, grain and stains.
pub(super) fn ground(textures: Textures, x: f32, y: f32) -> Rgb {
    let noise = |x, y, cell, kind| textures.noise(x, y, 0.0, cell, kind);
    let joint = |v: f32| (v - v.floor() - 0.5).abs() > 0.492;
    let stain = 14.0 * noise(x, y, 0.7, 1) + 9.0 * noise(x, y, 0.09, 2) + 5.0 * noise(x, y, 0.02, 3);
    let slab = 10.0 * noise(x.floor() * 3.7, y.floor() * 5.3, 1.0, 4);
    let dark = if joint(x) || joint(y) { -35.0 } else { 0.0 };
    GROUND.map(|c| c + stain + slab + dark)
}

/// Colour of a wall at a point: plaster, and panels of 1.2 metres with dark seams.
pub(super) fn wall(textures: Textures, point: &Point3<f64>, along: f64) -> Rgb {
    let noise = |x, y, z, cell, kind| textures.noise(x, y, z, cell, kind);
    let (along, z) = (along as f32, point.z as f32);
    let seam = (along / 1.2 - (along / 1.2).floor() - 0.5).abs() > 0.49 || (0.0..0.1).contains(&z);
    let plaster = 10.0 * noise(along, z, point.x as f32, 0.9, 5) + 6.0 * noise(along, z, point.y as f32, 0.06, 6);
    let panel = 12.0 * noise((along / 1.2).floor() * 2.9, 0.0, 0.0, 1.0, 7);
    let dark = if seam { -45.0 } else { 0.0 };
    [WALL[0] + plaster + panel + dark, WALL[1] + plaster + panel + dark, WALL[2] + plaster + dark]
}

pub(super) fn prop(textures: Textures, index: usize, point: &Point3<f64>) -> Rgb {
    let noise = |x, y, z, cell, kind| textures.noise(x, y, z, cell, kind);
    let [x, y, z] = [point.x, point.y, point.z].map(|c| c as f32);
    let grain = 12.0 * noise(x, y, z, 0.05, 20 + index as u32);
    let shade = 30.0 * noise(index as f32 * 7.3, 0.0, 0.0, 1.0, 8);
    [120.0 + shade + grain, 100.0 + grain, 85.0 - shade + grain]
}

pub(super) struct Clothing {
    of_link: Vec<Rgb>,
    textures: Textures,
}

impl Clothing {
    /// One colour per garment, the same for left and right: at a distance of `clothing_contrast` from the mean of
    /// ground and walls, in a random direction.
    pub(super) fn new(body: &Humanoid, settings: &ImageSettings, seed: KeyedSeed) -> Self {
        let mut garments: Vec<(&str, Rgb)> = Vec::new();
        let of_link = body.links.iter().map(|link| {
            let garment = garment(&link.name);
            if let Some((_, colour)) = garments.iter().find(|(name, _)| *name == garment) {
                return *colour;
            }
            let mut random = seed.stream(Purpose::Imaging, garments.len() as u64, 9, 0);
            let direction = Vector3::from_fn(|_, _| normal(&mut random)).try_normalize(1e-9).unwrap_or_else(Vector3::x);
            // darker for two garments in three; colours outside the sensor's range saturate
            let side = if random.random::<f64>() < 0.65 { -1.0 } else { 1.0 };
            let length = settings.clothing_contrast;
            let colour = std::array::from_fn(|c| {
                let mean = f64::from(0.5 * (GROUND[c] + WALL[c]));
                (mean + side * length * direction[c].abs()).clamp(5.0, 250.0) as f32
            });
            garments.push((garment, colour));
            colour
        });
        Self { of_link: of_link.collect(), textures: Textures::new(seed) }
    }

    /// The colour of a point on a link, with the texture of its cloth.
    pub(super) fn at(&self, link: usize, point_in_link: &Point3<f64>) -> Rgb {
        let [x, y, z] = [point_in_link.x, point_in_link.y, point_in_link.z].map(|c| c as f32);
        let noise = |cell, kind| self.textures.noise(x, y, z, cell, kind);
        let folds = 10.0 * noise(0.08, 40) + 5.0 * noise(0.015, 41);
        self.of_link[link].map(|c| c + folds)
    }
}

/// The garment of a link, by its name: trousers, shoes, a shirt, or skin.
fn garment(link: &str) -> &'static str {
    let name = link.to_ascii_lowercase();
    let contains = |words: &[&str]| words.iter().any(|word| name.contains(word));
    if contains(&["hand", "head", "neck", "wrist"]) {
        "skin"
    } else if contains(&["foot", "toe", "ankle"]) {
        "shoes"
    } else if contains(&["thigh", "shank", "hip", "knee", "pelvis", "leg", "femur", "tibia"]) {
        "trousers"
    } else {
        "shirt"
    }
}
