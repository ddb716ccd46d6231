"""Overriding a scenario's fluid and contact: as a whole, or only some of their options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagrs.errors import SceneError, not_allowed
from flagrs.scene import Contact, Fluid

FluidOverride = Fluid | str | Mapping[str, Any] | None
ContactOverride = bool | Contact | Mapping[str, Any] | None


def fluid_from(override: FluidOverride, default: Fluid, twist_drag: bool = True) -> Fluid:
    """Return the default fluid, the default with some options changed, or another one.

    Twist drag is on only where neither the fluid nor the argument switches it off.
    """
    if isinstance(override, str):
        override = {"model": override}
    if isinstance(override, Fluid):
        fluid = override
    elif override is None or isinstance(override, Mapping):
        try:
            fluid = default.replace(**(override or {}))
        except SceneError as error:
            raise error.within("fluid") from None
    else:
        raise not_allowed("fluid", override, "a Fluid, the name of a model, or a mapping of options")
    return fluid if twist_drag else fluid.replace(twist_drag=False)


def contact_from(override: ContactOverride) -> Contact | None:
    """Return no contact, contact as it is by default, with some options changed, or another one."""
    if isinstance(override, Contact):
        return override
    if override is None or isinstance(override, bool):
        return Contact() if override else None
    if isinstance(override, Mapping):
        try:
            return Contact(**override)
        except SceneError as error:
            raise error.within("contact") from None
    raise not_allowed("contact", override, "true, false, a Contact or a mapping of its options")
