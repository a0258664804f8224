"""Read the configuration, for users of the library."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from capsule.configuration import check_configuration
from capsule.configuration_files import read_config_file, read_schema
from capsule.kinds import Cells
from capsule.project import CONFIG, SCHEMAS, require_project

_SHIPPED = CONFIG / "config.yaml"
_SCHEMA = SCHEMAS / "config.schema.json"


def read_settings(config: str | Path | None = None, **changes: object) -> dict[str, Any]:
    """Read a configuration, check it, and change keys of it.

    Parameters
    ----------
    config : str or Path, optional
        The file; the default is the configuration that ships with the library.
    **changes
        Other values for keys of the configuration, as in `capsule.load`.

    Returns
    -------
    dict

    Raises
    ------
    CapsuleError
        A key or a value is not allowed; the message names the file, the key, the value and the
        allowed values.
    """
    require_project()
    path = _SHIPPED if config is None else Path(config)
    content = read_config_file(path)
    settings = dict(content)
    for key, value in changes.items():
        section = settings.get(key)
        if isinstance(section, dict) and isinstance(value, dict):
            settings[key] = {**section, **value}
        else:
            settings[key] = value
    sources = {str(path): content, "changes": changes}
    return check_configuration(settings, read_schema(_SCHEMA), sources)


def shipped_settings() -> Cells:
    """Read the configuration that ships with the project."""
    settings: Cells = json.loads(_shipped_settings())
    return settings


@lru_cache(maxsize=1)
def _shipped_settings() -> str:
    return json.dumps(read_settings())
