"""Read the configuration and check it, for programs beside the workflow."""

from pathlib import Path
from typing import Any

from capsule.configuration import check_configuration
from capsule.configuration_files import read_config_file, read_schema
from capsule.project import CONFIG, SCHEMAS, require_project


def read_settings(config: str | Path | None = None, **changes: object) -> dict[str, Any]:
    """Read a configuration file, or the configuration that ships, and change keys of it.

    Parameters
    ----------
    config : str or Path, optional
        The file.
    **changes
        Other values for keys of the configuration, as in `capsule.load`.

    Raises
    ------
    CapsuleError
        A key or a value is not allowed; the message names the file, the key, the value and the
        allowed values.
    """
    require_project()
    path = CONFIG / "config.yaml" if config is None else Path(config)
    content = read_config_file(path)
    settings = dict(content)
    for key, value in changes.items():
        section = settings.get(key)
        if isinstance(section, dict) and isinstance(value, dict):
            value = section | value
        settings[key] = value
    sources = {str(path): content, "changes": changes}
    return check_configuration(settings, read_schema(SCHEMAS / "config.schema.json"), sources)
