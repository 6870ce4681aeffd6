//! Shards: parts of a plan for one machine each.

use std::fmt;
use std::str::FromStr;

use super::plan::Point;

/// Part number `index` (from 1) of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    pub index: usize,
    pub count: usize,
}

impl Shard {
    /// All of a plan.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Part number `index` of `count`, if there is one.
    pub fn new(index: usize, count: usize) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count })
    }

    /// Points of this shard in groups that share their limit, each the indices (from 0) of `points`.
    ///
    /// Groups stand in the order of their digests, so that every shard gets a fair mixture of the plan. One that would be
    /// more than a shard's part is cut.
    pub fn groups(self, points: &[Point]) -> Vec<Vec<usize>> {
        let most = points.len().div_ceil(self.count).max(1);
        let mut indices: Vec<usize> = (0..points.len()).collect();
        indices.sort_by_key(|index| (points[*index].shares, *index));
        let groups = indices.chunk_by(|a, b| points[*a].shares == points[*b].shares);
        let pieces = groups.flat_map(|group| group.chunks(most));
        // The first shard that is not full takes the piece that begins in it.
        let mut groups = Vec::new();
        let mut before = 0;
        for piece in pieces {
            let shard = before * self.count / points.len();
            if shard + 1 == self.index {
                groups.push(piece.to_vec());
            }
            before += piece.len();
        }
        groups
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(index, count)| {
            Some((index.parse::<usize>().ok()?, count.parse::<usize>().ok()?))
        });
        let shard = numbers.and_then(|(index, count)| Self::new(index, count));
        shard.ok_or_else(|| "give a shard and their number, such as 3/8: from 1/8 to 8/8".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::on_device::OnDevice;
    use taxel_learn::Options;

    fn points(shares: &[u64]) -> Vec<Point> {
        let point = |shares: &u64| Point {
            id: String::new(),
            values: vec![],
            scene: String::new(),
            on_device: OnDevice::new(toml::Table::new()).unwrap(),
            fold: None,
            usual: Options::default(),
            digest: 0,
            shares: *shares,
            keys: [0; 6],
        };
        shares.iter().map(point).collect()
    }

    #[test]
    fn shards_have_every_point_once_and_about_as_many() {
        let mixed: Vec<u64> = (0..64).map(|i| i * 7 % 16).collect();
        let cases = [vec![5; 20], (0..20).collect(), mixed, vec![1], vec![]];
        for points in cases.map(|shares| points(&shares)) {
            for count in [1, 3, 8, 100] {
                let shards =
                    (1..=count).map(|index| Shard { index, count }.groups(&points).concat());
                let shards: Vec<Vec<usize>> = shards.collect();
                let mut all = shards.concat();
                all.sort_unstable();
                assert_eq!(all, (0..points.len()).collect::<Vec<_>>());
                let most = 2 * points.len().div_ceil(count);
                assert!(shards.iter().all(|shard| shard.len() <= most), "{shards:?}");
            }
        }
    }

    #[test]
    fn points_that_share_their_limit_stay_together_where_they_fit() {
        let points = points(&[3, 1, 2, 3, 1, 2, 3, 1, 2]);
        for index in 1..=3 {
            let groups = Shard { index, count: 3 }.groups(&points);
            assert_eq!((groups.len(), groups[0].len()), (1, 3));
            assert!(groups[0].iter().all(|i| points[*i].shares == points[groups[0][0]].shares));
        }
    }

    #[test]
    fn a_shard_that_does_not_exist_is_refused() {
        assert_eq!("3/8".parse(), Ok(Shard { index: 3, count: 8 }));
        for bad in ["0/8", "9/8", "3", "a/b", "1/0", "-1/8", ""] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
