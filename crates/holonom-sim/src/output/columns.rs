//! The columns of the files of rows: names, quantities, units, in the order of the files.
//!
//! | file | columns, all after [`HEAD`] |
//! |---|---|
//! | `trajectory.csv` | `MEMBER.` and [`COORDINATES`] of each member, then [`TAIL`] |
//! | `residuals.csv` | [`RESIDUALS`]; in statics [`UNSTABLE`] |
//! | `energy.csv` | [`KINETIC`], [`GRAVITY`], [`ELASTIC`], [`SPRINGS`], [`CONTACTS`], [`energy`] of each bushing, [`TOTAL`], [`work`] of each source, [`BALANCE`] |
//! | `events.csv` | [`EVENT_COLUMNS`], without [`HEAD`] |
//! | `contacts.csv` | [`CONTACT_COLUMNS`] |
//! | `sensors.csv` | those of [`crate::sensor::SensorColumn`] |
//! | `beams.csv` | [`PLACE`], [`SECTION`] |
//! | `momenta.csv` | the groups [`MULTIPLIERS`], [`MOMENTUM`], [`PROJECTED`], [`REDUCED`]; `ENERGY.kinetic` and `ENERGY.potential` of [`NODE_ENERGIES`] |
//!
//! Whoever writes or reads these files takes names, units and places from here.

use vi_core::force::Source;

/// What the fields of a column hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// Whole numbers that count steps or elements.
    Index,
    /// Names.
    Text,
    /// Numbers.
    Number,
    /// Numbers whose powers of ten matter.
    Residual,
}

/// A column, or what the columns of several owners have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputColumn {
    /// Its name in the header; of owned columns what stands after the name of the owner.
    pub name: &'static str,
    /// What it is.
    pub quantity: &'static str,
    /// Its unit; empty when it has none.
    pub unit: &'static str,
    /// What its fields hold.
    pub kind: FieldKind,
}

const fn number(name: &'static str, quantity: &'static str, unit: &'static str) -> OutputColumn {
    OutputColumn { name, quantity, unit, kind: FieldKind::Number }
}

const fn residual(name: &'static str) -> OutputColumn {
    OutputColumn { name, quantity: "largest residual", unit: "SI", kind: FieldKind::Residual }
}

const fn index(name: &'static str, quantity: &'static str) -> OutputColumn {
    OutputColumn { name, quantity, unit: "", kind: FieldKind::Index }
}

/// Names of columns.
#[must_use]
pub const fn names<const N: usize>(columns: &[OutputColumn; N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut k = 0;
    while k < N {
        names[k] = columns[k].name;
        k += 1;
    }
    names
}

/// Step index of a node.
pub const STEP: OutputColumn = index("step", "step");
/// Time of a node; in statics the load factor.
pub const TIME: OutputColumn = number("t", "time", "s");
/// The first columns of all files.
pub const HEAD: [OutputColumn; 2] = [STEP, TIME];

/// Coordinates of a body or node; a point mass has the first three, in the plane two.
pub const COORDINATES: [OutputColumn; 12] = [
    number("x", "position", "m"),
    number("y", "position", "m"),
    number("z", "position", "m"),
    number("d1x", "director", ""),
    number("d1y", "director", ""),
    number("d1z", "director", ""),
    number("d2x", "director", ""),
    number("d2y", "director", ""),
    number("d2z", "director", ""),
    number("d3x", "director", ""),
    number("d3y", "director", ""),
    number("d3z", "director", ""),
];
/// Names of [`COORDINATES`].
pub const COORDINATE_NAMES: [&str; 12] = names(&COORDINATES);
/// Names of the coordinates of a position.
pub const POSITION_NAMES: [&str; 3] =
    [COORDINATE_NAMES[0], COORDINATE_NAMES[1], COORDINATE_NAMES[2]];

/// `E_d` of the step that starts at a node.
pub const DISCRETE_ENERGY: OutputColumn = number("E", "energy", "J");
/// `H_d` of a node.
pub const HAMILTONIAN: OutputColumn = number("H", "energy", "J");
/// Angular momentum.
pub const ANGULAR_MOMENTUM: [OutputColumn; 3] = [
    number("Lx", "angular momentum", "kg·m²/s"),
    number("Ly", "angular momentum", "kg·m²/s"),
    number("Lz", "angular momentum", "kg·m²/s"),
];
/// Linear momentum.
pub const LINEAR_MOMENTUM: [OutputColumn; 3] = [
    number("Px", "linear momentum", "kg·m/s"),
    number("Py", "linear momentum", "kg·m/s"),
    number("Pz", "linear momentum", "kg·m/s"),
];
/// The columns of `trajectory.csv` after those of the members.
pub const TAIL: [OutputColumn; 8] = {
    let ([l1, l2, l3], [p1, p2, p3]) = (ANGULAR_MOMENTUM, LINEAR_MOMENTUM);
    [DISCRETE_ENERGY, HAMILTONIAN, l1, l2, l3, p1, p2, p3]
};

/// Constraint residuals.
pub const LEVELS: [OutputColumn; 3] =
    [residual("position"), residual("velocity"), residual("momentum")];
/// Newton iterations of the step that led to a node.
pub const ITERATIONS: OutputColumn = number("newton_iterations", "Newton iterations", "");
/// The columns of `residuals.csv`.
pub const RESIDUALS: [OutputColumn; 4] = [LEVELS[0], LEVELS[1], LEVELS[2], ITERATIONS];
/// Its last column in statics: directions in which the equilibrium is unstable.
pub const UNSTABLE: OutputColumn = number("unstable", "unstable directions", "");

/// `T` of the projected momentum.
pub const KINETIC: OutputColumn = number("kinetic", "energy", "J");
/// `V` of the weight.
pub const GRAVITY: OutputColumn = number("gravity", "energy", "J");
/// `V` of beams.
pub const ELASTIC: OutputColumn = number("elastic", "energy", "J");
/// `V` of springs.
pub const SPRINGS: OutputColumn = number("springs", "energy", "J");
/// `V` of compliant contacts.
pub const CONTACTS: OutputColumn = number("contacts", "energy", "J");
/// The parts of the energy, those that a model has.
pub const PARTS: [OutputColumn; 5] = [KINETIC, GRAVITY, ELASTIC, SPRINGS, CONTACTS];
/// `V` of a bushing, `energy.NAME`.
pub const ENERGY: OutputColumn = number("energy", "energy", "J");
/// Their sum.
pub const TOTAL: OutputColumn = number("total", "energy", "J");
/// Work since the start, `work.NAME` of force elements.
pub const WORK: OutputColumn = number("work", "work", "J");
/// What the energy has changed by, and no work accounts for.
pub const BALANCE: OutputColumn = number("balance", "energy", "J");
/// What does the work of prescribed motions.
pub const MOTIONS: Source = Source::System("motions");
/// What changes the energy at events.
pub const EVENTS: Source = Source::System("events");

/// The columns of `events.csv`.
pub const EVENT_COLUMNS: [OutputColumn; 7] = [
    number("t", "time", "s"),
    OutputColumn { kind: FieldKind::Text, ..number("event", "event", "") },
    OutputColumn { kind: FieldKind::Text, ..number("action", "action", "") },
    number("energy_lost", "energy", "J"),
    number("impulse", "impulse", "N·s or N·m·s"),
    number("before", "velocity", "m/s or rad/s"),
    number("after", "velocity", "m/s or rad/s"),
];

const fn text(name: &'static str) -> OutputColumn {
    OutputColumn { kind: FieldKind::Text, ..number(name, name, "") }
}

/// The columns of `contacts.csv` after [`HEAD`].
pub const CONTACT_COLUMNS: [OutputColumn; 18] = [
    text("contact"),
    text("a"),
    text("b"),
    index("feature", "point"),
    number("x", "position", "m"),
    number("y", "position", "m"),
    number("z", "position", "m"),
    number("nx", "normal", ""),
    number("ny", "normal", ""),
    number("nz", "normal", ""),
    number("gap", "gap", "m"),
    number("normal", "force", "N"),
    number("tx", "force", "N"),
    number("ty", "force", "N"),
    number("tz", "force", "N"),
    number("slip", "slip", "m/s"),
    text("state"),
    text("unique"),
];

/// The name of a beam.
pub const BEAM: OutputColumn = OutputColumn { kind: FieldKind::Text, ..number("beam", "beam", "") };
/// The number of an element in its beam.
pub const ELEMENT: OutputColumn = index("element", "element");
/// Arc length along the stress-free beam.
pub const ARC_LENGTH: OutputColumn = number("s", "arc length", "m");
/// What describes the place of a row of `beams.csv`, after [`HEAD`].
pub const PLACE: [OutputColumn; 3] = [BEAM, ELEMENT, ARC_LENGTH];
/// Strains and section forces.
pub const SECTION: [OutputColumn; 12] = [
    number("Gamma1", "strain", ""),
    number("Gamma2", "strain", ""),
    number("Gamma3", "strain", ""),
    number("K1", "curvature", "1/m"),
    number("K2", "curvature", "1/m"),
    number("K3", "curvature", "1/m"),
    number("N1", "section force", "N"),
    number("N2", "section force", "N"),
    number("N3", "section force", "N"),
    number("M1", "section moment", "N·m"),
    number("M2", "section moment", "N·m"),
    number("M3", "section moment", "N·m"),
];
/// Strains and curvatures.
pub const STRAINS: [&str; 6] = {
    let [a, b, c, d, e, f, ..] = names(&SECTION);
    [a, b, c, d, e, f]
};
/// Section forces and moments.
pub const STRESSES: [&str; 6] = {
    let [.., a, b, c, d, e, f] = names(&SECTION);
    [a, b, c, d, e, f]
};

/// Section moments.
pub const MOMENTS: [&str; 3] = {
    let [.., a, b, c] = STRESSES;
    [a, b, c]
};

/// `λ_n`, `lambda.OWNER.k`.
pub const MULTIPLIERS: OutputColumn = number("lambda", "multiplier", "N");
/// `p_n`, `p.MEMBER.x` and so on.
pub const MOMENTUM: OutputColumn = number("p", "momentum", "kg·m/s");
/// `ᵠp_n`, likewise.
pub const PROJECTED: OutputColumn = number("p_projected", "momentum", "kg·m/s");
/// `ᴾp_n`, `p_reduced.JOINT.k`.
pub const REDUCED: OutputColumn = number("p_reduced", "reduced momentum", "");
/// `E_d`, `H_d(p_n)`, `H_d(ᵠp_n)`, each in [`NODE_PARTS`].
pub const NODE_ENERGIES: [&str; 3] = ["E_d", "H_d", "H_d_projected"];
/// The parts of [`NODE_ENERGIES`].
pub const NODE_PARTS: [OutputColumn; 2] = [KINETIC, number("potential", "energy", "J")];

/// The column of the work of a source.
#[must_use]
pub fn work(source: &Source) -> String {
    let work = WORK.name;
    match source {
        Source::Element(name) => format!("{work}.{name}"),
        Source::System(words) => format!("{work}_of_{}", words.replace(' ', "_")),
    }
}

/// The column of the energy of a bushing.
#[must_use]
pub fn energy(name: &str) -> String {
    format!("{}.{name}", ENERGY.name)
}

/// The source that a column of `energy.csv` is the work of, in words; `None` of the others.
#[must_use]
pub fn source_of_work(column: &str) -> Option<String> {
    let source = column.strip_prefix(WORK.name)?;
    let element = source.strip_prefix('.').map(str::to_owned);
    element.or_else(|| Some(source.strip_prefix("_of_")?.replace('_', " ")))
}

/// A file of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowTable {
    /// `trajectory.csv`.
    Trajectory,
    /// `residuals.csv`.
    Residuals,
    /// `energy.csv`.
    Energy,
    /// `sensors.csv`, whose columns the model describes: [`crate::sensor::columns`].
    Sensors,
    /// `beams.csv`, with several rows for each node.
    Beams,
    /// `momenta.csv`.
    Momenta,
}

impl RowTable {
    /// All files of rows.
    pub const ALL: [Self; 6] = [
        Self::Trajectory,
        Self::Residuals,
        Self::Energy,
        Self::Sensors,
        Self::Beams,
        Self::Momenta,
    ];

    /// The name of the file without extension.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Trajectory => "trajectory",
            Self::Residuals => "residuals",
            Self::Energy => "energy",
            Self::Sensors => "sensors",
            Self::Beams => "beams",
            Self::Momenta => "momenta",
        }
    }

    /// The name of the file.
    #[must_use]
    pub fn file(self) -> String {
        format!("{}.csv", self.name())
    }

    /// How many fields of a row stand before its numbers.
    #[must_use]
    pub fn head(self) -> usize {
        HEAD.len() + if self == Self::Beams { PLACE.len() } else { 0 }
    }

    /// The column of a name.
    #[must_use]
    pub fn column(self, name: &str) -> OutputColumn {
        let (owner, part) = name.rsplit_once('.').unwrap_or(("", name));
        let of =
            |columns: &[OutputColumn]| columns.iter().find(|column| column.name == part).copied();
        let own = |columns: &[OutputColumn]| of(columns).filter(|_| owner.is_empty());
        let group = |column: OutputColumn| {
            let member = name.strip_prefix(column.name).and_then(|rest| rest.strip_prefix('.'));
            member.map(|_| column)
        };
        let found = own(&HEAD).or_else(|| match self {
            Self::Trajectory => own(&TAIL).or_else(|| of(&COORDINATES)),
            Self::Residuals => own(&RESIDUALS).or_else(|| own(&[UNSTABLE])),
            Self::Energy
                if name.strip_prefix(ENERGY.name).is_some_and(|rest| rest.starts_with('.')) =>
            {
                Some(ENERGY)
            }
            Self::Energy if source_of_work(name).is_some() => Some(WORK),
            Self::Energy => own(&PARTS).or_else(|| own(&[TOTAL, BALANCE])),
            Self::Sensors => None,
            Self::Beams => own(&PLACE).or_else(|| of(&SECTION)),
            Self::Momenta if NODE_ENERGIES.contains(&owner) => of(&NODE_PARTS),
            Self::Momenta => group(MULTIPLIERS).or_else(|| group(REDUCED)).or_else(|| {
                group(MOMENTUM).or_else(|| group(PROJECTED)).map(|momentum| {
                    if POSITION_NAMES.contains(&part) { momentum } else { OF_DIRECTORS }
                })
            }),
        });
        found.unwrap_or(number("", "value", ""))
    }
}

const OF_DIRECTORS: OutputColumn = number("", "momentum of directors", "kg·m²/s");

/// The member whose first coordinate a column of `trajectory.csv` is.
#[must_use]
pub fn member(column: &str) -> Option<&str> {
    column.strip_suffix(COORDINATE_NAMES[0])?.strip_suffix('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_is_described_by_its_name() {
        let described = |table: RowTable, name: &str| {
            let OutputColumn { quantity, unit, kind, .. } = table.column(name);
            format!("{}/{name}: {quantity} [{unit}] {kind:?}", table.name())
        };
        let mut words = Vec::new();
        for (table, names) in [
            (RowTable::Trajectory, "step t bob.x rod.0.z arm.d2y E H Ly Pz"),
            (RowTable::Residuals, "step position momentum newton_iterations unstable"),
            (
                RowTable::Energy,
                "kinetic springs energy.bearing total work.arm.motor work_of_motions balance",
            ),
            (RowTable::Sensors, "t E beam"),
            (RowTable::Beams, "beam element s Gamma3 rod.0.K1 N2 M1"),
            (
                RowTable::Momenta,
                "lambda.rod.1 p.bob.x p_projected.arm.d1x p_reduced.hinge.1 H_d.kinetic",
            ),
        ] {
            words.extend(names.split(' ').map(|name| described(table, name)));
        }
        insta::assert_snapshot!(words.join("\n"));
    }

    #[test]
    fn the_source_of_work_is_read_back_from_its_column() {
        let sources = [Source::Element("arm.motor".into()), Source::Element("work.x".into())];
        for source in sources.into_iter().chain([MOTIONS, vi_beam::damping::SOURCE]) {
            let words = match &source {
                Source::Element(name) => name.as_str(),
                Source::System(words) => words,
            };
            let column = work(&source);
            println!("{source:?}: {column}");
            assert_eq!(source_of_work(&column).as_deref(), Some(words));
        }
        assert_eq!(source_of_work(TOTAL.name), None);
    }
}
