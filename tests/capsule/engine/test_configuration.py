"""A configuration is read and checked; each fault is told with its place."""

import copy
import datetime

import pytest
import yaml

from capsule.engine.configuration import (
    changed_values,
    check_configuration,
    read_config_file,
    read_schema,
    without_effect,
)
from capsule.errors import CapsuleError
from support.project import ROOT

SCHEMA = read_schema(ROOT / "workflow/schemas/config.schema.json")
GONE = object()
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))


def test_yaml_and_json_are_read_and_a_file_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "c.yaml"
    with pytest.raises(CapsuleError, match=f"{path}: No such file or directory"):
        read_config_file(path)
    for text in ("a: {b: 1}\n", '{"a": {"b": 1}}', "\ufeffa:\r\n  b: 1\r\n"):
        path.write_text(text, encoding="utf-8")
        assert read_config_file(path) == {"a": {"b": 1}}


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"", ": this file is empty"),
        (b"- 1\n- 2\n", ": this file holds a list instead of keys"),
        (b"fit: [1, 2\n", ", line 2: "),
        (b"fit: {}\nreport: {}\nfit: {}\n", ", line 3: the key 'fit' appears twice"),
        (b"fit: \xff\n", ": this is not UTF-8 text"),
        (b"fit: \x00\n", ": this is not valid YAML"),
        (b"a: &a [1]\nb: [*a, *a]\n", ", line 2: the alias *a is not allowed; write its value"),
        (b"fit:\n  seed: " + b"1" * 5000, ": a value cannot be read: "),
        (b"? [1]\n: 2\n", ", line 1: found unhashable key"),
        (b"[" * 20_000, ": the keys are nested too deeply"),
    ],
)
def test_what_is_no_configuration_is_told_with_the_file_and_the_line(tmp_path, content, fault):
    path = tmp_path / "c.yaml"
    path.write_bytes(content)
    with pytest.raises(CapsuleError) as caught:
        read_config_file(path)
    assert str(caught.value).startswith(f"{path}{fault}")


def changed(path, value):
    """Return the configuration with another value of a key; GONE takes the key away."""
    config = copy.deepcopy(CONFIG)
    *sections, key = path.split(".")
    place = config
    for section in sections:
        place = place[section]
    place[key] = value
    if value is GONE:
        del place[key]
    return config


def message(config, **sources):
    with pytest.raises(CapsuleError) as caught:
        check_configuration(config, SCHEMA, {"config/config.yaml": CONFIG, **sources})
    return str(caught.value)


def test_the_configuration_holds_the_papers_numbers():
    assert CONFIG["preprocessing"] == {"window": 84, "threshold": 1.0, "length": 1000}
    paper = {"sensors": 4, "rate_hz": 10, "particles": 2000, "iterations": 2000, "first_peak": 150}
    paper |= {"peak_spacing_range": [100, 250], "horizontal_spread_range": [1, 60]}
    paper |= {"continuous_step": 0.1, "integer_step": 1}
    told = CONFIG["recording"] | CONFIG["fit"]
    assert paper.items() <= told.items()
    assert [told[f"{name}_range"][1] for name in ("amplitude", "vertical_spread")] == [1.5, 1.0]


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("preprocessing.windw", 84, "there is no such key; did you mean window?"),
        ("zzz", 1, "zzz: there is no such key; allowed here: detectors, diagonal"),
        ("fit.particles", 0, "must be a whole number, at least 1, at most 1000000"),
        ("fit.continuous_step", "1e-3", "(this is text; write 0.001)"),
        ("fit", 3, "fit: 3 is not allowed; must be a section with the keys seed, particles"),
        ("evaluation.confidence", 1, "must be a number, more than 0, less than 1"),
        ("evaluation.schemes", ["loo"], "each one of leave_one_out, resubstitution"),
        ("evaluation.held_out", [datetime.date(2024, 6, 3)], "twice (put it in quotes)"),
        ("recordings_per_job", "all", "must be auto or a whole number, at least 1, at most 1000"),
        ("report.lead", "taugt", "must be one of best, template, diagonal, taught"),
        ("preprocessing.window", 1001, "more than preprocessing.length, which is 1000"),
        ("fit.peak_spacing_range", [100, 300], "column 1050; preprocessing.length is only 1000"),
        ("recording.sensors", 5, "is only 1000; set preprocessing.length: 1250"),
        ("fit.amplitude_range", [1.5, 0.1], "1.5 is above 0.1"),
        ("fit.amplitude_range", [1.5], "must be a list of 2, each a number"),
        ("fit.first_peak", 251, "the last of 4 peaks could be at column 1001;"),
        ("fit.first_peak", 1200, "fit.first_peak: with first_peak 1200, the last of 4 peaks"),
        ("recording.max_gap_s", 5, "at most 4.2 s are allowed"),
        ("diagonal.wave_speed_mm_s", 1000, "lasts 0.8 samples at 10 Hz; at least 10 are needed"),
    ],
)
def test_a_fault_names_the_key_the_value_and_what_is_allowed(path, value, fault):
    text = message(changed(path, value))
    assert text.startswith("the configuration cannot be used:\n  config/config.yaml: ")
    assert fault in text


def test_ranges_may_be_one_number_and_the_last_peak_may_be_in_the_last_column():
    for path, value in (("fit.peak_spacing_range", [250, 250]), ("fit.first_peak", 250)):
        config = changed(path, value)
        assert check_configuration(config, SCHEMA, {"config/config.yaml": CONFIG}) == config


def test_all_faults_are_told_at_once_each_with_the_last_source_that_sets_the_value():
    config = changed("fit.particles", 0)
    config["preprocessing"]["window"] = "wide"
    del config["fit"]["seed"]
    few = {"fit": {"particles": 0}}
    for source in ("mine.yaml", "--config"):
        _, *lines = message(config, **{"mine.yaml": few, "--config": {}, source: few}).splitlines()
        assert len(lines) == 3
        assert [line.split(": ")[0] for line in lines if "fit.particles" in line] == [f"  {source}"]
        assert "  config/config.yaml: fit.seed: is missing" in lines


def keys_with_values():
    """Yield every key that holds a value, with its part of the schema."""
    for section, part in SCHEMA["properties"].items():
        for name, inner in part.get("properties", {"": part}).items():
            if "$ref" in inner:
                inner = SCHEMA["$defs"][inner["$ref"].rsplit("/", 1)[1]] | inner
            if "oneOf" in inner:
                # A number, or a word in its place.
                _, inner = inner["oneOf"]
            yield f"{section}.{name}" if name else section, inner


# What no key takes, and what only a key of this type may take.
NEVER = [None, float("nan"), float("inf"), [[]], 1j, {}]
TYPES = {"string": "text", "boolean": True, "array": []}
ENDS = {"minimum": -1, "exclusiveMinimum": 0, "maximum": 1, "exclusiveMaximum": 0}


def faulty_values(part, value):
    """Yield values that a key must not take: of each other type, and beyond each limit."""
    kind = part.get("type")
    yield from NEVER
    yield from (each for name, each in TYPES.items() if name != kind)
    if kind == "array":
        yield from ([item] * len(value) for item in faulty_values(part["items"], value[0]))
        yield [*value, value[-1]]
        yield from [[]] if "minItems" in part else []
    if kind == "integer":
        yield from (float(value), value + 0.5)
    if kind in ("integer", "number"):
        limits = [part[name] + step for name, step in ENDS.items() if name in part]
        assert len(limits) == 2, "each number has a limit on both sides"
        yield from (str(value), *limits)


@pytest.mark.parametrize(("key", "part"), list(keys_with_values()), ids=str)
def test_every_key_is_missed_misspelt_and_refused_with_the_right_name_and_what_is_allowed(
    key, part
):
    *sections, name = key.split(".")
    if "default" in part:
        # A configuration of an earlier version need not have it.
        used = check_configuration(changed(key, GONE), SCHEMA, {"config/config.yaml": CONFIG})
        assert used[sections[0]][name] == part["default"]
    else:
        assert f"\n  config/config.yaml: {key}: is missing" in message(changed(key, GONE))
    told = message(changed(key + "s", 1))
    assert f"{key}s: there is no such key; did you mean {name}?" in told
    value = CONFIG
    for each in key.split("."):
        value = value[each]
    for wrong in faulty_values(part, part["minimum"] if value == "auto" else value):
        config = changed(key, wrong)
        text = message(config, **{"mine.yaml": config})
        assert f"\n  mine.yaml: {key}: {repr(wrong)[:57]}" in text
        assert "is not allowed; must be " in text
        assert text.count("\n") == 1


def test_the_values_that_a_later_configuration_changes_are_found():
    first = {"list": [1, 2], "part": {"a": 1, "b": 2}, "same": {"a": 1}, "gone": {"a": 1}}
    last = {"list": [2, 1], "part": {"a": 1, "b": 3}, "same": {"a": 1}, "gone": 1, "new": None}
    differing = {"list": [2, 1], "part": {"b": 3}, "gone": 1, "new": None}
    assert changed_values(first, last) == differing


def test_a_key_of_an_earlier_version_is_accepted_without_effect_and_each_is_told():
    config = copy.deepcopy(CONFIG)
    config["detectors"].insert(1, "template_threshold")
    config["taught"]["penalties"] = [1.0, 0.1]
    config["evaluation"] |= {"bootstrap": 1000, "permutations": "any"}
    config["evaluation"]["groups"] = ["site", "session"]
    config["report"]["max_megabytes"] = 25
    written = copy.deepcopy(config)
    used = check_configuration(config, SCHEMA, {"config/config.yaml": config})
    assert used == changed("evaluation.groups", ["session"])
    assert config == written
    gone = ["detectors: template_threshold", "taught.penalties", "evaluation.groups: site"]
    gone += ["evaluation.bootstrap", "evaluation.permutations", "report.max_megabytes"]
    told = [f"{each} has no effect any more; remove it" for each in gone]
    assert without_effect(config, SCHEMA) == told
    for other in (CONFIG, CONFIG | {"evaluation": None}):
        assert without_effect(other, SCHEMA) == []
