"""Put together the page's section on surveys from each survey's stored results."""

from collections.abc import Mapping, Sequence

from capsule.kinds import Cells, Row
from capsule.page.packing import to_json


def page_values(surveys: Sequence[Row], passed_over: Mapping[str, str]) -> Cells:
    """Return the values of the page's section on surveys.

    Parameters
    ----------
    surveys : sequence of mapping
        Each survey's results (``survey.json``) and its ``pictures``; only ``name`` and ``problem``
        for a survey that cannot be read.
    passed_over : mapping of str to str
        Folders that are not a finished survey, and why.

    Returns
    -------
    dict
        ``shown``, for each survey what `capsule.page.survey_words.survey_values` returns,
        ``pictures`` and ``data`` (JSON for the page's scripts); ``problems``, pairs of a name and
        a reason; ``any_simulated``.
    """
    readable = [survey for survey in surveys if "problem" not in survey]
    problems = [(each["name"], each["problem"]) for each in surveys if "problem" in each]
    return {
        "shown": [_shown(survey) for survey in readable],
        "problems": [*problems, *passed_over.items()],
        "any_simulated": any(survey["simulated"] for survey in readable),
    }


def _shown(survey: Row) -> Cells:
    carried = ("title", "places", "frames", "player")
    return {
        **{name: value for name, value in survey.items() if name not in ("player", "frames")},
        "data": to_json({name: survey[name] for name in carried}),
    }
