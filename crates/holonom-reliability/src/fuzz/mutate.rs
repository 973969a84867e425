//! Mutations of bytes, and of the numbers and words of a text.

use crate::soak::draw::Draw;

/// Numbers that programs stumble over.
pub const NUMBERS: [&str; 26] = [
    "0",
    "-1",
    "1",
    "0.0",
    "-0.0",
    "1e308",
    "-1e308",
    "1e100",
    "1e-100",
    "nan",
    "inf",
    "-inf",
    "1e-320",
    "5e-324",
    "1e18",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "4294967296",
    "1e400",
    "0.1",
    "1_000",
    "0x7fffffff",
    "3",
    "1e-9",
    "2.5",
];

/// Texts that programs stumble over.
pub const WORDS: [&str; 22] = [
    "",
    "ground",
    "=",
    "= 1/0",
    "= x",
    "\u{0}",
    "\u{1b}[31m",
    "\u{202e}",
    "..",
    "a.b",
    "a,b",
    "\"",
    "'''",
    "é",
    "𝄞",
    "\r\n",
    "nodal",
    "static",
    "true",
    "[",
    "{ x = 1 }",
    "= pi*(2^3)",
];

/// Pieces of the syntax of all formats.
const PIECES: [&str; 24] = [
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ",",
    ".",
    "\n",
    "\"",
    "'",
    "#",
    ":",
    "(",
    ")",
    "^",
    "-",
    "step,t",
    "\n[[body]]\n",
    "\n[parameters]\n",
    "e",
    " ",
    "\u{feff}",
];

/// A mutated copy; `other`: another input, for crossings. At most 64 KiB.
#[must_use]
pub fn bytes(input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut out = input.to_vec();
    for _ in 0..draw.weighted(&[(6, 1), (3, 2), (2, 4), (1, 16)]) {
        once(&mut out, other, draw);
    }
    out.truncate(1 << 16);
    out
}

/// A copy with other numbers.
#[must_use]
pub fn numbers(input: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut out = input.to_vec();
    for _ in 0..draw.count(1, 3) {
        replace_number(&mut out, draw);
    }
    out
}

fn once(out: &mut Vec<u8>, other: &[u8], draw: &mut Draw) {
    let at = draw.index(out.len() + 1).min(out.len());
    let reach = |draw: &mut Draw, length: usize| {
        let most = length.min(draw.pick(&[1, 4, 32, 512]));
        draw.index(most + 1)
    };
    match draw.index(10) {
        0 if at < out.len() => out[at] ^= 1 << draw.index(8),
        1 if at < out.len() => out[at] = draw.index(256) as u8,
        2 => {
            let end = at + reach(draw, out.len() - at);
            out.drain(at..end);
        }
        3 => {
            let end = at + reach(draw, out.len() - at);
            let piece = out[at..end].to_vec();
            let to = draw.index(out.len() + 1).min(out.len());
            out.splice(to..to, piece);
        }
        4 if !other.is_empty() => {
            let from = draw.index(other.len());
            let end = from + reach(draw, other.len() - from);
            out.splice(at..at, other[from..end].iter().copied());
        }
        5 => replace_number(out, draw),
        6 => replace_number(out, draw),
        7 => {
            let word = draw.pick(&WORDS);
            out.splice(at..at, word.bytes());
        }
        8 if !other.is_empty() => {
            let from = draw.index(other.len());
            out.truncate(at);
            out.extend(&other[from..]);
        }
        _ => {
            let piece = draw.pick(&PIECES);
            out.splice(at..at, piece.bytes());
        }
    }
}

/// Puts a special number, or one that is a little different, in the place of a number.
fn replace_number(out: &mut Vec<u8>, draw: &mut Draw) {
    let digit = |byte: &u8| byte.is_ascii_digit();
    if out.is_empty() {
        return;
    }
    let at = draw.index(out.len());
    let Some(begin) = out[at..].iter().position(digit).map(|k| at + k) else { return };
    let number = |byte: &u8| byte.is_ascii_alphanumeric() || b".+-_".contains(byte);
    let end = out[begin..].iter().position(|byte| !number(byte)).map_or(out.len(), |k| begin + k);
    let new = match draw.index(3) {
        0 => format!("{:?}", draw.magnitude(&[1e-6, 1e-2, 1.0, 1e4])),
        _ => draw.pick(&NUMBERS).to_owned(),
    };
    out.splice(begin..end, new.bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mutations_are_those_of_their_seed_and_change_most_inputs() {
        let input = b"[model]\nname = \"a\"\nstep = 0.01\n".as_slice();
        let many = |seed| -> Vec<Vec<u8>> {
            let mut draw = Draw::new(seed, 0);
            (0..200).map(|_| bytes(input, b"other", &mut draw)).collect()
        };
        assert_eq!(many(1), many(1));
        assert_ne!(many(1), many(2));
        let changed = many(1).iter().filter(|out| *out != input).count();
        println!("{changed} of 200 changed");
        assert!(changed > 150, "{changed}");
    }
}
