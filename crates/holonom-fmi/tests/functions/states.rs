//! States: back in the middle, into another instance, on another thread.

use crate::phases::ARM;
use crate::unit::{ERROR, Instance, OK, Unit, shipped};
use holonom::model::Scheme;
use holonom_fmu::{Causality, Version};

/// Takes steps with inputs that change; all outputs along the way.
fn steps(unit: &Unit, own: &Instance, first: u32, count: u32) -> Vec<u64> {
    let h = unit.model.settings.step;
    let of = |causality| unit.interface.of_causality(causality).map(|(k, _)| k as u32);
    let inputs: Vec<u32> = of(Causality::Input).collect();
    let outputs: Vec<u32> = of(Causality::Output).collect();
    let mut seen = Vec::new();
    for n in first..first + count {
        for input in &inputs {
            assert_eq!(own.set(*input, 1e-3 * f64::from(n % 5)), OK);
        }
        assert_eq!(own.step(f64::from(n) * h, h).0, OK, "{}", own.said());
        seen.extend(own.get(&outputs).iter().map(|value| value.to_bits()));
    }
    seen
}

#[test]
fn a_state_goes_on_bit_for_bit_on_all_shipped_models() {
    let mut sizes = Vec::new();
    for (name, text) in shipped() {
        let unit = Unit::new(&text, &[], &[], &[]);
        if unit.model.settings.scheme == Scheme::Static {
            continue;
        }
        let first = unit.begun(Version::Fmi3);
        steps(&unit, &first, 0, 4);
        let state = first.state();
        let bytes = first.bytes(state);
        let expected = steps(&unit, &first, 4, 4);
        assert_eq!(first.resume(state), OK, "{name}: {}", first.said());
        assert_eq!(steps(&unit, &first, 4, 4), expected, "{name}: back in the same instance");
        first.free(state);
        // another instance, before its initialization, from bytes
        let other = unit.instance(Version::Fmi2);
        let state = other.state_of(&bytes).unwrap();
        assert_eq!(other.resume(state), OK, "{name}: {}", other.said());
        assert_eq!(steps(&unit, &other, 4, 4), expected, "{name}: in another instance");
        other.free(state);
        sizes.push(bytes.len());
    }
    println!("{} models, states of {:?} bytes at most", sizes.len(), sizes.iter().max());
}

#[test]
fn parameters_start_and_step_are_part_of_a_state() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let (mass, effort) = (unit.reference("parameters.mass"), unit.reference("shoulder.effort"));
    let angle = unit.reference("angle");
    let own = unit.instance(Version::Fmi3);
    assert_eq!(own.set(mass, 3.0), OK);
    assert_eq!(own.initialize(2.0), OK, "{}", own.said());
    assert_eq!(own.set(effort, 5.0), OK);
    assert!(own.step(2.0, 2.5e-3).0 < 2, "{}", own.said()); // three steps of 2.5e-3/3 s
    let bytes = own.bytes(own.state());
    assert!(own.step(2.0025, 2.5e-3).0 < 2, "{}", own.said());
    let expected = own.get(&[0, angle, effort, mass]);
    assert!((expected[0] - 2.005).abs() < 1e-12);
    // back in the same instance, after another input was held
    assert_eq!(own.set(effort, 0.0), OK);
    assert!(own.step(2.005, 2.5e-3).0 < 2, "{}", own.said());
    let state = own.state_of(&bytes).unwrap();
    assert_eq!(own.resume(state), OK, "{}", own.said());
    assert!(own.step(2.0025, 2.5e-3).0 < 2, "{}", own.said());
    assert_eq!(own.get(&[0, angle, effort, mass]), expected);
    let other = unit.begun(Version::Fmi3);
    assert_eq!(other.step(0.0, 1e-3).0, OK);
    let state = other.state_of(&bytes).unwrap();
    assert_eq!(other.resume(state), OK, "{}", other.said());
    assert_eq!(other.step(2.0025, 2.5e-3).0, OK, "{}", other.said());
    assert_eq!(other.get(&[0, angle, effort, mass]), expected);
    // another mass alone
    let heavy = unit.instance(Version::Fmi3);
    assert_eq!(heavy.set(mass, 3.0), OK);
    assert_eq!(heavy.initialize(0.0), OK);
    let bytes = heavy.bytes(heavy.state());
    let expected = steps(&unit, &heavy, 0, 5);
    let light = unit.begun(Version::Fmi3);
    assert_eq!(light.resume(light.state_of(&bytes).unwrap()), OK, "{}", light.said());
    assert_eq!(steps(&unit, &light, 0, 5), expected);
    // reset: as it was made
    assert_eq!(other.reset(), OK);
    assert_eq!(other.get(&[effort, mass]), [0.0, 2.0]);
    assert_eq!(other.initialize(0.0), OK);
    let fresh = unit.begun(Version::Fmi3);
    assert_eq!(steps(&unit, &other, 0, 5), steps(&unit, &fresh, 0, 5));
}

#[test]
fn bytes_that_are_no_state_of_the_unit_are_refused() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let own = unit.begun(Version::Fmi3);
    let bytes = own.bytes(own.state());
    assert!(own.state_of(&bytes[..20]).unwrap_err().contains("no state of this unit"));
    assert!(own.state_of(&bytes[..bytes.len() - 1]).unwrap_err().contains("no state"));
    assert!(own.state_of(b"").unwrap_err().contains("no state"));
    let other = Unit::new(&ARM.replace("9.81", "1.62"), &[], &[], &[]).begun(Version::Fmi3);
    assert!(other.state_of(&bytes).unwrap_err().contains("of another unit"));
    let mut older = bytes.clone();
    older[1] = b'9'; // of the version
    assert!(own.state_of(&older).unwrap_err().contains("this is holonom"));
    // too small a place for the bytes
    let state = own.state();
    let mut small = [0; 8];
    let status = unsafe {
        holonom_fmi::fmi3::fmi3SerializeFMUState(own.id, state, small.as_mut_ptr(), small.len())
    };
    assert_eq!(status, ERROR);
    assert!(own.said().contains("bytes, and there are 8"));
}

#[test]
fn instances_on_threads_do_not_see_one_another() {
    let unit = Unit::new(ARM, &[], &[], &[]);
    let alone = steps(&unit, &unit.begun(Version::Fmi3), 0, 100);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..3)
            .map(|_| {
                let own = unit.begun(Version::Fmi3); // made here, used there
                let unit = &unit;
                scope.spawn(move || {
                    let own = own;
                    steps(unit, &own, 0, 100)
                })
            })
            .collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), alone);
        }
    });
}
