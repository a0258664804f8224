"""The recorder's core against any bytes on the serial line."""

import contextlib
import itertools
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from capsule.bench import growing_file
from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.protocol import Sample, decode, encode
from capsule.bench.timeline import steps_between
from support.bench.scripted import ScriptedBench, identity_frame, sample_frame

pytestmark = pytest.mark.takes(0.3)

U32 = st.integers(0, 2**32 - 1)
PIECES = st.one_of(
    st.binary(max_size=60),
    st.integers(0, 300).map(sample_frame),
    st.builds(sample_frame, st.integers(0, 300), U32, U32),
    st.builds(
        lambda uptime, bits, state: identity_frame(uptime_ms=uptime, adc_bits=bits, state=state),
        U32,
        st.sampled_from([10, 12]),
        st.sampled_from(["running", "paused"]),
    ),
    st.text("DIAEP,=0123456789abc", max_size=40).map(lambda text: encode(f"D{text}")),
)
SCRIPTS = st.lists(st.tuples(st.floats(0, 30), PIECES), max_size=60)


def ends(bench, script):
    """Run a session on scripted bytes and times to an end that a session may have."""
    now_s, timed = 0.0, []
    for step_s, content in script:
        now_s += step_s
        timed.append((now_s, content))
    with contextlib.suppress(AcquisitionError):
        bench.run(timed)
    return bench.recorder.state.ended


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(SCRIPTS)
def test_any_bytes_end_with_every_accepted_sample_on_disk(monkeypatch, script):
    monkeypatch.setattr(growing_file.os, "fsync", lambda descriptor: None)
    with tempfile.TemporaryDirectory() as folder:
        bench = ScriptedBench(Path(folder), monkeypatch)
        accepted = []
        keep = bench.logger.state.add
        monkeypatch.setattr(
            bench.logger.state, "add", lambda counts: (accepted.append(counts), keep(counts))
        )
        reason = ends(bench, script)
        endings = ("Ctrl-C", "(--patience)", "the end stop", "(docs/bench.md)")
        assert reason.endswith(endings)
        cells = [row[1:] for row in bench.rows()]
        assert cells == [[str(n) for n in counts] if counts else [""] * 4 for counts in accepted]
        places = [round(float(row[0]) * 10) for row in bench.rows()]
        assert places == list(range(len(places)))  # time never shifts and never runs back
        # What is missing passed by the computer's clock; a false clock makes it no longer.
        assert len(places) / 10 <= bench.now_s + 12


def continue_each_other(frames):
    """Return whether some of the frames are samples of which one can follow another."""
    samples = [each for each in map(decode, frames) if isinstance(each, Sample)]
    return any(
        steps_between(earlier, later, 100.0, passed_s=10.0)
        for earlier, later in itertools.permutations(samples, 2)
    )


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 99), PIECES.filter(lambda piece: b"$I" not in piece))))
def test_no_bytes_between_good_samples_cost_more_than_the_one_that_they_hit(monkeypatch, strange):
    """Check that strange bytes between frames harm none of 100 good samples."""
    # Two whole samples that continue each other are no noise: the recorder believes their clock.
    assume(not continue_each_other({content.strip() for _, content in strange}))
    monkeypatch.setattr(growing_file.os, "fsync", lambda descriptor: None)
    script = [(number / 10, sample_frame(number)) for number in range(100)]
    script += [(number / 10 + 0.05, content + b"\n") for number, content in strange]
    with tempfile.TemporaryDirectory() as folder:
        bench = ScriptedBench(Path(folder), monkeypatch)
        bench.run(sorted(script, key=lambda step: step[0]))
        strangers = {content for _, content in strange if content.startswith(b"$D")}
        kept = bench.numbers()
        # A stranger may look exactly like the next sample, and then takes its place.
        assert len(set(range(100)) - set(kept)) <= len(strangers)
