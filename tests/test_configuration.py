import copy
import json
from pathlib import Path

import pytest
import yaml

from capsule.configuration import check_configuration
from capsule.errors import CapsuleError

ROOT = Path(__file__).parents[1]
SCHEMA = json.loads((ROOT / "workflow/schemas/config.schema.json").read_text(encoding="utf-8"))
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))


def changed(path, value):
    config = copy.deepcopy(CONFIG)
    *sections, key = path.split(".")
    place = config
    for section in sections:
        place = place[section]
    if value is None:
        del place[key]
    else:
        place[key] = value
    return config


def message(config):
    with pytest.raises(CapsuleError) as caught:
        check_configuration(config, SCHEMA, "config/config.yaml")
    return str(caught.value)


def test_the_configuration_holds_the_papers_numbers():
    check_configuration(CONFIG, SCHEMA, "config/config.yaml")
    assert CONFIG["recording"]["sensors"] == 4
    assert CONFIG["recording"]["rate_hz"] == 10
    assert CONFIG["preprocessing"] == {"window": 84, "threshold": 1.0, "length": 1000}
    fit = CONFIG["fit"]
    assert (fit["particles"], fit["iterations"], fit["first_peak"]) == (2000, 2000, 150)
    assert fit["peak_spacing_range"] == [100, 250]
    assert fit["horizontal_spread_range"] == [1, 60]
    assert (fit["amplitude_range"][1], fit["vertical_spread_range"][1]) == (1.5, 1.0)
    assert (fit["continuous_step"], fit["integer_step"]) == (0.1, 1)


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        (
            "preprocessing.windw",
            84,
            "preprocessing.windw: there is no such key; did you mean window",
        ),
        ("zzz", 1, "zzz: there is no such key; known here: evaluation, fit"),
        ("fit.particles", None, "fit.particles: is missing"),
        ("fit.particles", "many", "fit.particles: 'many' is not allowed; must be of type integer"),
        ("fit.particles", 2000.5, "fit.particles: 2000.5 is not allowed"),
        ("fit.particles", 0, "fit.particles: 0 is not allowed; must be at least 1"),
        ("evaluation.tolerance_mm", -1, "evaluation.tolerance_mm: -1 is not allowed"),
        ("evaluation.confidence", 1, "must be less than 1"),
        ("evaluation.schemes", ["loo"], "must be one of leave_one_out, resubstitution"),
        ("on_rejected", "stop", "must be one of report, fail"),
        ("preprocessing.window", 1001, "1001 samples are more than preprocessing.length, 1000"),
        ("fit.peak_spacing_range", [100, 300], "peaks could lie at column 1050"),
        ("fit.amplitude_range", [1.5, 0.1], "1.5 is above 0.1"),
        ("fit.amplitude_range", [1.5], "must be a list of at least 2"),
        ("recording.max_gap_s", 5, "allowed is at most 4.2 s"),
    ],
)
def test_a_fault_names_the_key_the_value_and_what_is_allowed(path, value, fault):
    text = message(changed(path, value))
    assert text.startswith("config/config.yaml cannot be used:")
    assert fault in text


def test_all_faults_are_told_at_once():
    config = changed("fit.particles", 0)
    config["preprocessing"]["window"] = "wide"
    assert message(config).count("\n  ") == 2
