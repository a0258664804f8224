"""The order in which verdicts are written."""

import pandas as pd

from capsule.evaluation.whole_evaluation import by_name


def test_verdicts_stand_by_detector_then_by_name_then_as_they_were_made():
    keys = [
        (detector, name, scheme)
        for detector in ("template", "diagonal")
        for name in ("2mm/r10", "0mm/b", "2mm/r9")
        for scheme in ("resubstitution", "leave_one_out")
    ]
    made = by_name(pd.DataFrame(keys, columns=["detector", "recording", "scheme"]))
    assert [tuple(row) for row in made.values] == [
        (detector, name, scheme)
        for detector in ("template", "diagonal")
        for name in ("0mm/b", "2mm/r9", "2mm/r10")
        for scheme in ("resubstitution", "leave_one_out")
    ]
