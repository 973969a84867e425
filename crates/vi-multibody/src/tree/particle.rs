//! Point masses joined by rigid bars: trees of two-force members.
//!
//! ```text
//! free particle    x_{n+1} = x_n + u
//! bar, in space    x²_{n+1} = x¹_{n+1} + exp(θ̂) r_n,  θ = u_1 b_1 + u_2 b_2,  b_i ⟂ r_n,  r = x² − x¹
//! bar, in a plane  x²_{n+1} = x¹_{n+1} + Rot(u) r_n                             LMO08 (48), (49)
//! ẋ² = ẋ¹ + ω × r
//! ```
//! The bases `b_i` belong to `q_n`; the tangent at `q_{n+1}` is `(T(θ) b_i) × r_{n+1}`.

use crate::pair::joint::complete_axis;
use crate::pair::{Twist, TwistTransfer, VelocityMap};
use crate::tree::FLOOR;
use nalgebra::{DMatrix, Vector3};
use vi_core::interval::Interval;
use vi_core::newton::{BlockKind, Fault, UnknownBlock};
use vi_rigid::rotation;

/// The inboard component of a particle of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Carrier {
    /// Nothing: it is free.
    Free,
    /// A bar to a point of the ground.
    Ground(Vector3<f64>),
    /// A bar to the particle with this position in the tree.
    Particle(usize),
}

/// A particle of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bead {
    /// Offset of its coordinates in `q`.
    pub offset: usize,
    /// Its inboard component.
    pub carrier: Carrier,
    /// Length of the bar (0 when free).
    pub length: f64,
    /// First unknown among `u`.
    pub unknown: usize,
}

/// A forest of particles in `dimension` = 2 or 3, root first.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticleTree {
    dimension: usize,
    beads: Vec<Bead>,
    dof: usize,
}

impl ParticleTree {
    /// From beads in an order in which carriers precede; unknowns are assigned from `first` on.
    #[must_use]
    pub fn new(dimension: usize, mut beads: Vec<Bead>, first: usize) -> Self {
        let mut dof = 0;
        for bead in &mut beads {
            bead.unknown = first + dof;
            dof += match bead.carrier {
                Carrier::Free => dimension,
                _ => dimension - 1,
            };
        }
        Self { dimension, beads, dof }
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Units and scales of the increments.
    #[must_use]
    pub fn blocks(&self) -> Vec<UnknownBlock> {
        let block = |bead: &Bead| {
            let (kind, size) = match bead.carrier {
                Carrier::Free => (BlockKind::Position, self.dimension),
                _ => (BlockKind::Rotation, self.dimension - 1),
            };
            UnknownBlock { kind, range: bead.unknown..bead.unknown + size, floor: FLOOR }
        };
        self.beads.iter().map(block).collect()
    }

    /// Offset in `q` of the point mass that an unknown moves against its carrier.
    #[must_use]
    pub fn owner(&self, unknown: usize) -> Option<usize> {
        let k = self.beads.partition_point(|bead| bead.unknown <= unknown);
        Some(self.beads[..k].last()?.offset)
    }

    /// 2 or 3.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The point masses, root first.
    #[must_use]
    pub fn beads(&self) -> &[Bead] {
        &self.beads
    }

    fn vector(&self, q: &[f64], offset: usize) -> Vector3<f64> {
        let mut x = Vector3::zeros();
        for i in 0..self.dimension {
            x[i] = q[offset + i];
        }
        x
    }

    fn arm(&self, bead: &Bead, q: &[f64]) -> Vector3<f64> {
        let x = self.vector(q, bead.offset);
        match bead.carrier {
            Carrier::Free => Vector3::zeros(),
            Carrier::Ground(point) => x - point,
            Carrier::Particle(k) => x - self.vector(q, self.beads[k].offset),
        }
    }

    /// Rotation axes of a bar at `q_n`: one in the plane, two in space.
    fn axes(&self, arm: &Vector3<f64>) -> [Vector3<f64>; 2] {
        if self.dimension == 2 {
            return [Vector3::z(), Vector3::zeros()];
        }
        let triad = complete_axis(&arm.normalize());
        [triad.column(0).into(), triad.column(1).into()]
    }

    fn rotation_vector(&self, bead: &Bead, u: &[f64], arm: &Vector3<f64>) -> Vector3<f64> {
        let axes = self.axes(arm);
        (0..self.dimension - 1).map(|k| u[bead.unknown + k] * axes[k]).sum()
    }

    /// Writes the rows of `P(q)` that belong to particles into a zeroed matrix.
    pub fn null_space(&self, q: &[f64], out: &mut DMatrix<f64>) {
        self.columns(out, |bead, k| self.rate(bead, q, k));
    }

    /// `out ← P(q)ᵀ w` of the particles: forces are summed from the leaves to the roots, in `sums`.
    pub fn pull_back(&self, q: &[f64], w: &[f64], sums: &mut Vec<Vector3<f64>>, out: &mut [f64]) {
        sums.clear();
        sums.extend(self.beads.iter().map(|bead| self.vector(w, bead.offset)));
        for (k, bead) in self.beads.iter().enumerate().rev() {
            let force = sums[k];
            if let Carrier::Particle(carrier) = bead.carrier {
                sums[carrier] += force;
            }
            for i in 0..self.dof_of(bead) {
                out[bead.unknown + i] = match bead.carrier {
                    Carrier::Free => force[i],
                    _ => self.rate(bead, q, i).dot(&force),
                };
            }
        }
    }

    /// Writes the rows of `∂F_d/∂u` that belong to particles into a zeroed matrix.
    pub fn tangent(&self, u: &[f64], s: &Interval, out: &mut DMatrix<f64>) {
        self.columns(out, |bead, k| self.tangent_rate(bead, u, s, k));
    }

    /// `maps ← X, S` of each particle at `q`: `ẋ = ẋ_carrier + S ν`.
    pub fn velocity_maps<'m>(
        &self,
        q: &[f64],
        maps: impl IntoIterator<Item = &'m mut VelocityMap>,
    ) {
        self.write_maps(maps, |bead, k| self.rate(bead, q, k));
    }

    /// `maps ← X, S'` of each particle for a reparametrized interval.
    pub fn tangents<'m>(
        &self,
        u: &[f64],
        s: &Interval,
        maps: impl IntoIterator<Item = &'m mut VelocityMap>,
    ) {
        self.write_maps(maps, |bead, k| self.tangent_rate(bead, u, s, k));
    }

    fn write_maps<'m>(
        &self,
        maps: impl IntoIterator<Item = &'m mut VelocityMap>,
        rate: impl Fn(&Bead, usize) -> Vector3<f64>,
    ) {
        for (bead, map) in self.beads.iter().zip(maps) {
            map.dof = self.dof_of(bead);
            map.transfer = match bead.carrier {
                Carrier::Particle(_) => TwistTransfer::Point(Vector3::zeros()),
                _ => TwistTransfer::None,
            };
            for k in 0..map.dof {
                let column = match bead.carrier {
                    Carrier::Free => Vector3::ith(k, 1.0),
                    _ => rate(bead, k),
                };
                map.s[k] = Twist::new(column, Vector3::zeros());
            }
        }
    }

    /// Degrees of freedom of one point mass.
    pub(crate) fn dof_of(&self, bead: &Bead) -> usize {
        match bead.carrier {
            Carrier::Free => self.dimension,
            _ => self.dimension - 1,
        }
    }

    /// Velocity of a particle against its carrier by the unit rate `k`.
    fn rate(&self, bead: &Bead, q: &[f64], k: usize) -> Vector3<f64> {
        let arm = self.arm(bead, q);
        self.axes(&arm)[k].cross(&arm)
    }

    /// The same with the tangent of the increments.
    fn tangent_rate(&self, bead: &Bead, u: &[f64], s: &Interval, k: usize) -> Vector3<f64> {
        let arm = self.arm(bead, &s.q0);
        let theta = self.rotation_vector(bead, u, &arm);
        let axis = rotation::tangent(&theta) * self.axes(&arm)[k];
        axis.cross(&self.arm(bead, &s.q1))
    }

    fn columns(&self, out: &mut DMatrix<f64>, arm_rate: impl Fn(&Bead, usize) -> Vector3<f64>) {
        for bead in &self.beads {
            let own = match bead.carrier {
                Carrier::Free => {
                    for i in 0..self.dimension {
                        out[(bead.offset + i, bead.unknown + i)] = 1.0;
                    }
                    continue;
                }
                Carrier::Ground(_) => None,
                Carrier::Particle(k) => Some(self.beads[k].offset),
            };
            if let Some(carrier) = own {
                for i in 0..self.dimension {
                    for j in 0..bead.unknown {
                        out[(bead.offset + i, j)] = out[(carrier + i, j)];
                    }
                }
            }
            for k in 0..self.dimension - 1 {
                let rate = arm_rate(bead, k);
                for i in 0..self.dimension {
                    out[(bead.offset + i, bead.unknown + k)] = rate[i];
                }
            }
        }
    }

    /// `F_d(u, q_n)`: writes the particles in `s.q1` and `s.dq`.
    ///
    /// # Errors
    /// [`Fault::OutsideChart`].
    pub fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        for bead in &self.beads {
            let moved = match bead.carrier {
                Carrier::Free => self.vector(u, bead.unknown),
                Carrier::Ground(_) | Carrier::Particle(_) => {
                    let arm = self.arm(bead, &s.q0);
                    let theta = self.rotation_vector(bead, u, &arm);
                    let angle = theta.norm();
                    if angle.is_nan() {
                        return Err(Fault::NotFinite);
                    }
                    if angle > rotation::MAX_ROTATION {
                        let (kind, unknown) = (BlockKind::Rotation, bead.unknown);
                        return Err(Fault::OutsideChart { kind, unknown, size: angle });
                    }
                    let own = rotation::exp_minus_identity(&theta) * arm;
                    match bead.carrier {
                        Carrier::Particle(k) => own + self.vector(&s.dq, self.beads[k].offset),
                        _ => own,
                    }
                }
            };
            for i in 0..self.dimension {
                s.increment(bead.offset + i, moved[i]);
            }
        }
        Ok(())
    }

    /// Restores the lengths of the bars where round-off has passed a few ulp.
    pub fn clean(&self, q: &mut [f64]) {
        for bead in &self.beads {
            if matches!(bead.carrier, Carrier::Free) {
                continue;
            }
            let arm = self.arm(bead, q);
            let stretch = 0.5 * (1.0 - arm.norm_squared() / (bead.length * bead.length));
            if stretch.abs() > 4.0 * f64::EPSILON {
                for i in 0..self.dimension {
                    q[bead.offset + i] += stretch * arm[i];
                }
            }
        }
    }
}
