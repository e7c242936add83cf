//! A summary as people read it.

use super::Summary;
use crate::plan::tiles;
use crate::wording::{Figure, plural};
use std::fmt;

/// The closing words of a run.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (ranks, threads) = (plural(self.ranks as u64, "rank"), plural(self.threads as u64, "thread"));
        let tiling = tiles::in_words(self.tiles, self.retile);
        let seed = if self.is_seeded { format!(", seed {}", self.seed) } else { String::new() };
        writeln!(f, "{}: {}{seed}, {tiling}", self.title, plural(self.bodies, "body"))?;
        writeln!(f, "{ranks} ({}), {threads} each; built in {:.2} s", self.transport, self.build_s)?;
        let early = if self.interrupted { ", interrupted" } else { "" };
        let rate = if self.wall_s > 0.0 { (self.steps - self.resumed_at) as f64 / self.wall_s } else { 0.0 };
        let after = if self.resumed_at > 0 { format!(" after the first {}", self.resumed_at) } else { String::new() };
        let steps = plural(self.steps - self.resumed_at, "step");
        write!(f, "{steps}{after} in {:.2} s", self.wall_s)?;
        if self.steps > self.resumed_at {
            write!(f, ": {:.3} ms per step, {rate:.1} steps/s", self.ms_per_step)?;
        }
        writeln!(f, "{early}")?;
        self.write_phases(f)?;
        self.write_facts(f)
    }
}

/// Of the last step, where the run went on from a snapshot and made none.
const NOT_KNOWN: &str = "not known, as no step was made since the snapshot";

impl Summary {
    fn write_phases(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let total: f64 = self.phases.iter().map(|(_, time)| time.mean_ms).sum();
        let share = |ms: f64| if total > 0.0 { 100.0 * ms / total } else { 0.0 };
        writeln!(f)?;
        writeln!(f, "{:<14}{:>10}{:>9}{:>15}", "phase", "ms/step", "share", "slowest rank")?;
        for (name, time) in &self.phases {
            let (mean, slowest) = (time.mean_ms, format!("{:.3} (#{})", time.max_rank_ms, time.slowest_rank));
            writeln!(f, "{:<14}{mean:>10.3}{:>7.1} %{slowest:>15}", name.replace('_', " "), share(mean))?;
        }
        writeln!(f, "{:<14}{total:>10.3}{:>7.1} %", "total", share(total))?;
        writeln!(f)
    }

    fn write_facts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = |f: &mut fmt::Formatter<'_>, name: &str, text: fmt::Arguments<'_>| writeln!(f, "{name:<14}{text}");
        let mega = 1e-6;
        row(f, "bodies", format_args!("{}, {} lost, {} escaped", self.bodies, self.bodies_lost, self.escaped))?;
        let border = 100.0 * self.border_contact_fraction;
        row(f, "contacts", format_args!("{} near or touching, {border:.2} % across tiles", self.contacts))?;
        let [mean, most] = [self.mean_penetration, self.max_penetration].map(Figure);
        row(f, "overlap", format_args!("{mean:.5} m on the average, {most:.5} m at most"))?;
        match (self.constraint_violation, self.max_constraint_violation) {
            (Some(mean), Some(most)) => {
                let [mean, most] = [mean, most].map(Figure);
                let what = format_args!("{mean:.5} m/s on the average after the last solve, {most:.5} m/s at most");
                row(f, "violation", what)?;
            }
            _ => row(f, "violation", format_args!("{NOT_KNOWN}"))?,
        }
        // One over a border is counted in each of its tiles.
        let within = if self.tile_count > 1 { " within tiles" } else { "" };
        match (self.islands, self.largest_island, self.colors) {
            (Some(islands), Some(largest), Some(colors)) => {
                let (largest, colors) = (plural(largest, "body"), plural(colors, "color"));
                let asleep = self.asleep.filter(|&asleep| asleep > 0);
                let asleep = asleep.map_or(String::new(), |asleep| format!(", {} asleep", plural(asleep, "body")));
                row(f, "islands", format_args!("{islands}{within}, the largest of {largest}{asleep}; {colors}"))?;
            }
            _ => row(f, "islands", format_args!("{NOT_KNOWN}"))?,
        }
        let [half_v2, spin2] = [self.mean_half_v2, self.mean_spin2].map(Figure);
        row(f, "motion", format_args!("mean v^2/2 {half_v2:.6} m^2/s^2, mean spin^2 {spin2:.6} rad^2/s^2"))?;
        let [x, y] = self.momentum;
        row(f, "energy", format_args!("{:.6e} J of motion, momentum ({x:.6e}, {y:.6e}) kg m/s", self.kinetic_energy))?;
        // Of those before no snapshot tells.
        let since = if self.resumed_at > 0 { format!("since step {}", self.resumed_at) } else { "in all".to_owned() };
        let ghosts = self.ghosts.map_or(String::new(), |ghosts| format!("{ghosts} ghosts in the last step, "));
        row(f, "tiles", format_args!("{ghosts}{} migrations {since}", self.migrations))?;
        let sent = self.bytes_sent as f64 * mega;
        row(f, "sent", format_args!("{sent:.1} MB between ranks in {} messages", self.messages_sent))?;
        if self.ranks > 1 {
            let (busiest, moved) = (100.0 * (self.imbalance - 1.0), self.tiles_moved);
            let held =
                format_args!("the busiest rank has {busiest:.1} % more than the mean to do; {moved} tiles moved");
            row(f, "balance", held)?;
        }
        row(f, "memory", format_args!("{:.0} MB at most", self.peak_rss_bytes as f64 * mega))?;
        row(f, "config hash", format_args!("{}", self.config_hash))?;
        row(f, "state hash", format_args!("{}", self.state_hash))?;
        row(f, "contact hash", format_args!("{}", self.contact_hash))
    }
}
