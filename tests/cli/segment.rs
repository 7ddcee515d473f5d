//! `skiagraph segment` on small images.

use crate::sandbox::Sandbox;

/// A colour image: a background whose brightness changes with `period`, and a square.
fn image(period: u8, noise: u8, square: bool) -> Vec<u8> {
    let mut bytes = b"P6 64 48 255\n".to_vec();
    for (y, x) in (0..48_u32).flat_map(|y| (0..64_u32).map(move |x| (y, x))) {
        let grain = ((x * 7 + y * 13 + u32::from(noise) * 5) % 5) as u8;
        let inside = square && (20..40).contains(&x) && (10..30).contains(&y);
        let colour = if inside { [30, 160, 40] } else { [100 + 15 * period, 90 + 15 * period, 80 + 15 * period] };
        bytes.extend(colour.map(|value| value + grain));
    }
    bytes
}

fn room() -> Sandbox {
    let room = Sandbox::new();
    for folder in ["empty", "walk"] {
        std::fs::create_dir(room.path(folder)).unwrap();
    }
    for number in 0..12 {
        room.write(&format!("empty/{number:02}.ppm"), image(number / 4, number, false));
        room.write(&format!("walk/{number:02}.ppm"), image(number / 4, number + 50, true));
    }
    room
}

fn set_pixels(png: &[u8]) -> Vec<(u32, u32)> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (0..)
        .zip(&pixels)
        .filter(|(_, value)| **value == 255)
        .map(|(i, _): (u32, _)| (i % info.width, i / info.width))
        .collect()
}

#[test]
fn a_square_before_a_changing_background() {
    let room = room();
    let record = room.json_of("segment --background empty --frames walk --out masks --json");
    assert_eq!((record["schema"].as_str(), record["frames"].as_u64()), (Some("skiagraph.segment/1"), Some(12)));
    assert_eq!(record["background_frames"], serde_json::json!([4, 4, 4]));
    let expected: Vec<(u32, u32)> = (10..30).flat_map(|y| (20..40).map(move |x| (x, y))).collect();
    for number in 0..12 {
        assert_eq!(set_pixels(&room.read(&format!("masks/{number:02}.png"))), expected, "{number}");
    }
    // own output may be replaced, a foreign folder may not
    room.succeed("segment --background empty --frames walk --out masks");
    assert_eq!(room.ask("segment --background empty --frames walk --out walk").code, 2);
}

#[test]
fn mismatched_images_are_refused() {
    let room = room();
    let refused = |arguments: &str, words: &[&str]| {
        let answer = room.ask(&format!("segment {arguments} --out masks"));
        assert_eq!(answer.code, 2, "{arguments}: {}", answer.stderr);
        assert!(words.iter().all(|word| answer.stderr.contains(word)), "{arguments}: {}", answer.stderr);
        assert!(!room.path("masks").exists());
    };
    refused("--background empty --frames walk --components 13", &["found 12", "13 components"]);
    refused("--background nowhere --frames walk", &["nowhere"]);
    refused("--background empty --frames empty --risk 0", &["--risk", "above 0"]);
    let whole = room.read("walk/05.ppm");
    room.write("walk/05.ppm", &whole[..whole.len() / 2]);
    refused("--background empty --frames walk", &["05.ppm", "expected a complete"]);
    room.write("walk/05.ppm", b"P6 2 2 255\n123456789abc");
    refused("--background empty --frames walk", &["05.ppm", "2 x 2 pixels with 3 channel(s), expected 64 x 48"]);
    room.write("walk/05.ppm", &whole);
    room.write("empty/07.ppm", b"P5 64 48 255\n".iter().copied().chain([0; 64 * 48]).collect::<Vec<u8>>());
    refused("--background empty --frames walk", &["07.ppm", "with 1 channel(s), expected 64 x 48 with 3"]);
    room.write("walk/05.png", b"");
    refused("--background empty --frames walk", &["two images would become 05.png"]);
}

#[test]
fn useless_masks_are_named() {
    let room = room();
    let told = |arguments: &str| room.succeed(&format!("segment {arguments} --out masks --force")).stderr;
    let few = told("--background empty --frames walk");
    assert!(few.contains("learned from 4 image(s)") && few.contains("record about 20"), "{few}");
    let enough = told("--background empty --frames walk --components 2");
    assert!(!enough.contains("note"), "{enough}");
    for number in 0..12 {
        room.write(&format!("walk/{number:02}.ppm"), image(10, number, true));
    }
    let bright = told("--background empty --frames walk --components 2");
    assert!(bright.contains("% of all pixels are foreground") && bright.contains("light or camera"), "{bright}");
    let nothing = told("--background empty --frames empty --components 2");
    assert!(nothing.contains("no pixel is foreground") && nothing.contains("--keep-shadows"), "{nothing}");
}
