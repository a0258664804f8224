"""The figures: what they show, at every width, and that the bytes are always the same."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from capsule.detectors.registry import DETECTORS
from capsule.evaluation.columns import RATES
from capsule.evaluation.learning import COLUMNS as LEARNING
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import Evaluation, printed_tables
from capsule.figures import draw_rates, draw_signals, style
from capsule.method.particle import Particle, render
from capsule.method.preprocessing import preprocess_run
from capsule.store.files import read_csv
from draw import WIDTHS_IN, write_figure
from support.evaluated import RULES, read_paper
from support.synthetic import make_recording
from support.verdicts import verdicts

SCHEMES = ["leave_one_out", "resubstitution"]
SIZES = [0.0, 2.5, 6.0]
COLUMN, PAGE = style.COLUMN_WIDTH_IN, style.PAGE_WIDTH_IN


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_visible()]


def test_preprocessing_shows_a_run_without_and_one_with_a_nodule():
    values = make_recording(3, "3mm/r01", samples=400, sensors=3, spacing=110).values
    values[:, 100:110] = np.nan
    example = preprocess_run("3mm/r01", "3 mm nodule", values, rate_hz=10, window=40, threshold=1.0)
    figure = draw_signals.draw_preprocessing([None, example], 1.0, COLUMN)
    assert figure.get_figwidth() == COLUMN
    assert texts(figure).count("no such recording") == 3
    assert {"(B) 3 mm nodule", "sensor 1", "sensor 3"} <= set(texts(figure))
    # The readings of each sensor stand around its own tick.
    signal = figure.axes[1]
    middles = [np.nanmedian(line.get_ydata()) for line in signal.lines]
    assert middles == pytest.approx(list(signal.get_yticks()), abs=1e-9)
    # The bar of the matrices, which stands last, reaches its highest value.
    assert 1 < example.matrix.max() <= figure.axes[-1].get_ylim()[1]
    table = draw_signals.example_table([None, example])
    assert list(table["envelope_2"]) == list(example.envelope[1])
    assert (table["matrix_1"] >= 0).all()
    # Missing samples leave a gap.
    assert table["reading_1"].isna().sum() == 10
    assert style.render_figure(figure, "svg", "gap")


@pytest.mark.parametrize(
    ("nodules_mm", "nodule"),
    [([1, 2.5, 6, 7], ("2.5 mm nodule", "2.5mm/a")), ([], ("nodule", None))],
)
def test_the_archive_shows_a_run_without_a_nodule_and_one_of_the_middle_size(nodules_mm, nodule):
    rows = [
        {"recording": f"{size:g}mm/{run}", "scheme": scheme, "size_mm": size, "rmse_0mm": distance}
        | {f"rmse_{nodule:g}mm": 1.0 for nodule in nodules_mm}
        for scheme in SCHEMES
        for size in [0.0, *nodules_mm]
        for run, distance in (("b", 0.9), ("a", 0.2), ("c", 0.1), ("d", 1.5))
    ]
    shown = draw_signals.typical_recordings(Evaluation(pd.DataFrame(rows), {}, {}))
    assert shown == [("no nodule", "0mm/a"), nodule]


@pytest.mark.parametrize(("sensors", "width"), [(1, COLUMN), (4, PAGE)])
def test_templates_of_any_number_of_sensors_and_sizes(sensors, width):
    ones = np.ones(sensors)
    particle = Particle(ones, 0.4 * ones, 60.0 * ones[1:], 20.0 * ones)
    matrices = np.zeros((sensors, 500)), render(particle, 60, 500), np.full((sensors, 500), np.nan)
    templates = dict(zip(SIZES, matrices, strict=True))
    figure = draw_signals.draw_templates(templates, [0, 3, 0], width)
    shown = texts(figure)
    assert "zero everywhere" in shown
    assert "not known: no accepted recording" in shown
    assert any(text.startswith("2.5 mm (") for text in shown)
    # A faint level shows low patterns.
    low, faint, first, *_ = figure.axes[1].collections[0].levels
    assert (low, faint) == (0, pytest.approx(first / 5))
    # Kills: a size without a template takes the ticks of all the others.
    assert len(figure.axes[1].get_xticks()) > 1
    assert {axes.get_xlim() for axes in figure.axes[:3]} == {(1, 500)}
    table = draw_signals.template_table(templates)
    assert len(table) == 3 * 500
    assert table.loc[table["size_mm"] == 2.5, "sensor_1"].max() == pytest.approx(1.0)


def inputs_of(lead="best", sizes_mm=(0.0, 2.0), learning=None, **of_detectors):
    """Make the inputs of the figures of rates out of the verdicts of each detector."""
    judged = [
        verdicts(pairs, name, scheme, threshold=0.0)
        for name, pairs in of_detectors.items()
        for scheme in SCHEMES
    ]
    predictions = pd.concat(judged).assign(**{f"rmse_{size:g}mm": 0.0 for size in sizes_mm})
    tables = measure_tables(predictions, list(sizes_mm), RULES, names=[*RATES, "summary", "roc"])
    evaluation = Evaluation(predictions, tables, printed_tables(read_paper(), 0.95))
    settings = {"evaluation": RULES | {"schemes": SCHEMES}, "report": {"lead": lead}}
    return SimpleNamespace(evaluation=evaluation, settings=settings, learning=learning)


HALF_RIGHT, ALL_RIGHT = [(0, 0), (0, 2), (2, 2), (2, 0)], [(0, 0), (0, 0), (2, 2), (2, 2)]


def test_rates_are_drawn_for_any_sizes_and_marked_where_one_sided():
    inputs = inputs_of("template", SIZES, template=[(size, size) for size in SIZES])
    exact, within = draw_rates.sizing_drawing(inputs)[1](COLUMN).axes
    assert [label.get_text() for label in exact.get_xticklabels()] == ["2.5", "6"]
    assert [label.get_text() for label in within.get_xticklabels()] == ["2.5*", "6*"]
    assert exact.get_yticklabels()[-1].get_text() == "100 %"
    assert exact.get_xlim() == pytest.approx((-0.6, 1.6))
    assert list(exact.lines[-1].get_ydata()) == [0, 0]


# Kills: the paper's detector a second time where it leads.
@pytest.mark.parametrize(
    ("lead", "shown"), [("best", ["taught", "template"]), ("template", ["template"])]
)
def test_rates_show_the_leading_detector_the_papers_and_the_paper(lead, shown):
    inputs = inputs_of(lead, template=HALF_RIGHT, taught=ALL_RIGHT)
    table, draw = draw_rates.detection_drawing(inputs)
    figure = draw(PAGE)
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == [*(f"{name} (leave-one-out)" for name in shown), "paper, as printed"]
    at_2_mm = table[(table["measure"] == "recall") & (table["size_mm"] == 2)]
    assert at_2_mm["hits"].tolist() == [2, 1, 17][-len(names) :]
    drawn = [
        (*series.lines[0].get_ydata(), *series.lines[2][0].get_segments()[0][:, 1])
        for series in figure.axes[1].containers
    ]
    assert np.array(drawn) == pytest.approx(at_2_mm[["rate", "low", "high"]].to_numpy())
    # They stand beside each other, and no size that the archive has not is drawn.
    positions = [series.lines[0].get_xdata().tolist() for series in figure.axes[0].containers]
    assert positions == [[0.2 * place - 0.1 * len(shown)] for place in range(len(names))]


def test_each_detector_has_a_curve_and_the_point_of_its_verdicts():
    table, draw = draw_rates.roc_drawing(inputs_of(template=HALF_RIGHT, taught=ALL_RIGHT))
    points = table[table["kind"] == "operating point"]
    of_any = points[points["size_mm"].isna()].set_index("detector")["false_positive_rate"]
    # Beside these stands no point of the baseline.
    assert of_any.to_dict() == {"template": 0.5, "taught": 0.0}
    assert set(table["detector"]) == {"template", "taught"}
    figure = draw(COLUMN)
    shown = texts(figure)
    assert "score of template" in shown and "verdicts of taught" in shown
    curve = figure.axes[0].get_lines()[1]
    assert (curve.get_xdata()[0], curve.get_ydata()[0]) == (0, 0)
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()]
    assert titles == ["any nodule", "2 mm"]
    assert style.render_figure(figure, "svg", "roc")


def learning_curves(*ranges, **columns):
    """Return the drawing of learning curves from rows as capsule.evaluation.learning makes them."""
    rows = [
        {"detector": "taught", "share": share, "taught": 40 * share, "taught_healthy": 8 * share}
        | {"size_from_mm": first, "size_to_mm": last, "rate": share, "rate_low": 0, "rate_high": 1}
        for first, last in ranges
        for share in (0.25, 0.5, 0.75, 1.0)
    ]
    table = pd.DataFrame(rows, columns=LEARNING).assign(**columns)
    return draw_rates.learning_drawing(inputs_of(learning=table, taught=ALL_RIGHT))


def test_a_learning_curve_has_a_panel_for_no_nodule_the_smallest_size_and_larger_ones():
    figure = learning_curves((0, 0), (1, 1), (2, 2), (3, 3), (2, 3))[1](PAGE)
    titles = ["no nodule: specificity", "1 mm: found", "from 2 mm on: found"]
    assert [axes.get_title(loc="left") for axes in figure.axes] == titles
    (line,) = figure.axes[2].get_lines()
    assert list(line.get_xdata()) == [10, 20, 30, 40]
    assert list(line.get_ydata()) == [0.25, 0.5, 0.75, 1.0]
    assert figure.axes[0].get_xticklabels()[0].get_text() == "10\n(2)"


@pytest.mark.parametrize(
    "drawing",
    [
        lambda: draw_rates.negatives_drawing(inputs_of(sizes_mm=[7.0], template=[(7, 7)])),
        lambda: draw_rates.roc_drawing(inputs_of(template=[])),
        learning_curves,
        lambda: learning_curves((0, 0), rate=np.nan),
    ],
)
def test_without_a_recording_the_figure_says_so(drawing):
    assert "no recording to count" in texts(drawing()[1](PAGE))


INPUTS = SimpleNamespace(
    templates={0.0: np.zeros((4, 30)), 3.0: np.eye(4, 30)}, template_counts=[0, 1]
)


@pytest.mark.parametrize(("kind", "ends"), [("svg", [""]), ("pdf", ["", "_column"])])
def test_a_figure_is_written_with_its_data_and_again_the_same(tmp_path, monkeypatch, kind, ends):
    names = {"templates.csv", *(f"templates{end}.{kind}" for end in ends)}
    line = write_figure("templates", INPUTS, kind, tmp_path)
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert set(written) == names and len(set(written.values())) == len(names)
    assert line == f"templates: {len(read_csv(tmp_path / 'templates.csv'))} rows of data"
    monkeypatch.setitem(WIDTHS_IN, kind, {ends[-1]: WIDTHS_IN[kind][ends[-1]]})
    write_figure("templates", INPUTS, kind, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == written
    # Files are vectors that need no font from elsewhere.
    figure = written[f"templates.{kind}"]
    if kind == "svg":
        assert b"<image" not in figure and b"<text" not in figure
        assert b'width="%gpt"' % (72 * PAGE) in figure
    else:
        assert b"/FontFile2" in figure and b"/CreationDate" not in figure


# Shapes differ, so that the colour blind and readers in grey tell the series apart.
def test_every_detector_and_the_paper_have_a_shape_of_their_own():
    looks = [*style.DETECTOR_LOOKS, style.PAPER_LOOK]
    shapes = {(look["marker"], look.get("markerfacecolor")) for look in looks}
    assert len(DETECTORS) < len(shapes) == len(looks)
