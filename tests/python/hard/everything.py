"""All rooms of hard cases; importing this registers them."""

from __future__ import annotations

from hard import driving, fluid_shapes, shapes, sizes, stability, stepping, stiffnesses, touching

ROOMS = (sizes, stiffnesses, shapes, fluid_shapes, driving, stability, touching, stepping)
