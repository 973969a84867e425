//! What a steady motion does with a system: a finite displacement, its velocities, the matrices
//! that multiply them.
//!
//! ```text
//! v = V + W (q − q_o) + S q,   W x = Ω × x for every centre (from o) and director x
//! (S q)_{d_I} = Σ_J d_J ŵ_{JI}                     w: spin of a frame, along its directors
//! δq = Φ(t) ξ,   Φ̇ = Φ A,   A = W + S              displacements in the frame that moves
//! M (ξ̈ + 2 A ξ̇ + A² ξ) + …                         M A = A M where spins are about axes of symmetry
//! ```
#![allow(non_snake_case)] // W, A

use nalgebra::{Matrix3, SMatrix, Vector3};
use vi_constraints::Constraints;
use vi_core::force::Source;
use vi_core::linear::norm_inf;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{Configuration, SeparableSystem};
use vi_multibody::mechanism::{Description, Mechanism};
use vi_multibody::sparse_nodal::VelocityLayout;
use vi_rigid::directors::{self, FRAME};
use vi_rigid::rotation::{exp, skew};

/// Forces and constraints that differ by more than this part after a turn are not those of a
/// system that moves steadily.
pub(crate) const EQUAL: f64 = 1e-8;

/// The velocities of a steady motion.
#[derive(Clone, Debug)]
pub(crate) struct Movement {
    /// `o`, m.
    pub(crate) point: Vector3<f64>,
    /// `Ω`, rad/s.
    pub(crate) velocity: Vector3<f64>,
    /// `V`, m/s.
    pub(crate) translation: Vector3<f64>,
    /// `w` of each frame, rad/s; empty where none spins.
    pub(crate) spins: Vec<Vector3<f64>>,
}

/// `g = 0`, `G v + ∂g/∂t = 0` and the same null space of `G` after the turn, rates compared with
/// `speed`, 1/s; otherwise the name of a constraint.
pub(crate) fn check_constraints(
    mechanism: &Mechanism,
    [before, after]: [Configuration<'_>; 2],
    field: &Field,
    turn: &AxisRotation,
    speed: f64,
) -> Result<(), String> {
    let (m, n) = (mechanism.len(), before.q.len());
    let (mut value, mut sizes) = (vec![0.0; m], vec![0.0; m]);
    mechanism.row_sizes(after, &mut sizes);
    mechanism.value(after, &mut value);
    let (mut v, mut rates) = (vec![0.0; n], vec![0.0; m]);
    field.velocity(after.q, &mut v);
    mechanism.time_derivative(after.t, after.q, &mut rates);
    mechanism.add_rates(after.t, after.q, &v, &mut rates);
    // velocities that the joints of the tree let through: those of a joint mix its rows, no
    // more
    let mut layout = VelocityLayout::new(mechanism);
    let mut columns = layout.columns();
    layout.null_space(before.q, &mut columns);
    let nu: Vec<f64> = (0..layout.dof()).map(scatter).collect();
    layout.velocity(&columns, &nu, &mut v);
    let (mut here, mut there) = (vec![0.0; m], vec![0.0; m]);
    mechanism.add_rates(before.t, before.q, &v, &mut here);
    mechanism.add_rates(after.t, after.q, &turn.of_vectors(&v), &mut there);
    let size = norm_inf(&v).max(f64::MIN_POSITIVE);
    let mut first = 0;
    while first < m {
        let name = mechanism.constraint_name(first);
        let rows = first..(first..m).find(|&i| mechanism.constraint_name(i) != name).unwrap_or(m);
        let norm = |x: &[f64]| x[rows.clone()].iter().map(|x| x * x).sum::<f64>().sqrt();
        let own = norm(&sizes);
        let change = (norm(&there) - norm(&here)).abs() / size;
        let all = (norm(&value) + norm(&rates) / speed) / own + change;
        if all.is_nan() || all > EQUAL {
            return Err(name.into());
        }
        first = rows.end;
    }
    Ok(())
}

/// `|a − b|` as a part of the larger of both.
pub(crate) fn apart(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let relative = norm_inf(&difference) / norm_inf(a).max(norm_inf(b)).max(f64::MIN_POSITIVE);
    if relative.is_nan() { f64::INFINITY } else { relative }
}

/// A number of the size of 1 for each index, in no symmetry.
pub(crate) fn scatter(k: usize) -> f64 {
    (1.0 + k as f64).sqrt().fract() - 0.5
}

/// Whether all forces beside a configuration are the same after a displacement, loads and what
/// follows a reference at `t = 0` or at the time of `after`; what is not, in words. Constant forces
/// and those that are no elastic forces of strains are judged by themselves, too: beside stiff
/// parts they would not be seen.
pub(crate) fn forces_go_along(
    system: &SeparableSystem,
    [before, after]: [Configuration<'_>; 2],
    field: &Field,
    displaced: &AxisRotation,
) -> Result<(), String> {
    // where a configuration is free of forces, their gradients have to go along as well
    const ASIDE: f64 = 1e-3;
    let weight = system.constant_force();
    if apart(&displaced.of_vectors(&weight), &weight) > EQUAL {
        return Err("the weight".to_owned());
    }
    let aside = |(k, q): (usize, &f64)| q + ASIDE * scatter(k);
    let near: Vec<f64> = before.q.iter().enumerate().map(aside).collect();
    let there = displaced.of_configuration(&near);
    let net = |at: Configuration<'_>, beside_strains: bool| {
        let (mut v, mut out) = (vec![0.0; at.q.len()], vec![0.0; at.q.len()]);
        field.velocity(at.q, &mut v);
        match beside_strains {
            true => system.net_force_beside_strains(at.moving(&v), &mut out),
            false => system.net_force(at.moving(&v), &mut out),
        }
        out
    };
    let before = Configuration { q: &near, ..before };
    let same = |t: f64| {
        let after = Configuration { t, q: &there, ..after };
        let apart =
            |beside| apart(&displaced.of_vectors(&net(before, beside)), &net(after, beside));
        apart(false) <= EQUAL && apart(true) <= EQUAL
    };
    if same(0.0) || same(after.t) {
        return Ok(());
    }
    Err(unlike(system, [before, Configuration { t: 0.0, q: &there, ..after }], displaced))
}

/// What of the forces is not the same after a displacement, in words: a force by its name, or a
/// potential. A force that goes along has the same power with velocities that do.
fn unlike(
    system: &SeparableSystem,
    [before, after]: [Configuration<'_>; 2],
    displaced: &AxisRotation,
) -> String {
    let v: Vec<f64> = (0..before.q.len()).map(scatter).collect();
    let mut scratch = vec![0.0; v.len()];
    let mut powers = |at: Configuration<'_>, v: &[f64]| {
        let mut out = vec![0.0; system.sources().len()];
        system.add_power(at.moving(v), 1.0, &mut scratch, &mut out);
        out
    };
    let (here, there) = (powers(before, &v), powers(after, &displaced.of_vectors(&v)));
    let all = here.iter().zip(&there).zip(system.sources());
    let named = all.filter(|((here, there), _)| (*here - *there).abs() > EQUAL * here.abs());
    let mut names = named.map(|(_, source)| match source {
        Source::Element(name) if name.is_empty() => "a force".to_owned(),
        Source::Element(name) => format!("`{name}`"),
        Source::System(words) => (*words).to_owned(),
    });
    names.next().unwrap_or_else(|| "a spring or a bushing".to_owned())
}

/// Which coordinates are those of points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointPlaces {
    frames: usize,          // coordinates of frames
    pub(crate) size: usize, // of a block: 3, in the plane 2
}

impl PointPlaces {
    pub(crate) fn of(description: &Description) -> Self {
        Self { frames: 12 * description.bodies.len(), size: description.dimension.max(2) }
    }

    pub(crate) fn is_point(self, first: usize) -> bool {
        first >= self.frames || first.is_multiple_of(12)
    }
}

/// A finite rotation about the axis; of a steady motion with a displacement and spins of frames.
pub(crate) struct AxisRotation {
    pub(crate) angle: f64, // rad
    rotation: Matrix3<f64>,
    point: Vector3<f64>,
    shift: Vector3<f64>,
    spins: Vec<Matrix3<f64>>, // of the directors, from the right; empty without
    places: PointPlaces,
}

impl AxisRotation {
    /// A turn about the axis through a point, by an angle in rad.
    pub(crate) fn about(
        axis: Vector3<f64>,
        point: Vector3<f64>,
        description: &Description,
        angle: f64,
    ) -> Self {
        let places = PointPlaces::of(description);
        let (shift, spins) = (Vector3::zeros(), Vec::new());
        Self { angle, rotation: exp(&(angle * axis)), point, shift, spins, places }
    }

    /// What a motion does in a time, s.
    pub(crate) fn of(motion: &Movement, description: &Description, time: f64) -> Self {
        Self {
            angle: time * motion.velocity.norm(),
            rotation: exp(&(time * motion.velocity)),
            point: motion.point,
            shift: time * motion.translation,
            spins: motion.spins.iter().map(|spin| exp(&(time * spin))).collect(),
            places: PointPlaces::of(description),
        }
    }

    pub(crate) fn of_vectors(&self, x: &[f64]) -> Vec<f64> {
        self.spun(self.blocks(x, |_| Vector3::zeros()))
    }

    pub(crate) fn of_configuration(&self, q: &[f64]) -> Vec<f64> {
        let origin =
            |first| if self.places.is_point(first) { self.point } else { Vector3::zeros() };
        let mut moved = self.spun(self.blocks(q, origin));
        if self.shift != Vector3::zeros() {
            let size = self.places.size;
            for (k, x) in moved.chunks_exact_mut(size).enumerate() {
                if self.places.is_point(size * k) {
                    x.iter_mut().zip(&self.shift).for_each(|(x, shift)| *x += shift);
                }
            }
        }
        moved
    }

    /// With the directors of each frame turned among themselves.
    fn spun(&self, mut x: Vec<f64>) -> Vec<f64> {
        for (frame, spin) in x.chunks_exact_mut(FRAME).zip(&self.spins) {
            let turned = directors::triad(frame) * spin;
            for i in 0..3 {
                (0..3).for_each(|k| frame[3 + 3 * i + k] = turned[(k, i)]);
            }
        }
        x
    }

    fn blocks(&self, x: &[f64], origin: impl Fn(usize) -> Vector3<f64>) -> Vec<f64> {
        let size = self.places.size;
        let block = |(k, x): (usize, &[f64])| {
            let o = origin(size * k);
            let x = Vector3::from_fn(|i, _| if i < size { x[i] } else { 0.0 }) - o;
            let turned = o + self.rotation * x;
            (0..size).map(move |i| turned[i])
        };
        x.chunks_exact(size).enumerate().flat_map(block).collect()
    }
}

/// The velocities of a motion, and the matrices that multiply them.
pub(crate) struct Field {
    W: Matrix3<f64>,
    point: Vector3<f64>,
    places: PointPlaces,
    translation: Vector3<f64>,
    spins: Vec<Matrix3<f64>>, // ŵ of each frame; empty where none spins
}

impl Field {
    pub(crate) fn new(motion: &Movement, description: &Description) -> Self {
        Self {
            W: skew(&motion.velocity),
            point: motion.point,
            places: PointPlaces::of(description),
            translation: motion.translation,
            spins: motion.spins.iter().map(skew).collect(),
        }
    }

    /// Whether frames turn beside the others.
    pub(crate) fn has_spins(&self) -> bool {
        !self.spins.is_empty()
    }

    /// `v = V + W (q − q_o) + S q`.
    pub(crate) fn velocity(&self, q: &[f64], v: &mut [f64]) {
        self.turned(q, self.point, v);
        let size = self.places.size;
        if self.translation != Vector3::zeros() {
            for (k, v) in v.chunks_exact_mut(size).enumerate() {
                if self.places.is_point(size * k) {
                    v.iter_mut().zip(&self.translation).for_each(|(v, x)| *v += x);
                }
            }
        }
    }

    /// `out ← (W + S) x`: how a displacement from the motion changes with it.
    pub(crate) fn carried(&self, x: &[f64], out: &mut [f64]) {
        self.turned(x, Vector3::zeros(), out);
    }

    /// `W (q − q_o) + S q`.
    fn turned(&self, q: &[f64], origin: Vector3<f64>, v: &mut [f64]) {
        let size = self.places.size;
        for (k, (v, q)) in v.chunks_exact_mut(size).zip(q.chunks_exact(size)).enumerate() {
            let point = self.places.is_point(size * k);
            for (i, v) in v.iter_mut().enumerate() {
                let from = |j: usize| if point { q[j] - origin[j] } else { q[j] };
                *v = (0..size).map(|j| self.W[(i, j)] * from(j)).sum();
            }
        }
        for ((frame, v), spin) in
            q.chunks_exact(FRAME).zip(v.chunks_exact_mut(FRAME)).zip(&self.spins)
        {
            let turned = directors::triad(frame) * spin;
            for i in 0..3 {
                (0..3).for_each(|k| v[3 + 3 * i + k] += turned[(k, i)]);
            }
        }
    }

    /// `out ← out + M (W + S) v`: with `v` of the rotation the force of inertia `M W² (q − q_o)`.
    pub(crate) fn add_inertia(&self, mass: &SparseMatrix, v: &[f64], out: &mut [f64]) {
        let mut change = vec![0.0; v.len()];
        self.carried(v, &mut change);
        mass.mul_add(1.0, &change, out);
    }

    /// Emits `M (W + S)²`.
    pub(crate) fn emit_stiffness(&self, mass: &SparseMatrix, out: &mut dyn Entries) {
        let frames = self.frames().iter().map(|own| own * own).collect();
        mass.emit(&mut self.times(self.W * self.W, frames, 1.0, out));
    }

    /// Emits `C (W + S)` with the matrix `C = −∂f/∂v` of dampers to the ground: what stands still
    /// in space sees the velocity `W δq` of a point that stands still in the frame that rotates.
    pub(crate) fn emit_circulation(
        &self,
        dampers: &dyn Fn(&mut dyn Entries),
        out: &mut dyn Entries,
    ) {
        dampers(&mut self.times(self.W, self.frames(), 1.0, out));
    }

    /// Emits `2 M (W + S)`.
    pub(crate) fn emit_gyroscopic(&self, mass: &SparseMatrix, out: &mut dyn Entries) {
        mass.emit(&mut self.times(self.W, self.frames(), 2.0, out));
    }

    /// `W + S` of each frame; none where none spins.
    fn frames(&self) -> Vec<FrameBlock> {
        let block = |spin: &Matrix3<f64>| {
            let mut own = FrameBlock::zeros();
            for i in 0..4 {
                own.fixed_view_mut::<3, 3>(3 * i, 3 * i).copy_from(&self.W);
            }
            for i in 0..3 {
                for j in 0..3 {
                    (0..3).for_each(|k| own[(3 + 3 * i + k, 3 + 3 * j + k)] += spin[(j, i)]);
                }
            }
            own
        };
        self.spins.iter().map(block).collect()
    }

    fn times<'a>(
        &self,
        block: Matrix3<f64>,
        frames: Vec<FrameBlock>,
        scale: f64,
        into: &'a mut dyn Entries,
    ) -> TimesBlocks<'a> {
        TimesBlocks { into, block, frames, size: self.places.size, scale }
    }
}

type FrameBlock = SMatrix<f64, FRAME, FRAME>;

/// Multiplies a matrix from the right by `I ⊗ B`, in frames by blocks of their own.
struct TimesBlocks<'a> {
    into: &'a mut dyn Entries,
    block: Matrix3<f64>,
    frames: Vec<FrameBlock>,
    size: usize,
    scale: f64,
}

impl Entries for TimesBlocks<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if let Some(frame) = self.frames.get(column / FRAME) {
            let (j, first) = (column % FRAME, column - column % FRAME);
            for k in 0..FRAME {
                self.into.add(row, first + k, self.scale * value * frame[(j, k)]);
            }
            return;
        }
        let (j, first) = (column % self.size, column - column % self.size);
        for k in 0..self.size {
            self.into.add(row, first + k, self.scale * value * self.block[(j, k)]);
        }
    }
}
