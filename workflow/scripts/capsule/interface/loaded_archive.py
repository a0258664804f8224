"""Hold an archive of recordings in memory, for notebooks and for teaching detectors."""

from collections.abc import Iterable, Mapping, Sequence
from difflib import SequenceMatcher
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pandas as pd

from capsule import words
from capsule.described_recording import described, template_options, training_archive
from capsule.detectors.training import TrainingArchive
from capsule.errors import CapsuleError
from capsule.fits import by_size
from capsule.fitting import Fit
from capsule.held_out import teaching
from capsule.interface.arguments import refuse
from capsule.kinds import Cells, Row, Settings
from capsule.listing import COLUMNS, NEAR_COPIES
from capsule.naming import folder_size_mm, size_mm, sizes_of
from capsule.particles import ParameterSpace, Particle
from capsule.places import places_of
from capsule.recording import column_names
from capsule.seeding import fit_generator
from capsule.stages import preprocess_run
from capsule.templates import TemplateSet, build_templates

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_Value = TypeVar("_Value")
# As difflib.get_close_matches has it; of several names that are as near, the first is told.
_LIKE = 0.6


class UnknownRecordingError(CapsuleError, KeyError):
    """The error of a name that no recording has; a KeyError too, as of any dict."""

    # A KeyError shows its text in quotation marks.
    __str__ = Exception.__str__


class ByRecording(dict[str, _Value]):
    """A dict by recording; for an unknown name, its error tells the nearest one."""

    def __missing__(self, name: str) -> _Value:
        def likeness(other: str) -> float:
            return SequenceMatcher(None, str(name), other).ratio()

        near = max(self, key=likeness, default="")
        hint = f"did you mean {near}? " if likeness(near) > _LIKE else ""
        listed = "archive.recordings lists all, and why some were rejected"
        raise UnknownRecordingError(f"there is no recording {name}; {hint}{listed}")


class LoadedArchive:
    """The recordings in a folder such as ``raw/``, checked and pre-processed as by the workflow.

    `capsule.load` makes an archive. Slow results (the fits) are computed when first needed.

    Attributes
    ----------
    recordings : DataFrame
        One row per file, indexed by the recording's name such as ``3mm/r07``, with the columns of
        ``results/recordings.csv``. ``status`` is ``accepted`` or ``rejected``, and ``reason`` is
        the reason. ``no_verdict`` is the reason why no detector judges an accepted recording.
    passed_over : DataFrame
        Files in the folder that are not recordings, and why.
    settings : dict
        The configuration, by sections.
    readings : dict of str to (S, K) array
        Readings of each accepted recording, on an even grid in time; NaN where a sample is missing.
    headers : dict of str to dict
        The ``# key: value`` lines of each accepted recording.
    labelled, unlabelled : list of str
        The accepted recordings of known size, and the others.
    """

    def __init__(
        self,
        rows: Sequence[Row],
        checks: Mapping[str, Row],
        readings: Mapping[str, np.ndarray],
        passed_over: Mapping[str, str],
        settings: Settings,
    ) -> None:
        self._rows = ByRecording({row["recording"]: row for row in rows})
        self._checks, self.settings = checks, dict(settings)
        accepted = [name for name, row in self._rows.items() if row["status"] == "accepted"]
        self.readings = ByRecording({name: readings[name] for name in accepted})
        seen = described(self.readings.values(), settings)
        self._described = ByRecording(zip(accepted, seen, strict=True))
        self.headers = ByRecording({name: dict(checks[name]["header"]) for name in accepted})
        self.labelled = [name for name in accepted if size_mm(name) is not None]
        self.unlabelled = [name for name in accepted if size_mm(name) is None]
        self.recordings = frame([*COLUMNS, NEAR_COPIES], rows).set_index("recording")
        paths = [{"path": path, "reason": reason} for path, reason in passed_over.items()]
        self.passed_over = frame(["path", "reason"], paths)
        self._passed_over = passed_over

    def __repr__(self) -> str:
        folders = {name.partition("/")[0] for name in self.readings}
        labels = sorted(folders, key=lambda label: (folder_size_mm(label) is None, label))
        rejected = len(self._rows) - len(self.readings)
        return (
            f"<LoadedArchive: {len(self)} recordings accepted ({', '.join(labels)}), "
            f"{rejected} rejected>"
        )

    def __len__(self) -> int:
        return len(self.readings)

    @cached_property
    def matrices(self) -> ByRecording[np.ndarray]:
        """V of each accepted recording, (S, L) (the paper's Eq. 6)."""
        return ByRecording({name: each.matrix for name, each in self._described.items()})

    @cached_property
    def X(self) -> np.ndarray:
        """`rows` of the labelled recordings, for estimators, (n, L S)."""
        return self.rows(self.labelled)

    @property
    def y(self) -> np.ndarray:
        """True sizes of the labelled recordings in mm, 0 for no nodule, (n,)."""
        return np.array([size_mm(name) for name in self.labelled], dtype=np.float64)

    @property
    def preprocess_options(self) -> Cells:
        """The arguments of `capsule.preprocess` except the readings."""
        return dict(self.settings["preprocessing"])

    @property
    def fit_options(self) -> Cells:
        """The arguments of `capsule.fit_particle` except matrix and generator."""
        ranges = {key: value for key, value in self.settings["fit"].items() if key != "seed"}
        counts = {key: ranges.pop(key) for key in ("particles", "iterations", "first_peak")}
        return {**counts, "space": ParameterSpace(**ranges)}

    @property
    def template_options(self) -> Cells:
        """The arguments of `capsule.build_templates` except the particles."""
        return template_options(self.settings)

    def rows(self, names: Iterable[str]) -> np.ndarray:
        """Return the readings of some accepted recordings as rows for estimators, (n, L S).

        A row is sample after sample as in the file, with NaN after the last. Missing samples at
        the very end of a recording are lost here.
        """
        values = [self.readings[name].T.ravel() for name in _listed(names)]
        options = self.template_options
        rows = np.full((len(values), options["sensors"] * options["length"]), np.nan)
        for row, each in zip(rows, values, strict=True):
            row[: each.size] = each
        return rows

    def to_dataframe(self, names: Iterable[str] | None = None) -> pd.DataFrame:
        """Return readings as a table with a row per sample, of all accepted recordings or of some.

        The columns are ``recording``, ``size_mm`` (NaN if unknown), ``time_s`` and ``sensor_1`` to
        ``sensor_S``.
        """
        sensors = column_names(self.settings["recording"]["sensors"])[1:]
        empty = pd.DataFrame(columns=["recording", "size_mm", "time_s", *sensors])
        parts = []
        for name in self.readings if names is None else _listed(names):
            cells = dict(zip(sensors, self.readings[name], strict=True))
            size = float("nan") if (known := size_mm(name)) is None else known
            key = {"recording": name, "size_mm": size, "time_s": self.time_s(name)}
            parts.append(pd.DataFrame(key | cells))
        return pd.concat(parts, ignore_index=True) if parts else empty

    def plot(self, name: str) -> "Figure":
        """Draw a recording: readings, envelope and matrix over time in s.

        The title tells the true size. A line marks where sensor 1 passes the best candidate for a
        nodule, which a healthy recording has too.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from capsule.figures.judged_picture import draw_judged  # matplotlib only if it is used

        row, seen = self._rows[name], self._described[name]
        shape, rate_hz = self.settings["preprocessing"], self.settings["recording"]["rate_hz"]
        title = f"{name}, true size: {words.size(size_mm(name))}"
        options = {key: shape[key] for key in ("window", "threshold")}
        run = preprocess_run(name, title, self.readings[name], rate_hz=rate_hz, **options)
        place_s = float("nan") if row["no_verdict"] else seen.passage.location_samples / rate_hz
        places = {place_s: ["the search for a nodule"]} if np.isfinite(place_s) else {}
        return draw_judged(run, shape["threshold"], places)

    def time_s(self, name: str) -> np.ndarray:
        """Return the time of each reading of a recording in seconds, (K,)."""
        rate_hz: float = self.settings["recording"]["rate_hz"]
        return np.arange(self.readings[name].shape[1]) / rate_hz

    def generator(self, name: str) -> np.random.Generator:
        """Return the random generator for a recording's fit, as the workflow uses it."""
        return fit_generator(self.settings["fit"]["seed"], self.readings[name])

    def fit(self, name: str) -> Fit:
        """Return the particle that is most similar to a recording, with its RMSE."""
        return self._described[name].fit

    def particles(self) -> dict[float, list[Particle]]:
        """Return the fitted particles by the size of their recordings, for `build_templates`.

        The first call fits each recording of a nodule that shows a wave; each takes some 0.2 s.
        """
        return by_size(self._particles)

    @cached_property
    def templates(self) -> TemplateSet:
        """The template of each size, from all recordings."""
        return build_templates(self.particles(), **self.template_options)

    def select(self, names: Iterable[str]) -> "LoadedArchive":
        """Return an archive of some of the recordings, such as ``archive.labelled[::5]``."""
        wanted = {self._rows[name]["recording"] for name in _listed(names)}
        rows = [dict(row) for name, row in self._rows.items() if name in wanted]
        for row in rows:
            others = [other for other in row[NEAR_COPIES].split() if other in wanted]
            row[NEAR_COPIES] = " ".join(others)
        return LoadedArchive(rows, self._checks, self.readings, self._passed_over, self.settings)

    def index(self, names: Iterable[str]) -> dict[str, Row]:
        """Return the rows of some accepted recordings, in the workflow's order (by checksum)."""
        rows = sorted((self._rows[name] for name in names), key=lambda row: row["readings_sha256"])
        return {row["recording"]: row for row in rows}

    def training_archive(self) -> TrainingArchive:
        """Return the training data of the configured detectors; the first call makes all fits."""
        names = [*self.labelled, *self.unlabelled]
        no_verdict = {name: self._rows[name]["no_verdict"] for name in names}
        return training_archive(
            sizes_of(self.index(self.labelled)),
            {name: self._described[name] for name in names if not no_verdict[name]},
            self.templates,
            self._particles,
            self.settings,
            self.settings["detectors"],
            no_verdict=no_verdict,
            places=places_of(self.index(names)),
        )

    @cached_property
    def _particles(self) -> dict[str, Particle]:
        index = self.index(name for name in self.labelled if size_mm(name))
        index = teaching(index, self.settings["evaluation"]["held_out"])
        usable = [name for name, row in index.items() if not row["no_verdict"]]
        return {name: self._described[name].fit.particle for name in usable}


def require_archive(archive: object) -> None:
    """Refuse anything but an archive."""
    if not isinstance(archive, LoadedArchive):
        raise refuse("archive", archive, "what capsule.load returns")


def _listed(names: Iterable[str]) -> Iterable[str]:
    return [names] if isinstance(names, str) else names


def frame(columns: Sequence[str], rows: Iterable[Row]) -> pd.DataFrame:
    """Return rows as a table; unknown values are NaN, as in a table that pandas reads."""
    cells: dict[str, list[Any]] = {name: [] for name in columns}
    for row in rows:
        for name, values in cells.items():
            values.append(float("nan") if row[name] in (None, "") else row[name])
    return pd.DataFrame(cells, columns=list(columns))
