//! A compiled expression: operations in the order of evaluation.

use std::cell::RefCell;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::function::{Binary, Unary};
use super::surface::{Surface, SurfaceDerivatives};
use super::table::Curve;

/// Operations of an expression at most.
pub(super) const MOST: usize = 4096;

/// One operation; its operands are earlier ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operation {
    Constant(f64),
    Input(usize),
    Unary(Unary, usize),
    Binary(Binary, [usize; 2]),
    /// `a` where `c > 0`, else `b`.
    Select([usize; 3]),
    /// The table of this index.
    Curve(usize, usize),
    /// The table of two numbers of this index.
    Surface(usize, [usize; 2]),
}

/// An expression that is ready to be evaluated. Clones share it.
#[derive(Clone)]
pub struct ExpressionProgram {
    pub(super) text: Arc<str>,
    pub(super) operations: Arc<[Operation]>,
    pub(super) spans: Arc<[Range<usize>]>,
    pub(super) curves: Arc<[Curve]>,
    pub(super) surfaces: Arc<[Surface]>,
}

impl fmt::Debug for ExpressionProgram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Program").field(&self.text).finish()
    }
}

impl PartialEq for ExpressionProgram {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
            && self.operations == other.operations
            && self.curves == other.curves
            && self.surfaces == other.surfaces
    }
}

/// A part of an expression that is no finite number.
#[derive(Clone, Debug, PartialEq)]
pub struct UndefinedPart {
    /// Its text and what is wrong with it: `sqrt(x)` is not defined.
    pub message: String,
    /// The numbers it was computed from.
    pub arguments: Vec<f64>,
}

/// What is wrong with a part that has this value.
pub(super) fn words(part: &str, value: f64) -> String {
    let what = if value.is_nan() { "is not defined" } else { "is not finite" };
    format!("`{part}` {what}")
}

impl fmt::Display for UndefinedPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Value and derivatives by the time of `f(x, y)`, with the rates and accelerations of both.
fn of_two(
    (f, [fx, fy], [fxx, fxy, fyy]): SurfaceDerivatives,
    [[dx, dy], [ddx, ddy]]: [[f64; 2]; 2],
) -> [f64; 3] {
    let bend = fxx * dx * dx + 2.0 * fxy * dx * dy + fyy * dy * dy;
    [f, fx * dx + fy * dy, fx * ddx + fy * ddy + bend]
}

/// An operation of two numbers at most, with its derivatives by them.
#[derive(Clone, Copy)]
struct OperationNode {
    of: [Option<usize>; 2],
    first: [f64; 2],
    second: [f64; 3],
}

/// Operations of an expression whose values are kept on the stack.
const SHORT: usize = 32;

thread_local! {
    /// Of longer ones; these grow to the longest expression once.
    static JETS: RefCell<Vec<[f64; 3]>> = const { RefCell::new(Vec::new()) };
    static WORKSPACE: RefCell<(Vec<f64>, Vec<f64>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

impl ExpressionProgram {
    /// The text it was compiled from.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether it reads this input.
    #[must_use]
    pub fn reads(&self, input: usize) -> bool {
        self.operations.contains(&Operation::Input(input))
    }

    /// The same of other inputs: of `place(k)` in the place of `k`.
    #[must_use]
    pub fn with_inputs(mut self, place: impl Fn(usize) -> usize) -> Self {
        let moved = self.operations.iter().map(|operation| match *operation {
            Operation::Input(input) => Operation::Input(place(input)),
            other => other,
        });
        self.operations = moved.collect();
        self
    }

    /// The value if it reads nothing.
    #[must_use]
    pub fn constant(&self) -> Option<f64> {
        match self.operations.last() {
            Some(Operation::Constant(value)) => Some(*value),
            _ => None,
        }
    }

    /// Its value at `inputs`.
    ///
    /// # Errors
    /// [`UndefinedPart`] names the first part that is no finite number.
    pub fn value(&self, inputs: &[f64]) -> Result<f64, UndefinedPart> {
        self.with_numbers(|values, _| {
            let finite = self.forward(inputs, values);
            self.defined(finite, values)
        })
    }

    /// Its value at `inputs`; `slopes ←` the derivatives by each of them, of the same length.
    ///
    /// # Errors
    /// [`UndefinedPart`], also where a slope is no finite number (`sqrt` at 0).
    pub fn gradient(&self, inputs: &[f64], slopes: &mut [f64]) -> Result<f64, UndefinedPart> {
        self.with_numbers(|values, adjoints| {
            slopes.fill(0.0);
            let finite = self.forward(inputs, values);
            let value = self.defined(finite, values)?;
            if self.backward(values, adjoints, slopes) == 0.0 {
                return Ok(value);
            }
            adjoints.fill(0.0);
            slopes.fill(0.0);
            Err(self.undefined_slope(values, adjoints, slopes))
        })
    }

    /// `slopes ←` how its derivatives by the inputs change where these change by `along`, `D²e`
    /// times that; zero where a second derivative is no finite number (`x^1.5` at 0). Allocates.
    pub fn bend(&self, inputs: &[f64], along: &[f64], slopes: &mut [f64]) {
        let count = self.operations.len();
        let (mut values, mut rates) = (vec![0.0; count], vec![0.0; count]);
        slopes.fill(0.0);
        if count == 0 || self.forward(inputs, &mut values) != 0.0 {
            return;
        }
        let parts: Vec<OperationNode> = (0..count).map(|k| self.partials(k, &values)).collect();
        for (k, operation) in self.operations.iter().enumerate() {
            let OperationNode { of, first, .. } = parts[k];
            rates[k] = match *operation {
                Operation::Input(input) => along[input],
                _ => {
                    of.iter().zip(first).map(|(x, slope)| slope * x.map_or(0.0, |x| rates[x])).sum()
                }
            };
        }
        // adjoints and how they change
        let mut adjoints = vec![[0.0; 2]; count];
        adjoints[count - 1][0] = 1.0;
        for (k, operation) in self.operations.iter().enumerate().rev() {
            let [adjoint, change] = adjoints[k];
            if let Operation::Input(input) = *operation {
                slopes[input] += change;
                continue;
            }
            if adjoint == 0.0 && change == 0.0 {
                continue;
            }
            let OperationNode { of, first, second: [xx, xy, yy] } = parts[k];
            let [dx, dy] = of.map(|x| x.map_or(0.0, |x| rates[x]));
            let turned = [xx * dx + xy * dy, xy * dx + yy * dy];
            for ((x, slope), bend) in of.into_iter().zip(first).zip(turned) {
                let Some(x) = x else { continue };
                adjoints[x][0] += adjoint * slope;
                adjoints[x][1] += change * slope + adjoint * bend;
            }
        }
        if slopes.iter().any(|slope| !slope.is_finite()) {
            slopes.fill(0.0);
        }
    }

    /// The operands of an operation that count, with its first and second derivatives by them.
    fn partials(&self, k: usize, values: &[f64]) -> OperationNode {
        let still = OperationNode { of: [None; 2], first: [0.0; 2], second: [0.0; 3] };
        match self.operations[k] {
            Operation::Constant(_) | Operation::Input(_) => still,
            Operation::Unary(function, x) => {
                let (first, second) =
                    (function.slope(values[x], values[k]), function.bend(values[x], values[k]));
                OperationNode {
                    of: [Some(x), None],
                    first: [first, 0.0],
                    second: [second, 0.0, 0.0],
                }
            }
            Operation::Curve(curve, x) => {
                let [_, first, second] = self.curve(curve, values[x]);
                OperationNode {
                    of: [Some(x), None],
                    first: [first, 0.0],
                    second: [second, 0.0, 0.0],
                }
            }
            Operation::Select([c, a, b]) => {
                let taken = if values[c] > 0.0 { a } else { b };
                OperationNode { of: [Some(taken), None], first: [1.0, 0.0], ..still }
            }
            Operation::Binary(function, [x, y]) => {
                let at = [values[x], values[y]];
                let (first, second) = function.partials(at, values[k], self.is_constant(y));
                OperationNode { of: [Some(x), Some(y)], first, second }
            }
            Operation::Surface(surface, [x, y]) => {
                let (_, first, second) = self.surface(surface, [values[x], values[y]]);
                OperationNode { of: [Some(x), Some(y)], first, second }
            }
        }
    }

    /// With room for the values and the adjoints, zero, of all operations.
    fn with_numbers<T>(&self, then: impl FnOnce(&mut [f64], &mut [f64]) -> T) -> T {
        let count = self.operations.len();
        if count <= SHORT {
            let [mut values, mut adjoints] = [[0.0; SHORT]; 2];
            return then(&mut values[..count], &mut adjoints[..count]);
        }
        WORKSPACE.with_borrow_mut(|(values, adjoints)| {
            for numbers in [&mut *values, &mut *adjoints] {
                numbers.clear();
                numbers.resize(count, 0.0);
            }
            then(values, adjoints)
        })
    }

    /// The value, where all parts are finite: `finite` is zero.
    fn defined(&self, finite: f64, values: &[f64]) -> Result<f64, UndefinedPart> {
        if finite == 0.0 {
            return Ok(values.last().copied().unwrap_or_default());
        }
        let first = values.iter().position(|value| !value.is_finite()).unwrap_or(0);
        Err(self.undefined(first, values))
    }

    /// Adds the slopes of an operation to the adjoints of its operands.
    #[inline(always)]
    fn pull_back(&self, k: usize, values: &[f64], adjoints: &mut [f64], slopes: &mut [f64]) -> f64 {
        let adjoint = adjoints[k];
        match self.operations[k] {
            Operation::Constant(_) => 0.0,
            Operation::Input(input) => {
                slopes[input] += adjoint;
                0.0
            }
            Operation::Unary(function, x) => {
                adjoints[x] += adjoint * function.slope(values[x], values[k]);
                adjoints[x] * 0.0
            }
            Operation::Binary(function, [x, y]) => {
                let at = [values[x], values[y]];
                let [by_x, by_y] = function.slopes(at, values[k], self.is_constant(y));
                adjoints[x] += adjoint * by_x;
                adjoints[y] += adjoint * by_y;
                (adjoints[x] + adjoints[y]) * 0.0
            }
            Operation::Select([c, a, b]) => {
                let taken = if values[c] > 0.0 { a } else { b };
                adjoints[taken] += adjoint;
                adjoints[taken] * 0.0
            }
            Operation::Curve(curve, x) => {
                let [_, slope, _] = self.curve(curve, values[x]);
                adjoints[x] += adjoint * slope;
                adjoints[x] * 0.0
            }
            Operation::Surface(surface, [x, y]) => {
                let (_, [by_x, by_y], _) = self.surface(surface, [values[x], values[y]]);
                adjoints[x] += adjoint * by_x;
                adjoints[y] += adjoint * by_y;
                (adjoints[x] + adjoints[y]) * 0.0
            }
        }
    }

    /// The reverse sweep; zero where all adjoints are finite, else not a number.
    fn backward(&self, values: &[f64], adjoints: &mut [f64], slopes: &mut [f64]) -> f64 {
        let count = self.operations.len();
        adjoints[count - 1] = 1.0;
        let mut finite = 0.0;
        for k in (0..count).rev() {
            if adjoints[k] != 0.0 {
                finite += self.pull_back(k, values, adjoints, slopes);
            }
        }
        finite
    }

    /// The first slope that is not finite, from the end of the expression.
    #[cold]
    fn undefined_slope(
        &self,
        values: &[f64],
        adjoints: &mut [f64],
        slopes: &mut [f64],
    ) -> UndefinedPart {
        let count = self.operations.len();
        adjoints[count - 1] = 1.0;
        for k in (0..count).rev() {
            if adjoints[k] == 0.0 {
                continue;
            }
            self.pull_back(k, values, adjoints, slopes);
            if let Some(bad) = self.operands(k).find(|operand| !adjoints[*operand].is_finite()) {
                let message = words(self.part(k), adjoints[bad]);
                let message = format!("the slope of {message}");
                return UndefinedPart { message, ..self.undefined(k, values) };
            }
        }
        self.undefined(count - 1, values)
    }

    /// Value, first and second derivative of a function of one input, the time.
    ///
    /// # Errors
    /// As [`ExpressionProgram::gradient`].
    pub fn taylor(&self, t: f64) -> Result<[f64; 3], UndefinedPart> {
        let count = self.operations.len();
        if count <= SHORT {
            return self.taylor_with(t, &mut [[0.0; 3]; SHORT]);
        }
        JETS.with_borrow_mut(|jets| {
            jets.resize(jets.len().max(count), [0.0; 3]);
            self.taylor_with(t, jets)
        })
    }

    fn taylor_with(&self, t: f64, jets: &mut [[f64; 3]]) -> Result<[f64; 3], UndefinedPart> {
        for (k, operation) in self.operations.iter().enumerate() {
            let jet = match *operation {
                Operation::Constant(value) => [value, 0.0, 0.0],
                Operation::Input(_) => [t, 1.0, 0.0],
                Operation::Unary(function, x) => {
                    let [x, dx, ddx] = jets[x];
                    let f = function.value(x);
                    let slope = function.slope(x, f);
                    let bend = if dx == 0.0 { 0.0 } else { function.bend(x, f) * dx * dx };
                    [f, slope * dx, slope * ddx + bend]
                }
                Operation::Binary(function, [x, y]) => {
                    let constant = self.is_constant(y);
                    let ([x, dx, ddx], [y, dy, ddy]) = (jets[x], jets[y]);
                    let f = function.value(x, y);
                    let (first, second) = function.partials([x, y], f, constant);
                    of_two((f, first, second), [[dx, dy], [ddx, ddy]])
                }
                Operation::Surface(surface, [x, y]) => {
                    let ([x, dx, ddx], [y, dy, ddy]) = (jets[x], jets[y]);
                    of_two(self.surface(surface, [x, y]), [[dx, dy], [ddx, ddy]])
                }
                Operation::Select([c, a, b]) => jets[if jets[c][0] > 0.0 { a } else { b }],
                Operation::Curve(curve, x) => {
                    let [x, dx, ddx] = jets[x];
                    let [f, slope, bend] = self.curve(curve, x);
                    [f, slope * dx, slope * ddx + bend * dx * dx]
                }
            };
            jets[k] = jet;
            if !jet.iter().all(|x| x.is_finite()) {
                return Err(self.undefined_jet(k, jets));
            }
        }
        Ok(self.operations.len().checked_sub(1).map_or([0.0; 3], |last| jets[last]))
    }

    /// Why a value or a derivative by the time is no finite number.
    #[cold]
    fn undefined_jet(&self, k: usize, jets: &[[f64; 3]]) -> UndefinedPart {
        let values: Vec<f64> = jets.iter().map(|jet| jet[0]).collect();
        let undefined = self.undefined(k, &values);
        let Some(bad) = jets[k].iter().position(|x| !x.is_finite()).filter(|bad| *bad > 0) else {
            return undefined;
        };
        let message = words(self.part(k), jets[k][bad]);
        let which = ["", "first", "second"][bad];
        UndefinedPart { message: format!("the {which} derivative of {message}"), ..undefined }
    }

    /// The values of all operations; zero where all are finite, else not a number.
    fn forward(&self, inputs: &[f64], values: &mut [f64]) -> f64 {
        let mut finite = 0.0;
        for (k, operation) in self.operations.iter().enumerate() {
            let value = match *operation {
                Operation::Constant(value) => value,
                Operation::Input(input) => inputs[input],
                Operation::Unary(function, x) => function.value(values[x]),
                Operation::Binary(function, [x, y]) => function.value(values[x], values[y]),
                Operation::Select([c, a, b]) => values[if values[c] > 0.0 { a } else { b }],
                Operation::Curve(curve, x) => self.curve(curve, values[x])[0],
                Operation::Surface(k, [x, y]) => self.surface(k, [values[x], values[y]]).0,
            };
            values[k] = value;
            finite += value * 0.0;
        }
        finite
    }

    fn is_constant(&self, operation: usize) -> bool {
        matches!(self.operations[operation], Operation::Constant(_))
    }

    fn operands(&self, k: usize) -> impl Iterator<Item = usize> + use<> {
        let all: [Option<usize>; 3] = match self.operations[k] {
            Operation::Constant(_) | Operation::Input(_) => [None; 3],
            Operation::Unary(_, x) | Operation::Curve(_, x) => [Some(x), None, None],
            Operation::Binary(_, [x, y]) | Operation::Surface(_, [x, y]) => {
                [Some(x), Some(y), None]
            }
            Operation::Select(all) => all.map(Some),
        };
        all.into_iter().flatten()
    }

    fn curve(&self, curve: usize, x: f64) -> [f64; 3] {
        self.curves[curve].at(x).unwrap_or([f64::NAN; 3])
    }

    fn surface(&self, surface: usize, at: [f64; 2]) -> SurfaceDerivatives {
        self.surfaces[surface].at(at).unwrap_or((f64::NAN, [f64::NAN; 2], [f64::NAN; 3]))
    }

    pub(super) fn part(&self, k: usize) -> &str {
        self.text[self.spans[k].clone()].trim()
    }

    fn undefined(&self, k: usize, values: &[f64]) -> UndefinedPart {
        let message = match self.operations[k] {
            Operation::Curve(curve, x) => {
                let ([first, last], name) = (self.curves[curve].range(), self.curves[curve].name());
                format!("`{name}`: {} is outside of {first} … {last}", values[x])
            }
            Operation::Surface(k, [x, y]) => {
                let surface = &self.surfaces[k];
                let [[a, b], [c, d]] = [surface.range(0), surface.range(1)];
                let (name, x, y) = (surface.name(), values[x], values[y]);
                format!("`{name}`: ({x}, {y}) is outside of {a} … {b}, {c} … {d}")
            }
            _ => words(self.part(k), values[k]),
        };
        let arguments = self.operands(k).map(|operand| values[operand]).collect();
        UndefinedPart { message, arguments }
    }

    /// Whether it is a polynomial of degree 0 or 1 in the inputs of which `counts` is true; the
    /// others may come in any way.
    #[must_use]
    pub fn is_affine(&self, counts: impl Fn(usize) -> bool) -> bool {
        let mut degrees: Vec<u8> = Vec::with_capacity(self.operations.len()); // 2: any
        for operation in self.operations.iter() {
            let free = |degree: u8| if degree == 0 { 0 } else { 2 };
            degrees.push(match *operation {
                Operation::Constant(_) => 0,
                Operation::Input(input) => u8::from(counts(input)),
                Operation::Unary(Unary::Negative | Unary::Integer(1), x) => degrees[x],
                Operation::Unary(_, x) | Operation::Curve(_, x) => free(degrees[x]),
                Operation::Surface(_, [x, y]) => free(degrees[x].max(degrees[y])),
                Operation::Binary(function, [x, y]) => {
                    let (x, y) = (degrees[x], degrees[y]);
                    match function {
                        Binary::Sum | Binary::Difference => x.max(y),
                        Binary::Product => (x + y).min(2),
                        Binary::Quotient if y == 0 => x,
                        _ => free(x.max(y)),
                    }
                }
                Operation::Select([c, a, b]) => free(degrees[c]).max(degrees[a].max(degrees[b])),
            });
        }
        degrees.last().is_none_or(|degree| *degree < 2)
    }

    /// The functions in it that jump where their argument crosses a number, each once: `sign`,
    /// `floor`, `select`, a table of steps; without those that are multiplied by what they switch
    /// on, as `select(v, 2, 1)*v`, and without tables of the time.
    #[must_use]
    pub fn jumps(&self) -> Vec<&'static str> {
        let mut found = Vec::new();
        for (k, name, x) in self.jumping() {
            // in time they belong on step boundaries, as those of a history
            let in_time = matches!(self.operations[k], Operation::Curve(..)) && self.is_time(x);
            if !in_time && !found.contains(&name) {
                found.push(name);
            }
        }
        found
    }

    /// The first part that jumps as of [`ExpressionProgram::jumps`] where inputs move; `moves`:
    /// which ones do.
    #[must_use]
    pub fn jumps_moved(&self, moves: impl Fn(usize) -> bool) -> Option<&str> {
        let mut changes: Vec<bool> = Vec::with_capacity(self.operations.len());
        for (k, operation) in self.operations.iter().enumerate() {
            let own = matches!(*operation, Operation::Input(input) if moves(input));
            changes.push(own || self.operands(k).any(|x| changes[x]));
        }
        let found = self.jumping().find(|(_, _, x)| changes[*x]);
        found.map(|(k, ..)| self.part(k))
    }

    /// The parts that jump: the operation, its name, and on what it switches.
    fn jumping(&self) -> impl Iterator<Item = (usize, &'static str, usize)> {
        (0..self.operations.len()).filter_map(|k| {
            let (name, switch) = match self.operations[k] {
                Operation::Unary(Unary::Floor, x) => ("floor", x),
                Operation::Unary(Unary::Sign, x) => ("sign", x),
                Operation::Select([c, a, b]) if self.operations[a] != self.operations[b] => {
                    ("select", c)
                }
                Operation::Curve(curve, x) if self.curves[curve].jumps() => ("a table", x),
                _ => return None,
            };
            let everywhere = name == "floor" || name == "a table";
            (everywhere || !self.vanishes(k, switch)).then_some((k, name, switch))
        })
    }

    fn is_time(&self, k: usize) -> bool {
        let is_input = matches!(self.operations[k], Operation::Input(_));
        is_input && self.text[self.spans[k].clone()].trim() == "t"
    }

    /// Why it has no derivative by its inputs there, in words: the first part that depends on them
    /// and jumps, or is at its kink.
    pub(crate) fn kink(&self, inputs: &[f64]) -> Option<String> {
        self.with_numbers(|values, _| {
            self.forward(inputs, values);
            let mut changes: Vec<bool> = Vec::with_capacity(values.len());
            for (k, operation) in self.operations.iter().enumerate() {
                let own = matches!(operation, Operation::Input(_));
                changes.push(own || self.operands(k).any(|x| changes[x]));
                let kinks = match *operation {
                    Operation::Unary(Unary::Floor, x) => changes[x],
                    Operation::Unary(Unary::Abs | Unary::Sign, x) => changes[x] && values[x] == 0.0,
                    Operation::Binary(Binary::Min | Binary::Max, [x, y]) => {
                        changes[k] && values[x].total_cmp(&values[y]).is_eq()
                    }
                    Operation::Select([c, ..]) => changes[c] && values[c] == 0.0,
                    _ => false,
                };
                if kinks {
                    let part = self.text[self.spans[k].clone()].trim();
                    let how = match operation {
                        Operation::Unary(Unary::Floor, _) => "jumps",
                        _ => "has a kink there",
                    };
                    return Some(format!("`{part}` {how}"));
                }
            }
            None
        })
    }

    /// Whether the result has the factor `switch` wherever it has the factor `k`.
    fn vanishes(&self, k: usize, switch: usize) -> bool {
        let mut users = (0..self.operations.len()).filter(|j| self.operands(*j).any(|x| x == k));
        let (Some(user), None) = (users.next(), users.next()) else { return false };
        match self.operations[user] {
            Operation::Unary(Unary::Negative, _) => self.vanishes(user, switch),
            Operation::Binary(Binary::Product, [x, y]) => {
                let other = if x == k { y } else { x };
                self.has_factor(other, switch) || self.vanishes(user, switch)
            }
            Operation::Binary(Binary::Quotient, [x, _]) => x == k && self.vanishes(user, switch),
            _ => false,
        }
    }

    fn has_factor(&self, product: usize, factor: usize) -> bool {
        let of = |k: usize| self.has_factor(k, factor);
        product == factor
            || match self.operations[product] {
                Operation::Binary(Binary::Product, [x, y]) => of(x) || of(y),
                Operation::Unary(Unary::Negative | Unary::Abs | Unary::Integer(_), x) => of(x),
                _ => false,
            }
    }
}
