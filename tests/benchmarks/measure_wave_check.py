"""Measure how often noise passes as a wave, and how often a wave is missed.

The table stands in workflow/studies/results/detection-familiar.md.

    python tests/benchmarks/measure_wave_check.py --folders FOLDER ...

Folders hold recordings of other benches, as for judge_unseen.py.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from foreign_readings import COUPLED, INDEPENDENT, SAMPLES, hum
from judge_report import table
from judge_unseen import USUAL, simulated, stored

from capsule.arguments import natural
from capsule.detectors.wave import missing_wave
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import BENCHES
from capsule.seeding import generator


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
    for what, noise in (INDEPENDENT | COUPLED).items():
        made = [noise(generator(1, what, str(run))) for run in range(arguments.runs)]
        alone = [passes(values) for values in made]
        row = {"readings": f"{what}, on all sensors", "recordings": str(len(made))}
        rows.append(row | {"judged": f"{100 * np.mean(alone):.1f} %"})
        if noise is hum or what in COUPLED:
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
