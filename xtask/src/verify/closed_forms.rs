//! Values of the discrete equations that are known in closed form.

use holonom::evidence::certificate::Finding;
use holonom::evidence::closed_form;

/// A curved cantilever under an end moment.
pub(crate) fn curved_cantilever() -> Vec<Finding> {
    vec![closed_form::curved_cantilever(&|_| {})]
}
