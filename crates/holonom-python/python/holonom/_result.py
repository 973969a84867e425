"""Results: arrays by the names of the columns of the files of a run."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike, fspath
from os.path import join
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._errors import (
    HolonomError,
    HolonomWarning,
    MissingPackage,
    OutputExists,
    RunFailed,
    UnknownName,
    guarded,
    needed,
    no_panic,
)
from ._model import Model, load

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from ._page import Drawing

    Array = NDArray[np.float64]

HEAD = ("step", "t")
SECTION = [f"{what}{k}" for what in ("Gamma", "K", "N", "M") for k in (1, 2, 3)]


class Table:
    """Columns over time: ``table["kinetic"]`` is a column ``(K,)``, ``table["bearing"]`` all
    columns ``(K, m)`` of a name with dots below it.

    Attributes
    ----------
    columns : names of the columns.
    values : shape ``(K, columns)``, in their units.
    units : of the columns; empty of numbers without one.
    """

    def __init__(self, columns: list[str], values: Array, units: list[str]) -> None:
        self.columns, self.values, self.units = columns, values, units

    def unit(self, name: str) -> str:
        """The unit of a column, or of all columns below a name.

        Parameters
        ----------
        name : of the column or columns.

        Returns
        -------
        str
            Of several units those there are.

        Raises
        ------
        UnknownName
        """
        if name in self.columns:
            return self.units[self.columns.index(name)]
        parts, _ = self.below(name)
        if not parts:
            raise unknown(name, self.names())
        own = [self.columns.index(f"{name}.{part}") for part in parts]
        return ", ".join(dict.fromkeys(self.units[k] for k in own if self.units[k]))

    def names(self) -> list[str]:
        """What stands before the dots, each once.

        Returns
        -------
        list of str
        """
        return list(dict.fromkeys(column.rsplit(".", 1)[0] for column in self.columns))

    def below(self, name: str) -> tuple[list[str], slice | list[int]]:
        """Parts of a name, and where their columns are.

        Parameters
        ----------
        name : what stands before the dot.

        Returns
        -------
        list of str
            What stands behind it.
        slice or list of int
            The columns of ``values``.
        """
        places = [k for k, column in enumerate(self.columns) if column.rsplit(".", 1)[0] == name]
        parts = [self.columns[k].rsplit(".", 1)[-1] for k in places]
        if places and places == list(range(places[0], places[-1] + 1)):
            return parts, slice(places[0], places[-1] + 1)
        return parts, places

    def __getitem__(self, name: str) -> Array:
        if name in self.columns:
            column: Array = self.values[:, self.columns.index(name)]
            return column
        parts, places = self.below(name)
        if parts:
            group: Array = self.values[:, places]
            return group
        raise unknown(name, self.names())

    def __contains__(self, name: object) -> bool:
        return name in self.columns or name in self.names()

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    def __repr__(self) -> str:
        return f"<holonom.Table {self.values.shape[0]} rows: {', '.join(self.columns)}>"


def unknown(name: str, known: list[str]) -> UnknownName:
    """There is no such name."""
    import difflib

    near = difflib.get_close_matches(name, known, 1)
    remedy = f"did you mean `{near[0]}`?" if near else f"there are: {', '.join(known)}"
    return UnknownName(f"there is no `{name}`", remedy)


class Member:
    """A body, a node of a beam or a point mass over time; views of ``q``, but the quaternions.

    Attributes
    ----------
    name : its name.
    q : its coordinates, shape ``(K, 12)``: position, m, and directors, 1; of a point mass the
        position.
    """

    def __init__(self, name: str, q: Array) -> None:
        self.name, self.q = name, q

    @property
    def position(self) -> Array:
        """Position of the centre of mass, m, shape ``(K, 3)``; in the plane ``(K, 2)``."""
        return self.q[:, :3]

    @property
    def directors(self) -> Array:
        """Directors, 1, shape ``(K, 3, 3)``: ``directors[k, i]`` is the ``i``-th one in space.

        They are the axes of the body; of one whose inertia is a full tensor its principal axes, as
        in ``trajectory.csv``: a sensor of type ``orientation`` gives those of the body.
        """
        if self.q.shape[1] != 12:
            raise UnknownName(f"`{self.name}` has no directors", "only bodies and nodes of beams have")
        return self.q[:, 3:].reshape(-1, 3, 3)

    @property
    def rotation(self) -> Array:
        """Rotation matrices, 1, shape ``(K, 3, 3)``: directors are the columns."""
        return self.directors.swapaxes(1, 2)

    @property
    def quaternion(self) -> Array:
        """Unit quaternions ``w, x, y, z`` with a continuous sign, 1, shape ``(K, 4)``."""
        r = self.rotation
        trace = np.trace(r, axis1=1, axis2=2)
        diagonal = np.stack([trace, *(r[:, i, i] for i in range(3))])
        best = np.argmax(diagonal, axis=0)
        found = np.empty((len(r), 4))
        for kind in range(4):
            rows = np.flatnonzero(best == kind)
            m = r[rows]
            if kind == 0:
                w = 1.0 + trace[rows]
                part = [w, m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]]
            else:
                i = kind - 1
                j, k = (i + 1) % 3, (i + 2) % 3
                part = [m[:, k, j] - m[:, j, k]] * 4
                part[1 + i] = 1.0 + m[:, i, i] - m[:, j, j] - m[:, k, k]
                part[1 + j] = m[:, j, i] + m[:, i, j]
                part[1 + k] = m[:, k, i] + m[:, i, k]
            found[rows] = np.stack(part, axis=1)
        found /= np.linalg.norm(found, axis=1, keepdims=True)
        turn = np.sign(np.sum(found[1:] * found[:-1], axis=1))
        found[1:] *= np.cumprod(np.where(turn < 0, -1.0, 1.0))[:, None]
        return found

    def __repr__(self) -> str:
        return f"<holonom.Member {self.name!r}>"


class Beam:
    """Sections of a beam over time, at the middle of each element, along its directors.

    Attributes
    ----------
    element : number of the element of each section, shape ``(m,)``.
    s : arc length of the stress-free beam, m, shape ``(m,)``.
    values : strains, curvatures, forces and moments, 1, 1/m, N, N·m, shape ``(K, m, 12)``.
    """

    def __init__(self, element: NDArray[Any], s: Array, values: Array) -> None:
        self.element, self.s, self.values = element, s, values

    @property
    def strain(self) -> Array:
        """Shear and extension, 1, shape ``(K, m, 3)``."""
        return self.values[:, :, 0:3]

    @property
    def curvature(self) -> Array:
        """Change of curvature, 1/m, shape ``(K, m, 3)``."""
        return self.values[:, :, 3:6]

    @property
    def force(self) -> Array:
        """Section force, N, shape ``(K, m, 3)``."""
        return self.values[:, :, 6:9]

    @property
    def moment(self) -> Array:
        """Section moment, N·m, shape ``(K, m, 3)``."""
        return self.values[:, :, 9:12]


class Momentum:
    """Momentum maps over time.

    Attributes
    ----------
    linear : kg·m/s, shape ``(K, 3)``.
    angular : about the origin, kg·m²/s, shape ``(K, 3)``.
    """

    def __init__(self, linear: Array, angular: Array) -> None:
        self.linear, self.angular = linear, angular


@guarded()
class Result:
    """A run as arrays over ``K`` recorded nodes.

    Attributes
    ----------
    model : the model that ran.
    step : index of each node, shape ``(K,)``.
    t : time of each node, s, shape ``(K,)``; in statics the time of the loads.
    q : coordinates, shape ``(K, n)``; their names are ``tables["q"].columns``.
    tables : ``q``, ``tail``, ``residuals``, ``energy``, ``sensors``, ``momenta``; those there are.
    beams : sections by the names of beams.
    summary : the object of ``summary.json``.
    text : the sentences that the program prints.
    folder : its files, where there are any.
    acting : what acted from outside; a pickle leaves it out.
    """

    def __init__(self, model: Model, found: dict[str, Any], folder: Path | None = None) -> None:
        self.model = model
        self.step: NDArray[np.uint64] = found["step"]
        self.t: Array = found["t"]
        names = ("q", "tail", "residuals", "energy", "sensors", "momenta")
        self.tables: dict[str, Table] = {n: self._described(n, *found[n]) for n in names if n in found}
        self.beams: dict[str, Beam] = {n: Beam(*b) for n, b in found.get("beams", {}).items()}
        self.summary: dict[str, Any] = found["summary"]
        self.text: str = found["text"]
        self.folder = folder
        self.acting: _core.Acting | None = None
        self._acted = False
        self._stepped = False  # by a stepper

    def _described(
        self, name: str, columns: list[str], values: Array, units: list[str] | None = None
    ) -> Table:
        """A table with the units of its columns."""
        if units is not None:
            return Table(columns, values, units)
        if name == "sensors":
            return Table(columns, values, self.model._core.sensor_units(columns))
        table = "trajectory" if name in ("q", "tail") else name
        return Table(columns, values, _core.units(table, columns))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "acting": None}  # functions stay where they are

    @property
    def q(self) -> Array:
        """Coordinates, members one after the other: positions, m, directors, 1; shape ``(K, n)``."""
        return self._table("q").values

    @property
    def energy(self) -> Table:
        """Parts of the energy and work done, J: ``energy["kinetic"]``, shape ``(K,)``."""
        return self._table("energy")

    @property
    def sensors(self) -> Table:
        """What sensors measure: ``sensors["angle"]``, shape ``(K,)`` or ``(K, parts)``."""
        return self._table("sensors")

    @property
    def residuals(self) -> Table:
        """Constraint residuals and Newton iterations."""
        return self._table("residuals")

    @property
    def momenta(self) -> Table:
        """Multipliers and momenta, where the model asks for them; NaN where there are none."""
        return self._table("momenta")

    @property
    def momentum(self) -> Momentum:
        """Momentum maps."""
        if "tail" not in self.tables:
            raise UnknownName("this result has no momentum maps", '`record` leaves them out; add "residuals"')
        values = self.tables["tail"].values
        return Momentum(values[:, 5:8], values[:, 2:5])

    @property
    def columns(self) -> dict[str, list[str]]:
        """Names of the columns of each table: ``columns["sensors"]``."""
        return {name: list(table.columns) for name, table in self.tables.items()}

    @property
    def units(self) -> dict[str, dict[str, str]]:
        """Units of the columns of each table, ``units["sensors"]["angle"]``; empty of numbers
        without one."""
        tables = self.tables.items()
        return {name: dict(zip(own.columns, own.units, strict=True)) for name, own in tables}

    @property
    def members(self) -> list[str]:
        """Names of bodies, nodes of beams and point masses."""
        return self._table("q").names()

    @property
    def failure(self) -> dict[str, Any] | None:
        """Why the run ended before its time: ``step``, ``t``, ``message``, ``remedy``."""
        found: dict[str, Any] | None = self.summary.get("failure")
        return found

    def _table(self, name: str) -> Table:
        if name not in self.tables:
            remedy = f"the model has none, or `record` leaves them out; there are: {', '.join(self.tables)}"
            raise UnknownName(f"this result has no {name}", remedy)
        return self.tables[name]

    def __getitem__(self, name: str) -> Member:
        table = self._table("q")
        parts, places = table.below(name)
        if not parts:
            raise unknown(name, table.names())
        return Member(name, table.values[:, places])

    def sense(self, type: str, *, of: str, **keys: Any) -> Array:
        """A sensor afterwards, from the recorded positions.

        Angles of joints and signs of quaternions are counted on from one recorded node to the next,
        by the way that is shorter than half a turn.

        Parameters
        ----------
        type : ``"position"``, ``"orientation"``, ``"distance"`` or ``"joint_coordinate"``, as of
            ``[[sensor]]``; what needs velocities or forces is stated before the run.
        of : a body, node, point mass or joint.
        keys : further keys of the sensor: ``point=[0.5, 0, 0]``, ``seen_from="base"``.

        Returns
        -------
        array (K,) or (K, parts)
            In the unit of the sensor.

        Raises
        ------
        InvalidModel, AnalysisFailed
        """
        name, spec = "sensed", self.model.spec()
        while name in self.model.sensors:
            name += "_"
        spec.sensor(name, type=type, of=of, **keys)
        t, q = np.ascontiguousarray(self.t), np.ascontiguousarray(self.q)
        values = _core.sense(spec.compile()._core, name, t, q).reshape(len(t), -1)
        return values[:, 0] if values.shape[1] == 1 else values

    def table(self, name: str) -> Table:
        """The table of a file, with all its columns after ``step`` and ``t``.

        Parameters
        ----------
        name : ``"trajectory"``, ``"energy"``, ``"sensors"``, ``"residuals"``, ``"momenta"``.

        Returns
        -------
        Table
        """
        parts = [name]
        if name == "trajectory":
            parts = ["q", "tail"] if "tail" in self.tables else ["q"]
        tables = [self._table(part) for part in parts]
        columns = [*HEAD, *(column for table in tables for column in table.columns)]
        head = np.stack([self.step.astype(np.float64), self.t], axis=1)
        units = ["", "s", *(unit for table in tables for unit in table.units)]
        return Table(columns, np.hstack([head, *(table.values for table in tables)]), units)

    def to_pandas(self, table: str = "trajectory") -> Any:
        """A table over ``t``.

        Parameters
        ----------
        table : as of :meth:`table`.

        Returns
        -------
        pandas.DataFrame
        """
        pandas = needed("pandas", "notebook")
        found = self.table(table)
        return pandas.DataFrame(found.values, columns=found.columns).set_index("t")

    def to_xarray(self) -> Any:
        """A variable for each member and each column over ``t``, with its unit as an attribute.

        Returns
        -------
        xarray.Dataset
        """
        xarray = needed("xarray", "notebook")
        variables: dict[str, Any] = {}
        for name in self.members if "q" in self.tables else []:
            own = self[name]
            columns = ["x", "y", "z"][: own.position.shape[1]]
            variables[f"{name}.position"] = (("t", "component"), own.position, {"units": "m"})
            if own.q.shape[1] == 12:
                variables[f"{name}.directors"] = (("t", "director", "component"), own.directors)
            elif len(columns) == 2:
                padded = np.pad(own.position, ((0, 0), (0, 1)))
                variables[f"{name}.position"] = (("t", "component"), padded, {"units": "m"})
        for part in ("energy", "sensors"):
            if part in self.tables:
                table = self.tables[part]
                for column, unit in zip(table.columns, table.units, strict=True):
                    units = {"units": unit} if unit else {}
                    variables[f"{part}.{column}"] = ("t", table[column], units)
        coordinates = {"t": ("t", self.t, {"units": "s"}), "component": ["x", "y", "z"]}
        return xarray.Dataset(variables, coordinates, {"model": self.model.name})

    def to_npz(self, path: str | PathLike[str]) -> None:
        """Writes ``t``, ``step`` and all tables to a file of ``numpy.load``.

        Parameters
        ----------
        path : the file.
        """
        arrays = {name: table.values for name, table in self.tables.items()}
        names = {f"{n}_columns": np.array(table.columns) for n, table in self.tables.items()}
        np.savez(fspath(path), t=self.t, step=self.step, **arrays, **names)  # type: ignore[arg-type]

    def plot(self, *names: str) -> Any:
        """Draws columns of sensors or energies over time.

        Parameters
        ----------
        names : of the columns; the total energy where none is named.

        Returns
        -------
        Axes of matplotlib, or where it is not installed a :class:`Drawing` of the program.
        """
        try:
            plt = needed("matplotlib.pyplot", "notebook")
        except MissingPackage:
            return self._drawn(names or ("total",))
        axes = plt.figure().add_subplot()
        units: list[str] = []
        for name in names or ["total"]:
            where = self._over_time(name)
            parts, _ = where.below(name)
            values = where[name]
            labels = [f"{name}.{part}" for part in parts] if values.ndim == 2 else [name]
            axes.plot(self.t, values, label=labels)
            units.append(where.unit(name))
        axes.set_xlabel("t [s]")
        if len(set(units)) == 1 and units[0]:
            axes.set_ylabel(f"[{units[0]}]")
        axes.legend()
        return axes

    def _over_time(self, name: str) -> Table:
        """The table, of sensors or energies, that has a column or columns below a name."""
        tables = [self.tables[part] for part in ("sensors", "energy") if part in self.tables]
        for table in tables:
            if name in table:
                return table
        raise unknown(name, [known for table in tables for known in table.names()])

    def _drawn(self, names: Sequence[str]) -> Drawing:
        """Columns over time as ``holonom plot`` draws them."""
        from pathlib import Path
        from tempfile import TemporaryDirectory

        from ._page import Drawing

        for name in names:
            self._over_time(name)  # says what there is
        with self._files() as folder, TemporaryDirectory() as place:
            file = Path(place) / "plot.svg"
            code, said = _core.plot(folder, ",".join(names), str(file))
            if code != 0:
                raise HolonomError(said.strip(), "pip install matplotlib")
            return Drawing(file.read_text(encoding="utf-8"), self.model.name)._draw()

    def page(self) -> str:
        """The page of the run, as ``holonom run`` writes it: HTML that needs no other file.

        A result in memory runs once more into a folder of its own, which is removed.

        Returns
        -------
        str
        """
        from pathlib import Path

        with self._files() as folder:
            page = _core.write_page(folder)
            return Path(page).read_text(encoding="utf-8")

    def save(self, folder: str | PathLike[str], *, force: bool = False) -> None:
        """Writes the files of ``holonom run`` to a folder, bit for bit. A result in memory runs once
        more.

        Parameters
        ----------
        folder : where.
        force : whether the files of a run that are there are replaced.

        Raises
        ------
        OutputExists
        """
        if self.folder is None:
            self._run_into(fspath(folder), force)
            return
        import shutil
        from pathlib import Path

        place = Path(folder)
        if place.exists() and not force:
            raise OutputExists(f"{place} exists", "choose another folder, or force=True")
        if place.exists() and not (place / "summary.json").is_file():
            raise OutputExists(f"{place} holds no run: it is not replaced", "choose another folder")
        if place.exists():
            shutil.rmtree(place)
        shutil.copytree(self.folder, place)

    def export(
        self, format: str, path: str | PathLike[str] | None = None, *, frames: int | None = None
    ) -> str:
        """Writes the run for other programs; what is there is replaced.

        Parameters
        ----------
        format : ``"npz"``, ``"parquet"``, ``"vtk"``, ``"gltf"`` or ``"svg"``.
        path : the file or folder; by default of the name of the model.
        frames : how many, of ``vtk``, ``gltf`` and ``svg``.

        Returns
        -------
        str
            The path.
        """
        ends = {"npz": ".npz", "parquet": "-parquet", "vtk": "-vtk", "gltf": ".glb", "svg": ".svg"}
        to = fspath(path) if path is not None else self.model.name + ends.get(format, "")
        with self._files() as folder:
            _core.export(folder, format, to, frames)
        return to

    def _run_into(self, folder: str, force: bool = False) -> None:
        if self._acted and self.acting is None:
            words = "functions acted on this run, and did not travel with it"
            raise HolonomError(words, "run it again here")
        if self._stepped:
            words = "these are steps of a stepper, and no run from the start of the model"
            raise HolonomError(words, "holonom.simulate(inputs=…) makes a run that has files")
        how = {"force": force, "checkpoint_every": None, "report": True}
        _core.simulate_into(self.model._core, folder, how, None, self.acting)

    @contextmanager
    def _files(self) -> Iterator[str]:
        """A folder with the files of the run."""
        if self.folder is not None:
            yield fspath(self.folder)
            return
        from tempfile import TemporaryDirectory

        with TemporaryDirectory() as folder:
            place = join(folder, "run")
            self._run_into(place)
            yield place

    def view(self) -> None:
        """Shows the page: in a notebook a frame, with a still of the first node for viewers that
        have no frames; elsewhere the browser."""
        from pathlib import Path
        from tempfile import TemporaryDirectory

        from ._page import show

        with self._files() as folder, TemporaryDirectory() as place:
            page = Path(_core.write_page(folder)).read_text(encoding="utf-8")
            still = Path(place) / "still.svg"
            _core.export(folder, "svg", str(still), 1)
            show(page, self.model.name, still.read_text(encoding="utf-8"))

    def __len__(self) -> int:
        return len(self.t)

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"<holonom.Result {self.model.name!r}: {len(self.t)} nodes, {self.summary['status']}>"

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(self.text)}</pre>"


@no_panic
def open_folder(folder: str | PathLike[str]) -> Result:
    """Reads the files of a run.

    Parameters
    ----------
    folder : of ``holonom run`` or of ``simulate(out=…)``.

    Returns
    -------
    Result

    Raises
    ------
    OutputFailed, InvalidModel
    HolonomError
        For a folder that holds no run.
    """
    from pathlib import Path

    path = Path(folder)
    if not (path / "summary.json").is_file():
        raise HolonomError(f"{path} holds no run", "name the folder that `holonom run` wrote")
    summary, text = _core.summary(fspath(path))
    found: dict[str, Any] = {"summary": summary, "text": text}
    read = _core.read_table(fspath(path), "trajectory")
    if read is None:
        raise HolonomError(f"{path} holds no trajectory", "run the model again")
    columns, values, _ = read
    found["step"], found["t"] = values[:, 0].astype(np.uint64), np.ascontiguousarray(values[:, 1])
    found["q"] = (columns[2:-8], values[:, 2:-8])
    found["tail"] = (columns[-8:], values[:, -8:])
    for name in ("residuals", "energy", "sensors", "momenta"):
        read = _core.read_table(fspath(path), name)
        if read is not None:
            found[name] = (read[0][2:], read[1][:, 2:])
    read = _core.read_table(fspath(path), "beams")
    if read is not None:
        columns, values, owners = read
        names = np.array(owners)
        beams = {}
        for name in dict.fromkeys(owners):
            own = values[names == name].reshape(len(found["t"]), -1, len(columns))
            beams[name] = (own[0, :, 2].astype(np.uint64), own[0, :, 3], own[:, :, 4:])
        found["beams"] = beams
    return Result(load(path / "model.toml"), found, path)


def told(result: Result, on_failure: str, raised: BaseException | None = None) -> Result:
    """The result with its warnings given; a failed run raises, with what a function raised."""
    for words in result.summary.get("warnings", []):
        warnings.warn(words, HolonomWarning, stacklevel=4)
    failure = result.failure
    if raised is not None and on_failure == "raise":
        raise raised
    if failure is not None and on_failure == "raise":
        words = failure["message"], failure["remedy"]
        raise RunFailed(failure["step"], failure["t"], *words, result)
    return result
