"""Figures of runs and studies, drawn with matplotlib (``pip install 'flagrs[plot]'``)."""

from flagrs.plot.curves import study
from flagrs.plot.overview import summary
from flagrs.plot.rates import speed
from flagrs.plot.shape import shape

__all__ = ["shape", "speed", "study", "summary"]
