//! Sensor model: gain, offset, noise, eight bits.

use rand::RngExt;

use super::settings::{ImageSettings, PERIODS};
use super::texture::mixed;
use crate::observing::Image;
use skiagraph_core::rng::{KeyedSeed, Purpose, normal};

/// Number of tabulated normal deviates, a power of two.
const DEVIATES: usize = 1 << 16;

/// The image being exposed: a frame of the sequence, or a background image of a period.
#[derive(Clone, Copy, Debug)]
pub(super) enum Exposure {
    /// Index of the frame, and number of frames.
    Frame(usize, usize),
    /// Period, and index of the image in it.
    Background(usize, usize),
}

/// Converts brightness to images of eight bits.
pub(super) struct Sensor {
    settings: ImageSettings,
    seed: KeyedSeed,
    /// Gain and offset of each period.
    drift: [[f32; 2]; PERIODS],
    deviates: Vec<f32>,
}

impl Sensor {
    pub(super) fn new(settings: &ImageSettings, seed: KeyedSeed) -> Self {
        let mut random = seed.stream(Purpose::Imaging, 0, 0, 0);
        let mut even = |most: f64| (most * (2.0 * random.random::<f64>() - 1.0)) as f32;
        let drift = [(); PERIODS].map(|()| [1.0 + even(settings.gain_drift), even(settings.offset_drift)]);
        let mut random = seed.stream(Purpose::Imaging, 0, 0, 1);
        let deviates = (0..DEVIATES).map(|_| normal(&mut random) as f32).collect();
        Self { settings: *settings, seed, drift, deviates }
    }

    /// An image of planes of brightness: with the gain and offset of its time, and read and shot noise with variance
    /// `read^2 + shot * brightness`, rounded and clamped to 0..=255.
    pub(super) fn expose(&self, width: u32, height: u32, planes: &[Vec<f32>], camera: usize, of: Exposure) -> Image {
        let [gain, offset] = self.drift_of(of);
        let deviation = self.deviations();
        let (time, layer) = match of {
            Exposure::Frame(frame, _) => (frame as u64, 1),
            Exposure::Background(period, number) => (number as u64, 2 + period as u64),
        };
        let key: u64 = self.seed.stream(Purpose::Imaging, time, layer, camera as u64).random();
        let expose = |(channel, plane): (usize, &Vec<f32>)| {
            let start = mixed(key ^ channel as u64);
            let chunks = plane.chunks(4).enumerate();
            let mut values = Vec::with_capacity(plane.len());
            for (index, chunk) in chunks {
                // four deviates per word of random bits
                let bits = mixed(start.wrapping_add(index as u64));
                for (shift, brightness) in [0, 16, 32, 48].into_iter().zip(chunk) {
                    let level = (gain * brightness + offset).clamp(0.0, 255.0);
                    let noise = self.deviates[(bits >> shift) as usize & (DEVIATES - 1)] * deviation[level as usize];
                    values.push((level + noise + 0.5) as u8);
                }
            }
            values
        };
        let planes = planes.iter().enumerate().map(expose).collect();
        Image::from_valid_planes(width, height, planes)
    }

    /// Gain and offset: those of the period; interpolated between periods for frames.
    fn drift_of(&self, of: Exposure) -> [f32; 2] {
        match of {
            Exposure::Background(period, _) => self.drift[period],
            Exposure::Frame(frame, frames) => {
                let at = frame as f32 / frames.saturating_sub(1).max(1) as f32 * (PERIODS - 1) as f32;
                let first = (at as usize).min(PERIODS - 2);
                let share = at - first as f32;
                std::array::from_fn(|i| {
                    self.drift[first][i] + share * (self.drift[first + 1][i] - self.drift[first][i])
                })
            }
        }
    }

    /// Standard deviation of the noise at each brightness.
    fn deviations(&self) -> [f32; 256] {
        let ImageSettings { read_noise, shot_noise, .. } = self.settings;
        std::array::from_fn(|level| (read_noise * read_noise + shot_noise * level as f64).sqrt() as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(image: &Image) -> (f64, f64) {
        let values = || image.planes()[0].iter().map(|v| f64::from(*v));
        let mean = values().sum::<f64>() / values().count() as f64;
        (mean, values().map(|v| (v - mean).powi(2)).sum::<f64>() / values().count() as f64)
    }

    #[test]
    fn noise_has_the_variance_of_read_and_shot_noise_and_of_rounding() {
        let settings = ImageSettings { gain_drift: 0.0, offset_drift: 0.0, ..ImageSettings::default() };
        let sensor = Sensor::new(&settings, 3.into());
        for level in [40.0_f32, 160.0] {
            let plane = vec![vec![level; 300 * 200]];
            let (mean, variance) = moments(&sensor.expose(300, 200, &plane, 1, Exposure::Frame(5, 9)));
            let expected = 2.5 * 2.5 + 0.02 * f64::from(level) + 1.0 / 12.0;
            assert!((mean - f64::from(level)).abs() < 0.06, "{mean}");
            assert!((variance / expected - 1.0).abs() < 0.03, "{variance}, expected {expected}");
        }
    }

    #[test]
    fn frames_drift_from_the_first_period_via_the_second_to_the_last() {
        let sensor =
            Sensor::new(&ImageSettings { read_noise: 0.0, shot_noise: 0.0, ..ImageSettings::default() }, 8.into());
        for (frame, period) in [(0, 0), (5, 1), (10, 2)] {
            let pair = [Exposure::Frame(frame, 11), Exposure::Background(period, 0)].map(|of| sensor.drift_of(of));
            assert!((0..2).all(|i| (pair[0][i] - pair[1][i]).abs() < 1e-5), "{pair:?}");
        }
        assert!(sensor.drift.iter().all(|[gain, offset]| (gain - 1.0).abs() <= 0.02 && offset.abs() <= 3.0));
        assert_ne!(sensor.drift[0], sensor.drift[1]);
    }

    #[test]
    fn images_differ_and_are_reproducible() {
        let sensor = Sensor::new(&ImageSettings::default(), 3.into());
        let plane = vec![vec![100.0; 64]; 3];
        let image = |camera, of| sensor.expose(8, 8, &plane, camera, of);
        let all = [
            image(0, Exposure::Frame(1, 9)),
            image(1, Exposure::Frame(1, 9)),
            image(0, Exposure::Frame(2, 9)),
            image(0, Exposure::Background(0, 1)),
            image(0, Exposure::Background(1, 1)),
        ];
        assert!(all.iter().enumerate().all(|(i, a)| all[..i].iter().all(|b| a != b)));
        assert_eq!(image(0, Exposure::Frame(1, 9)), all[0]);
        assert_ne!(all[0].planes()[0], all[0].planes()[1]);
    }
}
