"""The progress lines of the training are right."""

from scorer_teaching.episodes import Progress


def test_the_time_left_follows_from_the_time_taken(capsys):
    seconds = iter([0.0, 5.0, 60.0, 70.0, 90.0])
    progress = Progress(4.0, lambda: next(seconds))
    for done in (0.5, 1.0, 2.0, 3.0):
        progress.tell(done, f"{done:g} of 4")
    assert capsys.readouterr().err.splitlines() == [
        "1 of 4, about 3.0 min left",
        "3 of 4, about 0.5 min left",
    ]


def test_nothing_is_told_before_something_is_done(capsys):
    seconds = iter([0.0, 100.0])
    Progress(1.0, lambda: next(seconds)).tell(0.0, "nothing")
    assert capsys.readouterr().err == ""
