"""Hold an archive of recordings in memory, for notebooks and for teaching detectors."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np

from capsule.detectors.registry import detector_row
from capsule.detectors.training import TrainingArchive
from capsule.errors import CapsuleError
from capsule.fitting import Fit
from capsule.held_out import teaching
from capsule.interface.described import DescribedRecording, JudgingSettings
from capsule.interface.frames import frame
from capsule.interface.sample_rows import as_rows
from capsule.kinds import Cells, Row, Settings
from capsule.listing import COLUMNS, NEAR_COPIES
from capsule.naming import folder_size_mm, size_mm, sizes_of
from capsule.particles import ParameterSpace, Particle
from capsule.places import places_of
from capsule.seeding import fit_generator
from capsule.templates import TemplateSet, build_templates


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
    matrices : dict of str to (S, L) array
        V of each accepted recording (the paper's Eq. 6).
    headers : dict of str to dict
        The ``# key: value`` lines of each accepted recording.
    labelled, unlabelled : list of str
        The accepted recordings of known size, and the others.
    X : (n, L S) array
        `rows` of the labelled recordings, for estimators.
    y : (n,) array
        Their true sizes in mm, 0 for no nodule.
    """

    def __init__(
        self,
        rows: Sequence[Row],
        checks: Mapping[str, Row],
        readings: Mapping[str, np.ndarray],
        passed_over: Mapping[str, str],
        settings: Settings,
    ) -> None:
        self._rows = {row["recording"]: row for row in rows}
        self._checks, self.settings = checks, dict(settings)
        accepted = [name for name, row in self._rows.items() if row["status"] == "accepted"]
        judging = JudgingSettings(settings)
        self._described = {n: DescribedRecording(readings[n], judging) for n in accepted}
        self.readings = {name: readings[name] for name in accepted}
        self.headers = {name: dict(checks[name]["header"]) for name in accepted}
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
            f"<{type(self).__name__}: {len(self.readings)} recordings accepted "
            f"({', '.join(labels)}), {rejected} rejected>"
        )

    def __len__(self) -> int:
        return len(self.readings)

    @cached_property
    def matrices(self) -> dict[str, np.ndarray]:
        """V of each accepted recording, (S, L)."""
        return {name: each.matrix for name, each in self._described.items()}

    @cached_property
    def X(self) -> np.ndarray:
        """The readings of the labelled recordings as estimators take them, (n, L S)."""
        return self.rows(self.labelled)

    @property
    def y(self) -> np.ndarray:
        """True sizes of the labelled recordings in mm, (n,)."""
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
        return {
            "sensors": self.settings["recording"]["sensors"],
            "first_peak": self.settings["fit"]["first_peak"],
            "length": self.settings["preprocessing"]["length"],
        }

    def rows(self, names: Iterable[str]) -> np.ndarray:
        """Return the readings of some accepted recordings as rows for estimators.

        Returns
        -------
        (n, L S) array
            One row per recording, sample after sample as in its file, with NaN after the last.
            Missing samples at the very end of a recording are lost here.
        """
        sensors = self.settings["recording"]["sensors"]
        length = self.settings["preprocessing"]["length"]
        return as_rows([self.readings[name] for name in names], sensors, length)

    def time_s(self, name: str) -> np.ndarray:
        """Return the time of each reading of a recording in seconds, (K,)."""
        rate_hz: float = self.settings["recording"]["rate_hz"]
        return np.arange(self.readings[name].shape[1]) / rate_hz

    def generator(self, name: str) -> np.random.Generator:
        """Return the random generator for a recording's fit, as the workflow uses it."""
        return fit_generator(self.settings["fit"]["seed"], self.readings[name])

    def fit(self, name: str) -> Fit:
        """Return the particle that is most similar to a recording, with its RMSE."""
        if name not in self._described:
            raise CapsuleError(
                f"{name}: this archive has no such accepted recording; archive.recordings lists all"
            )
        return self._described[name].fit

    def particles(self) -> dict[float, list[Particle]]:
        """Return the fitted particles by the size of their recordings, for `build_templates`.

        The first call fits each recording of a nodule that shows a wave; each takes some 0.2 s.
        """
        groups: dict[float, list[Particle]] = {}
        sizes_mm = sizes_of(self._particles)
        for name, particle in self._particles.items():
            groups.setdefault(sizes_mm[name], []).append(particle)
        return groups

    @cached_property
    def templates(self) -> TemplateSet:
        """The template of each size, from all recordings."""
        return build_templates(self.particles(), **self.template_options)

    def select(self, names: Iterable[str]) -> "LoadedArchive":
        """Return an archive of some of the recordings, such as ``archive.labelled[::5]``."""
        wanted = set(names)
        unknown = sorted(wanted - self._rows.keys())
        if unknown:
            raise CapsuleError(
                f"{unknown[0]}: this archive has no such recording; archive.recordings lists all"
            )
        rows = [dict(row) for name, row in self._rows.items() if name in wanted]
        for row in rows:
            others = [other for other in row[NEAR_COPIES].split() if other in wanted]
            row[NEAR_COPIES] = " ".join(others)
        return LoadedArchive(rows, self._checks, self.readings, self._passed_over, self.settings)

    def index(self, names: Iterable[str]) -> dict[str, Row]:
        """Return the rows of some accepted recordings, in the workflow's order (by checksum)."""
        rows = [self._rows[name] for name in names]
        rows.sort(key=lambda row: row["readings_sha256"])
        return {row["recording"]: row for row in rows}

    def training_archive(self) -> TrainingArchive:
        """Return the training data of the configured detectors; the first call makes all fits."""
        names = [*self.labelled, *self.unlabelled]
        rows = [detector_row(name) for name in self.settings["detectors"]]
        judged = [name for name in names if not self._rows[name]["no_verdict"]]
        described = self._described
        by_features = any(row.by_features for row in rows)
        return TrainingArchive(
            sizes_of(self.index(self.labelled)),
            self.templates,
            self._particles,
            {name: described[name].passage for name in judged},
            lambda name: described[name].matrix,
            self.settings,
            {name: described[name].features for name in judged} if by_features else {},
            {name: self._rows[name]["no_verdict"] for name in names},
            places_of(self.index(names)),
            {name: described[name].traits for name in judged},
        )

    @cached_property
    def _particles(self) -> dict[str, Particle]:
        index = self.index(name for name in self.labelled if size_mm(name))
        index = teaching(index, self.settings["evaluation"]["held_out"])
        usable = [name for name, row in index.items() if not row["no_verdict"]]
        return {name: self._described[name].fit.particle for name in usable}
