//! C3D files as motion capture systems write them: Intel, DEC and SGI numbers, floating-point or integer.

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Numbers {
    IntelFloats,
    IntelWhole,
    DecFloats,
    SgiFloats,
}

impl Numbers {
    fn word(self, word: u16) -> [u8; 2] {
        if self == Self::SgiFloats { word.to_be_bytes() } else { word.to_le_bytes() }
    }

    fn float(self, float: f32) -> [u8; 4] {
        match self {
            Self::SgiFloats => float.to_be_bytes(),
            Self::DecFloats if float == 0.0 => [0; 4],
            Self::DecFloats => {
                let [a, b, c, d] = (4.0 * float).to_le_bytes();
                [c, d, a, b]
            }
            _ => float.to_le_bytes(),
        }
    }

    fn parameter(self, group: i8, name: &str, kind: i8, dimensions: &[u8], data: &[u8]) -> Vec<u8> {
        let length = 2 + 2 + dimensions.len() + data.len() + 1;
        let head = [&[name.len() as u8, group as u8], name.as_bytes(), &self.word(length as u16)].concat();
        [head, vec![kind as u8, dimensions.len() as u8], dimensions.to_vec(), data.to_vec(), vec![0]].concat()
    }
}

/// A file of labelled points, millimetres; `up` is POINT:Y_SCREEN, which `None` omits. Three analogue samples follow
/// the points of every frame.
pub(crate) fn bytes(
    labels: &[String],
    frames: &[Vec<Option<[f64; 3]>>],
    rate: f32,
    up: Option<&str>,
    numbers: Numbers,
) -> Vec<u8> {
    let scale = if numbers == Numbers::IntelWhole { 0.1_f32 } else { -0.1 };
    let longest = labels.iter().map(String::len).max().unwrap_or(0);
    let texts = labels.iter().flat_map(|label| format!("{label:<longest$}").into_bytes()).collect::<Vec<u8>>();
    let (low, high) = texts.split_at((255 * longest).min(texts.len()));
    let word = |value: usize| numbers.word(value as u16).to_vec();
    let float = |value: f32| numbers.float(value).to_vec();
    let mut section = vec![
        1,
        0x50,
        0,
        match numbers {
            Numbers::IntelFloats | Numbers::IntelWhole => 84,
            Numbers::DecFloats => 85,
            Numbers::SgiFloats => 86,
        },
    ];
    section.extend([&[5, 255][..], b"POINT", &numbers.word(3), &[0]].concat());
    let mut parameters = vec![
        ("USED", 2, vec![], word(labels.len())),
        ("SCALE", 4, vec![], float(scale)),
        ("RATE", 4, vec![], float(rate)),
        ("UNITS", -1, vec![2], b"mm".to_vec()),
        ("LABELS", -1, vec![longest as u8, labels.len().min(255) as u8], low.to_vec()),
    ];
    if !high.is_empty() {
        parameters.push(("LABELS2", -1, vec![longest as u8, (labels.len() - 255) as u8], high.to_vec()));
    }
    if let Some(up) = up {
        parameters.push(("Y_SCREEN", -1, vec![2], up.as_bytes().to_vec()));
    }
    for (name, kind, dimensions, data) in parameters {
        section.extend(numbers.parameter(1, name, kind, &dimensions, &data));
    }
    section.extend([0, 0]);
    section.resize(section.len().div_ceil(512) * 512, 0);
    section[2] = (section.len() / 512) as u8;
    let start = 2 + section.len() / 512;
    let mut header = vec![2, 0x50];
    for value in [labels.len(), 3, 1, frames.len(), 10] {
        header.extend(numbers.word(value as u16));
    }
    header.extend(numbers.float(scale));
    header.extend(numbers.word(start as u16));
    header.extend(numbers.word(1));
    header.extend(numbers.float(rate));
    header.resize(512, 0);
    let number = |value: f64| match numbers {
        Numbers::IntelWhole => numbers.word((value as i16) as u16).to_vec(),
        _ => numbers.float(value as f32).to_vec(),
    };
    let divisor = if numbers == Numbers::IntelWhole { f64::from(scale) } else { 1.0 };
    let point = |point: &Option<[f64; 3]>| match point {
        Some(place) => [place[0], place[1], place[2]].map(|c| (c / divisor).round_to(divisor)).into_iter().chain([0.0]),
        None => [0.0; 3].into_iter().chain([-1.0]),
    };
    let of_frame = |frame: &Vec<Option<[f64; 3]>>| {
        frame.iter().flat_map(point).chain([1.0, 2.0, 3.0]).flat_map(number).collect::<Vec<u8>>()
    };
    [header, section, frames.iter().flat_map(of_frame).collect()].concat()
}

trait RoundTo {
    fn round_to(self, divisor: f64) -> f64;
}

impl RoundTo for f64 {
    fn round_to(self, divisor: f64) -> f64 {
        if divisor == 1.0 { self } else { self.round() }
    }
}
