"""Measure how often noise passes as a wave, and how often a wave is missed (docs/robustness.md).

    python tests/benchmarks/measure_wave_check.py --folders FOLDER ...

Folders hold recordings of other benches, as for judge_unseen.py.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parents[2] / "workflow" / "scripts"))

from judge_report import table
from judge_unseen import USUAL, simulated, stored

from capsule.configuration_files import read_config_file
from capsule.number_arguments import natural
from capsule.phantom.files import BENCHES
from capsule.project import CONFIG
from capsule.seeding import generator
from capsule.wave_check import missing_wave

SAMPLES = 420


def white(numbers: np.random.Generator) -> np.ndarray:
    """Return white noise of four sensors, (4, K), of any strength."""
    return numbers.normal(500, numbers.uniform(0.5, 60), (4, SAMPLES)).round()


def last_bit(numbers: np.random.Generator) -> np.ndarray:
    """Return sensors of which only the last bit toggles."""
    return 500.0 + (numbers.random((4, SAMPLES)) < 0.5)


def walk(numbers: np.random.Generator) -> np.ndarray:
    """Return sensors that drift at random."""
    steps = numbers.normal(0, numbers.uniform(0.3, 6), (4, SAMPLES))
    return np.clip(500 + steps.cumsum(axis=1), 0, 1023).round()


def slow(numbers: np.random.Generator) -> np.ndarray:
    """Return noise whose neighbouring samples are alike."""
    alike = numbers.uniform(0.5, 0.99)
    noise = lfilter([1], [1, -alike], numbers.normal(0, 8, (4, 200 + SAMPLES)), axis=1)
    return (500 + noise[:, 200:]).round()


def hum(numbers: np.random.Generator) -> np.ndarray:
    """Return slow noise that all channels share, such as that of the supply."""
    return (slow(numbers)[:1] + numbers.normal(0, 1, (4, SAMPLES))).round()


NOISE = {
    "white noise": white,
    "a toggling last bit": last_bit,
    "a random walk": walk,
    "slow noise": slow,
    "slow noise that all channels share": hum,
}


def main() -> None:
    """Print how many recordings pass."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folders", type=Path, nargs="*", default=[], metavar="FOLDER")
    parser.add_argument("--runs", type=natural, default=2000, metavar="N", help="of each noise")
    parser.add_argument("--archives", type=natural, default=4, metavar="N", help="of each bench")
    arguments = parser.parse_args()
    config = read_config_file(CONFIG / "config.yaml")
    rules, bench = config["recording"], config["diagonal"]

    def passes(values: np.ndarray) -> bool:
        return not missing_wave(values, rules["rate_hz"], bench, rules["wave_false_rate"])

    usual = list(next(simulated(USUAL, 1)).values())
    rows = []
    for what, noise in NOISE.items():
        made = [noise(generator(1, what, str(run))) for run in range(arguments.runs)]
        alone = [passes(values) for values in made]
        row = {"readings": f"{what}, on all sensors", "recordings": str(len(made))}
        rows.append(row | {"judged": f"{100 * np.mean(alone):.1f} %"})
        if noise is hum:
            continue
        beside = []
        for run, values in enumerate(made):
            mixed = usual[run % len(usual)][:, :SAMPLES].copy()
            mixed[run % 4] = values[run % 4, : mixed.shape[1]]
            beside.append(passes(mixed))
        row = {"readings": f"{what}, on one sensor of four", "recordings": str(len(made))}
        rows.append(row | {"judged": f"{100 * np.mean(beside):.1f} %"})
    benches = {name: simulated(name, arguments.archives) for name in [USUAL, *_benches()]}
    benches |= {folder.name: stored(folder) for folder in arguments.folders}
    for name, archives in benches.items():
        real = [passes(values) for archive in archives for values in archive.values()]
        row = {"readings": f"the simulated bench {name}", "recordings": str(len(real))}
        rows.append(row | {"judged": f"{100 * np.mean(real):.1f} %"})
    print(table(rows))


def _benches() -> list[str]:
    return sorted(path.stem for path in BENCHES.glob("*.yaml"))


if __name__ == "__main__":
    main()
