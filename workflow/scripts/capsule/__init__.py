"""Pure functions on arrays: no module of this package knows a file path or Snakemake.

`capsule.load`, `capsule.judge` and the other names of `capsule.interface.public` are imported when
a program asks for them: each step of the workflow imports this file, and shall load no more.
"""


def __getattr__(name: str) -> object:
    """Import a public name."""
    # By its name: what a string names is no import that makes the workflow run again.
    from importlib import import_module

    return import_module("capsule.interface.public").attribute(name)


def __dir__() -> list[str]:
    """List the public names."""
    from importlib import import_module

    names: list[str] = import_module("capsule.interface.public").public_names()
    return names
