"""Read what figures show."""

from capsule.detectors.files import read_templates
from capsule.engine.project import PROJECT
from capsule.evaluation.files import read_evaluation, read_printed, read_table
from capsule.kinds import Settings
from capsule.method.preprocessing import PreprocessedRun, preprocess_run
from capsule.store import files
from capsule.store.results import OfArchive, Results


class FigureInputs:
    """The results of a run of the workflow.

    Attributes
    ----------
    evaluation : Evaluation
        The rates of this project and of the paper.
    learning : DataFrame
        The rates that the detectors reach with parts of the archive.
    templates : dict of float to (S, L) array
        The template of every size in mm; size 0 is the first.
    template_counts : list of int
        The number of recordings behind each template.
    """

    def __init__(self, results: Results, settings: Settings) -> None:
        self._results, self.settings, folder = results, settings, results.folder
        printed = read_printed(PROJECT / "workflow" / "report" / "paper.yaml")
        self.evaluation = read_evaluation(folder, printed, settings["evaluation"]["confidence"])
        self.learning = read_table(folder / OfArchive.LEARNING)
        self.templates = read_templates(folder / OfArchive.TEMPLATES)
        told = files.read_or_explain(folder / OfArchive.TEMPLATE_PARAMETERS, files.read_json)
        self.template_counts = [entry["recordings"] for entry in told["templates"]]

    def run(self, name: str, title: str) -> PreprocessedRun:
        """Return an accepted recording after each stage of pre-processing."""
        shape = self.settings["preprocessing"]
        return preprocess_run(
            name,
            title,
            self._results.signal(name),
            rate_hz=self.settings["recording"]["rate_hz"],
            window=shape["window"],
            threshold=shape["threshold"],
        )
