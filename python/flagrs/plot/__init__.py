"""Figures of runs and studies, drawn with matplotlib (``pip install 'flagrs[plot]'``)."""

from flagrs.plot.bundling import bundle
from flagrs.plot.curves import study
from flagrs.plot.flow import flow
from flagrs.plot.kymograph import curvature, tension
from flagrs.plot.movie import movie
from flagrs.plot.overview import summary
from flagrs.plot.printed import printed
from flagrs.plot.rates import speed
from flagrs.plot.shape import shape
from flagrs.plot.table import save_table

__all__ = [
    "bundle",
    "curvature",
    "flow",
    "movie",
    "printed",
    "save_table",
    "shape",
    "speed",
    "study",
    "summary",
    "tension",
]
