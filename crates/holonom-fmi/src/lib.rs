//! The library in a functional mock-up unit: the C functions of FMI 2.0 and 3.0, co-simulation.
//!
//! ```text
//! tool ── fmi3…, fmi2… ──► handle: no panic leaves it, messages ──► holonom_fmu::Instance
//! ```
//! Each function is a few lines around the instance, which is safe code. This is the place where
//! pointers of others are read and written; the modules below are the only ones that may.
//!
//! | file | concept |
//! |---|---|
//! | [`pointers`] | lists, words and results behind pointers |
//! | `handle` | an instance as the tool holds it: panics, messages, status |
//! | [`fmi3`] | the functions of FMI 3.0 |
//! | [`fmi2`] | the functions of FMI 2.0 |
//!
//! A library that ends the process at a panic makes no instance: the profile `unwinding` is for it.
#![deny(missing_docs)]

/// Functions as the standards declare them.
macro_rules! interface {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[allow(
            missing_docs,
            non_snake_case,
            unsafe_code,
            clippy::missing_safety_doc,
            clippy::too_many_arguments,
            reason = "the functions, their names and arguments are those of the standard"
        )]
        pub mod $name;
    };
}

interface!(fmi2);
interface!(fmi3);
mod handle;
#[allow(unsafe_code, reason = "pointers of the tool")]
pub mod pointers;

/// What the exporter looks for in a library, see [`holonom_fmu::library`].
static MARK: &str = if cfg!(panic = "abort") {
    concat!("holonom functional mock-up unit library ", env!("CARGO_PKG_VERSION"), " aborts;")
} else {
    concat!("holonom functional mock-up unit library ", env!("CARGO_PKG_VERSION"), " unwinds;")
};

#[cfg(test)]
mod tests {
    #[test]
    fn the_mark_is_that_of_the_exporter() {
        assert_eq!(super::MARK, holonom_fmu::library::mark(true));
    }
}
