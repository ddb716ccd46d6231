"""What drives a run spends: reactions of its clamps, and powers."""

from __future__ import annotations

from flagrs.budget import powers_of
from flagrs.reactions import Reaction, reaction_of
from flagrs.scene.values import FloatArray


class DriverReadOuts:
    """Read-outs of `flagrs.Trajectory`, which sets the attributes."""

    clamp_force: FloatArray
    clamp_torque: FloatArray
    clamp_power: FloatArray
    account: FloatArray

    def reaction(self, clamp: int = 0) -> Reaction:
        """Return force (T, 3), torque (T, 3) and power (T,) of a clamp on its filament [N, N m, W].

        The torque is about the clamp's first node. A clamp that holds a swimmer, turned by it or by motors,
        feels the opposite: its thrust.

        Raises
        ------
        SceneError
            If there is no such clamp.
        FlagrsError
            If the file was written before reactions were recorded.
        """
        return reaction_of(clamp, self.clamp_force, self.clamp_torque, self.clamp_power)

    def powers(self) -> dict[str, FloatArray]:
        """Return the power (T,) through every channel of the energy budget, given or taken [W].

        ``motors``, ``clamps``, ``loads`` and ``gravity`` give; ``fluid``, ``twist_drag``, ``head``,
        ``contact`` and ``other`` take. A frame between adaptive steps has those of the step's end.
        """
        return powers_of(self.account)
