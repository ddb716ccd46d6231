"""What drives a simulation, seen live: ``simulation.motors[0].speed = 2.0`` counts from the next step on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flagrs.errors import FlagrsError
from flagrs.inputs import parts_of
from flagrs.scene import LinearFlow, Scene

Read = Callable[[], Scene]
Write = Callable[[str, Any], None]


class LiveField:
    """A signal of a part that is read from the scene of the moment, and set in it."""

    def __init__(self, meaning: str) -> None:
        self.__doc__ = meaning

    def __set_name__(self, owner: type, name: str) -> None:
        """Keep the name of the field."""
        self._name = name

    def __get__(self, view: LivePart | None, owner: type) -> Any:
        """Return the signal as it is now."""
        if view is None:
            return self
        return getattr(parts_of(view._read())[view._path], self._name)

    def __set__(self, view: LivePart, value: Any) -> None:
        """Change the signal from the next step on."""
        view._write(f"{view._path}.{self._name}", value)


class LivePart:
    """A part of a simulation's scene whose signals may be set."""

    __slots__ = ("_path", "_read", "_write")

    def __init__(self, path: str, read: Read, write: Write) -> None:
        self._path, self._read, self._write = path, read, write

    def __repr__(self) -> str:
        """Return the part as it is now."""
        return f"<live {self._path}: {parts_of(self._read())[self._path]!r}>"


class LiveMotor(LivePart):
    """A motor; only the one of speed and torque that drives it can be set."""

    __slots__ = ()
    speed = LiveField("Angular velocity of the shaft relative to the housing [rad/s].")
    torque = LiveField("Torque on the shaft [N m].")


class LiveRotation(LivePart):
    """The rigid turn of a clamp."""

    __slots__ = ()
    rate = LiveField("Angular velocity about the axis [rad/s].")
    angle = LiveField(
        "Angle about the axis on top of the turn that `rate` gives [rad]; only its changes count."
    )


class LiveClamp(LivePart):
    """A clamp."""

    __slots__ = ()
    velocity = LiveField("Velocity (3,) of the nodes [m/s].")
    displacement = LiveField("Displacement (3,) on top of what `velocity` gives [m]; only its changes count.")
    angular_velocity = LiveField("Spin of the edges about their tangents [rad/s].")

    @property
    def rotation(self) -> LiveRotation:
        """The clamp's rigid turn.

        Raises
        ------
        FlagrsError
            If the scene gives it none.
        """
        path = f"{self._path}.rotation"
        if path not in parts_of(self._read()):
            raise FlagrsError(f"{path}: the scene gives this clamp no rotation; one of rate 0 will do")
        return LiveRotation(path, self._read, self._write)


class LiveLoad(LivePart):
    """A load on a point or along a rod."""

    __slots__ = ()
    force = LiveField("Force (3,) [N], or per length [N/m].")
    torque = LiveField("Torque (3,) [N m], or per length [N].")


class LiveMagneticField(LivePart):
    """The magnetic field."""

    __slots__ = ()
    field = LiveField("Field (3,) at the origin [T].")


class LiveLinearFlow(LivePart):
    """A uniform flow and a velocity gradient."""

    __slots__ = ()
    velocity = LiveField("Velocity (3,) at the center [m/s].")
    strength = LiveField("Factor on the gradient [1].")


class LiveFlow(LivePart):
    """A flow through a tube or between plates, or one given by a function."""

    __slots__ = ()
    speed = LiveField("Speed at the middle [m/s].")
    function = LiveField("Function of points (M, 3) [m] and a time [s] that gives velocities (M, 3) [m/s].")


class LiveInputs:
    """The live parts of a simulation, which sets the attributes."""

    _scene: Scene

    def _change(self, path: str, value: Any) -> None:
        raise NotImplementedError

    def _live(self, path: str, kind: type[LivePart]) -> Any:
        return kind(path, lambda: self._scene, self._change)

    @property
    def motors(self) -> tuple[LiveMotor, ...]:
        """The motors, whose ``speed`` or ``torque`` may be set between steps.

        A signal is a number, a table or a function of time, as in the scene; it counts from the next step on,
        is checked like the scene's, and is part of `state`, so that a restart goes on with it. A function of
        time sees the simulated time. Steps begin anew after a change, because rates jump.
        """
        return tuple(self._live(f"motors[{k}]", LiveMotor) for k in range(len(self._scene.motors)))

    @property
    def clamps(self) -> tuple[LiveClamp, ...]:
        """The clamps, whose motion may be set between steps; see `motors`."""
        return tuple(self._live(f"clamps[{k}]", LiveClamp) for k in range(len(self._scene.clamps)))

    @property
    def loads(self) -> tuple[LiveLoad, ...]:
        """The loads, whose force or torque may be set between steps; see `motors`."""
        return tuple(self._live(f"loads[{k}]", LiveLoad) for k in range(len(self._scene.loads)))

    @property
    def magnetic_field(self) -> LiveMagneticField:
        """The magnetic field, whose ``field`` may be set between steps; see `motors`.

        Raises
        ------
        FlagrsError
            If the scene has none.
        """
        if self._scene.magnetic_field is None:
            raise FlagrsError("magnetic_field: the scene has none; one that is zero will do")
        field: LiveMagneticField = self._live("magnetic_field", LiveMagneticField)
        return field

    @property
    def background(self) -> tuple[LiveLinearFlow | LiveFlow, ...]:
        """The background flows, whose signals may be set between steps; see `motors`."""
        flows = () if self._scene.fluid is None else self._scene.fluid.background
        kinds = (LiveLinearFlow if isinstance(flow, LinearFlow) else LiveFlow for flow in flows)
        return tuple(self._live(f"fluid.background[{k}]", kind) for k, kind in enumerate(kinds))
