//! Random sequences of calls: each gets an answer, none ends an instance.
//!
//! `HOLONOM_FMU_CALLS` is their number, a few thousand by default.

use crate::phases::ARM;
use crate::unit::{Instance, Unit};
use holonom_fmi::{fmi2, fmi3};
use holonom_fmu::Version;
use std::ffi::c_void;

const FATAL: i32 = 4;

/// A linear congruential generator (Knuth, MMIX).
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn number(&mut self) -> f64 {
        let odd = [0.0, -0.0, 1e-300, 1e300, f64::NAN, f64::INFINITY, -1.0, 1e9, 1e-3];
        match self.below(12) {
            k if (k as usize) < odd.len() => odd[k as usize],
            _ => self.below(2000) as f64 / 1000.0 - 1.0,
        }
    }

    /// Mostly a step that is right, never one of very many steps.
    fn length(&mut self) -> f64 {
        let other = self.number();
        let right = 1e-3 * (1 + self.below(3)) as f64;
        if self.below(4) > 0 || (1.0..1e20).contains(&other) { right } else { other }
    }
}

/// A call; its status.
fn call(random: &mut Random, own: &Instance, t: &mut f64, states: &mut Vec<*mut c_void>) -> i32 {
    let reference = random.below(20) as u32;
    let state = (!states.is_empty()).then(|| states[random.below(states.len() as u64) as usize]);
    match random.below(16) {
        0 => own.reset(),
        1 => own.enter(if random.below(3) > 0 { 0.0 } else { random.number() }),
        2 => own.exit(),
        3 => own.terminate(),
        4 | 5 => own.set(reference, random.number()),
        6 | 7 => own.try_get(&[reference, 0]).map_or_else(|status| status, |_| 0),
        8 if states.len() < 8 => {
            let mut state = std::ptr::null_mut();
            let status = unsafe { fmi3::fmi3GetFMUState(own.id, &mut state) };
            if status == 0 {
                states.push(state);
            }
            status
        }
        9 => state.map_or(0, |state| own.resume(state)),
        10 => state.map_or(0, |state| {
            let mut bytes = own.bytes(state);
            let at = random.below(bytes.len() as u64) as usize;
            bytes[at] ^= (random.below(3) * random.below(256)) as u8;
            // a changed byte may still be a state, of other numbers
            own.state_of(&bytes).map_or(3, |changed| {
                let status = own.resume(changed);
                own.free(changed);
                own.reset(); // its step may be tiny
                status
            })
        }),
        11 => fmi3::fmi3GetString(own.id, &reference, 1, std::ptr::null_mut(), 1),
        12 => fmi2::fmi2SetRealInputDerivatives(
            own.id,
            &reference,
            1,
            std::ptr::null(),
            std::ptr::null(),
        ),
        _ => {
            let at = if random.below(5) > 0 { *t } else { random.number() };
            let (status, reached) = own.step(at, random.length());
            *t = reached;
            status
        }
    }
}

#[test]
fn random_calls_end_no_instance() {
    let text = format!("{ARM}\n[[signal]]\nname = \"wanted\"\nstart = 0.2\n");
    let unit = Unit::new(&text, &[], &["arm"], &["body.arm.position.0"]);
    let calls = std::env::var("HOLONOM_FMU_CALLS").ok().and_then(|own| own.parse().ok());
    let (calls, mut done) = (calls.unwrap_or(4000), 0_u64);
    let (mut found, mut seed) = ([0_u64; 5], 0);
    while done < calls {
        seed += 1;
        let mut random = Random(seed);
        let version = if random.below(2) == 0 { Version::Fmi2 } else { Version::Fmi3 };
        let (own, mut t, mut states) = (unit.instance(version), 0.0, Vec::new());
        for _ in 0..200 {
            let status = call(&mut random, &own, &mut t, &mut states);
            found[status as usize] += 1;
            assert!(status < FATAL, "seed {seed}: {}", own.said());
            done += 1;
        }
        states.into_iter().for_each(|state| own.free(state));
    }
    println!(
        "{done} calls: {} done, {} with a warning, {} discarded, {} refused",
        found[0], found[1], found[2], found[3]
    );
    assert!(found[0] > calls / 8 && found[3] > calls / 8);
}
