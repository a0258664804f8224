"""Read a configuration file and its schema; an error message names the file and the line.

Snakemake's own reader names no file. If a key appears twice, it uses the last one without a
warning.
"""

import json
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from capsule.detectors.registry import DETECTORS
from capsule.errors import CapsuleError


class _Loader(yaml.SafeLoader):
    """A YAML loader that refuses repeated keys, and aliases: a few aliases can fill the memory."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a node; raise an error if it is an alias."""
        if self.check_event(yaml.AliasEvent):
            # The type stubs of PyYAML give no types for this function.
            event = self.get_event()  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(
                None,
                None,
                f"the alias *{event.anchor} is not allowed; write its value out",
                event.start_mark,
            )
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return the mapping as a dict; raise an error if a key appears twice."""
        seen = set()
        for key_node, _ in node.value:
            key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} appears twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


def read_config_file(path: Path) -> dict[str, Any]:
    """Read a configuration file.

    Parameters
    ----------
    path : Path
        A YAML or JSON file.

    Returns
    -------
    dict

    Raises
    ------
    CapsuleError
        The file does not exist, or holds no configuration; the message names the file.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8-sig"), Loader=_Loader)
    except OSError as error:
        raise CapsuleError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise CapsuleError(f"{path}: this is not UTF-8 text; save it as UTF-8") from None
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise CapsuleError(f"{path}{line}: {error.problem}") from None
    except yaml.YAMLError as error:
        raise CapsuleError(f"{path}: this is not valid YAML: {error}") from None
    except ValueError as error:
        # Python refuses to read an integer with thousands of digits.
        raise CapsuleError(f"{path}: a value cannot be read: {error}") from None
    except RecursionError:
        raise CapsuleError(f"{path}: the keys are nested too deeply") from None
    if not isinstance(content, dict):
        what = (
            "is empty" if content is None else f"holds a {type(content).__name__} instead of keys"
        )
        raise CapsuleError(f"{path}: this file {what}; config/README.md shows every key")
    return content


def read_schema(path: Path) -> dict[str, Any]:
    """Read the JSON Schema of the configuration, and add the detectors of the registry to it.

    Parameters
    ----------
    path : Path
        config.schema.json.

    Returns
    -------
    dict
    """
    schema: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    schema["properties"]["detectors"] |= {
        "items": {"enum": list(DETECTORS)},
        "description": "; ".join(f"{row.name}: {row.summary}" for row in DETECTORS.values()) + ".",
    }
    return schema
