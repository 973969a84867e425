//! Symmetric compositions `Ψ = Φ_{γ_s h} ∘ … ∘ Φ_{γ_1 h}` of a self-adjoint one-step map.
//!
//! A self-adjoint map of order 2 composed with these coefficients has order 4, 6 or 8 at the macro
//! nodes and keeps every structure property of the map. Conditions: `Σγ = 1`, `Σγ³ = 0` (order 4),
//! further sums for 6 and 8.
//!
//! More sub-steps than an order needs leave free coefficients. For equal work Sofroniou &
//! Spaletta's have errors of a fourth to a nineteenth of Kahan & Li's at order 6, and their longest
//! sub-step is half as long (`docs/decisions.md`).
//!
//! Sources: Suzuki, Phys. Lett. A 146 (1990) 319 (order 4, s = 5); Yoshida, Phys. Lett. A 150
//! (1990) 262 (triple jump; order 6, s = 7); Kahan & Li, Math. Comp. 66 (1997) 1089 (order 6, s =
//! 9; order 8, s = 17); Suzuki & Umeno 1993 (order 8, s = 15); Sofroniou & Spaletta, Optim. Methods
//! Softw. 20 (2005) 597 (order 6, s = 13; order 8, s = 21). Most are collected in Hairer, Lubich &
//! Wanner, Geometric Numerical Integration, §V.3.2.

use crate::linear::norm_inf;
use serde::{Deserialize, Serialize};

/// A symmetric composition, by name.
///
/// ```
/// use vi_core::Composition;
/// let composition = Composition::of_order(4).unwrap();
/// assert_eq!(composition, Composition::Suzuki5);
/// assert!((composition.gammas().iter().sum::<f64>() - 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Composition {
    /// The map itself, order 2.
    #[default]
    Identity,
    /// Triple jump, order 4, `s = 3`.
    TripleJump,
    /// Suzuki, order 4, `s = 5`: the default of order 4.
    Suzuki5,
    /// Yoshida's solution A, order 6, `s = 7`.
    Yoshida7,
    /// Kahan & Li, order 6, `s = 9`.
    KahanLi9,
    /// Sofroniou & Spaletta, order 6, `s = 13`: the default of order 6.
    SofroniouSpaletta13,
    /// Suzuki & Umeno, order 8, `s = 15`.
    SuzukiUmeno15,
    /// Kahan & Li, order 8, `s = 17`.
    KahanLi17,
    /// Sofroniou & Spaletta, order 8, `s = 21`: the default of order 8.
    SofroniouSpaletta21,
}

// First halves of the coefficients, the middle one last; the rest follows by symmetry.
const SUZUKI5: [f64; 3] =
    [0.414_490_771_794_375_7, 0.414_490_771_794_375_7, -0.657_963_087_177_503];
const TRIPLE_JUMP: [f64; 2] = [1.351_207_191_959_657_8, -1.702_414_383_919_315_3];
const YOSHIDA7: [f64; 4] = [
    0.784_513_610_477_557_3,
    0.235_573_213_359_358_13,
    -1.177_679_984_178_871,
    1.315_186_320_683_911_2,
];
const KAHAN_LI9: [f64; 5] = [
    0.392_161_444_007_314_1,
    0.332_599_136_789_359_4,
    -0.706_246_172_557_639_4,
    0.082_213_596_293_550_8,
    0.798_543_990_934_83,
];
const SOFRONIOU_SPALETTA13: [f64; 7] = [
    0.138_619_308_540_516_95,
    0.133_465_628_510_747_6,
    0.130_705_310_114_492_25,
    0.129_618_937_569_070_34,
    -0.350_003_248_939_209,
    0.118_055_306_530_023_87,
    0.399_077_515_348_715_9,
];
const SUZUKI_UMENO15: [f64; 8] = [
    0.741_670_364_350_613,
    -0.409_100_825_800_031_6,
    0.190_754_710_296_238_4,
    -0.573_862_471_116_082_3,
    0.299_064_181_303_655_9,
    0.334_624_918_245_298_2,
    0.315_293_092_396_766_6,
    -0.796_887_939_352_916_4,
];
const KAHAN_LI17: [f64; 9] = [
    0.130_202_483_088_890_08,
    0.561_162_981_775_108_4,
    -0.389_474_962_644_847_3,
    0.158_841_906_555_155_6,
    -0.395_903_894_133_237_6,
    0.184_539_640_978_315_7,
    0.258_374_387_686_322_04,
    0.295_011_723_609_310_3,
    -0.605_508_533_830_034_5,
];
const SOFRONIOU_SPALETTA21: [f64; 11] = [
    0.106_477_289_845_500_32,
    0.108_374_086_458_357_26,
    0.353_378_210_526_543_4,
    -0.233_414_140_231_650_82,
    -0.244_452_667_915_288_4,
    0.113_178_484_357_556_33,
    0.118_929_056_250_003_5,
    0.126_039_123_218_259_88,
    0.125_817_187_361_760_4,
    0.116_991_350_192_176_42,
    -0.382_635_960_126_436_65,
];

impl Composition {
    /// The recommended composition of order 2, 4, 6 or 8; `None` for any other order.
    #[must_use]
    pub fn of_order(order: u32) -> Option<Self> {
        match order {
            2 => Some(Self::Identity),
            4 => Some(Self::Suzuki5),
            6 => Some(Self::SofroniouSpaletta13),
            8 => Some(Self::SofroniouSpaletta21),
            _ => None,
        }
    }

    /// Its order at the macro nodes.
    #[must_use]
    pub fn order(self) -> u32 {
        match self {
            Self::Identity => 2,
            Self::TripleJump | Self::Suzuki5 => 4,
            Self::Yoshida7 | Self::KahanLi9 | Self::SofroniouSpaletta13 => 6,
            Self::SuzukiUmeno15 | Self::KahanLi17 | Self::SofroniouSpaletta21 => 8,
        }
    }

    /// `max |γ_i|`: the longest sub-step in parts of the step.
    #[must_use]
    pub fn longest(self) -> f64 {
        norm_inf(&self.gammas())
    }

    /// `min |γ_i|`: the shortest one.
    #[must_use]
    pub fn shortest(self) -> f64 {
        self.gammas().iter().fold(f64::INFINITY, |least, gamma| least.min(gamma.abs()))
    }

    /// The coefficients `γ_1 … γ_s`, summing to 1.
    #[must_use]
    pub fn gammas(self) -> Vec<f64> {
        let half: &[f64] = match self {
            Self::Identity => &[1.0],
            Self::TripleJump => &TRIPLE_JUMP,
            Self::Suzuki5 => &SUZUKI5,
            Self::Yoshida7 => &YOSHIDA7,
            Self::KahanLi9 => &KAHAN_LI9,
            Self::SofroniouSpaletta13 => &SOFRONIOU_SPALETTA13,
            Self::SuzukiUmeno15 => &SUZUKI_UMENO15,
            Self::KahanLi17 => &KAHAN_LI17,
            Self::SofroniouSpaletta21 => &SOFRONIOU_SPALETTA21,
        };
        let (middle, head) = half.split_last().expect("never empty");
        let mirrored = head.iter().rev();
        head.iter().chain(std::iter::once(middle)).chain(mirrored).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Composition; 9] = [
        Composition::Identity,
        Composition::TripleJump,
        Composition::Suzuki5,
        Composition::Yoshida7,
        Composition::KahanLi9,
        Composition::SofroniouSpaletta13,
        Composition::SuzukiUmeno15,
        Composition::KahanLi17,
        Composition::SofroniouSpaletta21,
    ];

    /// Hairer, Lubich & Wanner, §V.3.1, for symmetric compositions; the last term of an inner sum
    /// counts half.
    #[test]
    fn all_order_conditions_are_met() {
        for composition in ALL {
            let (mut sums, mut inner) = ([0.0; 4], [0.0; 2]); // γ, γ³, γ⁵, γ⁷;  Σγ, Σγ³
            let mut nested = [0.0; 4];
            for gamma in composition.gammas() {
                let [linear, cubic] = [inner[0] + 0.5 * gamma, inner[1] + 0.5 * gamma.powi(3)];
                nested[0] += gamma.powi(3) * linear.powi(2); // order 6; the others order 8
                nested[1] += gamma.powi(5) * linear.powi(2);
                nested[2] += gamma.powi(3) * linear.powi(4);
                nested[3] += gamma * cubic.powi(2);
                sums = [1, 3, 5, 7].map(|k| gamma.powi(k) + sums[(k / 2) as usize]);
                inner = [inner[0] + gamma, inner[1] + gamma.powi(3)];
            }
            let [one, third, fifth, seventh] = sums;
            let conditions = [
                (2, vec![one - 1.0]),
                (4, vec![third]),
                (6, vec![fifth, nested[0]]),
                (8, vec![seventh, nested[1], nested[2], nested[3]]),
            ];
            println!("{composition:?}: {conditions:?}");
            for (order, values) in conditions {
                let met = values.iter().all(|value| value.abs() < 4e-15);
                assert_eq!(met, order <= composition.order(), "{composition:?}: {values:?}");
            }
        }
    }

    /// Midpoint rule for `ẏ = f(t) y` with non-commuting 2×2 generators: all order conditions
    /// count.
    fn error(composition: Composition, steps: u32) -> f64 {
        let run = |steps: u32, composition: Composition| {
            let h = 2.0 / f64::from(steps);
            let mut y = [1.0_f64, 0.3];
            for _ in 0..steps {
                for gamma in composition.gammas() {
                    let k = gamma * h; // Störmer–Verlet of ÿ = −sin y: self-adjoint, order 2
                    y[1] -= 0.5 * k * y[0].sin();
                    y[0] += k * y[1];
                    y[1] -= 0.5 * k * y[0].sin();
                }
            }
            y
        };
        let (coarse, fine) = (run(steps, composition), run(1024, Composition::KahanLi17));
        (coarse[0] - fine[0]).hypot(coarse[1] - fine[1])
    }

    #[test]
    fn observed_orders_are_nominal() {
        for composition in ALL {
            let steps = if composition.order() == 8 { 4 } else { 16 };
            let order = (error(composition, steps) / error(composition, 2 * steps)).log2();
            println!("{composition:?}: observed order {order:.2}");
            let nominal = f64::from(composition.order());
            assert!((order - nominal).abs() < 0.5, "{composition:?}: order {order:.2}");
        }
    }
}
