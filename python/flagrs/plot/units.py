"""Units with the prefix that a size reads best with."""

from __future__ import annotations

_PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"), (1e12, "p"), (1e15, "f"), (1e18, "a"))


def prefixed(size: float, unit: str) -> tuple[float, str]:
    """Return factor and name of the unit in which a size reads best: 1000 and mm for 2e-3 m.

    Parameters
    ----------
    size
        The largest size that is shown, in the plain unit; below a thousandth of an attounit it stays plain.
    unit
        The plain unit, such as ``N m``.
    """
    for factor, prefix in _PREFIXES:
        if size * factor >= 1.0:
            return factor, prefix + unit
    return 1.0, unit
