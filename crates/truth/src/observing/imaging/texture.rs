//! Noise textures, determined by position only.

use rand::RngExt;

use skiagraph_core::rng::{KeyedSeed, Purpose};

/// The textures of a scene. With the public key all scenes have the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Textures {
    /// Makes textures depend on the secret key; 0 with the public key.
    salt: u64,
}

impl Textures {
    pub(super) fn new(seed: KeyedSeed) -> Self {
        let drawn = || seed.stream(Purpose::Imaging, 0, 11, 0).random();
        Self { salt: if seed.key.is_public() { 0 } else { drawn() } }
    }

    /// Smooth noise between -1 and 1 at a point in space, with a length scale of `cell` metres; `kind` distinguishes
    /// the textures of a scene.
    pub(super) fn noise(self, x: f32, y: f32, z: f32, cell: f32, kind: u32) -> f32 {
        let (ix, sx) = split(x / cell);
        let (iy, sy) = split(y / cell);
        let (iz, sz) = split(z / cell);
        let mix = |a: f32, b: f32, s: f32| a + (b - a) * s;
        let at = |x: i32, y: i32, z: i32| self.at([x, y, z], kind);
        let along_x = |dy: i32, dz: i32| mix(at(ix, iy + dy, iz + dz), at(ix + 1, iy + dy, iz + dz), sx);
        let along_y = |dz: i32| mix(along_x(0, dz), along_x(1, dz), sy);
        mix(along_y(0), along_y(1), sz)
    }

    /// A lattice value between -1 and 1, from a hash of its position (the finaliser of `[Steele 2014]`).
    fn at(self, [x, y, z]: [i32; 3], kind: u32) -> f32 {
        let place =
            (u64::from(x as u32) << 32 | u64::from(y as u32)) ^ (u64::from(z as u32) << 16) ^ u64::from(kind) << 48;
        (mixed(place ^ self.salt) >> 40) as f32 * (2.0 / (1 << 24) as f32) - 1.0
    }
}

/// Integer part, and the smoothed fraction.
fn split(value: f32) -> (i32, f32) {
    let whole = value.floor().clamp(-1e9, 1e9);
    let rest = value - whole;
    (whole as i32, rest * rest * (3.0 - 2.0 * rest))
}

/// The finaliser of SplitMix64.
pub(super) fn mixed(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ value >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ value >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ value >> 31
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::ObservationKey;

    #[test]
    fn noise_is_continuous_bounded_and_differs_between_positions_and_textures() {
        let usual = Textures::new(1.into());
        let noise = |x, y, z, cell, kind| usual.noise(x, y, z, cell, kind);
        let mut sum = 0.0;
        for i in 0..4000 {
            let (x, y, z) = (i as f32 * 0.013 - 20.0, i as f32 * 0.007, 0.3);
            let here = noise(x, y, z, 0.1, 1);
            assert!(here.abs() <= 1.0);
            assert!((here - noise(x + 1e-4, y, z, 0.1, 1)).abs() < 0.01);
            sum += here;
        }
        assert!((sum / 4000.0_f32).abs() < 0.1, "{sum}");
        assert_ne!(noise(1.0, 2.0, 3.0, 0.3, 1), noise(1.0, 2.0, 3.0, 0.3, 2));
        let secret = Textures::new(KeyedSeed { key: ObservationKey::from_bytes([7; 16]), seed: 1 });
        assert_ne!(noise(1.0, 2.0, 3.0, 0.3, 1), secret.noise(1.0, 2.0, 3.0, 0.3, 1));
    }
}
