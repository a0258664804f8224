"""The live window of --plot: the readings of the sensors."""

import time

import matplotlib.pyplot as plt
from matplotlib.backends.registry import BackendFilter, backend_registry

from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.terminal import Progress

REDRAW_EVERY_S = 0.25


def check_screen() -> None:
    """Raise `AcquisitionError` if no window can be opened."""
    plt.ion()
    # Without a screen matplotlib silently draws into memory.
    if plt.get_backend().lower() not in backend_registry.list_builtin(BackendFilter.INTERACTIVE):
        raise AcquisitionError(
            f"--plot needs a screen, and there is none (matplotlib: {plt.get_backend()}); "
            "leave --plot out"
        )


class Window:
    """A window with one trace per sensor, over the last minute.

    Parameters
    ----------
    title : str
        The recording's name.
    sensors : int
        Number of sensors S.

    Raises
    ------
    AcquisitionError
        There is no screen to open a window on.
    """

    def __init__(self, title: str, sensors: int) -> None:
        check_screen()
        self._figure, self._axes = plt.subplots(sensors, sharex=True, num=title)
        self._lines = []
        for number, axes in enumerate(self._axes, start=1):
            self._lines.append(axes.plot([], [], linewidth=1)[0])
            axes.set_ylabel(f"sensor {number}")
            axes.margins(y=0.1)
        self._axes[-1].set_xlabel("time (s)")
        self._figure.suptitle(f"{title}: ADC counts")
        self._figure.show()
        self._drawn_s = 0.0

    def show(self, progress: Progress) -> None:
        """Draw the last samples; if the user closed the window, do nothing."""
        now_s = time.monotonic()
        if now_s - self._drawn_s < REDRAW_EVERY_S or not plt.fignum_exists(self._figure.number):
            return
        self._drawn_s = now_s
        first = progress.places - len(progress.recent)
        times = [(first + place) * progress.period_s for place in range(len(progress.recent))]
        missing = (float("nan"),) * len(self._lines)
        samples = [missing if sample is None else sample for sample in progress.recent]
        for sensor, (line, axes) in enumerate(zip(self._lines, self._axes, strict=True)):
            line.set_data(times, [sample[sensor] for sample in samples])
            axes.relim()
            axes.autoscale_view()
        self._figure.canvas.draw_idle()
        self._figure.canvas.flush_events()
