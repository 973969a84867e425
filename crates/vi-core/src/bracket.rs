//! Where a continuous function of one number becomes positive.
//!
//! Illinois variant of regula falsi, and bisection where that does not narrow the bracket. A trial
//! is moved away from an end that it would meet, so that both ends come close to the root.

/// A bracket `f(low) ≤ 0 < f(high)`.
#[derive(Clone, Copy, Debug)]
pub struct Bracket {
    low: [f64; 2], // place and value
    high: [f64; 2],
    last: i8, // which end the last trial became: −1, 1
    trials: u32,
}

/// Trials after which the bracket is halved.
const SECANTS: u32 = 30;

impl Bracket {
    /// Between two places with their values.
    #[must_use]
    pub fn new(low: [f64; 2], high: [f64; 2]) -> Self {
        Self { low: [low[0], low[1].min(0.0)], high, last: 0, trials: 0 }
    }

    /// The end where the function is not positive.
    #[must_use]
    pub fn low(&self) -> f64 {
        self.low[0]
    }

    /// The end where the function is positive.
    #[must_use]
    pub fn high(&self) -> f64 {
        self.high[0]
    }

    /// Where to look next; `None` once the bracket is no longer than `least`.
    pub fn next(&mut self, least: f64) -> Option<f64> {
        let ([a, fa], [b, fb]) = (self.low, self.high);
        if b - a <= 2.0 * least {
            return None;
        }
        self.trials += 1;
        let secant = b - fb * ((b - a) / (fb - fa));
        let trial = match self.trials > SECANTS || !secant.is_finite() {
            true => 0.5 * (a + b),
            false => secant.clamp(a + least, b - least),
        };
        (trial > a && trial < b).then_some(trial)
    }

    /// Takes up the value of the trial.
    pub fn take(&mut self, at: f64, value: f64) {
        if value > 0.0 {
            self.high = [at, value];
            self.low[1] *= if self.last == 1 { 0.5 } else { 1.0 };
            self.last = 1;
        } else {
            self.low = [at, value];
            self.high[1] *= if self.last == -1 { 0.5 } else { 1.0 };
            self.last = -1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(f: &dyn Fn(f64) -> f64, end: f64) -> (f64, u32) {
        let mut bracket = Bracket::new([0.0, f(0.0)], [end, f(end)]);
        while let Some(trial) = bracket.next(1e-14 * end) {
            bracket.take(trial, f(trial));
        }
        (bracket.high(), bracket.trials)
    }

    #[test]
    fn roots_are_found_to_round_off_in_few_trials() {
        let cases: [(&dyn Fn(f64) -> f64, f64); 5] = [
            (&|x| x * x - 0.5, 0.5_f64.sqrt()),
            (&|x| libm::exp(20.0 * x) - 1e4, 1e4_f64.ln() / 20.0),
            (&|x| (x - 0.3).min(2.0 * x - 0.7), 0.35), // a kink
            (&|x| if x > 0.123 { 1.0 } else { -1.0 }, 0.123), // a jump
            (&|x| x, 0.0),
        ];
        for (k, (f, root)) in cases.into_iter().enumerate() {
            let (at, trials) = found(f, 1.0);
            println!("case {k}: {at:.17} after {trials} trials, off by {:.1e}", at - root);
            assert!((at - root).abs() < 1e-13 && f(at) > 0.0, "{at} for {root}");
            assert!(trials < if k == 3 { 90 } else { SECANTS }, "{trials}");
        }
    }
}
