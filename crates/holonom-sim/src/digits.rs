//! Numbers in messages.

/// A stated or computed quantity with up to `digits` significant digits and no superfluous ones:
/// `2.26`, `5.65377`.
#[must_use]
pub fn rounded(value: f64, digits: usize) -> String {
    let short: f64 = format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value);
    match short.abs() {
        0.0 => "0".to_owned(),
        v if (1e-4..1e7).contains(&v) => format!("{short}"),
        _ => format!("{short:e}"),
    }
}
