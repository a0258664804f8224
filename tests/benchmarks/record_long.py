"""Record for a day on a line that is lost a hundred times, and count samples and memory.

    python tests/benchmarks/record_long.py --hours 24 --lost 100

The recorder, its file and its log are real; the serial line and the clock follow a script, so a day
takes less than a minute. The board restarts after each loss, as an Arduino does when its port is
opened.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from itertools import repeat
from pathlib import Path

import psutil
import pytest
from tables import table

from capsule.bench.bench_errors import LineLostError
from support.bench.scripted import ScriptedBench, sample_frame

RATE_HZ = 10
# Samples that no line carries while the board is away.
AWAY = 30


def script(samples: int, lost: int, seen: dict) -> Iterator[tuple[float, bytes | Exception]]:
    """Yield what arrives and when; count in ``seen`` what was sent, and look at the memory."""
    between, since = samples // (lost + 1), 0
    number = 0
    while number < samples:
        if number - since == between:
            yield number / RATE_HZ, LineLostError()
            number += AWAY
            since = number
        if number % (samples // 8) == 0:
            seen["memory_mb"].append(psutil.Process().memory_info().rss / 1e6)
        seen["sent"] += 1
        yield number / RATE_HZ, sample_frame(number, 100 * (number - since), number - since)
        number += 1


def main() -> None:
    """Record, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--lost", type=int, default=100, help="how often the line is lost")
    options = parser.parse_args()
    samples = round(options.hours * 3600 * RATE_HZ)
    seen = {"sent": 0, "memory_mb": []}
    with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as folder:
        bench = ScriptedBench(Path(folder), patch)
        bench.answers, bench.away_s = repeat({}), (AWAY - 1) / RATE_HZ
        begun = time.process_time()
        bench.run(script(samples, options.lost, seen))
        cpu_s = time.process_time() - begun
        rows = bench.rows()
    kept = sum(1 for row in rows if row[1])
    late = sum(1 for row in rows if row[1] and int(row[1]) != round(float(row[0]) * RATE_HZ) % 1024)
    row = {
        "hours": f"{options.hours:g}",
        "times lost": str(options.lost),
        "sent": str(seen["sent"]),
        "kept": str(kept),
        "rows": str(len(rows)),
        "memory, MB": " ".join(f"{each:.0f}" for each in seen["memory_mb"]),
        "CPU, us a sample": f"{1e6 * cpu_s / seen['sent']:.0f}",
        "whose time is not their own": str(late),
    }
    print(table([row]))


if __name__ == "__main__":
    main()
