//! Voronoi cells: what is nearer to one point than to any other.

/// Corners of a convex polygon.
pub type Polygon = Vec<[f64; 2]>;

/// Cell of each of `sites` within the rectangle from `low` to `high`; empty for one outside.
pub fn cells(sites: &[[f64; 2]], low: [f64; 2], high: [f64; 2]) -> Vec<Polygon> {
    let frame = vec![low, [high[0], low[1]], high, [low[0], high[1]]];
    let of_site = |site: &[f64; 2]| {
        sites
            .iter()
            .filter(|other| *other != site)
            .fold(frame.clone(), |cell, other| nearer(&cell, *site, *other))
    };
    sites.iter().map(of_site).collect()
}

/// Part of `polygon` that is nearer to `site` than to `other`.
fn nearer(polygon: &[[f64; 2]], site: [f64; 2], other: [f64; 2]) -> Polygon {
    let normal = [other[0] - site[0], other[1] - site[1]];
    let middle = [f64::midpoint(site[0], other[0]), f64::midpoint(site[1], other[1])];
    // Positive beyond the line half-way between the two.
    let beyond = |p: [f64; 2]| (p[0] - middle[0]) * normal[0] + (p[1] - middle[1]) * normal[1];
    let mut kept = Polygon::new();
    for (i, &from) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()];
        let (a, b) = (beyond(from), beyond(to));
        if a <= 0.0 {
            kept.push(from);
        }
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            let share = a / (a - b);
            kept.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]);
        }
    }
    kept
}

/// Stretch `[low, high]` of a level (`axis` 0) or upright (`axis` 1) line through `point` that is inside `polygon`.
pub fn chord(polygon: &[[f64; 2]], point: [f64; 2], axis: usize) -> Option<[f64; 2]> {
    let across = 1 - axis;
    let mut crossings: Vec<f64> = Vec::new();
    for (i, from) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()];
        let (a, b) = (from[across] - point[across], to[across] - point[across]);
        if (a <= 0.0) != (b <= 0.0) {
            crossings.push(from[axis] + a / (a - b) * (to[axis] - from[axis]));
        }
    }
    crossings.sort_by(f64::total_cmp);
    Some([*crossings.first()?, *crossings.last()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[[f64; 2]]) -> f64 {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum()
    }

    #[test]
    fn cells_share_the_face_and_each_holds_its_own_site() {
        let sites = [[1.0, 1.0], [3.0, 1.5], [7.5, 0.2], [5.0, 3.9], [0.5, 3.0]];
        let cells = cells(&sites, [0.0, 0.0], [8.0, 4.0]);
        let total: f64 = cells.iter().map(|cell| area(cell)).sum();
        assert!((total - 32.0).abs() < 1e-9, "{total}");
        for (site, cell) in sites.iter().zip(&cells) {
            for axis in 0..2 {
                let [low, high] = chord(cell, *site, axis).unwrap();
                assert!(low < site[axis] && site[axis] < high, "{site:?} in {cell:?}");
            }
        }
    }

    #[test]
    fn equal_cells_are_rectangles_and_one_site_has_the_whole_face() {
        let cells = cells(&[[1.0, 1.0], [3.0, 1.0]], [0.0, 0.0], [4.0, 2.0]);
        assert_eq!(chord(&cells[0], [1.0, 1.0], 0), Some([0.0, 2.0]));
        assert_eq!(area(&cells[1]), 4.0);
        let whole = super::cells(&[[1.0, 1.0], [1.0, 1.0]], [0.0, 0.0], [4.0, 2.0]);
        assert_eq!((area(&whole[0]), area(&whole[1])), (8.0, 8.0), "two at one place");
    }
}
