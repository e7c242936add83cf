//! Few colors that stand for many: median cut over a histogram. What fills much of a picture keeps its very color.

use std::cmp::Reverse;

/// Colors that differ less than this histogram can tell are one: 5 bits of red and blue, 6 of green.
const BINS: usize = 1 << 16;
/// A bin with this part of all pixels, or more, has a color of its own.
const MUCH: u32 = 200;

/// The colors of a picture.
#[derive(Debug)]
pub(super) struct Palette {
    bins: Vec<Bin>,
    /// Which color stands for those of a bin.
    index: Vec<u8>,
    colors: Vec<[u8; 3]>,
}

/// Pixels of nearly one color.
#[derive(Clone, Copy, Default, Debug)]
struct Bin {
    count: u32,
    sum: [u32; 3],
    /// The color that most of them have, if most have one, by the vote of Boyer and Moore.
    usual: [u8; 3],
    lead: u32,
}

impl Bin {
    fn mean(&self) -> [u8; 3] {
        self.sum.map(|sum| ((sum + self.count / 2) / self.count) as u8)
    }
}

impl Default for Palette {
    fn default() -> Self {
        Self { bins: vec![Bin::default(); BINS], index: vec![0; BINS], colors: Vec::new() }
    }
}

impl Palette {
    /// The index that stands for a pixel that stays as it is.
    pub(super) const UNCHANGED: u8 = 255;

    /// Chooses at most 255 colors for pixels.
    pub(super) fn choose<'a>(&mut self, rows: impl Iterator<Item = &'a [u8]>) {
        self.bins.fill(Bin::default());
        let mut total = 0;
        for pixel in rows.flat_map(|row| row.as_chunks::<3>().0) {
            let bin = &mut self.bins[bin(*pixel)];
            total += 1;
            bin.count += 1;
            bin.sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += u32::from(*value));
            match bin.lead {
                0 => (bin.usual, bin.lead) = (*pixel, 1),
                _ if bin.usual == *pixel => bin.lead += 1,
                _ => bin.lead -= 1,
            }
        }
        let mut used: Vec<u16> = (0..=u16::MAX).filter(|bin| self.bins[usize::from(*bin)].count > 0).collect();
        used.sort_by_key(|bin| Reverse(self.bins[usize::from(*bin)].count));
        let much = |bin: &&u16| self.bins[usize::from(**bin)].count >= (total / MUCH).max(1);
        let own = if used.len() <= 255 { used.len() } else { used.iter().take_while(much).count().min(128) };
        self.colors.clear();
        for (index, bin) in used.iter().take(own).enumerate() {
            let Bin { usual, lead, .. } = self.bins[usize::from(*bin)];
            self.colors.push(if lead > 0 { usual } else { self.bins[usize::from(*bin)].mean() });
            self.index[usize::from(*bin)] = index as u8;
        }
        self.cut(&mut used[own..], 255 - own);
    }

    /// Halves the group of bins in which colors lie farthest apart, weighed by how many pixels have them, until there are
    /// `most`; the mean of each is a color.
    fn cut(&mut self, used: &mut [u16], most: usize) {
        if used.is_empty() {
            return;
        }
        let mut groups = vec![self.group(used)];
        while groups.len() < most {
            let best = (0..groups.len()).max_by(|a, b| groups[*a].2.total_cmp(&groups[*b].2).then(b.cmp(a)));
            let Some(at) = best.filter(|at| groups[*at].0.len() > 1) else { break };
            let (bins, channel, _) = std::mem::take(&mut groups[at]);
            bins.sort_by_key(|bin| (self.bins[usize::from(*bin)].mean()[channel], *bin));
            let weights = bins.iter().map(|bin| u64::from(self.bins[usize::from(*bin)].count));
            let half = weights.clone().sum::<u64>() / 2;
            let below = weights.scan(0, |sum, weight| {
                *sum += weight;
                Some(*sum)
            });
            let middle = below.take_while(|sum| *sum <= half).count().clamp(1, bins.len() - 1);
            let (low, high) = bins.split_at_mut(middle);
            groups[at] = self.group(low);
            let other = self.group(high);
            groups.push(other);
        }
        for (bins, ..) in groups {
            let count: u64 = bins.iter().map(|bin| u64::from(self.bins[usize::from(*bin)].count)).sum();
            let mean = [0, 1, 2].map(|channel| {
                let sum: u64 = bins.iter().map(|bin| u64::from(self.bins[usize::from(*bin)].sum[channel])).sum();
                ((sum + count / 2) / count) as u8
            });
            bins.iter().for_each(|bin| self.index[usize::from(*bin)] = self.colors.len() as u8);
            self.colors.push(mean);
        }
    }

    /// Bins with the channel in which they differ most, and how much there is to gain by halving them.
    fn group<'a>(&self, bins: &'a mut [u16]) -> (&'a mut [u16], usize, f64) {
        let (mut count, mut sum, mut squares) = (0.0, [0.0; 3], [0.0; 3]);
        for bin in bins.iter().map(|bin| &self.bins[usize::from(*bin)]) {
            let weight = f64::from(bin.count);
            count += weight;
            for (channel, value) in bin.mean().map(f64::from).into_iter().enumerate() {
                sum[channel] += weight * value;
                squares[channel] += weight * value * value;
            }
        }
        let spread = [0, 1, 2].map(|channel| squares[channel] - sum[channel] * sum[channel] / count);
        let channel = (0..3).max_by(|a, b| spread[*a].total_cmp(&spread[*b]).then(b.cmp(a))).unwrap_or(0);
        let gain = if bins.len() > 1 { spread[channel] } else { -1.0 };
        (bins, channel, gain)
    }

    /// Which color stands for one.
    #[inline]
    pub(super) fn index(&self, pixel: [u8; 3]) -> u8 {
        self.index[bin(pixel)]
    }

    /// All colors, one after another.
    pub(super) fn colors(&self) -> Vec<u8> {
        // One more, for what is unchanged.
        let mut colors = self.colors.clone();
        colors.resize(256, [0; 3]);
        colors.into_flattened()
    }
}

/// In which bin a color is.
#[inline]
fn bin([red, green, blue]: [u8; 3]) -> usize {
    usize::from(red >> 3) << 11 | usize::from(green >> 2) << 5 | usize::from(blue >> 3)
}
