//! A projection as people read it.

use super::{Measured, Projection};
use crate::plan::tiles;
use std::fmt;

impl fmt::Display for Projection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tiling = tiles::in_words(self.tiles, self.retile);
        let (bodies, steps, alone) = (self.bodies, self.steps, self.ms_per_step_alone);
        writeln!(f, "{}: {bodies} bodies, {tiling}, {steps} steps of {alone:.3} ms on one thread", self.scene)?;
        let (latency, bandwidth) = (self.latency_s * 1e6, self.bandwidth * 1e-9);
        match self.measured {
            None => write!(f, "between ranks {latency} us and {bandwidth} GB/s")?,
            Some(Measured { transport, ranks }) => write!(
                f,
                "between ranks {latency:.2} us and {bandwidth:.2} GB/s, measured among {ranks} with transport {transport}"
            )?,
        }
        writeln!(f, "; times in ms per step")?;
        writeln!(f)?;
        writeln!(
            f,
            "{:>6} {:<9}{:>10}{:>10}{:>11}{:>10}{:>9}{:>9}{:>10}{:>11}{:>13}",
            "ranks",
            "balance",
            "step",
            "work",
            "imbalance",
            "exchange",
            "moving",
            "waiting",
            "speedup",
            "efficiency",
            "last quarter"
        )?;
        for one in &self.predictions {
            let last = format!("{:.1} %", 100.0 * one.last_quarter_efficiency);
            let all = format!("{:.1} %", 100.0 * one.efficiency);
            writeln!(
                f,
                "{:>6} {:<9}{:>10.3}{:>10.3}{:>11.3}{:>10.3}{:>9.3}{:>9.3}{:>10.2}{all:>11}{last:>13}",
                one.ranks,
                one.balance,
                one.ms_per_step,
                one.work_ms,
                one.imbalance,
                one.exchange_ms,
                one.moving_ms,
                one.waiting_ms,
                one.speedup
            )?;
        }
        if let Some(one) = self.predictions.iter().filter(|one| one.idle_ranks > 0).min_by_key(|one| one.ranks) {
            let (ranks, tiles) = (one.ranks, one.ranks - one.idle_ranks);
            writeln!(f)?;
            writeln!(f, "from {ranks} ranks on some have nothing to do: there are only {tiles} tiles")?;
        }
        Ok(())
    }
}
