//! The table of exchanges.

use super::{Method, Timing};

/// Prints what was measured on so many ranks: on stderr a table, on stdout a line of JSON for each length and method.
pub fn print(ranks: usize, columns: &[(Method, Vec<Timing>)]) {
    eprintln!("\n{ranks} ranks, each to its neighbours on a ring: microseconds per exchange, and with copies");
    eprint!("{:>10}", "bytes");
    columns.iter().for_each(|(method, _)| eprint!("{method:>22}"));
    eprintln!();
    for (row, &length) in super::SIZES.iter().enumerate() {
        eprint!("{length:>10}");
        for (method, timings) in columns {
            let Timing { bare, with_copies, .. } = timings[row];
            let (bare_us, copies_us) = (bare * 1e6, with_copies * 1e6);
            eprint!("{:>22}", format!("{bare_us:.2} / {copies_us:.2}"));
            let neighbours = if ranks == 2 { 1 } else { 2 };
            let gigabytes = 1e-9 * (length * neighbours) as f64;
            println!(
                r#"{{"bench":"exchange","method":"{method}","ranks":{ranks},"bytes":{length},"us":{bare_us:.3},"us_with_copies":{copies_us:.3},"gb_per_s_sent_by_a_rank":{:.3},"gb_per_s_with_copies":{:.3}}}"#,
                gigabytes / bare,
                gigabytes / with_copies,
            );
        }
        eprintln!();
    }
}
