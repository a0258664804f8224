"""Make a small folder of results like that of the workflow, for tests of the export."""

import numpy as np

from capsule.evaluation.columns import COLUMNS, RATES
from capsule.store.batches import batches
from capsule.store.files import write_csv, write_json
from capsule.store.results import (
    BATCH_COLUMNS,
    CHECKS,
    FITS,
    MATRICES,
    SIGNALS,
    pattern,
    write_arrays,
    write_contents,
)
from support.stored import rows_of

LENGTH = 30
# 16 digits are not enough to restore any of these numbers.
AWKWARD = (0.1 + 0.2, 1 / 3, 2 / 3 * 1e-7, -1e300 / 7)
# A text that a spreadsheet program would compute.
FORMULA = '=HYPERLINK("http://elsewhere")'
HEADER = {"source": "simulated phantom", "started": "2024-06-03T10:00:00Z", "adc_bits": "10"}
RECORDINGS = {
    "0mm/r01": (21, {**HEADER, "vref_v": "5"}),
    "3mm/r07": (LENGTH, {**HEADER, "vref_v": "5", "site": "-1+2", "wave speed": "25"}),
    "2.5mm/a-1": (17, {"source": "simulated phantom", "note": FORMULA}),
    "2.5mm/a_1": (12, {**HEADER, "started": "2024-06-03 10:00", "note": "bell \x07"}),
    "unlabelled/p": (9, {"started": "last Tuesday"}),
}
REJECTED = "3mm/flat"
_VERDICT = ["recording", "size_mm", "detector", "scheme", "predicted_mm", "rmse_0mm", "rmse_3mm"]
_VERDICT += ["score", "estimate_low_mm", "location_s"]
_LISTED = ["recording", "size_mm", "samples", "duration_s", "status", "reason", "no_verdict"]
_LISTED += ["sha256", "readings_sha256", "source", "site", "session", *BATCH_COLUMNS]


def make_results(results, most=1):
    """Write the results, and return the readings and the matrices by recording.

    Up to so many recordings stand in one batch.
    """
    generator = np.random.default_rng(1)
    made = {SIGNALS: {}, MATRICES: {}, CHECKS: {}, FITS: {}}
    rows = []
    for name, (samples, header) in RECORDINGS.items():
        values = generator.integers(0, 1023, (4, samples)).astype(float)
        values[1, 3] = np.nan
        made[SIGNALS][name] = values if "adc_bits" in header else values / 1000
        made[MATRICES][name] = generator.random((4, LENGTH)) * AWKWARD[0]
        size = "" if name.startswith("unlabelled") else float(name.partition("mm")[0])
        made[CHECKS][name] = {"recording": name, "header": header, "status": "accepted"}
        row = {"recording": name, "size_mm": size, "samples": samples, "status": "accepted"}
        row |= {"duration_s": (samples - 1) / 10, "sha256": f"{samples:064x}", "site": "007"}
        rows.append(row | {"source": header.get("source", "")})
        if size:
            fit = {"recording": name, "size_mm": size, "seed": 1, "first_peak": 5, "lag": 7}
            fit |= {"rmse_initial": 0.5, "rmse": AWKWARD[1], "accepted_moves": 3}
            made[FITS][name] = fit | {"parameters": _parameters(generator)}
    readings, matrices = dict(made[SIGNALS]), dict(made[MATRICES])
    rejected = {"recording": REJECTED, "size_mm": 3.0, "status": "rejected"}
    rows.append(rejected | {"reason": "sensor 2 is constant", "source": FORMULA})
    made[SIGNALS][REJECTED] = np.full((4, LENGTH), np.nan)
    made[CHECKS][REJECTED] = rejected | {"header": {"source": FORMULA}}
    for kind, of_kind in made.items():
        for batch, names in batches(sorted(of_kind), most).items():
            path = results / pattern(kind, alone=most == 1).format(batch=batch)
            contents = {name: of_kind[name] for name in names}
            if kind in (SIGNALS, MATRICES):
                write_arrays(path, contents)
            else:
                write_contents(path, contents, batch)
    named = rows_of([row["recording"] for row in rows], most)
    listed = [row | named[row["recording"]] for row in rows]
    _table(results / "recordings.csv", _LISTED, listed)
    _table(results / "passed_over.csv", ["path", "reason"], [])
    templates = [{"size_mm": 0.0, "recordings": 0, "parameters": None}]
    templates.append({"size_mm": 3.0, "recordings": 1, "parameters": _parameters(generator)})
    write_json(results / "templates.json", {"templates": templates})
    np.savez(results / "templates.npz", **{"0mm": np.zeros((4, 40)), "3mm": np.eye(4, 40) / 3})
    _evaluation(results)
    return readings, matrices


def _evaluation(results):
    verdict = {"recording": "3mm/r07", "size_mm": 3.0, "detector": "template"}
    verdict |= {"scheme": "leave_one_out", "predicted_mm": 3.0, "score": AWKWARD[3]}
    verdict |= {"rmse_0mm": AWKWARD[2], "rmse_3mm": float("inf"), "estimate_low_mm": AWKWARD[0]}
    _table(results / "evaluation/predictions.csv", _VERDICT, [verdict])
    rates = {"detector": "template", "size_mm": 3.0, "tp": 17, "recall": 17 / 20}
    rates |= {"recall_low": AWKWARD[1], "one_sided": True}
    for name in RATES:
        _table(results / "evaluation" / f"{name}.csv", list(rates), [rates, rates | {"tp": 3}])
    for name in COLUMNS.keys() - RATES.keys():
        _table(results / "evaluation" / f"{name}.csv", COLUMNS[name], [])
    _table(results / "evaluation/learning.csv", ["detector", "share", "rate"], [])
    _table(results / "detections.csv", _VERDICT, [])
    _table(results / "sites.csv", ["site", "detector", "passes"], [])


def _parameters(generator):
    lengths = {"amplitude": 4, "vertical_spread": 4, "peak_spacing": 3, "horizontal_spread": 4}
    return {name: generator.random(length).tolist() for name, length in lengths.items()}


def _table(path, columns, rows):
    write_csv(path, columns, [{name: row.get(name) for name in columns} for row in rows])
