//! Pareto front of settings whose errors are known as far as their test frames tell.
//!
//! Two errors count as equal where their difference is within two standard errors, by [blocks](crate::metrics::Blocks) of
//! the same frames, or within half a per cent, by which training with another seed changes them. Then the cheaper setting is
//! as good.

use std::cmp::Ordering;

use crate::metrics::{Blocks, standard_error};

/// Standard errors within which a difference counts as none.
const SURE: f64 = 2.0;

/// Share of an error within which a difference counts as none.
const SMALL: f64 = 0.005;

/// Whether the error called `name` of one setting is no larger than that of another, as far as frames tell.
pub fn is_as_good(name: &str, one: (f64, &Blocks), other: (f64, &Blocks)) -> bool {
    let unsure = match (one.1.get(name), other.1.get(name)) {
        (Some(a), Some(b)) if a.len() == b.len() => {
            (SURE * standard_error(a.iter().zip(b).map(|(a, b)| a - b))).max(SMALL * other.0)
        }
        _ => 0.0,
    };
    one.0 <= other.0 + unsure
}

/// The cheapest of the offers whose errors called `name` are as good as the smallest.
pub fn best<'t, 'o, T>(
    name: &str,
    offers: &'t [T],
    error: impl Fn(&T) -> (f64, &'o Blocks),
    by_cost: impl Fn(&&T, &&T) -> Ordering,
) -> Option<&'t T> {
    let least = offers.iter().min_by(|a, b| error(a).0.total_cmp(&error(b).0))?;
    offers.iter().filter(|it| is_as_good(name, error(it), error(least))).min_by(by_cost)
}

/// Setting with the results that are to be small.
pub struct Offer<'o> {
    pub values: Vec<f64>,
    pub blocks: &'o Blocks,
}

/// Places of the offers on the front of these `objectives`: no other is as good in all of them, and better in one. Of those
/// whose errors count as equal, the front has the cheapest.
pub fn front(objectives: &[String], offers: &[Offer<'_>]) -> Vec<usize> {
    let has_blocks = |name: &String| offers.iter().any(|it| it.blocks.contains_key(name));
    // What is known exactly comes first, so that what beats an offer stands before it.
    let mut order: Vec<usize> = (0..objectives.len()).collect();
    order.sort_by_key(|objective| has_blocks(&objectives[*objective]));
    let compare = |a: &usize, b: &usize| {
        let pairs = order.iter().map(|k| offers[*a].values[*k].total_cmp(&offers[*b].values[*k]));
        pairs.fold(Ordering::Equal, Ordering::then)
    };
    let mut places: Vec<usize> = (0..offers.len()).collect();
    places.sort_by(compare);
    let mut front: Vec<usize> = vec![];
    for place in places {
        let own = &offers[place];
        let beats = |other: &usize| {
            let other = &offers[*other];
            let is_as_good = |(k, name): (usize, &String)| {
                is_as_good(name, (other.values[k], other.blocks), (own.values[k], own.blocks))
            };
            other.values != own.values && objectives.iter().enumerate().all(is_as_good)
        };
        if !front.iter().any(beats) {
            front.push(place);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: &[Vec<f64>], blocks: &[Blocks]) -> Vec<usize> {
        let objectives: Vec<String> = (0..values[0].len()).map(|it| format!("o{it}")).collect();
        let offers = values.iter().zip(blocks);
        let offers = offers.map(|(values, blocks)| Offer { values: values.clone(), blocks });
        let mut front = front(&objectives, &offers.collect::<Vec<_>>());
        front.sort_unstable();
        front
    }

    #[test]
    fn the_front_is_that_of_all_pairs() {
        for objectives in [1, 2, 3_usize] {
            let value = |i: u32, it: usize| f64::from((i * [7, 11, 29][it] + 3) % [13, 17, 19][it]);
            let values: Vec<Vec<f64>> =
                (0..120).map(|i| (0..objectives).map(|it| value(i, it)).collect()).collect();
            let beaten = |own: &Vec<f64>| {
                let beats = |a: &Vec<f64>| a != own && a.iter().zip(own).all(|(a, b)| a <= b);
                values.iter().any(beats)
            };
            let expected: Vec<usize> = (0..120).filter(|i| !beaten(&values[*i])).collect();
            assert_eq!(of(&values, &vec![Blocks::new(); 120]), expected, "{objectives}");
        }
    }

    #[test]
    fn nobody_pays_for_a_difference_that_frames_do_not_tell() {
        // Errors (o0) of 50 blocks: the second differs from the first by as much in each, the third by chance.
        let noise = |block: u32| f64::from(block * 37 % 50) / 50.0 - 0.49;
        let blocks = |shift: f64, by_chance: f64| {
            let parts = (0..50).map(|block| 0.05 + shift + by_chance * noise(block)).collect();
            Blocks::from([("o0".to_owned(), parts)])
        };
        let all = [blocks(0.0, 0.01), blocks(-0.0005, 0.01), blocks(-0.0005, 0.03)];
        let values = [vec![0.1, 1.0], vec![0.099, 2.0], vec![0.099, 2.0]];
        assert_eq!(of(&[values[0].clone(), values[1].clone()], &all[..2]), [0, 1]);
        let unsure = [all[0].clone(), all[2].clone()];
        assert_eq!(of(&[values[0].clone(), values[2].clone()], &unsure), [0]);
        // What is sure and tiny is nothing to pay for, either.
        assert_eq!(of(&[values[0].clone(), vec![0.0996, 2.0]], &all[..2]), [0]);
        // The dearer one is left where it is better by more than chance.
        assert_eq!(of(&[values[0].clone(), vec![0.08, 2.0]], &unsure), [0, 1]);
    }
}
