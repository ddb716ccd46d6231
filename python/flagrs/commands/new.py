"""``flagrs new`` and ``flagrs schema``: a scene to start from, and what editors check it by."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import typer

from flagrs.errors import FileError, SceneError, file_error
from flagrs.files import check_output


def new(
    output: Annotated[Path, typer.Argument(help="TOML file to write.")] = Path("scene.toml"),
    scenario: Annotated[
        str | None, typer.Option(help="Start from a scenario of `flagrs scenarios`, with all its parameters.")
    ] = None,
) -> None:
    """Write a commented scene to start from: a soft helix turned in a fluid, or a scenario's parameters."""
    text = _of_scenario(scenario) if scenario else _template()
    if output.suffix != ".toml":
        raise SceneError(f"{output}: must end in .toml", field="output", value=str(output))
    if check_output(output, overwrite=True):
        raise FileError(output, "is there already")
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise file_error(output, error, "cannot be written") from None
    typer.echo(f"written           {output}; change it, and run it with: flagrs run {output}")


def schema() -> None:
    """Print the JSON Schema of scene files, for editors that complete and check TOML."""
    from flagrs.scene.schema import scene_schema  # help does without

    typer.echo(json.dumps(scene_schema(), indent=1))


def _template() -> str:
    return (files("flagrs.commands") / "scene.toml").read_text(encoding="utf-8")


def _of_scenario(name: str) -> str:
    """Return a file with all parameters of a scenario, at their defaults, and what they mean."""
    from flagrs import scenarios  # help does without
    from flagrs.scene.schema import meanings_of

    summary, defaults = scenarios.list().get(name), scenarios.parameters(name)
    meanings = meanings_of(getattr(scenarios, name), "Parameters")
    lines = [
        f"# {summary}",
        "# `flagrs run` runs it, `flagrs run --plan` says what it costs.",
        f'scenario = "{name}"',
    ]
    lines += ["", "[parameters]"]
    for key, value in defaults.items():
        lines += [f"# {meanings[key]}"] if key in meanings else []
        lines += [f"# {key} =" if value is None else _line(key, value), ""]
    return "\n".join(lines)


def _line(key: str, value: Any) -> str:
    import tomli_w

    plain = list(value) if isinstance(value, tuple) else value
    return tomli_w.dumps({key: plain}).rstrip("\n")
