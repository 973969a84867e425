//! How long an animation lasts.

/// Frames in a second of an animation of statics.
const STATIC_RATE: f64 = 10.0;
/// Shortest and longest animation, s.
const LENGTHS: [f64; 2] = [1.0, 100.0];
/// Rounding errors of a span of times, as a part of it.
const ROUNDING: f64 = 1e-9;

/// Seconds of an animation for one of the motion; in statics for one equilibrium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnimationPace {
    factor: Option<f64>,
    is_static: bool,
}

impl AnimationPace {
    /// For these times, s; in statics the numbers of the frames.
    pub(crate) fn of(times: &[f64], is_static: bool) -> Self {
        Self { factor: if is_static { None } else { factor(times) }, is_static }
    }

    /// What the user has to know: the factor, if it is not 1.
    pub(crate) fn reported(self) -> Option<f64> {
        self.factor
    }

    /// By which times are multiplied.
    pub(crate) fn scale(self) -> f64 {
        if self.is_static { 1.0 / STATIC_RATE } else { self.factor.unwrap_or(1.0) }
    }

    /// Length of the animation, s.
    pub(crate) fn length(self, times: &[f64]) -> f64 {
        let ends = times.last().zip(times.first());
        ends.map_or(0.0, |(last, first)| (last - first) * self.scale())
    }
}

/// The factor of the times, a power of ten; `None` for 1.
fn factor(times: &[f64]) -> Option<f64> {
    let span = times.last()? - times.first()?;
    let [shortest, longest] = LENGTHS;
    let exponent = match span {
        _ if span <= 0.0 => return None,
        _ if span < shortest => ((shortest / span).log10() - ROUNDING).ceil(),
        _ if span > longest => ((longest / span).log10() + ROUNDING).floor(),
        _ => return None,
    };
    Some(10f64.powf(exponent)).filter(|factor| factor.is_normal() && exponent.abs() >= 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_animation_lasts_from_one_second_to_a_hundred() {
        for (span, expected) in [
            (0.0, None),
            (1.0, None),
            (100.0, None),
            (0.99, Some(10.0)),
            (0.01, Some(100.0)),
            (2e-7, Some(1e7)),
            (101.0, Some(0.1)),
            (86400.0, Some(1e-3)),
        ] {
            let found = factor(&[3.0, 3.5, 3.0 + span]);
            let same = match (found, expected) {
                (Some(found), Some(expected)) => (found / expected - 1.0_f64).abs() < 1e-12,
                (found, expected) => found == expected,
            };
            assert!(same, "{span} s: {found:?}, expected {expected:?}");
        }
    }
}
