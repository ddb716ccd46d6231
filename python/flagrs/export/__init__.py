"""Runs for other programs: ParaView, xarray, pandas, plain arrays and tables; one file for each."""

from flagrs.export.formats import FORMATS, export

__all__ = ["FORMATS", "export"]
