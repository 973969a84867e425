//! Strains corrected to order 4.
#![allow(non_snake_case)] // G, K, C, S, R

use super::helix::{join, split};
use super::law::{Correction, Helicoidal};
use crate::small::re;
use crate::strain::Strain;
use nalgebra::{Matrix6, SMatrix, Vector2, Vector3, Vector6};
use vi_core::Number;

/// What the strains of order 4 are made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corrected<T: Number = f64> {
    pub(super) K: Vector3<T>,
    pub(super) G_3: T,
    pub(super) m: Vector3<T>,
    pub(super) w: Vector3<T>,
    pub(super) gamma: Vector2<T>, // γ_b
    pub(super) rho: T,
}

/// What acts on `η_1, η_2, η_3`, with what acts on them by `q`; on `η_K`; on `K×m`.
struct OnParts<T> {
    N: Vector3<T>,
    M: Vector3<T>,
    of_k: Vector3<T>,
}

impl<T: Number> Corrected<T> {
    /// These, and `η`.
    #[inline]
    pub(super) fn at(
        law: &Helicoidal<T>,
        Correction { S, R, .. }: &Correction<T>,
        xi: &Vector6<T>,
        z: &Vector6<T>,
    ) -> (Self, Vector6<T>) {
        let square = law.length * law.length;
        let ((_, K), (shear, bending)) = (split(xi), split(z));
        let C = &law.stiffness;
        // two short sums side by side
        let m = C.fixed_view::<3, 3>(3, 0) * shear + C.fixed_view::<3, 3>(3, 3) * bending;
        let w = S * K.cross(&m);
        let mut eta = *z;
        let shear = square / T::of(12.0);
        (eta[0], eta[1]) = (z[0] - shear * w[1], z[1] + shear * w[0]); // − (ℓ²/12) w×e_3
        let bent = K.cross(&w) * (square / T::of(24.0));
        for i in 0..3 {
            eta[3 + i] += bent[i];
        }
        let gamma = R * Vector2::new(eta[0], eta[1]);
        let (G_3, q) = (xi[2], gamma.norm_squared());
        let rho = (G_3 * G_3 + q).sqrt();
        // ρ − G_3 without its cancellation
        let excess = if re(G_3) > 0.0 { q / (rho + G_3) } else { rho - G_3 };
        eta[2] += T::of(0.1) * q + excess;
        (Self { K, G_3, m, w, gamma, rho }, eta)
    }

    /// `½/ρ + 1/10`, the slope of `ρ − G_3 + q/10` in `q`.
    fn slope_of_q(&self) -> T {
        T::of(0.5) / self.rho + T::of(0.1)
    }

    #[inline]
    fn parts(
        &self,
        Correction { S, R, .. }: &Correction<T>,
        law: &Helicoidal<T>,
        n: &Vector6<T>,
    ) -> OnParts<T> {
        let square = law.length * law.length;
        let (mut N, M) = split(n);
        let by_gamma = R.tr_mul(&self.gamma) * (T::of(2.0) * N[2] * self.slope_of_q());
        (N[0], N[1]) = (N[0] + by_gamma[0], N[1] + by_gamma[1]);
        let turned = Vector3::new(-N[1], N[0], T::of(0.0)); // e_3×N
        let bent = M.cross(&self.K) * (square / T::of(24.0));
        let of_k = S * (bent - turned * (square / T::of(12.0)));
        OnParts { N, M, of_k }
    }

    /// `Σ n_i ∂η_i/∂ξ`.
    #[inline]
    pub(super) fn pull_back(
        &self,
        own: &Correction<T>,
        law: &Helicoidal<T>,
        n: &Vector6<T>,
    ) -> Vector6<T> {
        let Self { K, G_3, m, w, rho, .. } = self;
        let OnParts { N, M, of_k } = self.parts(own, law, n);
        let of_K = w.cross(&M) * (law.length * law.length / T::of(24.0)) + m.cross(&of_k);
        let mut out = join(&N, &(M + of_K));
        out[2] += n[2] * (*G_3 / *rho - T::of(1.0));
        out + law.stiffness.fixed_rows::<3>(3).tr_mul(&of_k.cross(K))
    }
}

impl Corrected<f64> {
    /// `∂w/∂ξ` and `∂η/∂ξ`.
    #[inline(always)]
    pub(super) fn slopes(
        &self,
        own: &Correction<f64>,
        law: &Helicoidal,
    ) -> (SMatrix<f64, 3, 6>, Matrix6<f64>) {
        let Self { K, G_3, m, w, rho, .. } = self;
        let square = law.length * law.length;
        let (m_hat, w_hat) = (m.cross_matrix(), w.cross_matrix());
        let (mut of_w, mut of_eta) = (SMatrix::<f64, 3, 6>::zeros(), Matrix6::identity());
        for j in 0..6 {
            let m_j: Vector3<f64> = law.stiffness.fixed_view::<3, 1>(3, j).into();
            let mut k_j = K.cross(&m_j); // of K×m
            if j >= 3 {
                k_j -= m_hat.column(j - 3);
            }
            let w_j = own.S * k_j;
            let mut bent = K.cross(&w_j); // of K×w
            if j >= 3 {
                bent -= w_hat.column(j - 3);
            }
            of_w.set_column(j, &w_j);
            of_eta[(0, j)] -= square / 12.0 * w_j[1];
            of_eta[(1, j)] += square / 12.0 * w_j[0];
            (0..3).for_each(|i| of_eta[(3 + i, j)] += square / 24.0 * bent[i]);
        }
        let (_, of_q) = self.slopes_of_bending(own, &of_eta);
        for j in 0..6 {
            of_eta[(2, j)] += self.slope_of_q() * of_q[j];
        }
        of_eta[(2, 2)] += G_3 / rho - 1.0;
        (of_w, of_eta)
    }

    /// `∂γ_b/∂ξ` and `∂q/∂ξ`, from `∂η/∂ξ`.
    #[inline]
    fn slopes_of_bending(
        &self,
        own: &Correction<f64>,
        of_eta: &Matrix6<f64>,
    ) -> (SMatrix<f64, 2, 6>, SMatrix<f64, 1, 6>) {
        let of_gamma = own.R * of_eta.fixed_rows::<2>(0);
        (of_gamma, 2.0 * self.gamma.transpose() * of_gamma)
    }

    /// `Σ n_i ∂²η_i/∂ξ∂ξ`.
    pub(super) fn bends(
        &self,
        own: &Correction<f64>,
        law: &Helicoidal,
        n: &Strain,
    ) -> Matrix6<f64> {
        let Self { G_3, gamma, rho, .. } = self;
        let (square, extension) = (law.length * law.length, n[2]);
        let of_m = law.stiffness.fixed_rows::<3>(3);
        let (of_w, of_eta) = self.slopes(own, law);
        let (of_gamma, of_q) = self.slopes_of_bending(own, &of_eta);
        // d²(K×m) = 2 dK×dm,  d²(K×w) = 2 dK×dw + K×S d²(K×m)
        let OnParts { M, of_k, .. } = self.parts(own, law, n);
        let by_K = of_k.cross_matrix() * of_m + M.cross_matrix() * of_w * (square / 24.0);
        let mut out = Matrix6::zeros();
        let mut lower = out.fixed_rows_mut::<3>(3);
        lower -= by_K;
        let mut out = out + out.transpose();
        out += (2.0 * extension * self.slope_of_q()) * of_gamma.tr_mul(&of_gamma);
        let cube = extension / (rho * rho * rho);
        out -= (0.25 * cube) * of_q.tr_mul(&of_q);
        let across = (0.5 * cube * G_3) * of_q;
        for j in 0..6 {
            out[(2, j)] -= across[j];
            out[(j, 2)] -= across[j];
        }
        out[(2, 2)] += cube * gamma.norm_squared();
        out
    }
}
