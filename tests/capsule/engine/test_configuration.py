"""A configuration is read and checked; each fault is told with its place."""

import copy
import datetime
import json
import math
import re

import pytest
import yaml

from capsule.engine import configuration
from capsule.errors import CapsuleError
from support.project import ROOT

SCHEMA = configuration.read_schema(ROOT / "workflow/schemas/config.schema.json")
GONE = object()
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("text", ["a: {b: 1}\n", '{"a": {"b": 1}}', "\ufeffa:\r\n  b: 1\r\n"])
def test_yaml_and_json_are_read(tmp_path, text):
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    assert configuration.read_config_file(tmp_path / "c.yaml") == {"a": {"b": 1}}


def test_what_is_no_configuration_is_told_with_the_file_and_the_line(tmp_path):
    path = tmp_path / "c.yaml"
    for content, fault in (
        (None, ": No such file or directory"),
        (b"", ": this file is empty"),
        (b"- 1\n- 2\n", ": this file holds a list instead of keys"),
        (b"fit: [1, 2\n", ", line 2: "),
        (b"fit: {}\nreport: {}\nfit: {}\n", ", line 3: the key 'fit' appears twice"),
        (b"fit: \xff\n", ": this is not UTF-8 text"),
        (b"fit: \x00\n", ": this is not valid YAML"),
        (b"a: &a [1]\nb: [*a, *a]\n", ", line 2: the alias *a is not allowed; write its value"),
        (b"fit:\n  seed: " + b"1" * 5000, ": a value cannot be read: "),
        (b"? [1]\n: 2\n", ", line 1: found unhashable key"),
        (b"[" * 600, ": the keys are nested too deeply"),
    ):
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(CapsuleError, match=f"^{re.escape(f'{path}{fault}')}"):
            configuration.read_config_file(path)


def changed(path, value):
    """Return the configuration with another value of a key; GONE takes the key away."""
    config = copy.deepcopy(CONFIG)
    section, _, key = path.rpartition(".")
    place = config[section] if section else config
    place[key] = value
    if value is GONE:
        del place[key]
    return config


def check(config, **sources):
    sources = {"config/config.yaml": CONFIG, **sources}
    return configuration.check_configuration(config, SCHEMA, sources)


def test_the_configuration_holds_the_papers_numbers():
    paper = {"window": 84, "threshold": 1.0, "length": 1000, "sensors": 4, "rate_hz": 10}
    paper |= {"particles": 2000, "iterations": 2000, "first_peak": 150, "integer_step": 1}
    paper |= {"peak_spacing_range": [100, 250], "horizontal_spread_range": [1, 60]}
    told = CONFIG["preprocessing"] | CONFIG["recording"] | CONFIG["fit"]
    assert (paper | {"continuous_step": 0.1}).items() <= told.items()
    assert [told[f"{name}_range"][1] for name in ("amplitude", "vertical_spread")] == [1.5, 1.0]


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("preprocessing.windw", 84, "there is no such key; did you mean window?"),
        ("zzz", 1, "zzz: there is no such key; allowed here: detectors, diagonal"),
        ("fit.particles", 0, "must be a whole number, at least 1, at most 1000000"),
        *(("fit.particles", value, f"{value} is not allowed; must be a whole number, at")
          for value in (84.0, True, None, [[]], {})),
        *(("fit.continuous_step", value, f"{value} is not allowed; must be a number, more than 0")
          for value in (math.nan, math.inf, 1j, True, 100_001)),
        ("fit.continuous_step", "1e-3", "(this is text; write 0.001)"),
        ("fit.seed", GONE, "fit.seed: is missing"),
        ("fit", 3, "fit: 3 is not allowed; must be a section with the keys seed, particles"),
        ("evaluation.confidence", 1, "must be a number, more than 0, less than 1"),
        *(("evaluation.schemes", value, "must be a list of at least 1, each one of leave_one_out, "
           "resubstitution, no value twice") for value in (["loo"], [], ["resubstitution"] * 2)),
        ("evaluation.passes", [True], "each a whole number, at least 1, at most 100, no value"),
        ("evaluation.held_out", [datetime.date(2024, 6, 3)], "twice (put it in quotes)"),
        ("diagonal.pressing_lowers_reading", 1, "1 is not allowed; must be true or false"),
        ("report.lead", 3, "report.lead: 3 is not allowed; must be text"),
        ("report.lead", "taugt", "must be one of best, template, diagonal, taught"),
        ("preprocessing.window", 1001, "more than preprocessing.length, which is 1000"),
        ("fit.peak_spacing_range", [100, 300], "column 1050; preprocessing.length is only 1000"),
        ("recording.sensors", 5, "is only 1000; set preprocessing.length: 1250"),
        ("fit.amplitude_range", [1.5, 0.1], "1.5 is above 0.1"),
        ("fit.amplitude_range", [1.5], "must be a list of 2, each a number"),
        ("fit.first_peak", 251, "the last of 4 peaks could be at column 1001;"),
        ("recording.max_gap_s", 5, "at most 4.2 s are allowed"),
        ("diagonal.wave_speed_mm_s", 1000, "lasts 0.8 samples at 10 Hz; at least 10 are needed"),
    ],
)  # fmt: skip
def test_a_fault_names_the_key_the_value_and_what_is_allowed(path, value, fault):
    with pytest.raises(CapsuleError) as caught:
        check(changed(path, value))
    first, told = str(caught.value).splitlines()
    assert first == "the configuration cannot be used:"
    assert told.startswith("  config/config.yaml: ") and fault in told


def test_ranges_may_be_one_number_and_the_last_peak_may_be_in_the_last_column():
    for change in (("fit.peak_spacing_range", [250, 250]), ("fit.first_peak", 250)):
        assert check(changed(*change)) == changed(*change)


def test_all_faults_are_told_at_once_each_with_the_last_source_that_sets_the_value():
    config, few = changed("fit.seed", GONE), {"fit": {"particles": 0}}
    config["preprocessing"]["window"], config["fit"]["particles"] = "wide", 0
    for source in ("mine.yaml", "--config"):
        with pytest.raises(CapsuleError) as caught:
            check(config, **({"mine.yaml": few, "--config": {}} | {source: few}))
        told = re.findall(r"  (\S+): (\S+):", str(caught.value))
        others = [("config/config.yaml", key) for key in ("fit.seed", "preprocessing.window")]
        assert told == [(source, "fit.particles"), *others]


def test_each_key_is_asked_for_or_has_a_default_and_each_number_limits_on_both_sides():
    parts = []
    json.loads(json.dumps(SCHEMA), object_hook=lambda part: parts.append(part) or part)
    for part in parts:
        if "properties" in part and "required" in part:
            defaults = {name for name, of in part["properties"].items() if "default" in of}
            assert {*part["required"]} == part["properties"].keys() - defaults
            assert part["additionalProperties"] is False
        if part.get("type") in ("integer", "number"):
            assert len({"minimum", "exclusiveMinimum"} & part.keys()) == 1
            assert len({"maximum", "exclusiveMaximum"} & part.keys()) == 1
    # A configuration of an earlier version, which lacks the keys with a default.
    earlier = changed("evaluation.held_out", GONE)
    del earlier["evaluation"]["groups"], earlier["taught"]["penalty"]
    assert check(earlier) == changed("evaluation.held_out", [])


def test_the_values_that_a_later_configuration_changes_are_found():
    first = {"part": {"a": 1, "b": [1, 2]}, "same": {"a": 1}, "gone": {"a": 1}}
    last = {"part": {"a": 1, "b": [2, 1]}, "same": {"a": 1}, "gone": 1, "new": None}
    differing = {"part": {"b": [2, 1]}, "gone": 1, "new": None}
    assert configuration.changed_values(first, last) == differing


def test_a_key_of_an_earlier_version_is_accepted_without_effect_and_each_is_told():
    config = copy.deepcopy(CONFIG)
    config["detectors"].insert(1, "template_threshold")
    config["taught"]["penalties"] = [1.0, 0.1]
    config["evaluation"] |= {"bootstrap": 1, "permutations": "any", "groups": ["site", "session"]}
    config["report"]["max_megabytes"] = 25
    written = copy.deepcopy(config)
    assert check(config) == changed("evaluation.groups", ["session"])
    assert config == written
    gone = ["detectors: template_threshold", "taught.penalties", "evaluation.groups: site"]
    gone += ["evaluation.bootstrap", "evaluation.permutations", "report.max_megabytes"]
    told = [f"{each} has no effect any more; remove it" for each in gone]
    assert configuration.without_effect(config, SCHEMA) == told
    for other in (CONFIG, CONFIG | {"evaluation": None}):
        assert configuration.without_effect(other, SCHEMA) == []
