//! Robot files damaged in any way, seeded: the reader answers with a robot or with what is wrong.

use axisight_core::plant::assemble;
use axisight_core::robot_file::read_robot;
use axisight_tests::PRESET;
use rand::rngs::StdRng;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};

/// Files of each kind of damage; `make fuzz` asks for more.
fn count() -> usize {
    let asked = std::env::var("AXISIGHT_FUZZ").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(10_000)
}

/// What may stand where something else stood.
const TOKENS: [&str; 20] = [
    "nan",
    "-inf",
    "1e309",
    "-0.0",
    "1e-320",
    "0",
    "-1",
    "99999999999999999999",
    "[]",
    "[[]]",
    "\"\"",
    "true",
    "{}",
    "\u{0}",
    "\u{feff}",
    "[joint]",
    "[[joint]]",
    "a.b.c = 1",
    "\"\"\"",
    "#",
];

/// The text with a piece taken out, put in twice, exchanged for a token, or cut off.
fn damaged(text: &str, rng: &mut StdRng) -> String {
    let characters: Vec<char> = text.chars().collect();
    if characters.is_empty() {
        return String::new();
    }
    let at = rng.random_range(0..characters.len());
    let end = (at + rng.random_range(1..40)).min(characters.len());
    let (before, piece, after) = (&characters[..at], &characters[at..end], &characters[end..]);
    let token: Vec<char> = TOKENS.choose(rng).unwrap_or(&"").chars().collect();
    let parts: [&[char]; 4] = match rng.random_range(0..5) {
        0 => [before, after, &[], &[]],
        1 => [before, piece, piece, after],
        2 => [before, &token, after, &[]],
        3 => [before, &token, piece, after],
        _ => [before, &[], &[], &[]],
    };
    parts.concat().into_iter().collect()
}

/// The text with the value of one key exchanged.
fn with_another_value(text: &str, rng: &mut StdRng) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let keys: Vec<usize> = (0..lines.len())
        .filter(|i| lines[*i].contains(" = "))
        .collect();
    if let (Some(line), Some(token)) = (keys.choose(rng), TOKENS.choose(rng)) {
        let key = lines[*line].split(" = ").next().unwrap_or("").to_owned();
        lines[*line] = format!("{key} = {token}");
    }
    lines.join("\n")
}

#[test]
fn no_damaged_robot_file_ends_in_anything_but_an_answer() {
    let mut refused = 0;
    for run in 0..count() as u64 {
        let mut rng = StdRng::seed_from_u64(run);
        for spoil in [damaged, with_another_value] {
            let mut text = spoil(PRESET, &mut rng);
            if rng.random_bool(0.3) {
                text = spoil(&text, &mut rng);
            }
            match read_robot(&text) {
                // What is read can be built, or says why not.
                Ok(robot) => drop(assemble::<f64>(&robot, &[], &[])),
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() < 2000, "{error}");
                }
            }
        }
    }
    assert!(refused > count() / 2);
}
