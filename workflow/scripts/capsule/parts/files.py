"""Read config/parts.yaml, the choices that the paper leaves open, and the shipped design."""

import yaml

from capsule.engine.project import CONFIG
from capsule.kinds import Settings
from capsule.parts.design import Design, design_of
from capsule.phantom.files import DEFAULT_TABLE, read_phantom

PARTS_TABLE = CONFIG / "parts.yaml"


def read_parts_table() -> Settings:
    """Read ``config/parts.yaml``: the choices, and the limits of all values."""
    table: Settings = yaml.safe_load(PARTS_TABLE.read_text(encoding="utf-8"))
    return table


def shipped_design() -> Design:
    """Return the design with the values of ``config/parts.yaml`` and ``config/phantom.yaml``."""
    phantom = read_phantom(DEFAULT_TABLE, [])
    return design_of(read_parts_table(), {}, phantom, phantom)
