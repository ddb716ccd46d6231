"""A run's account of itself: energy in, out and stored, and the balance of outer forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagrs.scene.values import FloatArray

#: What gives energy, and what takes it, in the order of the native account (src/state/account.rs).
SOURCES = ("motors", "clamps", "loads", "gravity")
SINKS = ("fluid", "twist_drag", "head", "contact", "other")
#: Those of them that only ever take: the first ones.
DRAGS = SINKS[:3]
#: What stores it.
STORES = ("elastic", "contact", "kinetic")
#: Length of an account.
WIDTH = 42


@dataclass(frozen=True)
class EnergyBudget:
    """Energy through every channel since the start, at each frame of a run.

    At a frame between adaptive steps the account is that of the end of the step which holds it, so that
    everything in it belongs to one state.

    Attributes
    ----------
    time : ndarray
        Time (T,) up to which each account goes [s].
    sources : dict
        Energy (T,) given by motors, clamps, loads (with fields and flows) and gravity [J]; clamps by their
        reaction forces and torques.
    sinks : dict
        Energy (T,) taken by the fluid, twist drag, the head, contact (its friction) and other terms [J].
    stored : dict
        Elastic, contact and kinetic energy (T,) beyond that of the start [J] as a sum under ``total``, and by
        kind as they are.
    defect : ndarray
        What was given, less what was taken, less what is stored (T,) [J]: the error of the steps. Positive
        where a step loses energy, as steps of first order do; negative where energy comes from nowhere.
    relative_defect : ndarray
        The defect (T,) over the energy that has passed: the larger of what was given, what was taken, and the
        most that was ever stored; 0 where nothing has passed.
    """

    time: FloatArray
    sources: dict[str, FloatArray]
    sinks: dict[str, FloatArray]
    stored: dict[str, FloatArray]
    defect: FloatArray
    relative_defect: FloatArray


def budget_of(accounts: FloatArray) -> EnergyBudget:
    """Return the budget of native accounts (T, 42)."""
    through, stored = accounts[:, 1:10], accounts[:, 19:22]
    given, taken = through[:, : len(SOURCES)], through[:, len(SOURCES) :]
    begun = accounts[:, 23] > 0.0
    change = np.where(begun, stored.sum(axis=1) - accounts[:, 22], 0.0)
    defect = given.sum(axis=1) - taken.sum(axis=1) - change
    passed = _passed(accounts)
    parts = dict(zip(STORES, stored.T, strict=True)) | {"total": change}
    relative = np.divide(defect, passed, out=np.zeros_like(defect), where=passed > 0.0)
    return EnergyBudget(
        time=accounts[:, 0],
        sources=dict(zip(SOURCES, given.T, strict=True)),
        sinks=dict(zip(SINKS, taken.T, strict=True)),
        stored=parts,
        defect=defect,
        relative_defect=relative,
    )


def _passed(accounts: FloatArray) -> FloatArray:
    """Return the energy (T,) that has passed: the larger of what was given, taken, and ever stored [J]."""
    through = np.abs(accounts[:, 1:10])
    given, taken = through[:, : len(SOURCES)].sum(axis=1), through[:, len(SOURCES) :].sum(axis=1)
    passed: FloatArray = np.maximum.reduce([given, taken, accounts[:, 24]])
    return passed


def energy_passed(account: FloatArray) -> float:
    """Return the energy that has passed in an account (42,) [J]."""
    return float(_passed(account[None])[0])


def given_by_drag(account: FloatArray) -> float:
    """Return the energy that fluid, twist drag and head have given in an account (42,), over that passed.

    Drag takes. Where it has given on the whole, as by the forces of velocities long gone, steps are unstable.
    """
    first = 1 + len(SOURCES)
    taken, passed = account[first : first + len(DRAGS)], energy_passed(account)
    return float(-taken[taken < 0.0].sum()) / passed if passed > 0.0 else 0.0


def powers_of(accounts: FloatArray) -> dict[str, FloatArray]:
    """Return the power (T,) through every channel in native accounts (T, 42) [W]."""
    return dict(zip(SOURCES + SINKS, accounts[:, 10:19].T, strict=True))


def statistics_of(account: FloatArray) -> dict[str, float]:
    """Return the numbers of an account (42,) that belong into a run's statistics."""
    budget = budget_of(account[None])
    return {
        "energy_given": float(sum(part[0] for part in budget.sources.values())),
        "energy_taken": float(sum(part[0] for part in budget.sinks.values())),
        "energy_stored": float(budget.stored["total"][0]),
        "energy_defect": float(budget.relative_defect[0]),
        "force_imbalance": float(account[25]),
        "torque_imbalance": float(account[26]),
    }
