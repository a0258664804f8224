"""Make an environment of its own, with packages that this one lacks."""

import os
import subprocess
import sys
import sysconfig

# What another environment finds is only its own.
WITHOUT_PATH = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}


def environment_with(folder, *what):
    """Make an environment that finds the packages of this one behind its own; return its Python.

    `what` is installed into it: packages and options of pip.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    (packages,) = (folder / "lib").glob("python*/site-packages")
    # Files of this kind are read in the order of their names. A folder in one is searched last,
    # and what its own .pth files name is not.
    (packages / "0-others.pth").write_text(sysconfig.get_path("purelib"))
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "-q", "--no-compile", *what], check=True, capture_output=True)
    return python
