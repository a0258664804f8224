"""The library: functions on arrays, and a few modules that read and write files.

`capsule.load`, `capsule.judge` and the other names of `capsule.interface` are imported only
when a program asks for them. Each step of the workflow imports this file, so it must stay small.
"""


def __getattr__(name: str) -> object:
    """Import a public name."""
    # Snakemake follows import statements. A module named by a string triggers no new run.
    from importlib import import_module

    return import_module("capsule.interface").attribute(name)


def __dir__() -> list[str]:
    """List the public names."""
    from importlib import import_module

    names: list[str] = import_module("capsule.interface").public_names()
    return names
