//! The law of a contact at a node: what its impulse drives to zero, and within which set.
//!
//! ```text
//! γ = g(q_{n+1})/h                                                                            [N2]
//! γ   = (g(q_{n+1}) − (1 − h/H) g(q_n))/h     where g(q_n) < 0, in a part of a step H
//! ξ_N = γ                         kind p
//! ξ_N = min(γ, U_N⁺ + e U_N⁻)     of a contact that is hit; kind e where the second is smaller [N4]
//! ξ_N = min(γ, U_N⁺)              of one that was kept closed and leaves before it is at rest   [N8]
//! b_n = ½(h_{n−1} + h_n) τ_c + μ r |h λ_⊥|                                                    [N5]
//! Λ   = −b (s_0 + s_1)/(|s_0| + |s_1|)    where other forces drive the rate through zero      [N6]
//! ```
//! A contact is hit when `U_N⁻ < 0`, `e > 0` and a step without impulses of contacts would end with
//! `γ < 0`; also where it would not, if the contact has closed at this node: it would be passed and
//! left again within the step. At rest under a load `U⁻ = −ha/2`, and `γ = 0` asks for `U⁺ = ha/2 ≥
//! −e U⁻`: no threshold of velocity is needed. Where the step from the node is shorter than the one
//! before it is: what was kept closed over a step is not hit, whatever its `U⁻`.
//!
//! | state | `ξ_T` | |
//! |---|---|---|
//! | rest, start, stop | `σ`, the slip of the step | kind p |
//! | steady slip | `U_T⁺ + U_T⁻` | kind p, where it cannot stop in this step |
//! | impact | `U_T⁺ + e_T U_T⁻` | kind e |
//! | departure | `U_T⁺` | [N8], where the second part is smaller |
//!
//! [N6]: `s_0` is the rate in the step before, `s_1` that in the present one. The impulse
//! `H = −(s_1 − W_ii Λ_i − s_0)/W_ii` would hold the rate; where `|H| > b`, `s_0 H > 0` and
//! `s_0 s_1 ≤ 0`, the row gets the mean of the sign over the time of the node.
//!
//! An impact in the same island divides dry friction into `Λ_1 = −½ h_{n−1} τ_c sgn s_0` up to it
//! and `Λ_2 = −½ h_n τ_c sgn s_1` from there. The velocities of the impact are those between them:
//! ```text
//! U⁺ − W_NF Λ_2 + e (U⁻ + W_NF Λ_1)     in the place of U⁺ + e U⁻                              [N7]
//! ```
//!
//! Where no impulses are found, the speed `s` of slip is that of an earlier solution of the step:
//! ```text
//! (ξ_N + s, ξ_T) in the dual cone, Λ in the cone, orthogonal;   s = μ|ξ_T| is Coulomb's law  [2.51]
//! ```
//!
//! Static friction: what stuck in the step before, touches without slip, or turns back in this step
//! is solved with its static coefficient. Where it slips by that, it is solved again with the other
//! one. Of points whose impulses are not unique one may be at its bound and rest: what slips has a
//! slip beside rounding.

use super::mean_direction::mean_direction;
use super::unilateral::{ContactLaw, ContactPlace};
use vi_core::cone::Cone;
use vi_core::contact_state::ContactId;

/// A gap that counts as closed, in parts of its size.
pub(super) const CLOSED: f64 = 1e-11;

/// Changes of the kind of a contact that tell of an iteration that does not settle it.
const ALTERNATES: usize = 8;

/// What counts as at the bound of Coulomb's law, in parts of it; of dry friction, whose impulses
/// may be those of a bound that was known before.
const INSIDE: f64 = 1e-9;
const INSIDE_DRY: f64 = 1e-3;

/// How the normal of a contact is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// By the gap at the end of the step.
    #[default]
    Position,
    /// By the velocity after an impact.
    Impact,
    /// By the velocity with which what was kept closed leaves.
    Departure,
}

/// How dry friction of a coordinate is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Course {
    /// The usual law.
    #[default]
    Usual,
    /// The rate is driven through zero, [N6].
    Reversing,
    /// It was to be reversed, and an iterate has kept its sign: the impulse is that of the bound.
    Held,
    /// An impact reverses the rate: it has the sign of each step for the half of it at the node.
    Struck,
    /// The usual law, because the iteration did not settle whether the rate is reversed.
    Plain,
}

/// A contact of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    pub(super) id: ContactId,
    pub(super) law: ContactLaw,
    pub(super) row: usize, // its first
    pub(super) size: f64,
    pub(super) distance: f64, // of its point from the origin, m
    pub(super) place: Option<ContactPlace>,
    pub(super) gap: f64,                      // at q_n
    pub(super) before: f64,                   // s_0 of dry friction
    pub(super) slip_before: Option<[f64; 2]>, // s_0 along the tangents, of what was closed
    pub(super) turns: bool,                   // it slides in the mean direction from s_0
    pub(super) shift: [f64; 2],               // that ξ_T is asked for without
    pub(super) is_new: bool,                  // closed, and no contact of the node before
    pub(super) is_kept: bool,                 // closed from the node before to this one
    pub(super) loads: Option<[f64; 2]>,       // ΔU_N of the steps before, of what was kept over one
    pub(super) is_struck: bool,               // its impulse acts at once, in the node accepted last
    pub(super) leaves: bool,                  // by an impact beside it
    pub(super) may_depart: bool, // nothing else is closed or closes beside what is kept
    pub(super) departs: bool,    // it leaves from rest, if it leaves
    pub(super) rests: bool,      // beside an impact
    pub(super) is_hit: bool,
    pub(super) reduction: f64,            // η of the energy guard
    pub(super) is_plastic: bool,          // no impulses obey the restitution of its island
    pub(super) slides: bool,              // decided once: by the mean velocity
    pub(super) kept: bool,                // it was to slide, and sticks after all
    pub(super) held: bool,                // it stuck in the step before
    pub(super) holds: bool,               // by its static friction
    pub(super) caught: bool,              // it was asked whether that holds it where it turned back
    pub(super) kind: Kind,                // of the last evaluation
    pub(super) changes: usize,            // of the kind, of a hit contact
    pub(super) course: Course,            //
    pub(super) gamma: f64,                // g(q_{n+1})/h
    pub(super) sigma: [f64; 2],           // slip over h
    pub(super) bound: f64,                // b of dry friction
    pub(super) halves: [f64; 2],          // ½ h_{n−1} τ_c, ½ h_n τ_c of dry friction
    pub(super) parted_velocity: [f64; 3], // e W_NF Λ_1 − W_NF Λ_2 of the dry friction beside it
    pub(super) slip_speed: SlipSpeed,
    pub(super) slip: f64,    // μ|ξ_T| of the last evaluation
    pub(super) parted: bool, // its dry friction slides before an impact of its island and after it
}

/// The speed of slip in the law of friction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum SlipSpeed {
    /// Its own: Coulomb's law.
    #[default]
    Own,
    /// That of a solution of the step, or of a later one where that is less: what closes
    /// beside its law would gain energy where it is opened again.
    Least(f64),
}

/// What a row of a contact is driven by, at the last step that was solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Drive {
    /// `ξ`, with what is added to the diagonal of `W`.
    Zero { xi: f64, compliance: f64 },
    /// The impulse is known.
    Known(f64),
}

/// Velocities and impulses of the rows of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a> {
    pub(super) minus: &'a [f64],  // U⁻
    pub(super) plus: &'a [f64],   // U⁺
    pub(super) lambda: &'a [f64], // Λ
    pub(super) w: f64,            // the diagonal of its first row
}

impl Contact {
    /// Whether its gap counts as closed at the node.
    pub(super) fn is_closed(&self) -> bool {
        self.gap <= CLOSED * self.size
    }

    /// Whether it may be hit, if it approaches.
    pub(super) fn may_bounce(&self) -> bool {
        let may = |restitution| restitution > 0.0 || self.is_new;
        !self.is_kept && self.law.restitution().is_some_and(may)
    }

    /// The gap that it may end with in this part of a whole step. Where another feature of a pair
    /// is named, its gap may be less than zero by what shapes turn in a step, or by what counts as
    /// closed: within a whole step it is closed, and not at once in a short part of one, with a
    /// velocity `−g/h` of any size.
    pub(super) fn least_gap(&self, part: f64) -> f64 {
        if self.gap < 0.0 { (1.0 - part).max(0.0) * self.gap } else { 0.0 }
    }

    /// Rounding of its velocities beside others of a size, and of gaps and slip over `h`: those are
    /// differences of positions.
    pub(super) fn rounding(&self, speeds: f64, h: f64) -> f64 {
        4.0 * f64::EPSILON * (speeds + (self.size + self.distance) / h)
    }

    /// To which its laws are known: beside rounding, a gap that counts as closed may be open.
    pub(super) fn error(&self, speeds: f64, h: f64) -> f64 {
        let is_closed = self.gap.abs() <= CLOSED * self.size;
        self.rounding(speeds, h) + if is_closed { self.gap.abs() / h } else { 0.0 }
    }

    /// `μ` at present, of Coulomb's law.
    pub(super) fn coefficient(&self) -> f64 {
        match self.law {
            ContactLaw::Coulomb { static_friction, .. } if self.holds => static_friction,
            ContactLaw::Coulomb { friction, .. } => friction,
            _ => 0.0,
        }
    }

    /// Friction at present over that of sliding, of dry friction.
    pub(super) fn ratio(&self) -> f64 {
        match self.law {
            ContactLaw::Dry { static_ratio, .. } if self.holds => static_ratio,
            _ => 1.0,
        }
    }

    /// What drives its rows, and its cone.
    pub(super) fn equations(&mut self, rows: Rows<'_>) -> ([Drive; 3], Cone) {
        let zero = |xi| Drive::Zero { xi, compliance: 0.0 };
        match self.law {
            ContactLaw::Frictionless { restitution } => {
                ([zero(self.normal(rows, restitution)), zero(0.0), zero(0.0)], Cone::Normal)
            }
            ContactLaw::Coulomb { restitution, tangential_restitution, .. } => {
                let friction = self.coefficient();
                let normal = self.normal(rows, restitution);
                let [a, b] = [0, 1].map(|i| match self.kind {
                    Kind::Impact => {
                        rows.plus[1 + i]
                            + self.reduction * tangential_restitution * rows.minus[1 + i]
                            + self.parted_velocity[1 + i]
                    }
                    Kind::Departure => rows.plus[1 + i],
                    Kind::Position if self.slides => rows.plus[1 + i] + rows.minus[1 + i],
                    Kind::Position => self.sigma[i] - self.shift[i],
                });
                let turning =
                    self.slip_before.filter(|_| self.turns && self.kind == Kind::Position);
                let cone = match turning {
                    None => self.friction_cone(friction, libm::hypot(a, b)),
                    Some(s_0) => {
                        let (mean, slope) = mean_direction(s_0, self.sigma);
                        let direction = mean.map(|s| friction * s);
                        let slope = slope.map(|row| row.map(|s| friction * s));
                        Cone::Sliding { direction, slope, at: self.sigma }
                    }
                };
                ([zero(normal), zero(a), zero(b)], cone)
            }
            ContactLaw::Dry { .. } => {
                let drive = self.dry_friction(rows.lambda[0], rows.w);
                ([drive, zero(0.0), zero(0.0)], Cone::Bounded { bound: self.bound })
            }
        }
    }

    /// Coulomb's cone, with the slip `|ξ_T|`.
    fn friction_cone(&mut self, coefficient: f64, slip: f64) -> Cone {
        self.slip = coefficient * slip;
        let speed = match &mut self.slip_speed {
            SlipSpeed::Own => return Cone::Friction { coefficient },
            SlipSpeed::Least(speed) => {
                *speed = speed.min(self.slip);
                *speed
            }
        };
        Cone::Convex { coefficient, speed }
    }

    /// From now on the least speed of slip counts.
    pub(super) fn keep_slip_speed(&mut self) {
        self.slip_speed = SlipSpeed::Least(self.slip);
    }

    /// `ξ_N` [N4].
    fn normal(&mut self, rows: Rows<'_>, restitution: f64) -> f64 {
        let before = std::mem::replace(&mut self.kind, Kind::Position);
        let mut xi = self.gamma;
        if self.is_hit {
            let arrival = self.reduction * restitution * rows.minus[0];
            let velocity = rows.plus[0] + arrival + self.parted_velocity[0];
            if velocity < xi {
                self.kind = Kind::Impact;
                xi = velocity;
            }
            self.changes += usize::from(self.kind != before);
        } else if self.departs && rows.plus[0] < xi {
            self.kind = Kind::Departure;
            xi = rows.plus[0];
        }
        xi
    }

    /// Takes the usual laws where the iteration has not settled which one holds: of a coordinate
    /// whose rate is reversed or not, and of a contact that is an impact with the tangential law of
    /// one, and none with that of the other.
    pub(super) fn settle(&mut self) {
        if self.course != Course::Usual || self.parted {
            self.course = Course::Plain;
        }
        if self.changes > ALTERNATES {
            self.is_hit = false;
        }
    }

    /// Dry friction with its reversal [N6]: Newton's linearization of `Λ + b s̄(s_1) = 0`.
    fn dry_friction(&mut self, lambda: f64, w: f64) -> Drive {
        let (s_0, s_1, b) = (self.before, self.sigma[0], self.bound);
        if self.course == Course::Plain {
            return Drive::Zero { xi: s_1, compliance: 0.0 };
        }
        if self.parted && s_0 * s_1 < 0.0 {
            self.course = Course::Struck;
            return Drive::Known(-s_1.signum() * (b - 2.0 * self.halves[0]));
        }
        if self.course == Course::Struck {
            self.course = Course::Usual;
        }
        if self.course == Course::Usual {
            let hold = -(s_1 - w * lambda - s_0) / w;
            if !(w > 0.0 && hold.abs() > b && s_0 * hold > 0.0 && s_0 * s_1 <= 0.0) {
                return Drive::Zero { xi: s_1, compliance: 0.0 };
            }
        }
        if s_0 * s_1 > 0.0 {
            self.course = Course::Held;
            return Drive::Known(-b.copysign(s_0));
        }
        self.course = Course::Reversing;
        let sum = s_0.abs() + s_1.abs();
        let slope = 2.0 * b * s_0.abs() / (sum * sum); // ∂(b s̄)/∂s_1
        if slope > 0.0 {
            Drive::Zero { xi: (lambda + b * (s_0 + s_1) / sum) / slope, compliance: 1.0 / slope }
        } else {
            Drive::Known(0.0) // b = 0
        }
    }

    /// Whether dry friction slides before an impact and after it, so fast that it cannot hold what
    /// is left; `struck`: something is hit in its island, `w`: `W_ii`.
    pub(super) fn part(&mut self, struck: bool, w: f64) {
        /// What is divided changes the rate by half of their difference at most.
        const LEAVES: f64 = 2.0;
        const ENTERS: f64 = 4.0;
        let is_dry = matches!(self.law, ContactLaw::Dry { .. }) && self.course != Course::Plain;
        let least = if self.parted { LEAVES } else { ENTERS } * w * self.bound;
        self.parted = is_dry && struck && self.before != 0.0 && self.sigma[0].abs() > least;
    }

    /// The parts of dry friction up to an impact and from there, N·s.
    pub(super) fn parts(&self) -> Option<[f64; 2]> {
        let [before, after] = self.halves;
        let signs = [self.before, self.sigma[0]].map(f64::signum);
        self.parted.then(|| [-before * signs[0], -after * signs[1]])
    }

    /// Whether it slides by more than the velocity changes in this step, so that it cannot stop;
    /// `change`: `|(WΛ)_T|`.
    pub(super) fn cannot_stop(&self, rows: Rows<'_>, change: f64) -> bool {
        if self.kind != Kind::Position || self.kept || self.turns || !self.slips(rows.lambda) {
            return false;
        }
        let ([a, b], v) = (self.sigma, &rows.minus[1..3]);
        let off = libm::hypot(a - v[0], b - v[1]);
        a * v[0] + b * v[1] > 0.0 && libm::hypot(a, b) > 2.0 * (change + off)
    }

    /// Whether its slip stops or turns back in this step, if it is held by its friction.
    pub(super) fn may_turn(&self) -> bool {
        let Some([a, b]) = self.slip_before else { return false };
        self.kind == Kind::Position
            && self.slip_speed == SlipSpeed::Own
            && !self.slides
            && (a != 0.0 || b != 0.0)
            && a * self.sigma[0] + b * self.sigma[1] <= 0.0
    }

    /// Whether it slides no more, though it was taken to.
    pub(super) fn sticks_after_all(&self, lambda: &[f64]) -> bool {
        self.slides && !self.slips(lambda)
    }

    /// Whether these impulses are on the rim of its cone, or at its bound.
    pub(super) fn slips(&self, lambda: &[f64]) -> bool {
        let (size, bound, inside) = match self.law {
            ContactLaw::Frictionless { .. } => return false,
            ContactLaw::Coulomb { .. } => {
                (libm::hypot(lambda[1], lambda[2]), self.coefficient() * lambda[0], INSIDE)
            }
            // the bound may follow from forces that are known to the end of the iteration
            ContactLaw::Dry { .. } => (lambda[0].abs(), self.bound, INSIDE_DRY),
        };
        bound > 0.0 && size >= (1.0 - inside) * bound
    }

    /// Whether it slides at the end of the iteration; `compliance`: `W_ii` along a tangent,
    /// `least`: the rounding of a slip.
    pub(super) fn slides_by(&self, lambda: &[f64], compliance: f64, least: f64) -> bool {
        const PART: f64 = 1e-8; // of what the impulses change
        let size = match self.law.rows() {
            3 => libm::hypot(lambda[1], lambda[2]),
            _ => lambda[0].abs(),
        };
        let slip = libm::hypot(self.sigma[0], self.sigma[1]);
        self.slips(lambda) && slip > least.max(PART * compliance * size)
    }

    /// Whether it is to hold by its static friction from now on, or no more; `None`: as before.
    pub(super) fn holds_now(&mut self, slides: bool) -> Option<bool> {
        if !self.law.has_static_friction() || self.kind != Kind::Position {
            return None;
        }
        if self.holds {
            return (slides || self.course != Course::Usual).then_some(false);
        }
        let turned = match self.law {
            ContactLaw::Dry { .. } => self.before != 0.0 && self.before * self.sigma[0] <= 0.0,
            _ => self.turns || self.may_turn(),
        };
        (turned && !std::mem::replace(&mut self.caught, true)).then_some(true)
    }
}
