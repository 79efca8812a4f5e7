//! Placement of words beside points: on no other word or mark, on the least ink, in the same way every time.

use super::axes::{LABEL, Panel, SMALL};
use super::canvas::{Canvas, Pen, Side, Type};
use super::geometry::{Pixel, apart, clip, dotted, meet};
use super::palette::INK;
use super::text;

/// Directions of a word from its spot, in order of preference: both sides, below and above.
const WAYS: [(f64, f64); 8] = {
    const D: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        (D, -D),
        (1.0, 0.0),
        (D, D),
        (-D, -D),
        (-1.0, 0.0),
        (-D, D),
        (0.0, -1.0),
        (0.0, 1.0),
    ]
};
/// Distances of a word from its spot in pixels, each with a cost relative to a dot of ink.
const DISTANCES: [(f64, f64); 7] = [
    (7.0, 0.0),
    (13.0, 0.7),
    (24.0, 1.6),
    (38.0, 3.0),
    (55.0, 5.0),
    (75.0, 8.0),
    (100.0, 12.0),
];
/// Distance between word and spot beyond which a line joins the two.
const LED: f64 = 20.0;
/// Distance below which two spots look like one and share a word.
const SAME: f64 = 2.5;
/// Number of rounds over all words: a word that moves in one round makes room for other words in the next round.
const ROUNDS: usize = 3;
/// Cost of a mark under a word, over that of a dot of ink.
const MARK: f64 = 8.0;
/// Cost of a foreign mark hardly farther from a word than the mark of the word, over that of a dot of ink.
const STRANGER: f64 = 6.0;
/// Cost of a line across a word, over that of a dot of ink.
const CROSSING: f64 = 60.0;
/// Cost of a word on a word, over that of a dot of ink.
const COVERED: f64 = 1e4;
/// Cost of a word outside of the panel, over that of a dot of ink.
const OUTSIDE: f64 = 1e6;

/// A word in its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlacedLabel {
    /// The middle of the word.
    pub at: Pixel,
    /// Box of the word: [left, top, right, bottom].
    area: [f64; 4],
    /// The line from the spot to a distant word.
    pub leader: Option<[Pixel; 2]>,
}

impl PlacedLabel {
    /// A word of half width `w` at a distance from its spot.
    fn new(spot: Pixel, (x, y): Pixel, off: f64, w: f64) -> Self {
        let h = 0.5 * LABEL;
        let lean = |c: f64| if c.abs() < 0.1 { 0.0 } else { c.signum() };
        let on = |d: f64| (spot.0 + d * x, spot.1 + d * y);
        let (edge, leader) = (on(off), [on(5.0), on(off - 2.0)]);
        let at = (edge.0 + w * lean(x), edge.1 + h * lean(y));
        Self {
            at,
            area: [at.0 - w, at.1 - h, at.0 + w, at.1 + h],
            leader: (off > LED).then_some(leader),
        }
    }

    /// Distance of a pixel from the word, 0 inside.
    fn from(&self, p: Pixel) -> f64 {
        let [l, t, r, b] = self.area;
        apart(p, (p.0.clamp(l, r), p.1.clamp(t, b)))
    }

    /// The number of dots of a line on the word.
    fn dots(&self, dots: &[Pixel]) -> f64 {
        dots.iter().filter(|p| self.from(**p) == 0.0).count() as f64
    }

    /// Cost of the words and lines of others.
    fn beside(&self, other: &PlacedLabel) -> f64 {
        let led = |placed: &PlacedLabel| placed.leader.map(|line| dotted(&line, 3.0));
        let crossed = |line: Option<Vec<Pixel>>, word: &PlacedLabel| {
            line.is_some_and(|line| word.dots(&line) > 0.0)
        };
        let crossings = [crossed(led(self), other), crossed(led(other), self)];
        let lines = crossings.into_iter().filter(|crossed| *crossed).count() as f64;
        let on = meet(&self.area, &other.area, 1.0, 1.0);
        CROSSING * lines + if on { COVERED } else { 0.0 }
    }
}

/// Writes each word near its spot on a panel with these lines and marks; a distant word gets a line to its spot. Spots
/// that look like one share a word.
pub(crate) fn write<'w>(
    canvas: &mut Canvas,
    panel: &Panel,
    lines: impl IntoIterator<Item = &'w Vec<Pixel>>,
    marks: &[Pixel],
    words: &[(Pixel, &str)],
) {
    let edges = panel.edges();
    let lines = lines.into_iter().flat_map(|line| clip(line, edges));
    let ink: Vec<Pixel> = lines.flat_map(|line| dotted(&line, 3.0)).collect();
    let words = joined(words);
    let placed = place(edges, &ink, marks, &words);
    for [from, to] in placed.iter().filter_map(|placed| placed.leader) {
        canvas.line(&[from, to], Pen::new(INK, 0.6));
    }
    let font = Type::new(SMALL, Side::Middle, Side::Middle);
    for ((_, word), placed) in words.iter().zip(&placed) {
        canvas.halo_text(placed.at, word, font);
    }
}

/// Words of distinct spots, each with the names of all marks at the spot.
fn joined(words: &[(Pixel, &str)]) -> Vec<(Pixel, String)> {
    let mut spots: Vec<(Pixel, Vec<&str>)> = Vec::new();
    for &(at, word) in words.iter().filter(|(_, word)| !word.is_empty()) {
        match spots.iter_mut().find(|(spot, _)| apart(*spot, at) < SAME) {
            Some((_, names)) if names.contains(&word) => {}
            Some((_, names)) => names.push(word),
            None => spots.push((at, vec![word])),
        }
    }
    let all = spots.into_iter();
    all.map(|(at, names)| (at, listed(&names))).collect()
}

/// Names in a row, three or more successive ones in short: "BP1, LP2 to LP5".
fn listed(names: &[&str]) -> String {
    let parts = |name: &str| {
        let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let number: Option<u32> = name[letters.len()..].parse().ok();
        number.map(|number| (letters.to_owned(), number))
    };
    let follows = |pair: &[&str]| match (parts(pair[0]), parts(pair[1])) {
        (Some((kind, n)), Some((other, m))) => kind == other && n.checked_add(1) == Some(m),
        _ => false,
    };
    let mut from = 0;
    let mut list: Vec<String> = Vec::new();
    while let Some(first) = names.get(from) {
        let more = names[from..].windows(2).take_while(|pair| follows(pair));
        let run = 1 + more.count();
        if run > 2 {
            list.push(format!("{first} to {}", names[from + run - 1]));
            from += run;
        } else {
            list.push((*first).to_owned());
            from += 1;
        }
    }
    list.join(", ")
}

/// Places for all words, each with its spot, within `edges`, on these dots of ink and beside these marks.
pub(crate) fn place<W: AsRef<str>>(
    edges: [f64; 4],
    ink: &[Pixel],
    marks: &[Pixel],
    words: &[(Pixel, W)],
) -> Vec<PlacedLabel> {
    let mut placed: Vec<PlacedLabel> = Vec::new();
    for round in 0..ROUNDS {
        for (i, (spot, word)) in words.iter().enumerate() {
            let w = 0.5 * text::width(word.as_ref(), SMALL) + 1.5;
            let alone = |at: &PlacedLabel| {
                let [l, t, r, b] = at.area;
                let outside = l < edges[0] + 2.0
                    || t < edges[1] + 2.0
                    || r > edges[2] - 2.0
                    || b > edges[3] - 2.0;
                let own = at.from(*spot);
                let strange = |p: &&Pixel| apart(**p, *spot) >= SAME && at.from(**p) < 2.5 * own;
                let stranger = at.leader.is_none() && marks.iter().any(|p| strange(&p));
                let near = marks.iter().filter(|p| at.from(**p) < 4.5).count() as f64;
                at.dots(ink)
                    + MARK * near
                    + if stranger { STRANGER } else { 0.0 }
                    + if outside { OUTSIDE } else { 0.0 }
            };
            let cost = |at: &PlacedLabel| {
                let others = placed.iter().enumerate().filter(|(k, _)| *k != i);
                alone(at) + others.map(|(_, other)| at.beside(other)).sum::<f64>()
            };
            let ways = WAYS.iter().enumerate();
            let ways = ways.flat_map(|(k, &way)| DISTANCES.map(|(off, dear)| (k, way, off, dear)));
            let priced = ways.map(|(k, way, off, dear)| {
                let at = PlacedLabel::new(*spot, way, off, w);
                (cost(&at) + dear + 0.01 * k as f64, at)
            });
            let Some((_, best)) = priced.min_by(|a, b| a.0.total_cmp(&b.0)) else {
                continue;
            };
            if round == 0 {
                placed.push(best);
            } else {
                placed[i] = best;
            }
        }
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches words on words, words on marks, words outside of the panel, and places that change from run to run.
    #[test]
    fn words_of_a_cluster_are_apart() {
        let edges = [0.0, 0.0, 560.0, 235.0];
        // Fourteen points on a fold that is a few pixels wide, in the upper right corner of the panel.
        let spots: Vec<Pixel> = (0..14)
            .map(|i| {
                let t = f64::from(i) - 6.5;
                (500.0 - 0.4 * t * t, 40.0 + 3.0 * t)
            })
            .collect();
        let ink = dotted(&spots, 3.0);
        let words: Vec<(Pixel, String)> = (spots.iter().enumerate())
            .map(|(i, spot)| (*spot, format!("BP{}", i + 1)))
            .collect();
        let placed = place(edges, &ink, &spots, &words);
        assert_eq!(placed.len(), words.len());
        for (i, a) in placed.iter().enumerate() {
            let [l, t, r, b] = a.area;
            assert!(0.0 < l && 0.0 < t && r < edges[2] && b < edges[3], "{a:?}");
            // The box holds the word.
            assert!(r - l >= text::width(&words[i].1, SMALL) && b - t >= SMALL);
            assert!(spots.iter().all(|p| a.from(*p) > 0.0), "{i} on a mark");
            for (j, b) in placed.iter().enumerate().skip(i + 1) {
                assert!(!meet(&a.area, &b.area, 0.0, 0.0), "{i} on {j}");
            }
        }
        assert_eq!(placed, place(edges, &ink, &spots, &words));
    }

    /// Catches a point without its name where several look like one, and a name of another point.
    #[test]
    fn spots_that_look_like_one_share_a_word() {
        let words = [
            ((10.0, 10.0), "BP1"),
            ((90.0, 10.0), "BP3"),
            ((10.5, 10.0), "BP2"),
            ((90.0, 11.0), "BP4"),
            ((90.0, 10.0), "LP1"),
            ((91.0, 10.0), "BP7"),
            ((91.0, 10.0), "BP8"),
            ((91.0, 10.0), "BP9"),
            ((50.0, 50.0), ""),
        ];
        let all: Vec<String> = joined(&words).into_iter().map(|(_, word)| word).collect();
        assert_eq!(all, ["BP1, BP2", "BP3, BP4, LP1, BP7 to BP9"]);
    }
}
