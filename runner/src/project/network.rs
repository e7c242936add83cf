//! What it takes to get bytes from rank to rank: LogGP (A. Alexandrov et al., "LogGP: Incorporating long messages into the LogP
//! model", SPAA 1995), with a gap per byte at the receiver too: a halo is many messages to one, which the sender's gap alone
//! makes far too quick.

use std::str::FromStr;

/// Who sends or receives a message is busy for so long, in seconds.
const OVERHEAD: f64 = 0.5e-6;

/// Writing a byte of a frame, or reading one, takes so long, in seconds: two copies and what finds the records.
const BYTE: f64 = 0.4e-9;

/// A network.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Network {
    /// Until the first byte of a message is there, in seconds.
    pub latency: f64,
    /// Of a rank, each way, in bytes per second.
    pub bandwidth: f64,
}

/// Networks that have a name.
pub(super) const PRESETS: [(&str, Network); 3] = [
    // Threads or processes on cores of their own, through memory.
    ("node", Network { latency: 1e-6, bandwidth: 10e9 }),
    // InfiniBand and the like, which a rank has a part of.
    ("cluster", Network { latency: 2e-6, bandwidth: 10e9 }),
    ("ethernet", Network { latency: 30e-6, bandwidth: 1e9 }),
];

/// What a rank sends and receives in a step.
#[derive(Clone, Copy, Default, PartialEq, Debug)]
pub(super) struct Load {
    /// Bytes sent and received.
    pub bytes: [f64; 2],
    /// Messages sent and received.
    pub messages: [f64; 2],
}

impl Network {
    /// As bytes that another process reads.
    #[cfg(feature = "iceoryx2")]
    pub(crate) fn to_bits(self) -> [u8; 16] {
        bytemuck::cast([self.latency, self.bandwidth])
    }

    /// What such bytes say.
    #[cfg(feature = "iceoryx2")]
    pub(crate) fn of_bits(bytes: &[u8]) -> Option<Self> {
        let [latency, bandwidth] = bytemuck::try_pod_read_unaligned(bytes).ok()?;
        Some(Self { latency, bandwidth })
    }

    /// How long a rank is busy with its messages, in seconds.
    pub(super) fn busy(&self, load: &Load) -> f64 {
        let [sent, received] = load.bytes;
        let messages = load.messages[0] + load.messages[1];
        BYTE * (sent + received) + OVERHEAD * messages + sent.max(received) / self.bandwidth
    }

    /// How long a sync point takes beside, in seconds: a message's way, and the word that all ranks must hear, which goes
    /// through a tree.
    pub(super) fn sync(&self, ranks: usize) -> f64 {
        if ranks == 1 { 0.0 } else { self.latency + rounds(ranks) * (self.latency + OVERHEAD) }
    }

    /// The latency with which a sync point takes so long.
    pub(super) fn latency_of(ranks: usize, sync: f64) -> f64 {
        let rounds = rounds(ranks);
        ((sync - rounds * OVERHEAD) / (1.0 + rounds)).max(0.0)
    }

    /// How long it takes that all have all of so many bytes, of which each tells its part, in seconds: in rounds in which what is known
    /// doubles.
    pub(super) fn all_gather(&self, bytes: f64, ranks: usize) -> f64 {
        if ranks == 1 { 0.0 } else { self.sync(ranks) + bytes * (BYTE + 1.0 / self.bandwidth) }
    }

    /// How long it takes until one rank has so many bytes in so many messages of others.
    pub(super) fn gather(&self, bytes: f64, messages: f64, ranks: usize) -> f64 {
        let messages = messages.min(ranks as f64 - 1.0);
        if ranks == 1 { 0.0 } else { self.all_gather(bytes, ranks) + OVERHEAD * messages }
    }
}

/// In which what one knows is known to all.
fn rounds(ranks: usize) -> f64 {
    f64::from(usize::BITS - (ranks - 1).leading_zeros())
}

impl FromStr for Network {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some((_, network)) = PRESETS.iter().find(|(name, _)| *name == text) {
            return Ok(*network);
        }
        let read = || {
            let (latency, bandwidth) = text.split_once(',')?;
            let latency = number(latency, &[("ns", 1e-9), ("us", 1e-6), ("ms", 1e-3)])?;
            let bandwidth = number(bandwidth, &[("MB/s", 1e6), ("GB/s", 1e9)])?;
            (bandwidth > 0.0).then_some(Self { latency, bandwidth })
        };
        read().ok_or_else(|| {
            let names = PRESETS.map(|(name, _)| name).join(", ");
            format!("a network is one of {names}, or a latency and a bandwidth such as 2us,10GB/s")
        })
    }
}

/// A number that is not negative, in one of some units.
fn number(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let (digits, unit) = units.iter().find_map(|(name, unit)| Some((text.trim().strip_suffix(name)?, unit)))?;
    let number: f64 = digits.trim().parse().ok()?;
    (number.is_finite() && number >= 0.0).then_some(number * unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn networks_are_names_or_numbers() {
        assert_eq!("cluster".parse(), Ok(PRESETS[1].1));
        assert_eq!("1.5us,25 GB/s".parse(), Ok(Network { latency: 1.5e-6, bandwidth: 25e9 }));
        assert_eq!("0ms,100MB/s".parse(), Ok(Network { latency: 0.0, bandwidth: 100e6 }));
        for text in ["", "2us", "2,10GB/s", "2us,10", "-1us,10GB/s", "2us,0GB/s", "NaNus,1GB/s", "infus,1GB/s", "lan"] {
            let error = text.parse::<Network>().unwrap_err();
            assert!(error.starts_with("a network is one of node, cluster, ethernet, or"), "{text}: {error}");
        }
    }

    #[test]
    fn who_receives_from_many_is_busy_longer_and_words_take_rounds() {
        let network = PRESETS[1].1;
        let one = Load { bytes: [1e6, 1e6], messages: [1.0, 1.0] };
        let many = Load { bytes: [1e6, 8e6], messages: [1.0, 8.0] };
        assert!(network.busy(&many) > 4.0 * network.busy(&one));
        let rounds = |ranks| ((network.sync(ranks) - network.latency) / (network.latency + OVERHEAD)).round();
        assert_eq!([2, 3, 4, 5, 144, 4096].map(rounds), [1.0, 2.0, 2.0, 3.0, 8.0, 12.0]);
        assert_eq!(network.sync(1), 0.0);
    }
}
