//! Random changes of an input, reproducible from one seed.

/// Texts that parsers often mishandle.
const AWKWARD_TEXTS: [&str; 34] = [
    "nan",
    "-inf",
    "1e300",
    "-1e300",
    "1e-320",
    "0",
    "-0",
    "-1",
    "4294967296",
    "18446744073709551615",
    "99999999999999999999",
    "1e20",
    "{",
    "}",
    "[",
    "]",
    "(",
    ")",
    "\"",
    "'",
    "\\",
    "\n",
    "\r\n",
    "\0",
    "\u{1b}[2J",
    "é",
    "\u{202e}",
    "<!--",
    "]]>",
    "&#0;",
    "null",
    "true",
    "a.a.a",
    "= ",
];

const MAX_LENGTH: usize = 1 << 17;

/// A stream of random numbers (Steele, Lea and Flood 2014, SplitMix64).
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A random number below `end`; 0 if `end` is 0.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// One of the seeds with one to eight changes.
pub(crate) fn mutated(draw: &mut Draw, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[draw.below(seeds.len())].clone();
    for _ in 0..=draw.below(8) {
        change(draw, &mut bytes, seeds);
        bytes.truncate(MAX_LENGTH);
    }
    bytes
}

fn change(draw: &mut Draw, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let at = draw.below(bytes.len() + 1);
    let max_length = 1 << draw.below(10);
    let length = 1 + draw.below(max_length);
    let end = (at + length).min(bytes.len());
    match draw.below(12) {
        0 | 1 if at < bytes.len() => bytes[at] ^= 1 << draw.below(8),
        2 if at < bytes.len() => bytes[at] = draw.next() as u8,
        3 => drop(bytes.drain(at..end)),
        4 => drop(bytes.splice(at..at, AWKWARD_TEXTS[draw.below(AWKWARD_TEXTS.len())].bytes())),
        5 | 6 => replace_number(draw, bytes, at),
        7 => {
            let max_repeats = 1 << draw.below(9);
            let piece = bytes[at..end].repeat(1 + draw.below(max_repeats));
            drop(bytes.splice(at..at, piece.into_iter().take(MAX_LENGTH)));
        }
        8 => {
            let other = &seeds[draw.below(seeds.len())];
            let from = draw.below(other.len() + 1);
            let piece = &other[from..(from + length).min(other.len())];
            drop(bytes.splice(at..end, piece.iter().copied()));
        }
        9 => bytes.truncate(at),
        10 => swap_lines(draw, bytes),
        _ if at + 4 <= bytes.len() => {
            let sizes = [0, 1, 0x7fff_ffff, u32::MAX, 0x10000, draw.next() as u32];
            bytes[at..at + 4].copy_from_slice(&sizes[draw.below(sizes.len())].to_le_bytes());
        }
        _ => {}
    }
}

/// Replaces the first number at or after `at` by another one.
fn replace_number(draw: &mut Draw, bytes: &mut Vec<u8>, at: usize) {
    let is_number = |byte: &u8| byte.is_ascii_digit() || b".-+e".contains(byte);
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|found| at + found) else { return };
    let end = bytes[start..].iter().position(|byte| !is_number(byte)).map_or(bytes.len(), |found| start + found);
    drop(bytes.splice(start..end, AWKWARD_TEXTS[draw.below(12)].bytes()));
}

fn swap_lines(draw: &mut Draw, bytes: &mut Vec<u8>) {
    let mut lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
    let (a, b) = (draw.below(lines.len()), draw.below(lines.len()));
    lines.swap(a, b);
    *bytes = lines.join(&b'\n');
}
