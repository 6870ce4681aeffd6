//! Labels in a picture, placed where nothing else stands.

use crate::report::svg::{Anchor, Svg, text_width};

/// Height of a label in px, and its share of the usual text's width.
const HEIGHT: f64 = 13.0;
const WIDTH: f64 = 0.88;

/// Box [left, top, right, bottom] in px.
pub type Box = [f64; 4];

/// Places that are taken.
pub struct Labels {
    taken: Vec<Box>,
    room: Box,
}

impl Labels {
    /// Nothing is taken in this room.
    pub fn new(room: Box) -> Self {
        Self { taken: vec![], room }
    }

    /// Takes the place of a mark.
    pub fn take_mark(&mut self, [x, y]: [f64; 2], radius: f64) {
        self.taken.push([x - radius, y - radius, x + radius, y + radius]);
    }

    /// Writes `text` beside a point, as near as there is room. Returns whether there was any.
    pub fn beside(&mut self, svg: &mut Svg, [x, y]: [f64; 2], text: &str, class: &str) -> bool {
        let width = WIDTH * text_width(text);
        for away in [9.0, 18.0, 32.0, 50.0, 75.0] {
            let places = [
                ([x - width / 2.0, y + away], Anchor::Middle, x),
                ([x - away - width, y + away * 0.4], Anchor::End, x - away),
                ([x + away, y + away * 0.4], Anchor::Start, x + away),
                ([x - width / 2.0, y - away - HEIGHT], Anchor::Middle, x),
                ([x + away, y - away - HEIGHT], Anchor::Start, x + away),
                ([x - away - width, y - away - HEIGHT], Anchor::End, x - away),
            ];
            for ([left, top], anchor, at) in places {
                let place = [left, top, left + width, top + HEIGHT];
                if self.is_free(place) {
                    self.taken.push(place);
                    svg.text(at, top + HEIGHT - 3.0, anchor, class, text);
                    return true;
                }
            }
        }
        false
    }

    /// Writes `text` with its corner at one of these places (left or right end, baseline), the first that is free; at
    /// the first if none is.
    pub fn at(
        &mut self,
        svg: &mut Svg,
        places: &[[f64; 2]],
        anchor: Anchor,
        text: &str,
        class: &str,
    ) {
        let width = WIDTH * text_width(text);
        let place_of = |[x, y]: [f64; 2]| {
            let left = if anchor == Anchor::End { x - width } else { x };
            [left, y + 3.0 - HEIGHT, left + width, y + 3.0]
        };
        let free = places.iter().find(|place| self.is_free(place_of(**place)));
        if let Some(&place) = free.or(places.first()) {
            self.taken.push(place_of(place));
            svg.text(place[0], place[1], anchor, class, text);
        }
    }

    fn is_free(&self, [left, top, right, bottom]: Box) -> bool {
        let [a, b, c, d] = self.room;
        let inside = left >= a && top >= b && right <= c && bottom <= d;
        let apart = |other: &Box| {
            right < other[0] || left > other[2] || bottom < other[1] || top > other[3]
        };
        inside && self.taken.iter().all(apart)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_leave_marks_and_each_other_alone() {
        let mut labels = Labels::new([0.0, 0.0, 200.0, 100.0]);
        let mut svg = Svg::new(200.0, 100.0, "labels");
        labels.take_mark([100.0, 50.0], 5.0);
        let written = (0..40).filter(|_| labels.beside(&mut svg, [100.0, 50.0], "K = 64", "c"));
        let written = written.count();
        assert!((6..40).contains(&written), "{written}");
        assert_eq!(svg.finish().matches("K = 64").count(), written);
        for (i, a) in labels.taken.iter().enumerate() {
            for b in &labels.taken[..i] {
                let apart = a[2] < b[0] || a[0] > b[2] || a[3] < b[1] || a[1] > b[3];
                assert!(apart, "{a:?} {b:?}");
            }
        }
    }
}
