"""Durations of the steps are read from their logs."""

from edges.durations import read_durations


def test_a_stage_is_the_sum_of_the_jobs_of_recordings_that_are_still_there(tmp_path):
    for name, seconds in [("1mm/a", 0.25), ("1mm/b", 0.5), ("1mm/removed", 9.0)]:
        path = tmp_path / "fit" / f"{name}.log"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{name}: fitted\nfinished in {seconds:.3f} s\n", encoding="utf-8")
    drawn = [("draw/templates", 1.0), ("draw/design", 1.5)]
    for job, seconds in [*drawn, ("passages/1mm", 2), ("judge", 3)]:
        path = tmp_path / f"{job}.log"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"finished in {seconds:.3f} s\n", encoding="utf-8")
    (tmp_path / "detect.log").write_text("error: the disk is full\n", encoding="utf-8")
    assert read_durations(tmp_path, ["1mm/a", "1mm/b", "1mm/c"]) == [
        {"rule": "fit", "jobs": 2, "seconds": 0.75},
        {"rule": "passages", "jobs": 1, "seconds": 2.0},
        {"rule": "judge", "jobs": 1, "seconds": 3.0},
        {"rule": "draw", "jobs": 2, "seconds": 2.5},
    ]
