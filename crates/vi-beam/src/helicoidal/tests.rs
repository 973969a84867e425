use super::*;
use crate::strain::ElementCoordinates;
use nalgebra::Matrix6;
use vi_rigid::rotation;
use vi_testkit::Sample;

/// A node with the triad `exp(ψ n) e_I` at a point.
fn node(x: &mut ElementCoordinates, first: usize, center: &Vector3<f64>, triad: &Matrix3<f64>) {
    x.fixed_rows_mut::<3>(first).copy_from(center);
    for i in 0..3 {
        x.fixed_rows_mut::<3>(first + 3 + 3 * i).copy_from(&triad.column(i));
    }
}

fn full_compliance(sample: &mut Sample) -> Matrix6<f64> {
    let half = Matrix6::from_fn(|_, _| sample.number());
    0.05 * (half * half.transpose()) + Matrix6::identity() * 0.02
}

fn laws(sample: &mut Sample) -> [Helicoidal; 2] {
    let compliance = full_compliance(sample);
    let C = compliance.try_inverse().unwrap();
    [Helicoidal::of_order_2(0.7, C), Helicoidal::of_order_4(0.7, &compliance).unwrap()]
}

/// Forms of strains that are neither small nor beyond what an element takes.
fn some_forms(sample: &mut Sample, s: f64) -> Forms {
    let mut y = Forms::from_fn(|_, _| 0.3 * sample.number());
    (y[2], y[6]) = (1.0 + 0.2 * sample.number(), s);
    y
}

#[test]
fn derivatives_match_central_differences() {
    let mut sample = Sample::new(31);
    let (e, mut worst) = (1e-5, [0.0_f64; 2]);
    for s in [0.0, 1e-3, 0.049, 0.051, 0.3, 0.7] {
        for law in laws(&mut sample) {
            let (y, n) = (some_forms(&mut sample, s + 2.0 * e), sample.array::<6>().into());
            let reference = 0.1 * Strain::from(sample.array::<6>());
            let at = |y: &Forms| law.at(y, &reference);
            let (slopes, bends) = (at(&y).slopes(), at(&y).bends(&n));
            for j in 0..FORMS {
                let unit = Forms::ith(j, e);
                let (plus, minus) = (at(&(y + unit)), at(&(y - unit)));
                let slope = (plus.strain() - minus.strain()) / (2.0 * e);
                worst[0] = worst[0].max((slope - slopes.column(j)).amax());
                let bend = (plus.slopes() - minus.slopes()).tr_mul(&n) / (2.0 * e);
                worst[1] = worst[1].max((bend - bends.column(j)).amax());
            }
            let asymmetry = (bends - bends.transpose()).amax();
            assert!(asymmetry < 1e-13 * bends.amax().max(1.0), "{asymmetry:e}");
        }
    }
    println!("slopes off by {:.1e}, second derivatives by {:.1e}", worst[0], worst[1]);
    assert!(worst[0] < 1e-8 && worst[1] < 1e-7, "{worst:?}");
}

#[test]
fn the_gradients_of_the_forms_are_those_of_quadratic_forms() {
    let mut sample = Sample::new(32);
    for _ in 0..50 {
        let (x, step): (ElementCoordinates, ElementCoordinates) =
            (sample.array::<24>().into(), sample.array::<24>().into());
        let difference = (forms(&(x + step), 0.4) - forms(&(x - step), 0.4)) * 0.5;
        let error = (gradients(&x, 0.4).tr_mul(&step) - difference).amax();
        assert!(error < 1e-13, "𝔹x off by {error:e}");
        let c: Forms = sample.array::<FORMS>().into();
        let (B, mut product) = (weighted_matrix(&c, 0.4), ElementCoordinates::zeros());
        for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
            let own = B[(i, j)] * x.fixed_rows::<3>(3 * j);
            let mut rows = product.fixed_rows_mut::<3>(3 * i);
            rows += own;
        }
        let error = (product - gradients(&x, 0.4) * c).amax();
        assert!(error < 1e-13, "Σ c 𝔹 x off by {error:e}");
        let error = (product - force(&x.data.0[0], 0.4, &c.transpose())).amax();
        assert!(error < 1e-13, "force off by {error:e}");
        let wrench = wrenches(&x, 0.4, &c.transpose());
        for node in [0, 1] {
            let rows = |of: usize| product.fixed_rows::<3>(12 * node + 3 * of).into_owned();
            let torque = |i: usize| x.fixed_rows::<3>(12 * node + 3 * i).cross(&rows(i));
            let expected = [rows(0), (1..4).map(torque).sum()];
            for (k, expected) in expected.iter().enumerate() {
                let error = (wrench.fixed_rows::<3>(6 * node + 3 * k) - expected).amax();
                assert!(error < 1e-13, "wrench {k} of node {node} off by {error:e}");
            }
        }
    }
}

/// Nodes on a helix: position and triad of constant `(G, K)` over the length of an element.
fn on_helix(
    G: &Vector3<f64>,
    K: &Vector3<f64>,
    length: f64,
    start: &Matrix3<f64>,
) -> ElementCoordinates {
    let angle = K * length;
    let mut x = ElementCoordinates::zeros();
    let (first, end) = (Vector3::new(0.3, -0.2, 0.9), start * rotation::exp(&angle));
    // ∫ exp(s K) G ds = ℓ T(ℓK)ᵀ… by its series, ℓ Σ (ℓK̂)^k G/(k+1)!
    let (mut term, mut sum) = (*G * length, *G * length);
    for k in 1..60 {
        term = angle.cross(&term) / f64::from(k + 1);
        sum += term;
    }
    node(&mut x, 0, &first, start);
    node(&mut x, 12, &(first + start * sum), &end);
    x
}

#[test]
fn constant_strain_is_exact() {
    let mut sample = Sample::new(33);
    let length = 0.7;
    let mut worst = 0.0_f64;
    for angle in [1e-6, 0.1, 0.44, 0.46, 1.0, 2.0, 2.6] {
        let axis = sample.vector().normalize();
        let (K, G) = (axis * (angle / length), Vector3::z() + 0.2 * sample.vector());
        let start = rotation::exp(&sample.vector());
        let y = forms(&on_helix(&G, &K, length, &start), length);
        let law: Helicoidal = Helicoidal::of_order_2(length, Matrix6::identity());
        worst = worst.max((law.helix(&y) - join(&G, &K)).amax());
    }
    println!("constant strain off by {worst:.1e}");
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn the_discrete_slopes_give_the_change_of_the_strains() {
    let mut sample = Sample::new(34);
    for law in laws(&mut sample) {
        let reference = 0.1 * Strain::from(sample.array::<6>());
        let (from, to) = (some_forms(&mut sample, 0.02), some_forms(&mut sample, 0.2));
        let at = |y: &Forms| law.at(y, &reference).strain();
        let slopes = law.discrete_slopes([&from, &to], &reference);
        let error = (slopes * (to - from) - (at(&to) - at(&from))).amax();
        assert!(error < 1e-14, "{error:e}");
        let (e, n) = (1e-5, Strain::from(sample.array::<6>()));
        let (same, bends) = law.discrete_derivatives([&from, &to], &reference, &n);
        assert_eq!(same, slopes);
        for j in 0..FORMS {
            let at = |by| law.discrete_slopes([&from, &(to + Forms::ith(j, by))], &reference);
            let bend = (at(e) - at(-e)).tr_mul(&n) / (2.0 * e);
            let error = (bend - bends.column(j)).amax();
            assert!(error < 1e-8, "{error:e}");
        }
        let same = law.discrete_slopes([&from, &from], &reference);
        let error = (same - law.at(&from, &reference).slopes()).amax();
        assert!(error < 1e-15, "{error:e}");
    }
}

/// A chord that turns while the nodes do not: its tension is felt as that of the exact cubic,
/// `w'² + γ²/5` in place of the `w'² − γ²` of one point.
#[test]
fn bending_within_an_element_is_taut() {
    let (EI, EA, length, slope) = (1e-4, 1e4, 0.5, 1e-3);
    let compliance = Matrix6::from_diagonal(&[0.0, 0.0, 1.0 / EA, 1.0 / EI, 1.0 / EI, 1.0].into());
    let law = Helicoidal::of_order_4(length, &compliance).unwrap();
    let mut x = ElementCoordinates::zeros();
    let straight = Vector3::new(slope, 0.0, 1.0) * length; // w' = slope, γ = w'
    node(&mut x, 0, &Vector3::zeros(), &Matrix3::identity());
    node(&mut x, 12, &straight, &Matrix3::identity());
    let reference = Strain::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    let eta = law.at(&forms(&x, length), &reference).strain();
    // Γ_3 = ½ (w'² + γ²/5) = 0.6 w'² of the chord of unit slope in φ_3
    let error = eta[2] / (0.6 * slope * slope) - 1.0;
    println!("extension {:e}, off by {error:.1e}", eta[2]);
    assert!(error.abs() < 1e-6, "{error:e}");
}
