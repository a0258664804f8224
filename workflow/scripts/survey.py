"""Draw one survey, for the report and for print, with the values that the page shows."""

import argparse
import json
from pathlib import Path

import pandas as pd

from capsule.engine.jobs import run
from capsule.figures.draw_survey import draw_note, draw_survey, frame_of, track_table
from capsule.figures.style import render_figure
from capsule.page.surveys import player, survey_values, title_of
from capsule.store import files
from capsule.store.results import SURVEY_VALUES
from capsule.survey.files import SessionError, read_session
from capsule.survey.listed import refuse_changed
from capsule.survey.track import crest_at_mm, pins_of, track_of


def main() -> None:
    """Read the survey, and write the picture, its data and the values for the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--session", type=Path, required=True, help="the survey's folder")
    parser.add_argument("--content", required=True, help="the checksum of the survey's files")
    parser.add_argument("--settings", type=json.loads, required=True, help="section diagonal, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder")
    arguments = parser.parse_args()
    output, name = arguments.output, arguments.session.name
    detector = arguments.settings["diagonal"]
    refuse_changed(arguments.session, arguments.content)
    try:
        session = read_session(arguments.session)
    except SessionError as error:
        print(f"{name}: {error}")
        content = {"name": name, "problem": str(error)}
        table = pd.DataFrame([{"problem": str(error)}])
        figure = draw_note(f"{name} cannot be read: {error}")
    else:
        track, pins = track_of(session), pins_of(session)
        crest_mm = crest_at_mm(session, detector)
        content = survey_values(session, track, pins)
        content["player"] = player(session, track)
        wave = detector["wavelength_mm"], crest_mm
        table = track_table(track)
        figure = draw_survey(session, title_of(session), track, pins, wave)
    # A survey that was changed after the first look may have been read.
    refuse_changed(arguments.session, arguments.content)
    for kind in ("pdf", "svg"):
        with files.write_whole(output / f"picture.{kind}", "wb") as stream:
            stream.write(render_figure(figure, kind, name))
    content["frame"] = frame_of(figure)
    cells = table.itertuples(index=False, name=None)
    files.write_cells(output / "picture.csv", list(table), cells)
    files.write_json(output / SURVEY_VALUES, content)


if __name__ == "__main__":
    run(main)
