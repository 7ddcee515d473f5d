//! Background subtraction on simulated images, compared with OpenCV: regenerates `results/background.md`.
//!
//! `cargo run --release --example studies -- background`; `SKIAGRAPH_TEST_PYTHON` must be a Python with
//! opencv-python-headless. The images are written to `runs/background/`. Settings were tuned on seed 1; seeds 11 to 13
//! are reported.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use skiagraph::benchmark_set::silhouette_to_png;
use skiagraph::observation::{
    BackgroundMixture, BackgroundSettings, Cleaning, Image, ImageSettings, Observer, OnlineBackground, OnlineSettings,
    Risk, SceneCamera, Segmenter,
};
use skiagraph::prepare::PreparedScene;
use skiagraph::raster::{Mask, overlap};
use skiagraph::scenario::ScenarioFile;

const SEEDS: [u64; 3] = [11, 12, 13];
/// Interval of the images, frames of the default walk.
const STRIDE: usize = 15;
/// Contrasts of clothing with the background, grey values.
const CONTRASTS: [f64; 3] = [30.0, 60.0, 100.0];

/// True positives, false positives and false negatives in pixels, and seconds.
#[derive(Clone, Copy, Default)]
struct Count {
    both: u64,
    more: u64,
    less: u64,
    seconds: f64,
    frames: u32,
}

impl Count {
    fn add(&mut self, found: &Mask, exact: &Mask, seconds: f64) {
        let counts = overlap(found, exact);
        self.both += counts.both;
        self.more += counts.only_model;
        self.less += counts.only_observed;
        self.seconds += seconds;
        self.frames += 1;
    }

    fn f1(&self) -> f64 {
        2.0 * self.both as f64 / (2 * self.both + self.more + self.less) as f64
    }

    fn ms(&self) -> f64 {
        1000.0 * self.seconds / f64::from(self.frames)
    }
}

const METHODS: [&str; 4] = ["mixture", "mixture, cleaned, shadow rule", "online", "online, cleaned"];

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = std::env::var("SKIAGRAPH_TEST_PYTHON").unwrap_or("python3".to_owned());
    let prepared = PreparedScene::new(&ScenarioFile::built_in(&[])?, None)?;
    let (mut tables, mut library_f1, mut opencv_f1) = (String::new(), Vec::new(), Vec::new());
    for contrast in CONTRASTS {
        tables += &format!(
            "## Clothing {contrast} grey values from the background\n\n| method | F1 | ms per image |\n|---|---|---|\n"
        );
        let folder = root.join(format!("runs/background/{contrast}"));
        if folder.exists() {
            // the script reads all files in the folder, including old ones
            std::fs::remove_dir_all(&folder)?;
        }
        let counts = count_by_library(&prepared, contrast, &folder)?;
        for (name, count) in METHODS.iter().zip(&counts) {
            tables += &format!("| {name} | {:.4} | {:.2} |\n", count.f1(), count.ms());
        }
        let (rows, best) = opencv(&python, root, &folder)?;
        tables += &format!("{rows}\n");
        library_f1.push(counts[1].f1());
        opencv_f1.push(best);
    }
    let list = |f1: &[f64]| f1.iter().map(|f1| format!("{f1:.3}")).collect::<Vec<_>>().join(", ");
    let page = format!(
        "# Background subtraction on the scene's images\n\n\
         The default background subtraction (mixture, cleaned, with the shadow rule) has an F1 of {} with clothing {} grey values from the \
         background. The best of OpenCV's methods has {} on the same images.\n\n\
         {tables}\
         ## Method\n\n\
         Images: every {STRIDE}th frame of the default walk in four cameras of 640 x 480, in colour, with cast shadow and three periods of \
         20 background images with drift (`[observation.images]`, defaults except the contrast), seeds {SEEDS:?} of clothing, light \
         and noise. F1 is over all pixels of all images, against the exact silhouettes. The mixture learns each period as one \
         component and is then fixed. The online mixture, MOG2 and KNN see all background images in order and then classify; ours \
         continues to learn at its rate, OpenCV's do not. OpenCV's shadows count as background. *Cleaned* is, \
         for OpenCV's, an opening with 3 x 3 and a closing with 5 x 5; ours removes specks, fills holes and closes with 3 x 3. Times are \
         of one thread on a busy machine: compare them only with each other.\n\n\
         Made by `SKIAGRAPH_TEST_PYTHON=PYTHON cargo run --release --example studies -- background`, with opencv-python-headless in \
         PYTHON.\n",
        list(&library_f1),
        CONTRASTS.map(|contrast| contrast.to_string()).join(", "),
        list(&opencv_f1),
    );
    std::fs::write(root.join("results/background.md"), page)?;
    Ok(())
}

/// Writes the images for OpenCV and segments them.
fn count_by_library(prepared: &PreparedScene, contrast: f64, folder: &Path) -> Result<[Count; 4], Box<dyn Error>> {
    let mut counts = [Count::default(); 4];
    let observer = Observer::new(&prepared.ground_truth, &prepared.rig);
    for seed in SEEDS {
        let settings = ImageSettings { clothing_contrast: contrast, ..ImageSettings::default() };
        let scene = SceneCamera::new(&prepared.ground_truth, prepared.rig.rig(), &settings, seed);
        let numbers: Vec<usize> = (0..prepared.frames()).step_by(STRIDE).collect();
        let frames: Vec<(Vec<Image>, Vec<Mask>)> =
            numbers.iter().map(|frame| (scene.images(*frame), observer.observe(*frame).silhouettes)).collect();
        for camera in 0..prepared.rig.cameras() {
            let place = folder.join(format!("cam{seed}{camera:02}"));
            let period = |period| (0..20).map(|number| scene.background(camera, period, number)).collect();
            let periods: Vec<Vec<Image>> = (0..scene.periods()).map(period).collect();
            for (index, image) in periods.iter().flatten().enumerate() {
                write_image(&place.join(format!("background/{index:04}.png")), image)?;
            }
            let raw = BackgroundMixture::learn(periods.iter(), Risk::default())?;
            let segmenter = Segmenter::learn(periods.iter(), &BackgroundSettings::default())?;
            let mut online = OnlineBackground::new(&periods[0][0], OnlineSettings::default());
            for image in periods.iter().flatten().skip(1) {
                online.update(image)?;
            }
            for (frame, (images, exact)) in frames.iter().enumerate() {
                let (image, exact) = (&images[camera], &exact[camera]);
                write_image(&place.join(format!("frames/{frame:04}.png")), image)?;
                let name = format!("exact/{frame:04}.png");
                put(&place.join(&name), &silhouette_to_png(&name, exact)?)?;
                let (mask, seconds) = timed(|| raw.foreground(image));
                counts[0].add(&mask?, exact, seconds);
                let (mask, seconds) = timed(|| segmenter.silhouette(image));
                counts[1].add(&mask?, exact, seconds);
                let (mask, seconds) = timed(|| online.update(image));
                let mask = mask?;
                counts[2].add(&mask, exact, seconds);
                let (cleaned, more) = timed(|| Cleaning::default().clean(&mask));
                counts[3].add(&cleaned, exact, seconds + more);
            }
        }
    }
    Ok(counts)
}

/// Rows of the table, and the best F1.
fn opencv(python: &str, root: &Path, folder: &Path) -> Result<(String, f64), Box<dyn Error>> {
    let script = root.join("benches/reference/background_opencv.py");
    let output = std::process::Command::new(python).arg(script).arg(folder).output()?;
    if !output.status.success() {
        return Err(format!("OpenCV: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    let result: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
    let row = |name: &str, kind: &str| {
        let of = &result[name];
        let words = if kind == "raw" { "" } else { ", cleaned" };
        format!(
            "| OpenCV {} {name}{words} | {:.4} | {:.2} |\n",
            result["version"].as_str().unwrap_or("?"),
            number(&of["f1"][kind]),
            number(&of["ms"])
        )
    };
    let all = ["MOG2", "KNN"].into_iter().flat_map(|name| ["raw", "cleaned"].map(|kind| (name, kind)));
    let best = all.clone().map(|(name, kind)| number(&result[name]["f1"][kind])).fold(f64::NAN, f64::max);
    Ok((all.map(|(name, kind)| row(name, kind)).collect(), best))
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = Instant::now();
    let made = work();
    (made, begin.elapsed().as_secs_f64())
}

fn write_image(path: &Path, image: &Image) -> Result<(), Box<dyn Error>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width(), image.height());
    encoder.set_color(if image.planes().len() == 3 { png::ColorType::Rgb } else { png::ColorType::Grayscale });
    encoder.set_compression(png::Compression::Fastest);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.interleaved())?;
    writer.finish()?;
    put(path, &bytes)
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(path.parent().ok_or("a folder")?)?;
    Ok(std::fs::write(path, bytes)?)
}
