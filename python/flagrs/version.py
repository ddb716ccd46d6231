"""Which flagrs this is."""

from importlib.metadata import PackageNotFoundError, version


def installed_version() -> str:
    """Return the version of the installed distribution, or a note that the source tree is used as it is."""
    try:
        return version("flagrs")
    except PackageNotFoundError:
        return "source tree"
