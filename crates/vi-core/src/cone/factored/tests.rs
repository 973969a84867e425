//! Tests of the matrix of those laws whose blocks are not negligible.

use super::super::disc::Scaling;
use super::*;
use vi_testkit::Sample;

const SIDE: usize = 12;

/// Bodies in a square, next to those beside, before and across, with their laws and a right side.
fn square() -> (Factored, Vec<f64>) {
    let mut sample = Sample::new(3);
    let (mut ends, mut places, mut values) = (Vec::new(), Vec::new(), Vec::new());
    let mut count = 0;
    for a in 0..SIDE * SIDE {
        for (right, step) in [(1, 1), (0, SIDE), (1, SIDE + 1)] {
            if a % SIDE + right >= SIDE || a + step >= SIDE * SIDE {
                continue;
            }
            count += 1;
            for _ in 0..3 {
                for body in [a, a + step] {
                    places.extend((0..6).map(|i| (6 * body + i) as u32));
                    values.extend((0..6).map(|_| sample.number()));
                }
                ends.push(places.len());
            }
        }
    }
    let cones = vec![Cone::Friction { coefficient: 0.3 }; count];
    let w: Vec<f64> = (0..3 * count).map(|_| sample.number()).collect();
    let mut laws = Factored::default();
    laws.load(&cones, SparseRows { ends: &ends, places: &places, values: &values }, &w);
    let b = (0..laws.r).map(|_| sample.number()).collect();
    (laws, b)
}

/// `(I + Lᵀ B L) u − b`, the largest entry.
fn left(laws: &Factored, blocks: &[[[f64; 3]; 3]], u: &[f64], b: &[f64]) -> f64 {
    let moved: Vec<f64> = (0..laws.count())
        .flat_map(|k| {
            let own = laws.spread(k, u);
            blocks[k].map(|row| row.iter().zip(&own).map(|(b, own)| b * own).sum())
        })
        .collect();
    let mut out = vec![0.0; u.len()];
    laws.gather(&moved, &mut out);
    out.iter_mut().zip(u).zip(b).for_each(|((out, u), b)| *out += u - b);
    norm_inf(&out)
}

fn scaled(size: f64) -> [[f64; 3]; 3] {
    [[2.0 * size, 0.3 * size, 0.0], [0.1 * size, size, 0.0], [0.0, 0.0, size]]
}

/// Of open contacts the matrix has no entry, of those with a negligible block neither: there is
/// less to factorize, and what that leaves is of the size of those blocks.
#[test]
fn contacts_that_are_open_are_no_part_of_the_factors() {
    let (mut laws, b) = square();
    let mut sample = Sample::new(4);
    let closed: Vec<bool> = (0..laws.count()).map(|_| sample.number() > 0.2).collect();
    let none = vec![scaled(0.0); laws.count()];
    laws.factorize(&none, NEGLIGIBLE);
    let mut u = b.clone();
    laws.solve(&mut u);
    assert_eq!(u, b, "all are open: the matrix is the identity");
    let mut sizes = Vec::new();
    for (open, most) in [(0.0, 1e-9), (0.01 * NEGLIGIBLE, 1e-2), (1.0, 1e-9)] {
        let blocks: Vec<_> =
            closed.iter().map(|own| scaled(if *own { 1e3 } else { open })).collect();
        laws.factorize(&blocks, NEGLIGIBLE);
        let mut u = b.clone();
        laws.solve(&mut u);
        let left = left(&laws, &blocks, &u, &b);
        sizes.push(laws.matrix.blocks());
        println!("open {open:e}: {} blocks, {left:.1e} left", laws.matrix.blocks());
        assert!(left <= most, "{left:e} left of the blocks {open:e}");
    }
    assert_eq!(sizes[0], sizes[1], "negligible blocks change no pattern");
    assert!(2 * sizes[0] < sizes[2], "{sizes:?} blocks");
    // closed ones that open again are left out, too, but not for few of them
    let most: Vec<_> = (0..laws.count()).map(|k| scaled(if k < 5 { 0.0 } else { 1.0 })).collect();
    laws.factorize(&most, NEGLIGIBLE);
    assert_eq!(laws.matrix.blocks(), sizes[2]);
    let few: Vec<_> = closed.iter().map(|own| scaled(if *own { 1e3 } else { 0.0 })).collect();
    laws.factorize(&few, NEGLIGIBLE);
    assert_eq!(laws.matrix.blocks(), sizes[0]);
}

/// `(A + M V⁻²) b` of the interior point method, where the matrix lacks the open contacts.
#[test]
fn what_open_contacts_leave_is_corrected() {
    let (mut laws, _) = square();
    let (mut method, mut T) = (PrimalDual::default(), Vec::new());
    laws.scale(&mut method, &mut T);
    let (k, mut sample) = (laws.w.len(), Sample::new(6));
    let barriers: Vec<Barrier> = (0..laws.count())
        .map(|_| {
            let [x, y] = if sample.number() > 0.0 { [1.0, 1e-3] } else { [4e-3, 1.0] };
            let [x, y] = [x, y]
                .map(|size| Vector3::new(1.0, 0.5 * sample.number(), 0.5 * sample.number()) * size);
            let slip = y.norm();
            Barrier::Disc(Scaling::of(&x, &y), [y[1] / slip, y[2] / slip])
        })
        .collect();
    let b: Vec<f64> = (0..k).map(|_| sample.number()).collect();
    let (mut inverses, mut matrices, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
    let [mut left, mut refined, mut F] = [(); 3].map(|()| vec![0.0; k]);
    let mut u = vec![0.0; laws.r];
    let mut matrix = ScaledDelassus {
        laws: &mut laws,
        T: &T,
        inverses: &mut inverses,
        matrices: &mut matrices,
        left: &mut left,
        refined: &mut refined,
        blocks: &mut blocks,
        F: &mut F,
        u: &mut u,
    };
    matrix.factorize(&method.parts, &barriers);
    let open = matrix.laws.kept.iter().filter(|kept| !**kept).count();
    let mut x = b.clone();
    matrix.solve(&mut x);
    let mut out = vec![0.0; k];
    matrix.multiply(&x, &mut out);
    for (part, barrier) in method.parts.iter().zip(&barriers) {
        let own = barrier.matrix() * of_rows(&x, part.place..part.place + 3);
        (0..3).for_each(|i| out[part.place + i] += own[i]);
    }
    let left = out.iter().zip(&b).map(|(out, b)| (out - b).abs()).fold(0.0, f64::max);
    println!("{open} of {} are open, {left:.1e} left", barriers.len());
    assert!(open > 50 && left < ENOUGH, "{open} are open, {left:e} left");
}
