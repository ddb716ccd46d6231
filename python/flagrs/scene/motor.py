"""Motors: a hinge whose shaft edge turns against its housing edge."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from flagrs.errors import SceneError
from flagrs.scene.part import Part
from flagrs.scene.signal import CheckedSignalOrNone, Signal
from flagrs.scene.values import Index


class Motor(Part):
    """A motor at a hinge, driven by its speed or by its torque.

    Positive is the right-hand rule about the shaft edge's direction *away from the motor's node*, whichever
    way the edge itself runs; it is the motion of the shaft relative to the housing, the other edge of the
    hinge.

    Attributes
    ----------
    node : int
        Node of the rod at which the motor sits.
    shaft : int
        Edge of the rod that is turned; one of the two edges of the hinge at `node`.
    rod : int
        Index of the rod in the scene.
    speed : float, Table, TimeFunction or function of time
        Angular velocity of the shaft relative to the housing [rad/s]; see `flagrs.rpm`.
    torque : float, Table, TimeFunction or function of time
        Torque on the shaft, and opposite on the housing [N m]. Exactly one of `speed` and `torque` is given.
    """

    node: Index
    shaft: Index
    rod: Index = 0
    speed: CheckedSignalOrNone = None
    torque: CheckedSignalOrNone = None

    @model_validator(mode="after")
    def _check(self) -> Motor:
        if (self.speed is None) == (self.torque is None):
            given = "neither" if self.speed is None else "both"
            raise SceneError(
                f"speed: {given} of speed and torque given; a motor takes exactly one of them",
                field="speed",
                value=self.speed,
                allowed="exactly one of speed [rad/s] and torque [N m]",
            )
        return self

    @property
    def drive(self) -> Literal["speed", "torque"]:
        """Which of the two is prescribed."""
        return "torque" if self.speed is None else "speed"

    @property
    def signal(self) -> Signal:
        """The prescribed speed [rad/s] or torque [N m]."""
        signal = self.torque if self.speed is None else self.speed
        if signal is None:  # excluded on construction; stated for the type checker
            raise SceneError("speed: missing", field="speed")
        return signal
