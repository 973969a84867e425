//! Tests of the elimination by blocks.

use super::*;
use nalgebra::{DMatrix, DVector};
use vi_testkit::Sample;

/// Groups of several sizes with their blocks, and the same matrix dense; `weight` of the diagonal.
fn random(
    sample: &mut Sample,
    sizes: &[usize],
    places: &[[usize; 2]],
    weight: f64,
) -> (Vec<Vec<f64>>, DMatrix<f64>) {
    let first = |group: usize| sizes[..group].iter().sum::<usize>();
    let d = first(sizes.len());
    let mut dense = DMatrix::zeros(d, d);
    let mut blocks = Vec::new();
    for &[row, column] in places {
        let mut block = Vec::new();
        for i in 0..sizes[row] {
            for j in 0..sizes[column] {
                let own = if (row, i) == (column, j) { weight } else { 0.0 };
                // two of three unknowns of another unit
                let unit = |k: usize| if k.is_multiple_of(3) { 1.0 } else { 1e4 };
                let value = (sample.number() + own) * unit(i) * unit(j);
                dense[(first(row) + i, first(column) + j)] = value;
                block.push(value);
            }
        }
        blocks.push(block);
    }
    (blocks, dense)
}

fn both_ways(pairs: &[[usize; 2]], groups: usize) -> Vec<[usize; 2]> {
    let own = (0..groups).map(|g| [g, g]);
    own.chain(pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]])).collect()
}

fn relative_error(
    lu: &mut BlockLu,
    blocks: &[Vec<f64>],
    places: &[[usize; 2]],
    a: &DMatrix<f64>,
) -> f64 {
    let d = a.nrows();
    let diagonal: Vec<f64> = a.diagonal().iter().copied().collect();
    lu.factorize(&diagonal, places.iter().copied().zip(blocks.iter().map(|b| &b[..]))).unwrap();
    let b = DVector::from_fn(d, |i, _| (1.0 + i as f64).sin());
    let mut x = b.clone();
    lu.solve(x.as_mut_slice()).unwrap();
    let size = a.abs() * x.abs() + b.abs();
    (a * x - b).component_div(&size).amax()
}

#[test]
fn it_solves_chains_trees_rings_and_what_fills_in() {
    let mut sample = Sample::new(71);
    let chain: Vec<_> = (1..9).map(|k| [k - 1, k]).collect();
    let star: Vec<_> = (1..9).map(|k| [0, k]).collect();
    let ring: Vec<_> = chain.iter().copied().chain([[8, 0]]).collect();
    let grid: Vec<_> = (0..9).flat_map(|k| [[k, k + 1], [k, k + 3]]).filter(|p| p[1] < 9).collect();
    let sizes = [6, 6, 1, 3, 6, 2, 6, 0, 5];
    for (name, pairs, count) in
        [("chain", chain, 25), ("star", star, 25), ("ring", ring, 39), ("grid", grid, 0)]
    {
        let places = both_ways(&pairs, 9);
        let mut lu = BlockLu::new(&sizes, &places).unwrap();
        assert!(lu.blocks() == count || count == 0, "{name}: {} blocks", lu.blocks());
        for _ in 0..3 {
            let (blocks, dense) = random(&mut sample, &sizes, &places, 8.0);
            let error = relative_error(&mut lu, &blocks, &places, &dense);
            println!("{name}: {} blocks, backward error {error:.1e}", lu.blocks());
            assert!(error < 1e-14, "{name}: {error:e}");
        }
    }
}

#[test]
fn a_pivot_block_that_is_too_small_is_refused() {
    let places = both_ways(&[[0, 1]], 2);
    let mut lu = BlockLu::new(&[6, 6], &places).unwrap();
    let (mut blocks, _) = random(&mut Sample::new(72), &[6, 6], &places, 0.0);
    let mut factorize = |size: f64| {
        blocks[0].fill(0.0);
        (0..SIZE).for_each(|i| blocks[0][7 * i] = size);
        let blocks = blocks.iter().map(|block| &block[..]);
        lu.factorize(&[1.0; 12], places.iter().copied().zip(blocks))
    };
    assert_eq!(factorize(0.0), Err(Singular));
    assert_eq!(factorize(1e-9), Err(Singular));
    assert_eq!(factorize(1e5), Ok(()));
}

#[test]
fn a_dense_matrix_is_left_to_others() {
    let pairs: Vec<_> = (0..60).flat_map(|a| (0..a).map(move |b| [b, a])).collect();
    assert!(BlockLu::new(&[6; 60], &both_ways(&pairs, 60)).is_none());
}

#[test]
fn scales_are_powers_of_two_near_the_inverse_root() {
    for k in -600..600 {
        let x = 1.37_f64.powi(k);
        let unit = inverse_root(-x) * inverse_root(x) * x;
        assert!((0.5..2.0).contains(&unit), "{x:e}: {unit}");
        assert!(inverse_root(x).log2().fract() == 0.0);
    }
    for x in [0.0, f64::NAN, f64::INFINITY, 1e-310] {
        assert!(inverse_root(x) == 1.0);
    }
}

/// Bodies in layers, each next to those beside, above and below it.
#[test]
fn the_order_of_least_fill_takes_fewer_updates_in_a_bed() {
    let [side, layers] = [12, 5];
    let groups = side * side * layers;
    let mut pairs = Vec::new();
    for g in 0..groups {
        let [x, y, z] = [g % side, g / side % side, g / (side * side)];
        let next = [(x + 1 < side, 1), (y + 1 < side, side), (z + 1 < layers, side * side)];
        pairs.extend(next.iter().filter(|own| own.0).map(|own| [g, g + own.1]));
    }
    let (sizes, places) = (vec![2; groups], both_ways(&pairs, groups));
    let mut sample = Sample::new(5);
    let (blocks, dense) = random(&mut sample, &sizes, &places, 12.0);
    let b: Vec<f64> = (0..2 * groups).map(|_| sample.number()).collect();
    let diagonal: Vec<f64> = (0..2 * groups).map(|i| dense[(i, i)]).collect();
    let [by_degree, by_fill] = [Order::LeastDegree, Order::LeastFill].map(|order| {
        let limits = FactorLimits { updates: 1 << 14, largest: f64::INFINITY, order };
        let mut lu = BlockLu::with_limits(&sizes, &places, limits).unwrap();
        let of = places.iter().zip(&blocks).map(|(place, own)| (*place, &own[..]));
        lu.factorize(&diagonal, of).unwrap();
        let mut x = b.clone();
        lu.solve(&mut x).unwrap();
        let left = &dense * DVector::from_vec(x) - DVector::from_column_slice(&b);
        println!("{order:?}: {} updates, {:.1e} left", lu.updates.len(), left.amax());
        assert!(left.amax() < 1e-9, "{order:?} leaves {:e}", left.amax());
        lu.updates.len()
    });
    assert!(10 * by_fill < 9 * by_degree, "{by_fill} updates instead of {by_degree}");
}
