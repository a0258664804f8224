"""What the tables of the benchmarks show of archives, the same for every detector."""

import numpy as np


def rates(sizes: np.ndarray, predicted: np.ndarray) -> dict[str, float]:
    """Give what a table shows of one archive, detection and size apart."""
    detected, large = predicted > 0, sizes >= 2
    error = np.abs(predicted - sizes)
    specificity = float(np.mean(~detected[sizes == 0]))
    return {
        "specificity": specificity,
        "recall at 1 mm": float(np.mean(detected[sizes == 1])),
        "recall from 2 mm": float(np.mean(detected[large])),
        "within 1 mm, from 2 mm": float(np.mean((error[large] <= 1) & detected[large])),
        "balanced accuracy": (specificity + float(np.mean(detected[sizes > 0]))) / 2,
        "size error, from 2 mm (mm)": float(np.mean(error[large])),
    }


def mean_or_unknown(values: np.ndarray) -> float:
    """Average what is known; NaN where nothing is."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else float("nan")


def table(rows: list[dict]) -> str:
    """Write rows as a Markdown table; shares in per cent."""
    columns = list(dict.fromkeys(key for row in rows for key in row))

    def cell(key: str, value: object) -> str:
        if value is None or isinstance(value, str):
            return value or ""
        plain = "mm)" in key or "seconds" in key or "AUC" in key
        return f"{value:.3f}" if plain else f"{100 * value:.1f} %"

    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(cell(k, row.get(k)) for k in columns) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def mean_row(label: dict, rows: list[dict]) -> dict:
    """Average the rows of several archives."""
    return label | {key: mean_or_unknown(np.array([row[key] for row in rows])) for key in rows[0]}


def error_row(label: dict, rows: list[dict]) -> dict:
    """Give the standard error of what `mean_row` gives: how much is the luck of the archives."""
    return label | {
        key: float(np.nanstd([row[key] for row in rows], ddof=1)) / len(rows) ** 0.5
        for key in rows[0]
        if key != "seconds"
    }
