//! The canvas of a scene with its controls, and what is said of them.

use super::SceneParameter;

/// The section of a page that the viewer fills; `several`: with a legend of motions.
pub(super) fn html(parameter: SceneParameter, several: bool) -> String {
    let slider = match parameter {
        SceneParameter::Load => "load path",
        SceneParameter::Mode => "phase",
        SceneParameter::Time | SceneParameter::None => "time",
    };
    let legend = if several {
        "<div class=\"scene-legend\" role=\"group\" aria-label=\"motions\"></div>\n"
    } else {
        ""
    };
    let words = match parameter {
        SceneParameter::Mode => "<p class=\"scene-words\" role=\"status\"></p>\n",
        _ => "",
    };
    let trails = match parameter {
        SceneParameter::Load => "shapes",
        SceneParameter::Mode => "configuration",
        SceneParameter::Time | SceneParameter::None => "trails",
    };
    format!(
        "<section id=\"scene\" aria-label=\"animation\">\n{VIEW}{words}<div class=\"scene-bar\">\n\
         <select data-modes aria-label=\"mode\"></select>\n<button data-play aria-label=\"play\">▶</button>\n\
         <input data-slider type=\"range\" min=\"0\" max=\"1000\" step=\"any\" value=\"0\" aria-label=\"{slider}\">\n\
         <output data-clock></output>\n<select data-speed aria-label=\"speed\"></select>\n{VIEWS}\
         <span><button data-trails>{trails}</button>{TOGGLES}</span>\n</div>\n{legend}\
         <p class=\"note\">{MOUSE} {}</p>\n</section>\n",
        keys(parameter)
    )
}

const VIEW: &str = r#"<div class="scene-view"><canvas tabindex="0" aria-label="view of the mechanism: drag to rotate, shift and drag to move, keys + and − to zoom"></canvas><div class="scene-labels" aria-hidden="true"></div><p class="scene-note" role="status"></p></div>
"#;
const VIEWS: &str = r#"<span><button data-view="iso">3-D</button><button data-view="front">front</button><button data-view="side">side</button><button data-view="top">top</button></span>
"#;
const TOGGLES: &str = r"<button data-labels>names</button><button data-loads>loads</button><button data-reactions>reactions</button><button data-follow>follow</button><button data-grid>grid</button><button data-full>full screen</button>";
const MOUSE: &str = "Drag to rotate, shift and drag to move, wheel or + − to zoom.";

/// The keys.
fn keys(parameter: SceneParameter) -> &'static str {
    match parameter {
        SceneParameter::Time => {
            "Keys: space plays, ← → step (with shift ten at once), 1–4 views, T trails, N names, L loads, R reactions, G grid, F \
             follows. A click on a chart goes to its time."
        }
        SceneParameter::Load => {
            "Keys: space plays, ← → to the neighbouring equilibrium (with shift ten at once), 1–4 views, T shapes of other \
             equilibria, N names, L loads, G grid. A click on a chart goes to its load factor."
        }
        SceneParameter::Mode => {
            "Keys: ↑ ↓ choose the mode, space plays, ← → change the phase, 1–4 views, T configuration, N names, L loads, G grid."
        }
        SceneParameter::None => "Keys: 1–4 views, N names, L loads, G grid.",
    }
}
