"""The problems, a file for each kind; importing this registers them all."""

from flagrs.validation.problems import buckling, cantilevers

__all__ = ["buckling", "cantilevers"]
