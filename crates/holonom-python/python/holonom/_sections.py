"""The sections of a model as methods. Written from the schema of model files: do not edit."""

# ruff: noqa

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from ._parts import BeamPart, Part, Sections

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ._parts import Integer, Matrix, Name, Number, Vector

__all__ = ["Builder"]


class Builder(Sections):
    """A method for each section of a model file; its keywords are the keys of the section."""

    def __init__(
        self,
        name: str,
        *,
        description: str | None = None,
        dimension: Integer | None = None,
        gravity: Vector | None = None,
        arc_length: bool | None = None,
        bifurcation: Literal["pass", "switch"] | None = None,
        columns: Sequence[Literal["coordinates", "positions", "joints"]] | None = None,
        contact: Literal["events", "stepping"] | None = None,
        contacts: bool | None = None,
        end: Number | None = None,
        every: Integer | None = None,
        impact: Literal["newton", "moreau", "sequential"] | None = None,
        loop_tolerance: Number | None = None,
        max_events: Integer | None = None,
        method: Literal["composition", "galerkin"] | None = None,
        momenta: bool | None = None,
        newton_max_iterations: Integer | None = None,
        newton_tolerance: Number | None = None,
        on_failure: Literal["stop", "substep"] | None = None,
        order: Integer | None = None,
        project_start: bool | None = None,
        quadrature: Literal["midpoint", "trapezoidal"] | None = None,
        scheme: Literal["nodal", "constrained", "dalembert", "reduced", "em-constrained", "em-dalembert", "em-nodal", "static"] | None = None,
        solver: Literal["auto", "dense", "articulated", "sparse"] | None = None,
        start: Literal["stated", "relaxed"] | None = None,
        start_tolerance: Number | None = None,
        step: Number | None = None,
        strain: Literal["mass_scaled", "dissipative", "averaged", "midpoint"] | None = None,
    ) -> None:
        """The header ``[model]`` and the settings ``[simulation]``.

        Parameters
        ----------
        name : str
            Name of the model, for titles and summaries.
        description : str, optional
            What it shows.
        dimension : int, optional
            3 (default), or 2: point masses in the plane.
        gravity : array (n,), optional
            Gravitational acceleration, m/s²; ``dimension`` numbers, zero by default.
        arc_length : bool, optional
            Statics: follow the path of equilibria by its arc length, through points where the load
            has to fall. Steps are then lengths of arc: ``step/end`` of all of the load, or of the
            size of the system.
        bifurcation : str, optional
            Statics: what a path does at a bifurcation point, where it turns unstable.
            One of ``"pass"``, ``"switch"``.
        columns : array (n,), optional
            What ``trajectory.csv`` contains beside the energies and the momentum maps.
        contact : str, optional
            How impacts are placed in time.
            One of ``"events"``, ``"stepping"``.
        contacts : bool, optional
            Write the contacts of bodies at each recorded node to ``contacts.csv``.
        end : float, optional
            End time, s. The run takes the whole number of steps that reaches it.
        every : int, optional
            Record every k-th step (the first and the last always).
        impact : str, optional
            What an impact is.
            One of ``"newton"``, ``"moreau"``, ``"sequential"``.
        loop_tolerance : float, optional
            What closed loops may miss where their constraints nearly follow from one another: rad,
            or parts of the size of the loop. 0 takes every digit at its word.
        max_events : int, optional
            Touches of one step at which a node is put; the rest of the step is then taken as with
            ``contact = "stepping"``.
        method : str, optional
            How an order above 2 is reached.
            One of ``"composition"``, ``"galerkin"``.
        momenta : bool, optional
            Write multipliers, discrete Legendre transforms and the parts of the energies to
            ``momenta.csv``.
        newton_max_iterations : int, optional
            Newton iterations of a step before it counts as failed.
        newton_tolerance : float, optional
            Relative tolerance of Newton's method; 0 iterates to the round-off floor.
        on_failure : str, optional
            What happens where a step is refused.
            One of ``"stop"``, ``"substep"``.
        order : int, optional
            Order of accuracy: 2; 4, 6, 8 by symmetric composition; 2, 4 … 16 by the Galerkin
            scheme.
        project_start : bool, optional
            Project inconsistent initial values onto the constraints instead of refusing them.
        quadrature : str, optional
            Quadrature rule of the discrete Lagrangian; energy–momentum schemes have none.
            One of ``"midpoint"``, ``"trapezoidal"``.
        scheme : str, optional
            Time-stepping scheme.
            One of ``"nodal"``, ``"constrained"``, ``"dalembert"``, ``"reduced"``,
            ``"em-constrained"``, ``"em-dalembert"``, ``"em-nodal"``, ``"static"``.
        solver : str, optional
            Linear solver of the nodal and reduced schemes.
            One of ``"auto"``, ``"dense"``, ``"articulated"``, ``"sparse"``.
        start : str, optional
            Where the run begins.
            One of ``"stated"``, ``"relaxed"``.
        start_tolerance : float, optional
            Largest violation of a constraint by consistent initial values: parts of the size of the
            model, m/s, rad, rad/s.
        step : float, optional
            Time step, s.
        strain : str, optional
            Discrete potential of beams.
            One of ``"mass_scaled"``, ``"dissipative"``, ``"averaged"``, ``"midpoint"``.
        """
        model: dict[str, Any] = {
            "description": description,
            "dimension": dimension,
            "gravity": gravity,
            "name": name,
        }
        simulation: dict[str, Any] = {
            "arc_length": arc_length,
            "bifurcation": bifurcation,
            "columns": columns,
            "contact": contact,
            "contacts": contacts,
            "end": end,
            "every": every,
            "impact": impact,
            "loop_tolerance": loop_tolerance,
            "max_events": max_events,
            "method": method,
            "momenta": momenta,
            "newton_max_iterations": newton_max_iterations,
            "newton_tolerance": newton_tolerance,
            "on_failure": on_failure,
            "order": order,
            "project_start": project_start,
            "quadrature": quadrature,
            "scheme": scheme,
            "solver": solver,
            "start": start,
            "start_tolerance": start_tolerance,
            "step": step,
            "strain": strain,
        }
        self._begin(model, simulation)

    def body(
        self,
        name: str,
        *,
        angular_velocity: Vector | None = None,
        body_angular_velocity: Vector | None = None,
        collision: Sequence[Mapping[str, Any]] | None = None,
        color: str | None = None,
        euler: Mapping[str, Any] | None = None,
        fixed: bool | None = None,
        inertia: Vector | Matrix | None = None,
        mass: Number | None = None,
        matrix: Matrix | None = None,
        opacity: Number | None = None,
        picture: Sequence[Mapping[str, Any]] | None = None,
        position: Vector | None = None,
        quaternion: Vector | None = None,
        relative_to: Name | None = None,
        rotation_vector: Vector | None = None,
        shape: Mapping[str, Any] | None = None,
        velocity: Vector | None = None,
        visible: bool | None = None,
        along: Vector | None = None,
    ) -> Part:
        """``[[body]]``: a rigid body; its frame sits in the centre of mass.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        angular_velocity : array (3,), optional
            Initial angular velocity, spatial components, rad/s.
        body_angular_velocity : array (3,), optional
            Initial angular velocity, body components, rad/s; instead of ``angular_velocity``.
        collision : list of dict, optional
            Shapes with which it touches others in a ``[[contact]]``, in the place of ``shape``,
            each with a ``position`` and a ``quaternion`` in the body's frame; they weigh nothing
            and are not drawn.
        color : str, optional
            Its colour in pictures, ``"#rrggbb"`` or a name: the sixteen of HTML, ``"orange"``,
            ``"grey"``, ``"cyan"``, ``"magenta"``; one of a palette by default.
        euler : dict, optional
            Initial orientation by Euler angles.
            Keys: ``angles``, ``degrees``, ``sequence``.
        fixed : bool, optional
            The body does not move: a part of the ground with a name and a picture.
        inertia : array (3,) or array (3, 3), optional
            Inertia about the centre of mass in the body's own frame, kg·m²: 3 principal moments, or
            the full tensor (3 rows); from ``shape`` and the mass when not stated.
        mass : float, optional
            Mass, kg; from ``shape`` and its density when not stated.
        matrix : array (3, 3), optional
            Initial orientation as a rotation matrix, rows; its columns are the body's axes in
            space. Unit: 1.
        opacity : float, optional
            How much it covers in pictures, from 0, nothing, to 1, all that lies behind; 1 by
            default.
        picture : list of dict, optional
            Shapes of its picture in the place of ``shape``, each with a ``position`` and a
            ``quaternion`` in the body's frame; they weigh nothing.
        position : array (3,), optional
            Initial position of the centre of mass, m.
        quaternion : array (4,), optional
            Initial orientation as a unit quaternion ``[w, x, y, z]``, body to space. Unit: 1.
        relative_to : str, optional
            The frame of its position, orientation and velocities: a body, a node of a beam, a joint
            or a ``[[frame]]``; the inertial frame by default.
        rotation_vector : array (3,), optional
            Initial orientation as a rotation vector, rad.
        shape : dict, optional
            Its shape: gives mass and inertia when they are not stated, and the picture.
            Keys: ``density``, ``dimensions``, ``file``, ``position``, ``quaternion``, ``scale``,
            ``type``.
        velocity : array (3,), optional
            Initial velocity of the centre of mass, m/s.
        visible : bool, optional
            Whether it is drawn in pictures; ``true`` by default.
        along : array (3,), optional
            The third axis of the body, the axis of its shape, points along it in space; any length.
            Unit: 1.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "angular_velocity": angular_velocity,
            "body_angular_velocity": body_angular_velocity,
            "collision": collision,
            "color": color,
            "euler": euler,
            "fixed": fixed,
            "inertia": inertia,
            "mass": mass,
            "matrix": matrix,
            "opacity": opacity,
            "picture": picture,
            "position": position,
            "quaternion": quaternion,
            "relative_to": relative_to,
            "rotation_vector": rotation_vector,
            "shape": shape,
            "velocity": velocity,
            "visible": visible,
        }
        self._align(given, along)
        return self._add("body", given)

    def particle(
        self,
        name: str,
        mass: Number,
        position: Vector,
        *,
        relative_to: Name | None = None,
        velocity: Vector | None = None,
    ) -> Part:
        """``[[particle]]``: a point mass.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        mass : float
            Mass, kg.
        position : array (n,)
            Start position, m; ``dimension`` numbers.
        relative_to : str, optional
            The frame of its position and velocity: a body, a node of a beam, a joint or a
            ``[[frame]]``; the inertial frame by default.
        velocity : array (n,), optional
            Start velocity, m/s; ``dimension`` numbers, at rest by default.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "mass": mass,
            "position": position,
            "relative_to": relative_to,
            "velocity": velocity,
        }
        return self._add("particle", given)

    def beam(
        self,
        name: str,
        elements: Integer | Vector,
        *,
        angular_velocity: Vector | None = None,
        curvature: Vector | None = None,
        curve: Mapping[str, Any] | None = None,
        element: Literal["helicoidal", "mean_directors", "rope", "second_order"] | None = None,
        end: Literal["free", "clamped", "pinned"] | None = None,
        length: Number | None = None,
        mass: Literal["consistent", "lumped"] | None = None,
        normal: Vector | Matrix | None = None,
        order: Integer | None = None,
        points: Matrix | None = None,
        prestress: Number | None = None,
        radius: Number | None = None,
        relative_to: Name | None = None,
        section: Mapping[str, Any] | None = None,
        start: Literal["free", "clamped", "pinned"] | None = None,
        stations: Sequence[Mapping[str, Any]] | str | None = None,
        tension: Number | None = None,
        twist: Literal["normal", "minimal"] | None = None,
        velocity: Vector | None = None,
    ) -> BeamPart:
        """``[[beam]]``: a geometrically exact beam, free of stress in the initial configuration
        unless ``length``, ``curvature`` or ``prestress`` say otherwise. Its nodes are named
        ``NAME.start``, ``NAME.end`` and ``NAME.0``, ``NAME.1``, … wherever a body may be named.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        elements : int or array (n,)
            Elements of each leg, or a list with one number for each leg. Unit: 1.
        angular_velocity : array (3,), optional
            Initial angular velocity of the whole beam, spatial components, rad/s.
        curvature : array (3,), optional
            Curvature of the stress-free beam about ``d_1`` and ``d_2`` and its twist, 1/m, in the
            place of those of the centre line.
        curve : dict, optional
            Its centre line when it is curved; instead of ``points``.
        element : str, optional
            What its elements measure: ``helicoidal``, or ``mean_directors`` with ``strain =
            "midpoint"``.
        end : str, optional
            How the ground holds its end.
            One of ``"free"``, ``"clamped"``, ``"pinned"``.
        length : float, optional
            Its stress-free length, m, in the place of that of the centre line: a longer beam is
            slack or bent between its supports, a shorter one is stretched.
        mass : str, optional
            Distribution of its mass.
            One of ``"consistent"``, ``"lumped"``.
        normal : array (3,) or array (n, 3), optional
            Direction of ``d_1``, the first axis of the section, as far as it lies across the centre
            line; ``d_3`` is along it, ``d_2 = d_3 × d_1``. A list has one for each leg. Needed
            unless the section is the same in all directions. Unit: 1.
        order : int, optional
            Elements for each one that ``elements`` counts, 1, 2 or 3: for files that asked for
            elements with three or four nodes, of which there are none. All have two nodes.
        points : array (n, 3), optional
            The corners of its centre line, m: straight legs between them, rigid at the corners.
        prestress : float, optional
            Tension that it has as drawn, N; negative: a compression.
        radius : float, optional
            Radius of the spheres with which its nodes touch planes and bodies in a ``[[contact]]``,
            m; that of a section of shape ``circle`` or ``tube`` by default.
        relative_to : str, optional
            The frame of its points, directions and velocities: a body, a node of a beam, a joint or
            a ``[[frame]]``; the inertial frame by default.
        section : dict, optional
            Stiffness and inertia of its section; with ``stations``, what they do not state.
            Keys: ``EA``, ``EI1``, ``EI2``, ``GA1``, ``GA2``, ``GJ``, ``angle``, ``damping``,
            ``mass``, ``mass_center``, ``material``, ``rhoA``, ``rhoI1``, ``rhoI2``, ``rhoJ``,
            ``shape``, ``shear_center``, ``shear_factors``, ``stiffness``, ``tension_center``,
            ``torsion_constant``.
        start : str, optional
            How the ground holds its start.
            One of ``"free"``, ``"clamped"``, ``"pinned"``.
        stations : list of dict or str, optional
            Sections and twist at places along it, or a file of them; numbers are linear between.
        tension : float, optional
            Largest tension to be expected, N: the bound of the tension mass of helicoidal elements,
            then constant; by default it follows the tension.
        twist : str, optional
            Rotation of the section about a curved centre line.
            One of ``"normal"``, ``"minimal"``.
        velocity : array (3,), optional
            Initial velocity of its first point, m/s; the whole beam moves as if it were rigid.

        Returns
        -------
        BeamPart
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "elements": elements,
            "angular_velocity": angular_velocity,
            "curvature": curvature,
            "curve": curve,
            "element": element,
            "end": end,
            "length": length,
            "mass": mass,
            "normal": normal,
            "order": order,
            "points": points,
            "prestress": prestress,
            "radius": radius,
            "relative_to": relative_to,
            "section": section,
            "start": start,
            "stations": stations,
            "tension": tension,
            "twist": twist,
            "velocity": velocity,
        }
        return self._add_beam("beam", given)

    def joint(
        self,
        name: str,
        type: Literal["spherical", "revolute", "cylindrical", "prismatic", "planar", "fixed", "universal", "screw"],
        parent: Name,
        child: Name,
        *,
        anchor_child: Vector | None = None,
        anchor_parent: Vector | None = None,
        axis: Vector | None = None,
        axis2: Vector | None = None,
        bumper: Mapping[str, Any] | None = None,
        cut: bool | None = None,
        damper: Mapping[str, Any] | None = None,
        first_axis: Vector | None = None,
        friction: Mapping[str, Any] | None = None,
        limits: Vector | Mapping[str, Any] | None = None,
        motor: Mapping[str, Any] | None = None,
        pitch: Number | None = None,
        position: Vector | None = None,
        rate: Number | Vector | None = None,
        relative_to: Name | None = None,
        spring: Mapping[str, Any] | None = None,
    ) -> Part:
        """``[[joint]]``: a kinematic pair of two bodies, or of a body and the ground. Its place is
        ``position``, or ``anchor_parent`` and ``anchor_child``.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        type : str
            Kind of the joint.
            One of ``"spherical"``, ``"revolute"``, ``"cylindrical"``, ``"prismatic"``,
            ``"planar"``, ``"fixed"``, ``"universal"``, ``"screw"``.
        parent : str
            A body, or ``ground``.
        child : str
            A body, or ``ground``.
        anchor_child : array (3,), optional
            Its place on the child: body components from the centre of mass, m (ground: in space).
        anchor_parent : array (3,), optional
            Its place on the parent: body components from the centre of mass, m (ground: in space).
        axis : array (3,), optional
            Its axis in space in the initial configuration; any length but zero. Unit: 1.
        axis2 : array (3,), optional
            Universal joints: the axis fixed in the child, in space in the initial configuration,
            perpendicular to ``axis``, which is fixed in the parent. Unit: 1.
        bumper : dict, optional
            Elastic stops in the place of rigid ones.
            Keys: ``damping``, ``stiffness``.
        cut : bool, optional
            Cut the loop that the joint closes here; by default the spanning tree is found from the
            ground on, with short loops, and the joints left over are cut.
        damper : dict, optional
            A damper (viscous friction) on a joint coordinate.
            Keys: ``damping``, ``freedom``.
        first_axis : array (3,), optional
            The first axis of the joint frame, in space in the initial configuration; its part along
            ``axis`` is left out. Displacement 0 of a planar joint is along it, displacement 1 along
            ``axis`` × ``first_axis``, and reactions are given along both. By default a direction
            that is fixed in the frame of the parent of a planar joint (of the child where the
            parent is the ground), of other joints in the frame of ``relative_to``. Of universal
            joints it is ``axis2``.
        friction : dict, optional
            Dry friction of a joint coordinate.
            Keys: ``coefficient``, ``force``, ``freedom``, ``model``, ``radius``, ``static_ratio``,
            ``torque``.
        limits : array (2,) or dict, optional
            Stops of a joint coordinate: ``[lower, upper]``, or a table. Unit: m or rad.
        motor : dict, optional
            A motor on a joint coordinate.
            Keys: ``derivative``, ``effort``, ``freedom``, ``history``, ``path``, ``proportional``.
        pitch : float, optional
            Screw joints: advance along ``axis`` per right-handed revolution, m.
        position : array (3,), optional
            Its place in space in the initial configuration, m.
        rate : float or array (n,), optional
            Rates of its degrees of freedom initially (displacements first, then angles; m/s,
            rad/s): a number, or a list for several. The velocity of the child then follows from
            that of the parent.
        relative_to : str, optional
            The frame of its position and axes (and of anchors on the ground): a body, a node of a
            beam, a joint or a ``[[frame]]``; the inertial frame by default.
        spring : dict, optional
            A spring on a joint coordinate.
            Keys: ``freedom``, ``rest``, ``stiffness``, ``table``.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "type": type,
            "parent": parent,
            "child": child,
            "anchor_child": anchor_child,
            "anchor_parent": anchor_parent,
            "axis": axis,
            "axis2": axis2,
            "bumper": bumper,
            "cut": cut,
            "damper": damper,
            "first_axis": first_axis,
            "friction": friction,
            "limits": limits,
            "motor": motor,
            "pitch": pitch,
            "position": position,
            "rate": rate,
            "relative_to": relative_to,
            "spring": spring,
        }
        return self._add("joint", given)

    def constraint(
        self,
        name: str,
        type: Literal["distance", "point_on_line", "point_on_plane", "gear", "motion", "rolling", "blade", "velocity"],
        *,
        axis: Vector | None = None,
        body: Name | None = None,
        child: Name | None = None,
        freedom: Integer | None = None,
        freedoms: Vector | None = None,
        from_: Name | None = None,
        joint: Name | None = None,
        joints: Sequence[Name] | None = None,
        length: Number | None = None,
        parent: Name | None = None,
        path: str | Mapping[str, Any] | None = None,
        plane: Mapping[str, Any] | None = None,
        point_from: Vector | None = None,
        point_to: Vector | None = None,
        position: Vector | None = None,
        radius: Number | None = None,
        ratio: Number | None = None,
        relative_to: Name | None = None,
        terms: Sequence[Mapping[str, Any]] | None = None,
        to: Name | None = None,
        tube: Number | None = None,
        value: Number | None = None,
    ) -> Part:
        """``[[constraint]]``: a scalar constraint beside the joints.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        type : str
            Its kind.
            One of ``"distance"``, ``"point_on_line"``, ``"point_on_plane"``, ``"gear"``,
            ``"motion"``, ``"rolling"``, ``"blade"``, ``"velocity"``.
        axis : array (3,), optional
            The direction of the line in space, initially. / The normal of the plane in space,
            initially. / The axis of a wheel in space, initially; without it a sphere rolls. / The
            axis of the body along which the point does not move, in space, initially. Of
            point_on_line, point_on_plane, rolling, blade. Unit: 1.
        body : str, optional
            The body that rolls; the centre of the wheel or sphere is its centre of mass. / The
            body. Of rolling, blade.
        child : str, optional
            A body, or ``ground``. Of point_on_line, point_on_plane.
        freedom : int, optional
            Its degree of freedom, counted from 0. Of motion.
        freedoms : array (2,), optional
            Their degrees of freedom, counted from 0. Of gear. Unit: 1.
        from_ : str, optional
            A body, or ``ground``. Of distance.
        joint : str, optional
            The joint. Of motion.
        joints : list of str, optional
            The two joints a and b. Of gear.
        length : float, optional
            The distance, m; the initial one by default. Of distance.
        parent : str, optional
            A body, or ``ground``. Of point_on_line, point_on_plane.
        path : str or dict, optional
            The path; its rate at t = 0 must be the initial one. Of motion.
        plane : dict, optional
            The plane; z = 0 of the ground by default. Of rolling.
            Keys: ``normal``, ``on``, ``position``, ``spin``.
        point_from : array (3,), optional
            The point at ``from``, body components from the centre of mass, m (ground: in space). Of
            distance.
        point_to : array (3,), optional
            The point at ``to``, m. Of distance.
        position : array (3,), optional
            The point in space, initially, m. / The point of the body, in space, initially, m. Of
            point_on_line, point_on_plane, blade.
        radius : float, optional
            The outer radius, m. Of rolling.
        ratio : float, optional
            The ratio: teeth of b over teeth of a for gears that rotate in opposite directions. Of
            gear.
        relative_to : str, optional
            The frame of a point of the ground: a body, a node of a beam, a joint or a
            ``[[frame]]``; the inertial frame by default. / The frame of position and axis: a body,
            a node of a beam, a joint or a ``[[frame]]``; the inertial frame by default. / The frame
            of axis and plane: a body, a node of a beam, a joint or a ``[[frame]]``; the inertial
            frame by default. Of distance, point_on_line, point_on_plane, rolling, blade.
        terms : list of dict, optional
            What moves, each with its factor. Of velocity.
        to : str, optional
            A body, or ``ground``. Of distance.
        tube : float, optional
            The radius of the section of a tyre, part of ``radius``, m; 0 is a disc with a sharp
            edge. Of rolling.
        value : float or str, optional
            The value of the sum, an expression of ``t``, joint coordinates and places of bodies; 0
            by default. In m/s where factors are numbers and points move, in rad/s for angles. Of
            velocity.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "type": type,
            "axis": axis,
            "body": body,
            "child": child,
            "freedom": freedom,
            "freedoms": freedoms,
            "from": from_,
            "joint": joint,
            "joints": joints,
            "length": length,
            "parent": parent,
            "path": path,
            "plane": plane,
            "point_from": point_from,
            "point_to": point_to,
            "position": position,
            "radius": radius,
            "ratio": ratio,
            "relative_to": relative_to,
            "terms": terms,
            "to": to,
            "tube": tube,
            "value": value,
        }
        return self._add("constraint", given)

    def bar(
        self,
        name: str,
        from_: Name,
        to: Name,
        *,
        length: Number | None = None,
        point: Vector | None = None,
        relative_to: Name | None = None,
    ) -> Part:
        """``[[bar]]``: a rigid massless bar between two particles, or a particle and the ground.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        from_ : str
            A particle, or ``ground``.
        to : str
            A particle, or ``ground``.
        length : float, optional
            Its length, m; the initial distance by default.
        point : array (n,), optional
            The point of the ground it is held at, m; ``dimension`` numbers. Only with ``ground``;
            the origin by default.
        relative_to : str, optional
            The frame of ``point``: a body, a node of a beam, a joint or a ``[[frame]]``; the
            inertial frame by default.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "from": from_,
            "to": to,
            "length": length,
            "point": point,
            "relative_to": relative_to,
        }
        return self._add("bar", given)

    def spring(
        self,
        name: str,
        from_: Name,
        to: Name,
        stiffness: Number,
        *,
        damping: Number | None = None,
        law: Literal["linear", "quadratic_stretch"] | None = None,
        natural_length: Number | None = None,
        point_from: Vector | None = None,
        point_to: Vector | None = None,
        relative_to: Name | None = None,
        tension: Number | None = None,
    ) -> Part:
        """``[[spring]]``: a spring, with an optional damper, between two components or a component
        and the ground.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        from_ : str
            A body, a particle, or ``ground``.
        to : str
            A body, a particle, or ``ground``.
        stiffness : float
            Stiffness ``k``: N/m (``linear``), N/m³ (``quadratic_stretch``).
        damping : float, optional
            Damping along the line, N·s/m.
        law : str, optional
            Its energy as a function of its length.
            One of ``"linear"``, ``"quadratic_stretch"``.
        natural_length : float, optional
            Natural length ``l0``, m; the initial distance by default.
        point_from : array (n,), optional
            Where it is held at ``from``, m: body components from the centre of mass, or a point of
            the ground; the centre or the origin by default.
        point_to : array (n,), optional
            Where it is held at ``to``, m.
        relative_to : str, optional
            The frame of points of the ground: a body, a node of a beam, a joint or a ``[[frame]]``;
            the inertial frame by default.
        tension : float, optional
            Force with which it pulls in the initial configuration, N, negative where it pushes;
            instead of ``natural_length``, for a linear spring.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "from": from_,
            "to": to,
            "stiffness": stiffness,
            "damping": damping,
            "law": law,
            "natural_length": natural_length,
            "point_from": point_from,
            "point_to": point_to,
            "relative_to": relative_to,
            "tension": tension,
        }
        return self._add("spring", given)

    def bushing(
        self,
        name: str,
        from_: Name,
        to: Name,
        position: Vector,
        *,
        damping: Vector | Matrix | None = None,
        euler: Mapping[str, Any] | None = None,
        force: Vector | None = None,
        matrix: Matrix | None = None,
        preload: Vector | None = None,
        quaternion: Vector | None = None,
        relative_to: Name | None = None,
        rotation: Literal["vector", "tilt"] | None = None,
        rotation_vector: Vector | None = None,
        stiffness: Vector | Matrix | None = None,
    ) -> Part:
        """``[[bushing]]``: forces and torques by the six coordinates between a frame of ``from``
        and one of ``to`` that coincide initially: displacements ``x1``, ``x2``, ``x3`` along the
        axes of ``from``, m, and the rotation vector ``x4``, ``x5``, ``x6`` of ``to`` in ``from``,
        rad; ``v1`` to ``v6`` are their rates. Bushings of rubber, bearings, and dampers in all
        directions.

        Parameters
        ----------
        name : str
            Its name, unique in the model; its energy and its work are listed under it.
        from_ : str
            A body, a node of a beam, or ``ground``.
        to : str
            Another one.
        position : array (3,)
            Where both frames are initially, m, in space.
        damping : array (6,) or array (6, 6), optional
            Damping ``C``: 6 numbers, or 6 rows of 6, N·s/m, N·s/rad, N·s and N·m·s/rad; entries may
            be expressions.
        euler : dict, optional
            Orientation of its axes by Euler angles.
            Keys: ``angles``, ``degrees``, ``sequence``.
        force : array (6,), optional
            Forces and torques on ``to``, six expressions, instead of stiffness, damping and
            preload. Unit: N and N·m.
        matrix : array (3, 3), optional
            Orientation of its axes as a rotation matrix, rows; its columns are the axes. Unit: 1.
        preload : array (6,), optional
            Forces, N, and torques, N·m, on ``to`` in the initial configuration, along and about its
            axes.
        quaternion : array (4,), optional
            Orientation of its axes as a unit quaternion ``[w, x, y, z]``; by default they are those
            of space. Unit: 1.
        relative_to : str, optional
            The frame of its position and orientation: a body, a node of a beam, a joint or a
            ``[[frame]]``; the inertial frame by default.
        rotation : str, optional
            How its rotation is measured.
            One of ``"vector"``, ``"tilt"``.
        rotation_vector : array (3,), optional
            Orientation of its axes as a rotation vector, rad.
        stiffness : array (6,) or array (6, 6), optional
            Stiffness ``K``: 6 numbers along and about its axes, or 6 rows of 6, N/m, N/rad, N and
            N·m/rad. Entries may be expressions of ``t``, ``x1`` to ``x6``, ``v1`` to ``v6``, and of
            joints, members and signals by their names. It need not be symmetric.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "from": from_,
            "to": to,
            "position": position,
            "damping": damping,
            "euler": euler,
            "force": force,
            "matrix": matrix,
            "preload": preload,
            "quaternion": quaternion,
            "relative_to": relative_to,
            "rotation": rotation,
            "rotation_vector": rotation_vector,
            "stiffness": stiffness,
        }
        return self._add("bushing", given)

    def load(
        self,
        name: str,
        *,
        at: Number | None = None,
        beam: Name | None = None,
        body: Name | None = None,
        force: Vector | None = None,
        frame: Literal["space", "body"] | None = None,
        history: str | Mapping[str, Any] | None = None,
        point: Vector | None = None,
        relative_to: Name | None = None,
        torque: Vector | None = None,
    ) -> Part:
        """``[[load]]``: a force at a point of a body (or a node of a beam) and a torque, or both
        per length along a beam, times a history.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        at : float, optional
            A place of the beam: its arc length from the start of the stress-free beam, m. Force and
            torque then act there alone, N and N·m.
        beam : str, optional
            The beam along which it is distributed, instead of ``body``; force and torque are then
            per length of the stress-free beam, unless ``at`` states a place.
        body : str, optional
            The body, the node of a beam or the particle it acts on; on a particle a force with axes
            fixed in space.
        force : array (3,), optional
            Force, N, at ``point``; N/m along a beam; with ``frame = "body"`` a pressure that
            follows.
        frame : str, optional
            The frame of the components.
            One of ``"space"``, ``"body"``.
        history : str or dict, optional
            Factor in time: constant by default, in statics growing from 0 to 1 at the end.
        point : array (3,), optional
            Where the force acts: body components from the centre of mass, m; the centre by default.
            The point moves with the body, in both frames.
        relative_to : str, optional
            The frame in whose initial axes ``force`` and ``torque`` are stated, in the place of the
            inertial ones: a body, a node of a beam, a joint or a ``[[frame]]``. They remain fixed
            in space; only with ``frame = "space"``.
        torque : array (3,), optional
            Torque, N·m; N·m/m along a beam.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "at": at,
            "beam": beam,
            "body": body,
            "force": force,
            "frame": frame,
            "history": history,
            "point": point,
            "relative_to": relative_to,
            "torque": torque,
        }
        return self._add("load", given)

    def law(
        self,
        name: str,
        *,
        axes: Literal["space", "body"] | None = None,
        conservative: bool | None = None,
        effort: Number | None = None,
        force: Vector | None = None,
        freedom: Integer | None = None,
        from_: Name | None = None,
        joint: Name | None = None,
        on: Name | None = None,
        point: Vector | None = None,
        point_from: Vector | None = None,
        point_to: Vector | None = None,
        relative_to: Name | None = None,
        tension: Number | None = None,
        to: Name | None = None,
        torque: Vector | None = None,
    ) -> Part:
        """``[[law]]``: a force or torque by an expression of time and state, along a joint
        coordinate (``joint``, ``effort``), between two points (``from``, ``to``, ``tension``), or
        on a body or a particle (``on``, ``force``, ``torque``).

        Parameters
        ----------
        name : str
            Its name, unique in the model; its work is listed under it.
        axes : str, optional
            The axes along which force and torque have these components: fixed in space, or in the
            body of ``relative_to`` where there is one; or those of the body on which they act.
            One of ``"space"``, ``"body"``.
        conservative : bool, optional
            A law that reads a rate is taken for one that dissipates, whichever way time runs, and
            refused by composition methods; this one does not.
        effort : float or str, optional
            Force, N, or torque, N·m, on the child of the joint, equal and opposite on its parent:
            of ``t``, the coordinate ``x`` and its rate ``v``.
        force : array (3,), optional
            Force, N, three expressions: of ``t``, the place ``x``, ``y``, ``z`` of the point (m)
            and its velocity ``vx``, ``vy``, ``vz`` (m/s), the angular velocity ``wx``, ``wy``,
            ``wz`` of the body (rad/s), in space or in the frame of ``relative_to``.
        freedom : int, optional
            Which degree of freedom of the joint, counted from 0: displacements first, then angles.
        from_ : str, optional
            A body, a particle, or ``ground``: the first of two points.
        joint : str, optional
            The joint along whose coordinate it acts.
        on : str, optional
            A body or a particle: force and torque act on it alone.
        point : array (3,), optional
            Where the force acts on a body: components along its axes from its centre of mass, m;
            the centre by default.
        point_from : array (n,), optional
            Where it is held at ``from``, m: body components from the centre of mass, or a point of
            the ground; the centre or the origin by default.
        point_to : array (n,), optional
            Where it is held at ``to``, m.
        relative_to : str, optional
            Between points: the frame of points of the ground, a body, a node of a beam, a joint or
            a ``[[frame]]``; the inertial frame by default. On a body or a particle (``on``): a body
            or a node of a beam, along whose axes, from whose centre and in relation to whose
            rotation the law reads and acts; it takes the opposite force, and the couple of both.
        tension : float or str, optional
            Force with which the points pull each other, N: of ``t``, the distance ``x`` and its
            rate ``v``.
        to : str, optional
            A body, a particle, or ``ground``: the second.
        torque : array (3,), optional
            Torque, N·m, on a body, three expressions of the same names.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "axes": axes,
            "conservative": conservative,
            "effort": effort,
            "force": force,
            "freedom": freedom,
            "from": from_,
            "joint": joint,
            "on": on,
            "point": point,
            "point_from": point_from,
            "point_to": point_to,
            "relative_to": relative_to,
            "tension": tension,
            "to": to,
            "torque": torque,
        }
        return self._add("law", given)

    def signal(
        self,
        name: str,
        *,
        delay: Mapping[str, Any] | None = None,
        every: Number | None = None,
        filter: Mapping[str, Any] | None = None,
        pid: Mapping[str, Any] | None = None,
        rate: Number | None = None,
        start: Number | None = None,
        transfer: Mapping[str, Any] | None = None,
        value: Number | None = None,
    ) -> Part:
        """``[[signal]]``: a number that laws and other signals read by its name. One of ``value``,
        ``rate``, ``filter``, ``transfer``, ``pid`` and ``delay``; ``start`` alone is a number that
        only events change. Expressions know ``t``, joint coordinates (``knee``, ``knee.rate``,
        ``knee.1``), members (``arm.x``, ``arm.vx``, ``arm.wx``), other signals, tables and
        parameters.

        Parameters
        ----------
        name : str
            Its name, unique in the model: letters, digits and ``_``, a letter first.
        delay : dict, optional
            A value of the past.
            Keys: ``of``, ``time``.
        every : float, optional
            ``value`` or ``pid`` are sampled at nodes at multiples of this time, s, and held in
            between: a multiple of the step.
        filter : dict, optional
            A lag of first order.
            Keys: ``of``, ``time_constant``.
        pid : dict, optional
            A controller with proportional, integral and derivative parts.
            Keys: ``derivative``, ``feedforward``, ``filter``, ``integral``, ``limits``, ``of``,
            ``proportional``, ``tracking``.
        rate : float or str, optional
            Its derivative by time as an expression, which may read the signal itself.
        start : float, optional
            Its value at the start of ``rate``, ``filter``, of ``last``, or until an event changes
            it; 0 by default.
        transfer : dict, optional
            A transfer function.
            Keys: ``denominator``, ``numerator``, ``of``.
        value : float or str, optional
            The signal as an expression; with ``every`` it may read ``last``, its value until then.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "delay": delay,
            "every": every,
            "filter": filter,
            "pid": pid,
            "rate": rate,
            "start": start,
            "transfer": transfer,
            "value": value,
        }
        return self._add("signal", given)

    def table(
        self,
        name: str,
        *,
        axes: Matrix | None = None,
        columns: Sequence[Name] | None = None,
        file: str | None = None,
        grid: bool | None = None,
        interpolation: Literal["pchip", "linear", "spline", "steps"] | None = None,
        outside: Literal["hold", "slope", "error"] | None = None,
        points: Matrix | None = None,
        values: Matrix | None = None,
    ) -> Part:
        """``[[table]]``: a function of one number by its values, or of two by its values on a grid.
        Expressions call it by its name: ``torque(v)``, ``torque(v, heat)``.

        Parameters
        ----------
        name : str
            Its name, unique in the model: letters, digits and ``_``, a letter first.
        axes : array (2, n), optional
            The arguments of a function of two numbers, ``[[x, …], [y, …]]``: at least two each,
            increasing. Unit: of what takes and gives them.
        columns : list of str, optional
            The headings of the columns of arguments and values; the first two columns by default.
        file : str, optional
            A file of comma-separated values with a line of headings, instead of ``points``; its
            path starts in the folder of the model file.
        grid : bool, optional
            Whether the file has a grid, instead of ``axes`` and ``values``: ``y`` in its first
            line, ``x`` in its first column, values elsewhere.
        interpolation : str, optional
            What it is between its points; on a grid the same along both arguments.
            One of ``"pchip"``, ``"linear"``, ``"spline"``, ``"steps"``.
        outside : str, optional
            What it is before the first and after the last point.
            One of ``"hold"``, ``"slope"``, ``"error"``.
        points : array (n, 2), optional
            Arguments and values, ``[[x, y], …]``: at least two, arguments increasing. Unit: of what
            takes and gives them.
        values : array (n, n), optional
            Its values: a row for each ``x``, in it one for each ``y``. Unit: of what takes them.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "axes": axes,
            "columns": columns,
            "file": file,
            "grid": grid,
            "interpolation": interpolation,
            "outside": outside,
            "points": points,
            "values": values,
        }
        return self._add("table", given)

    def event(
        self,
        name: str,
        *,
        at: Number | None = None,
        disable: Sequence[Name] | None = None,
        enable: Sequence[Name] | None = None,
        end: bool | None = None,
        locate: Literal["root", "step"] | None = None,
        lock: Sequence[Name] | None = None,
        once: bool | None = None,
        release: Sequence[Name] | None = None,
        set: Mapping[str, Any] | None = None,
        when: str | None = None,
    ) -> Part:
        """``[[event]]``: changes the mechanism when a condition becomes true, or at a time.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        at : float, optional
            The time at which it acts, s, in the place of a condition.
        disable : list of str, optional
            Laws, loads and motors, by the name of their joint, that cease to act.
        enable : list of str, optional
            Laws, loads and motors, by the name of their joint, that act again.
        end : bool, optional
            The run ends here.
        locate : str, optional
            Where it acts: where its condition becomes true, to round-off, or at the end of that
            step.
            One of ``"root"``, ``"step"``.
        lock : list of str, optional
            Joint coordinates that are held where they are, ``elbow``, or ``elbow.1``: a plastic
            impact.
        once : bool, optional
            It acts once; else whenever its condition becomes true again.
        release : list of str, optional
            Joints, bars, constraints, springs, bushings and laws that vanish; with a joint all that
            acts along it.
        set : dict, optional
            New values of signals with ``start`` alone.
        when : str, optional
            The condition, comparisons by ``<`` and ``>`` joined by ``and`` and ``or``, of ``t``,
            joints (``knee``, ``knee.rate``; ``knee.1`` of its second degree of freedom), bodies,
            nodes and particles in space (``arm.x`` to ``arm.z``, ``arm.vx`` to ``arm.vz``,
            ``arm.wx`` to ``arm.wz``), sensors (``tip.x``). It acts when this becomes true.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "at": at,
            "disable": disable,
            "enable": enable,
            "end": end,
            "locate": locate,
            "lock": lock,
            "once": once,
            "release": release,
            "set": set,
            "when": when,
        }
        return self._add("event", given)

    def sensor(
        self,
        name: str,
        type: Literal["position", "velocity", "acceleration", "orientation", "angular_velocity", "angular_acceleration", "imu", "distance", "distance_rate", "joint_coordinate", "joint_rate", "joint_acceleration", "reaction", "effort", "power", "work", "slip", "gap", "clearance", "contact_force", "stop_force", "friction_torque", "section_force", "expression", "strain"],
        *,
        at: Number | None = None,
        element: Integer | None = None,
        euler: Mapping[str, Any] | None = None,
        frame: Literal["parent", "child", "space"] | None = None,
        matrix: Matrix | None = None,
        of: Name | None = None,
        point: Vector | None = None,
        point_to: Vector | None = None,
        quaternion: Vector | None = None,
        rotation_vector: Vector | None = None,
        seen_from: Name | None = None,
        to: Name | None = None,
        value: Number | None = None,
    ) -> Part:
        """``[[sensor]]``: a named column, or several, of ``sensors.csv``.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        type : str
            What it measures.
            One of ``"position"``, ``"velocity"``, ``"acceleration"``, ``"orientation"``,
            ``"angular_velocity"``, ``"angular_acceleration"``, ``"imu"``, ``"distance"``,
            ``"distance_rate"``, ``"joint_coordinate"``, ``"joint_rate"``, ``"joint_acceleration"``,
            ``"reaction"``, ``"effort"``, ``"power"``, ``"work"``, ``"slip"``, ``"gap"``,
            ``"clearance"``, ``"contact_force"``, ``"stop_force"``, ``"friction_torque"``,
            ``"section_force"``, ``"expression"``, ``"strain"``.
        at : float, optional
            The place on a beam (``section_force``, ``strain``) in the place of ``element``: arc
            length from its start, m.
        element : int, optional
            The element of a beam, counted along it from 0 (``section_force``, ``strain``): at its
            middle; the mean of its Gauss points when it has several.
        euler : dict, optional
            Orientation of the axes of an ``imu`` in the body by Euler angles.
            Keys: ``angles``, ``degrees``, ``sequence``.
        frame : str, optional
            The axes of the components of a ``reaction``: the joint frame of the parent by default.
        matrix : array (3, 3), optional
            Orientation of the axes of an ``imu`` in the body as a rotation matrix, rows; its
            columns are the axes. Unit: 1.
        of : str, optional
            The body, node, particle, joint, bar, beam or contact it is attached to; an
            ``expression`` has none.
        point : array (3,), optional
            The point of a body (``position``, ``velocity``, ``acceleration``, ``imu``,
            ``distance``): body components from the centre of mass, m; the centre by default.
        point_to : array (3,), optional
            The point at ``to``, m: body components from the centre of mass; of the ground in space.
        quaternion : array (4,), optional
            Orientation of the axes of an ``imu`` in the body as a unit quaternion ``[w, x, y, z]``;
            by default they are those of the body. Unit: 1.
        rotation_vector : array (3,), optional
            Orientation of the axes of an ``imu`` in the body as a rotation vector, rad.
        seen_from : str, optional
            The body or node of a beam in whose frame a ``position``, ``velocity``, ``orientation``
            or ``angular_velocity`` is given, as an observer on it sees it; by default space.
        to : str, optional
            The other end of a ``distance``: a body, a node of a beam, a particle or the ground; of
            a ``clearance`` the other body.
        value : float or str, optional
            The expression of an ``expression``.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "type": type,
            "at": at,
            "element": element,
            "euler": euler,
            "frame": frame,
            "matrix": matrix,
            "of": of,
            "point": point,
            "point_to": point_to,
            "quaternion": quaternion,
            "rotation_vector": rotation_vector,
            "seen_from": seen_from,
            "to": to,
            "value": value,
        }
        return self._add("sensor", given)

    def frame(
        self,
        name: str,
        *,
        euler: Mapping[str, Any] | None = None,
        matrix: Matrix | None = None,
        position: Vector | None = None,
        quaternion: Vector | None = None,
        relative_to: Name | None = None,
        rotation_vector: Vector | None = None,
    ) -> Part:
        """``[[frame]]``: a reference frame with a name, for ``relative_to``. It has neither mass
        nor motion of its own.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        euler : dict, optional
            Orientation by Euler angles.
            Keys: ``angles``, ``degrees``, ``sequence``.
        matrix : array (3, 3), optional
            Orientation as a rotation matrix, rows; its columns are the axes of the frame. Unit: 1.
        position : array (3,), optional
            Its origin, m.
        quaternion : array (4,), optional
            Orientation as a unit quaternion ``[w, x, y, z]``. Unit: 1.
        relative_to : str, optional
            The frame of its position and orientation: a body, a node of a beam, a joint or a
            ``[[frame]]``; the inertial frame by default.
        rotation_vector : array (3,), optional
            Orientation as a rotation vector, rad.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "euler": euler,
            "matrix": matrix,
            "position": position,
            "quaternion": quaternion,
            "relative_to": relative_to,
            "rotation_vector": rotation_vector,
        }
        return self._add("frame", given)

    def include(
        self,
        file: str,
        *,
        euler: Mapping[str, Any] | None = None,
        matrix: Matrix | None = None,
        parameters: Mapping[str, Any] | None = None,
        position: Vector | None = None,
        prefix: str | None = None,
        quaternion: Vector | None = None,
        relative_to: Name | None = None,
        rotation_vector: Vector | None = None,
    ) -> Part:
        """Files whose parts are added to the model; their [model] and [simulation] are not used.

        Parameters
        ----------
        file : str
            The file, relative to the directory of this one.
        euler : dict, optional
            Keys: ``angles``, ``degrees``, ``sequence``.
        matrix : array (3, 3), optional
            Orientation as a rotation matrix, rows. Unit: 1.
        parameters : dict, optional
            Values for parameters of the file, instead of its own.
        position : array (3,), optional
            Where the origin of the file is placed, m.
        prefix : str, optional
            Stands before all names and parameters of the file.
        quaternion : array (4,), optional
            Orientation as a unit quaternion ``[w, x, y, z]``. Unit: 1.
        relative_to : str, optional
            The frame in which the file is placed: a body, a node of a beam, a joint or a
            ``[[frame]]``.
        rotation_vector : array (3,), optional
            Orientation as a rotation vector, rad.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "file": file,
            "euler": euler,
            "matrix": matrix,
            "parameters": parameters,
            "position": position,
            "prefix": prefix,
            "quaternion": quaternion,
            "relative_to": relative_to,
            "rotation_vector": rotation_vector,
        }
        return self._add("include", given)

    def condition(
        self,
        name: str,
        *,
        at: Literal["end", "path"] | Number | None = None,
        equals: Number | None = None,
        max: Number | None = None,
        min: Number | None = None,
        of: Sequence[Name] | None = None,
        sensor: str | None = None,
        type: Literal["sensor", "rest"] | None = None,
    ) -> Part:
        """``[[condition]]``: what an optimum has to meet. A run does without it.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        at : str or float, optional
            When it holds.
        equals : float, optional
            The value of the sensor, in its unit.
        max : float, optional
            Its largest value.
        min : float, optional
            Its least value.
        of : list of str, optional
            The joints that are at rest, of a condition of type ``rest``; all by default.
        sensor : str, optional
            The name of a sensor, of one of several numbers with the number or its heading:
            ``"tip.z"``, ``"tip.2"``.
        type : str, optional
            What it is.
            One of ``"sensor"``, ``"rest"``.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "at": at,
            "equals": equals,
            "max": max,
            "min": min,
            "of": of,
            "sensor": sensor,
            "type": type,
        }
        return self._add("condition", given)

    def contact(
        self,
        name: str,
        a: Mapping[str, Any] | str | Sequence[Name],
        b: str | Sequence[Name],
        *,
        friction: Number | None = None,
        model: Mapping[str, Any] | None = None,
        overlap: Literal["refuse", "separate"] | None = None,
        relative_to: Name | None = None,
        restitution: Number | None = None,
        static_friction: Number | None = None,
        tangential_restitution: Number | None = None,
    ) -> Part:
        """``[[contact]]``: bodies that cannot pass through a plane, or through one another; rigid,
        with dry friction after Coulomb and impacts after Newton. Bodies that share a joint are no
        pair.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        a : dict or str or list of str
            What the bodies of ``b`` touch: a plane, or bodies.
        b : str or list of str
            The bodies that touch it: a name or a list of names, in which ``*`` stands for any
            characters. They touch with their ``collision`` shapes, without these with their
            ``shape``. A name of a beam stands for its nodes, ``rope.3``, ``rope.end`` and
            ``rope.*`` for those of them; each touches as a sphere with the ``radius`` of the beam.
        friction : float, optional
            Coefficient of friction: sliding, the force across the normal is this part of the normal
            force, against the slip; up to that it holds.
        model : dict, optional
            In the place of a rigid contact: a force that grows with the overlap.
        overlap : str, optional
            What happens where shapes overlap at the start.
            One of ``"refuse"``, ``"separate"``.
        relative_to : str, optional
            The frame of a plane that is fixed in the ground: a body, a node of a beam, a joint or a
            ``[[frame]]``, as it is initially; the inertial frame by default.
        restitution : float, optional
            Normal velocity after an impact over that before, between 0 and 1.
        static_friction : float, optional
            Coefficient of friction of what sticks, above ``friction``: up to that it holds, and
            then slides with the other one.
        tangential_restitution : float, optional
            The same of the velocity across the normal, as far as friction can reverse it; 1 of a
            superball.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "a": a,
            "b": b,
            "friction": friction,
            "model": model,
            "overlap": overlap,
            "relative_to": relative_to,
            "restitution": restitution,
            "static_friction": static_friction,
            "tangential_restitution": tangential_restitution,
        }
        return self._add("contact", given)

    def control(
        self,
        name: str,
        *,
        body: Name | None = None,
        force: Vector | None = None,
        frame: Literal["space", "body"] | None = None,
        freedom: Integer | None = None,
        hold: Integer | None = None,
        joint: Name | None = None,
        max: Number | None = None,
        min: Number | None = None,
        point: Vector | None = None,
        relative_to: Name | None = None,
        shape: Literal["constant", "linear"] | None = None,
        torque: Vector | None = None,
    ) -> Part:
        """``[[control]]``: an effort along a joint coordinate, or a wrench on a body, that is free:
        derivatives and optima are by its values. A run takes them as zero.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        body : str, optional
            The body, the node of a beam or the particle on which it acts, in the place of
            ``joint``: its values are factors of ``force`` and ``torque``.
        force : array (3,), optional
            The force of the value 1, N, at ``point``; with a unit vector the values are in N.
        frame : str, optional
            The frame of the components of ``force`` and ``torque``: with ``"body"`` they turn with
            it.
            One of ``"space"``, ``"body"``.
        freedom : int, optional
            Which degree of freedom of the joint, counted from 0: displacements first, then angles.
        hold : int, optional
            Steps for each value.
        joint : str, optional
            The joint on which it acts: its values are efforts, N or N·m.
        max : float, optional
            The largest value, of a joint N or N·m; none by default.
        min : float, optional
            The least value, of a joint N or N·m; none by default.
        point : array (3,), optional
            Where the force acts: body components from the centre of mass, m; the centre by default.
        relative_to : str, optional
            The frame in whose initial axes ``force`` and ``torque`` are stated, in the place of the
            inertial ones; only with ``frame = "space"``.
        shape : str, optional
            How it goes from value to value.
            One of ``"constant"``, ``"linear"``.
        torque : array (3,), optional
            The torque of the value 1, N·m; with a unit vector the values are in N·m.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "body": body,
            "force": force,
            "frame": frame,
            "freedom": freedom,
            "hold": hold,
            "joint": joint,
            "max": max,
            "min": min,
            "point": point,
            "relative_to": relative_to,
            "shape": shape,
            "torque": torque,
        }
        return self._add("control", given)

    def identify(
        self,
        *,
        initial: Sequence[Name] | None = None,
        max_iterations: Integer | None = None,
        parameters: Mapping[str, Any] | None = None,
        segments: Integer | None = None,
    ) -> Part:
        """``[identify]``: what is to be found from measurements.

        Parameters
        ----------
        initial : list of str, optional
            Joints whose coordinates and rates at the start are unknown, too.
        max_iterations : int, optional
            Iterations of the method at most.
        parameters : dict, optional
            Unknown numbers of ``[parameters]``, by name.
        segments : int, optional
            Parts of the run that begin at states of their own until they meet: for long data, whose
            residuals have many minima.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "initial": initial,
            "max_iterations": max_iterations,
            "parameters": parameters,
            "segments": segments,
        }
        return self._set("identify", given)

    def measurement(
        self,
        sensor: str,
        sigma: Number,
        *,
        column: str | None = None,
    ) -> Part:
        """``[[measurement]]``: a sensor beside a column of measured values, for ``holonom
        identify``.

        Parameters
        ----------
        sensor : str
            The name of a sensor, of one of several numbers with the number or its heading:
            ``"tip.z"``, ``"tip.2"``.
        sigma : float
            The standard deviation of a measured value, in the unit of the sensor.
        column : str, optional
            The heading of the column of the data; that of ``sensor`` by default.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "sensor": sensor,
            "sigma": sigma,
            "column": column,
        }
        return self._add("measurement", given)

    def objective(
        self,
        name: str,
        type: Literal["effort", "work", "time", "rate", "sensor", "value", "momentum"],
        *,
        at: Literal["end", "path"] | None = None,
        controls: Sequence[Name] | None = None,
        sensor: str | None = None,
        target: Number | None = None,
        weight: Number | None = None,
    ) -> Part:
        """``[[objective]]``: a term of what derivatives are of and optima are least in; the terms
        add up.

        Parameters
        ----------
        name : str
            Its name, unique in the model.
        type : str
            What it is.
            One of ``"effort"``, ``"work"``, ``"time"``, ``"rate"``, ``"sensor"``, ``"value"``,
            ``"momentum"``.
        at : str, optional
            Where a sensor counts.
            One of ``"end"``, ``"path"``.
        controls : list of str, optional
            The controls of an ``effort``, a ``work`` or a ``rate``; all of them by default.
        sensor : str, optional
            Of a ``sensor`` or a ``value`` its name, of one of several numbers with the number or
            its heading: ``"tip.z"``, ``"tip.2"``.
        target : float, optional
            The value that a sensor is to have, in its unit.
        weight : float, optional
            Its factor in the sum.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "name": name,
            "type": type,
            "at": at,
            "controls": controls,
            "sensor": sensor,
            "target": target,
            "weight": weight,
        }
        return self._add("objective", given)

    def optimize(
        self,
        *,
        guess: str | None = None,
        max_iterations: Integer | None = None,
        parameters: Mapping[str, Any] | None = None,
        refine: Integer | None = None,
        starts: Integer | None = None,
        time: Mapping[str, Any] | None = None,
    ) -> Part:
        """``[optimize]``: what is free in an optimum, and how it is looked for.

        Parameters
        ----------
        guess : str, optional
            The motion with which the search begins: ``"line"`` from start to end, ``"run"`` as the
            model moves without controls, or the folder of an earlier optimum.
        max_iterations : int, optional
            Iterations at most, of each number of steps.
        parameters : dict, optional
            The parameters that are free, by name: ``{ length = { min = 0.2, max = 0.6 } }``. The
            search begins with their values.
        refine : int, optional
            How often the steps are halved on the way: 2 begins with a quarter of them.
        starts : int, optional
            How many searches, the second and further ones from disturbed beginnings.
        time : dict, optional
            The time that the motion takes is free; ``end`` of the simulation by default. The number
            of steps is that of the simulation.
            Keys: ``guess``, ``max``, ``min``.

        Returns
        -------
        Part
            Its handle, which stands wherever its name can.
        """
        given: dict[str, Any] = {
            "guess": guess,
            "max_iterations": max_iterations,
            "parameters": parameters,
            "refine": refine,
            "starts": starts,
            "time": time,
        }
        return self._set("optimize", given)
