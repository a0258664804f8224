"""Read recordings, and hold an archive of them in memory, for notebooks and for estimators."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import SequenceMatcher
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeVar

import numpy as np
import pandas as pd

from capsule import words
from capsule.detectors.base import TrainingArchive
from capsule.detectors.described_recording import described
from capsule.engine.configuration import read_settings
from capsule.errors import CapsuleError
from capsule.interface.arguments import checked, refuse
from capsule.kinds import Cells, Row, Settings
from capsule.method.particle import Fit, Particle, fit_options
from capsule.method.preprocessing import preprocess_run
from capsule.method.templates import TemplateSet, build_templates, by_size, template_options
from capsule.recordings import recording
from capsule.recordings.acceptance import check_recording
from capsule.recordings.held_out import teaching
from capsule.recordings.listing import COLUMNS, NEAR_COPIES, full_list, refuse_rejected
from capsule.recordings.names import size_mm, sizes_of
from capsule.recordings.origin import places_of
from capsule.seeding import fit_generator
from capsule.store import files

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
    teaching : list of str
        The labelled recordings that are not held out (`evaluation.held_out`).
    """

    def __init__(
        self,
        rows: Sequence[Row],
        headers: Mapping[str, Row],
        readings: Mapping[str, np.ndarray],
        passed_over: pd.DataFrame,
        settings: Settings,
    ) -> None:
        self._rows = ByRecording({row["recording"]: row for row in rows})
        self.passed_over, self.settings = passed_over, dict(settings)
        self.recordings = with_nan(pd.DataFrame(rows, columns=[*COLUMNS, NEAR_COPIES]))
        self.recordings = self.recordings.set_index("recording")
        accepted = [name for name, row in self._rows.items() if row["status"] == "accepted"]
        self.readings = ByRecording({name: readings[name] for name in accepted})
        self.headers = ByRecording({name: dict(headers[name]) for name in accepted})
        seen = described(self.readings.values(), settings)
        self._described = ByRecording(zip(accepted, seen, strict=True))
        self.labelled = list(sizes_of(accepted))
        self.unlabelled = [name for name in accepted if size_mm(name) is None]
        held_out = settings["evaluation"]["held_out"]
        self.teaching = list(teaching({name: self._rows[name] for name in self.labelled}, held_out))

    def __repr__(self) -> str:
        labels = dict.fromkeys(name.partition("/")[0] for name in self.readings)
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
    def groups(self) -> np.ndarray:
        """The place of each labelled recording, (n,): a site, or recordings that are near copies.

        It is for the argument ``groups=`` of scikit-learn's splitters and of our estimators.
        """
        places = places_of(self.index(self.readings))
        return np.array([places[name] for name in self.labelled])

    @property
    def preprocess_options(self) -> Cells:
        """The arguments of `capsule.preprocess` except the readings."""
        return dict(self.settings["preprocessing"])

    @property
    def fit_options(self) -> Cells:
        """The arguments of `capsule.fit_particle` except matrix and generator."""
        return fit_options(self.settings["fit"])

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
        columns = recording.column_names(self.settings["recording"]["sensors"])
        tables = [pd.DataFrame(columns=["recording", "size_mm", *columns])]
        for name in self.readings if names is None else _listed(names):
            cells = zip(columns, [self.time_s(name), *self.readings[name]], strict=True)
            size = float("nan") if (known := size_mm(name)) is None else known
            tables.append(pd.DataFrame({"recording": name, "size_mm": size, **dict(cells)}))
        return pd.concat(tables[1:] or tables, ignore_index=True)

    def plot(self, name: str) -> "Figure":
        """Draw a recording: readings, envelope and matrix over time in s.

        The title tells the true size. A line marks where sensor 1 passes the best candidate for a
        nodule, which a healthy recording has too.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from capsule.figures.draw_signals import draw_judged  # matplotlib only if it is used

        shape, rate_hz = self.settings["preprocessing"], self.settings["recording"]["rate_hz"]
        title = f"{name}, true size: {words.size(size_mm(name))}"
        options = {key: shape[key] for key in ("window", "threshold")}
        run = preprocess_run(name, title, self.readings[name], rate_hz=rate_hz, **options)
        place_s = float("nan")
        if not self._rows[name]["no_verdict"]:
            place_s = self._described[name].passage.location_samples / rate_hz
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
        return LoadedArchive(rows, self.headers, self.readings, self.passed_over, self.settings)

    def index(self, names: Iterable[str]) -> dict[str, Row]:
        """Return the rows of some accepted recordings, in the workflow's order (by checksum)."""
        rows = sorted((self._rows[name] for name in names), key=lambda row: row["readings_sha256"])
        return {row["recording"]: row for row in rows}

    def teaching_rows(self, left_out: Collection[str]) -> np.ndarray:
        """Return the rows of `X` that teach when some recordings are left out.

        A recording that no detector can judge does not teach.
        """
        rows = [self._rows[name] for name in self.labelled]
        teach = [not row["no_verdict"] and row["recording"] not in left_out for row in rows]
        return np.flatnonzero(teach)

    def training_archive(self) -> TrainingArchive:
        """Return the training data of the configured detectors; the first call makes all fits."""
        index = self.index(self.readings)
        return TrainingArchive(
            sizes_of(index),
            self._described,
            self.templates,
            self._particles,
            self.settings,
            no_verdict={name: row["no_verdict"] for name, row in index.items()},
            places=places_of(index),
        )

    @cached_property
    def _particles(self) -> dict[str, Particle]:
        index = self.index(name for name in self.labelled if size_mm(name))
        index = teaching(index, self.settings["evaluation"]["held_out"])
        usable = [name for name, row in index.items() if not row["no_verdict"]]
        return {name: self._described[name].fit.particle for name in usable}


def load(
    raw: str | Path = "raw", config: str | Path | None = None, **changes: object
) -> LoadedArchive:
    """Read, check and pre-process all recordings under a folder, as the workflow does.

    Parameters
    ----------
    raw : str or Path
        The folder, with folders such as ``0mm``, ``2.5mm`` and ``unlabelled`` in it.
    config : str or Path, optional
        A configuration file. The default is ``config/config.yaml`` beside the folder; if that file
        does not exist, the configuration that ships with the library.
    **changes
        Other values for keys of the configuration; a dict changes keys of a section, as in
        ``load(fit={"iterations": 500})``.

    Returns
    -------
    LoadedArchive

    Raises
    ------
    CapsuleError
        The folder or the configuration cannot be used. A recording that cannot be used raises no
        error: it is listed with the reason.
    """
    if not isinstance(raw, str | Path):
        raise refuse("raw", raw, "a path to a folder of recordings")
    folder = Path(raw)
    beside = folder.resolve().parent / "config" / "config.yaml"
    settings = read_settings(beside if config is None and beside.exists() else config, **changes)
    archive = files.list_archive(folder)
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    checks, readings = {}, {}
    for name in archive.recordings:
        content = files.read_limited(folder / f"{name}.csv", max_bytes)
        checks[name], readings[name], _ = check_recording(name, content, max_bytes, settings)
    rows = full_list(archive, checks, readings.__getitem__)
    if settings["on_rejected"] == "fail":
        refuse_rejected(rows)
    headers = {name: check["header"] for name, check in checks.items()}
    passed_over = pd.DataFrame(archive.passed_over.items(), columns=["path", "reason"])
    return LoadedArchive(rows, headers, readings, passed_over, settings)


@checked
def read_recording(
    stream: str | Path | BinaryIO, sensors: int, max_bytes: int = 16_000_000
) -> recording.Recording:
    """Read a recording of `sensors` sensors from a path, or from a file that is open for reading.

    Raises
    ------
    CapsuleError
        The file cannot be read, is larger than `max_bytes`, or is no recording.
    """
    if isinstance(stream, str | Path):
        try:
            with Path(stream).open("rb") as opened:
                return recording.read_recording(opened, sensors, max_bytes)
        except OSError as error:
            raise CapsuleError(f"{stream}: it cannot be read: {error.strerror}") from None
    if not hasattr(stream, "read"):
        raise refuse("stream", stream, "a path, or a file that is open for reading")
    return recording.read_recording(stream, sensors, max_bytes)


def require_archive(archive: object) -> None:
    """Refuse anything but an archive."""
    if not isinstance(archive, LoadedArchive):
        raise refuse("archive", archive, "what capsule.load returns")


def _listed(names: Iterable[str]) -> Iterable[str]:
    return [names] if isinstance(names, str) else names


def with_nan(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose unknown values are NaN, as in a table that pandas reads."""
    return pd.DataFrame(
        {name: [np.nan if cell in (None, "") else cell for cell in table[name]] for name in table}
    )
