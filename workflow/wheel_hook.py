"""Put the project into a wheel, beside the package: its commands read these files.

An editable installation needs none of them, since the package lies in the project's folder.
"""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_PARTS = ("Snakefile", "config", "profiles", "workflow")
# The package stands in the wheel once; no command reads the others.
_LEFT_OUT = {Path("workflow", name) for name in ("scripts/capsule", "studies", "firmware")}


class ProjectInWheel(BuildHookInterface):
    """Add the files under `capsule_project`; the package itself stands in the wheel once."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the files before the wheel is built."""
        if version == "editable":
            return
        root = Path(self.root)
        for part in _PARTS:
            path = root / part
            for file in [path] if path.is_file() else sorted(path.rglob("*")):
                name = file.relative_to(root)
                if not file.is_file() or _LEFT_OUT & {*name.parents}:
                    continue
                if "__pycache__" not in name.parts:
                    build_data["force_include"][str(file)] = f"capsule_project/{name.as_posix()}"
