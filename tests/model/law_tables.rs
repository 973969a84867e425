//! Springs of joints by tables, and tables of two numbers.

#![allow(clippy::unwrap_used)] // a test

use super::laws::{apart, links, run};
use holonom::Model;
use vi_testkit::model::part;

const SCHEMES: [&str; 6] = [
    "scheme = \"nodal\"",
    "scheme = \"constrained\"",
    "scheme = \"reduced\"",
    "scheme = \"em-nodal\"",
    "method = \"galerkin\", order = 4",
    "order = 4",
];

fn table(keys: &str) -> String {
    part("table", "pull") + keys
}

const PULL: &str = "points = [[-1.0, -9.0], [-0.2, -0.5], [0.0, 0.0], [0.3, 0.6], [1.0, 12.0]]\n";

fn sprung(settings: &str, spring: &str, more: &str) -> String {
    let keys = format!("rate = -2.0\nspring = {{ {spring} }}\n");
    links(settings, more).replacen("rate = -2.0\n", &keys, 1)
}

#[test]
fn a_spring_by_a_table_moves_as_the_law() {
    let law =
        part("law", "same") + "joint = \"elbow\"\neffort = \"-3*(x - 0.1) - pull(x - 0.1)\"\n";
    for scheme in SCHEMES {
        let a = run(&sprung(scheme, "stiffness = 3.0, rest = 0.1, table = \"pull\"", &table(PULL)));
        let b = run(&links(scheme, &(law.clone() + &table(PULL))));
        let free = run(&links(scheme, "")).unwrap();
        let (a, b) = (a.unwrap(), b.unwrap());
        let distance = apart(&a, &b);
        println!("{scheme}: {distance:.1e}, without it {:.1e}", apart(&a, &free));
        assert!(distance < 1e-12 && apart(&a, &free) > 1e-3, "{scheme}: {distance:e}");
    }
}

#[test]
fn what_is_no_table_of_a_spring_is_refused() {
    let grid = "axes = [[0.0, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0], [2.0, 3.0]]\n";
    for (spring, keys, why) in [
        ("stiffness = 1.0, table = \"pul\"", PULL, "did you mean `pull`?"),
        ("stiffness = 1.0, table = \"pull\"", grid, "a table of two numbers"),
    ] {
        let error = run(&sprung("", spring, &table(keys))).unwrap_err();
        assert!(error.contains(why) && error.contains("joint.elbow.spring.table"), "{error}");
    }
    let ends = format!("{PULL}outside = \"error\"\n").replace("[-1.0, -9.0], ", "");
    let error = run(&sprung("", "stiffness = 0.0, table = \"pull\"", &table(&ends))).unwrap_err();
    println!("{error}");
    assert!(error.contains("the spring of `elbow`: `pull`: -0.2"), "{error}");
}

/// A table of two numbers that is a product of two moves as the product.
#[test]
fn a_grid_is_a_function_of_two_numbers() {
    let law = |effort: &str| {
        part("law", "motor") + &format!("joint = \"shoulder\"\neffort = \"{effort}\"\n")
    };
    let one = "points = [[-1.0, -9.0], [-0.2, -0.5], [0.1, 0.3], [1.0, 12.0]]\n";
    let two = "axes = [[-1.0, -0.2, 0.1, 1.0], [-2.0, 2.0]]\n\
               values = [[9.0, -27.0], [0.5, -1.5], [-0.3, 0.9], [-12.0, 36.0]]\n";
    for (kind, outside) in [("linear", "hold"), ("pchip", "slope"), ("spline", "slope")] {
        let keys = format!("interpolation = \"{kind}\"\noutside = \"{outside}\"\n");
        for scheme in SCHEMES {
            let product = law("-pull(elbow)*(1 + shoulder)");
            let a = run(&links(scheme, &(product + &table(&format!("{one}{keys}"))))).unwrap();
            let b = law("-pull(elbow, shoulder)");
            let b = run(&links(scheme, &(b + &table(&format!("{two}{keys}"))))).unwrap();
            let distance = apart(&a, &b);
            println!("{kind}, {scheme}: {distance:.1e}");
            assert!(distance < 1e-11, "{kind}, {scheme}: {distance:e}");
        }
    }
}

#[test]
fn what_is_no_grid_is_refused_at_its_place() {
    let motor = part("law", "motor") + "joint = \"shoulder\"\neffort = \"-pull(elbow, t)\"\n";
    for (keys, key, why) in [
        ("axes = [[0.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0]]\n", "axes", "1 value(s) of x"),
        (
            "axes = [[0.0, 1.0], [1.0, 1.0]]\nvalues = [[0.0, 1.0], [0, 0]]\n",
            "axes",
            "values of y must increase",
        ),
        (
            "axes = [[0.0, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0]]\n",
            "axes",
            "1 row(s) of values for 2 of x",
        ),
        (
            "axes = [[0.0, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0], [1.0]]\n",
            "axes",
            "row 2 has 1 value(s) for 2 of y",
        ),
        ("values = [[0.0, 1.0], [1.0, 2.0]]\n", "values", "nothing says where"),
        (
            "axes = [[0.0, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0], [1.0, 2.0]]\ngrid = true\n",
            "grid",
            "only a file",
        ),
        (
            "axes = [[0.0, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0], [1.0, 2.0]]\npoints = [[0, 1], [1, 2]]\n",
            "points",
            "stated twice",
        ),
    ] {
        let error = run(&links("", &(motor.clone() + &table(keys)))).unwrap_err();
        assert!(
            error.contains(why) && error.contains(&format!("\"table.pull.{key}\"")),
            "{keys}\n{error}"
        );
    }
    let two = "axes = [[-0.1, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0], [1.0, 2.0]]\n";
    for (effort, why) in [("pull(x)", "a function of two numbers"), ("pull", "write pull(x, y)")] {
        let law = part("law", "motor") + &format!("joint = \"elbow\"\neffort = \"{effort}\"\n");
        let error = run(&links("", &(law + &table(two)))).unwrap_err();
        assert!(error.contains(why), "{error}");
    }
    let error =
        run(&links("", &(motor + &table(&format!("{two}outside = \"error\"\n"))))).unwrap_err();
    println!("{error}");
    assert!(
        error.contains("law `motor`: `pull`: (-0.1")
            && error.contains("outside of -0.1 … 1, 0 … 1"),
        "{error}"
    );
}

#[test]
fn a_grid_is_data() {
    let two = "axes = [[-1.0, 1.0], [0.0, 1.0]]\nvalues = [[0.0, 1.0], [1.0, 2.0]]\n";
    let law = part("law", "motor") + "joint = \"elbow\"\neffort = \"pull(x, t)\"\n";
    let model = Model::from_toml(&links("", &(law + &table(two)))).unwrap();
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
    let spring = sprung("", "stiffness = 1.0, table = \"pull\"", &table(PULL));
    let model = Model::from_toml(&spring).unwrap();
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
}
