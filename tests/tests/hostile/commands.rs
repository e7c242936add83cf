//! Lines of commands.

use crate::random::{below, change_bits, noise, one_of, rounds};
use atoll::scene::SplitMix64;
use atoll_tests::fuzz;

/// A number of any size, most often one that means something.
fn number(random: &mut SplitMix64) -> String {
    match below(random, 8) {
        0 => one_of(random, &["-1", "1e999", "null", "\"7\"", "[]", "1.5", "4294967295", "18446744073709551615"])
            .to_owned(),
        1 => format!("{}e{}", below(random, 1000), below(random, 70) as i32 - 35),
        2 => format!("{:.3}", below(random, 8000) as f64 * 1e-3),
        _ => below(random, 12).to_string(),
    }
}

fn fields(random: &mut SplitMix64, names: &[&str]) -> String {
    let mut fields = Vec::new();
    for name in names {
        if below(random, 12) > 0 {
            fields.push(format!("\"{name}\": {}", number(random)));
        }
    }
    format!("{{{}}}", fields.join(", "))
}

fn pair(random: &mut SplitMix64) -> String {
    format!("[{}, {}]", number(random), number(random))
}

fn line(random: &mut SplitMix64) -> String {
    let what = match below(random, 14) {
        0 | 1 => format!("\"add\": {}", fields(random, &["id", "kind", "x", "y", "angle", "vx", "vy", "omega"])),
        2 => format!("\"add\": [{}, {}]", fields(random, &["x", "y"]), fields(random, &["x", "y", "kind"])),
        3 => format!("\"remove\": {}", number(random)),
        4 => format!("\"wake\": [{}, {}]", number(random), number(random)),
        5 => format!("\"velocity\": {}", fields(random, &["id", "vx", "vy", "omega"])),
        6 => format!("\"impulse\": {{\"id\": 3, \"x\": {}, \"y\": 0, \"at\": {}}}", number(random), pair(random)),
        7 => format!("\"force\": {}", fields(random, &["id", "x", "y", "torque", "steps"])),
        8 => format!("\"kind\": {}", fields(random, &["id", "kind"])),
        9 => format!("\"add_kind\": {{\"shape\": \"circle\", \"radius\": {}}}", number(random)),
        10 => format!("\"add_kind\": {{\"shape\": \"box\", \"width\": {}, \"height\": 1}}", number(random)),
        11 => format!("\"gravity\": {}", pair(random)),
        12 => format!("\"ray\": {{\"from\": {}, \"to\": {}}}", pair(random), pair(random)),
        _ => format!("\"rectangle\": {{\"low\": {}, \"high\": {}}}", pair(random), pair(random)),
    };
    format!("{{\"step\": {}, {what}}}\n", below(random, 5))
}

#[test]
fn any_commands() {
    let mut random = SplitMix64::after(11, 0);
    let (mut accepted, mut done, mut left_out) = (0, 0, 0);
    for round in 0..rounds(20_000) {
        let mut bytes: Vec<u8> = (0..=below(&mut random, 3)).flat_map(|_| line(&mut random).into_bytes()).collect();
        let length = bytes.len();
        match round % 10 {
            0 => change_bits(&mut random, &mut bytes, length),
            1 => bytes.extend(noise(&mut random, 9)),
            _ => {}
        }
        let (outcome, counts) = fuzz::commands(&bytes);
        accepted += usize::from(outcome.accepted);
        done += counts[0];
        left_out += counts[1];
    }
    let all = rounds(20_000);
    assert!(accepted > all / 6 && done > all / 6 && left_out > all / 20, "{accepted} of {all}: {done}, {left_out}");
}
