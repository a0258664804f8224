"""The progress lines of the training are right."""

from scorer_teaching.episodes import progress


def test_the_time_left_follows_from_the_time_taken(capsys):
    seconds = iter([0.0, 5.0, 60.0, 70.0, 90.0])
    assert list(progress("abcd", "letter", lambda: next(seconds))) == [*"abcd"]
    assert capsys.readouterr().err.splitlines() == [
        "letter 2 of 4, about 1.0 min left",
        "letter 4 of 4, about 0.0 min left",
    ]
