"""The live window of --plot, drawn into memory because there is no screen."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("agg")

from matplotlib import pyplot

from capsule.bench import window
from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.terminal import Progress


@pytest.fixture
def screen(monkeypatch):
    """Pretend that drawing into memory is a screen."""
    monkeypatch.setattr(window.backend_registry, "list_builtin", lambda kind: ["agg"])
    monkeypatch.setattr(pyplot.Figure, "show", lambda figure: None)
    yield
    pyplot.close("all")
    pyplot.ioff()


def test_the_window_shows_the_last_minute_of_each_sensor(screen):
    shown = window.Window("3mm/r01", 4)
    progress = Progress(0.1, places=1000)
    progress.recent.extend((place, 2, 3, 4) for place in range(400, 998))
    progress.recent.extend([None, (999, 2, 3, 4)])
    shown.show(progress)
    first_sensor = pyplot.gcf().axes[0].lines[0]
    times, counts = first_sensor.get_data()
    assert times == pytest.approx(np.arange(400, 1000) / 10)
    assert np.isnan(counts[598])
    assert np.nanmax(np.abs(np.array(counts) - np.arange(400, 1000))) == 0
    low, high = pyplot.gcf().axes[0].get_ylim()
    assert low < 400 < 999 < high


def test_a_closed_window_does_not_stop_the_recording(screen):
    shown = window.Window("3mm/r01", 4)
    pyplot.close("all")
    shown.show(Progress(0.1))


def test_without_a_screen_there_is_no_window():
    with pytest.raises(AcquisitionError, match="needs a screen"):
        window.Window("3mm/r01", 4)
