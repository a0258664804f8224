"""The verdict on every patient, nodules first, and nothing said that nobody knows."""

import pandas as pd

from capsule.page import patients
from support.evaluated import UNKNOWN

INDEX = ["recording", "size_mm", "status", "reason", "site"]
DETECTED = ["recording", "detector", "predicted_mm", "probability", "estimate_mm"]
DETECTED += ["estimate_low_mm", "estimate_high_mm", "location_s", "location_mm"]
DETECTED += ["score", "threshold"]
SITE = ["site", "size_mm", "recordings", "detector", "detected", "estimate_mm"]
SITE += ["location_mm", "estimate_low_mm", "estimate_high_mm", "passes", "score", "threshold"]


def quality(name):
    gap = "gaps: 5 % of the samples, the longest 0.5 s"
    return gap if name.endswith("gap") else "no gap, no loose sensor"


def nodule(name, detector, chance, size_mm=2.7):
    return [name, detector, 3.0, chance, size_mm, 1.8, 3.6, 12.34, 6.1, 12.43, 8.1]


def healthy(name, detector, chance):
    return [name, detector, 0.0, chance, *[UNKNOWN] * 5, 3.1, 8.1]


def silent(name, detector):
    return [name, detector, *[UNKNOWN] * 9]


def accepted(*names, site=UNKNOWN):
    return [[name, UNKNOWN, "accepted", UNKNOWN, site] for name in names]


def values(index, detections, sites=(), columns=DETECTED, site_columns=SITE):
    return patients.page_values(
        pd.DataFrame(index, columns=INDEX),
        pd.DataFrame(detections, columns=columns),
        pd.DataFrame(sites, columns=site_columns),
        "diagonal",
        {name: quality(name) for name, *_ in index},
        5.0,
    )


def test_a_nodule_has_its_size_with_interval_its_place_and_its_probability():
    page = values(
        accepted("unlabelled/a-gap"),
        [
            nodule("unlabelled/a-gap", "diagonal", 0.99999),
            healthy("unlabelled/a-gap", "template", UNKNOWN),
            nodule("unlabelled/a-gap", "taught", 0.5),
        ],
    )
    (row,) = page["rows"]
    assert row["kind"] == row["verdict"] == "nodule"
    assert (row["size"], row["place"]) == ("2.7 mm (1.8 to 3.6)", "12.3 s, 6.1 mm")
    assert row["probability"] == "> 99.9 %"
    assert row["quality"] == "gaps: 5 % of the samples, the longest 0.5 s"
    assert row["others"] == "1 of 2 agree; template: no nodule"
    # Of one patient a count says nothing; the sentence says all.
    assert page["counts"] == ""
    assert page["sentences"] == [
        (
            "a-gap",
            "a nodule of about 2.7 mm (1.8 to 3.6), 6 mm along the way, probability > 99.9 %; its "
            "score, 12.4, exceeds the threshold of 8.10.",
        )
    ]


def test_each_of_a_few_patients_has_a_sentence():
    names = [f"unlabelled/{name}" for name in "abc"]
    open_end = nodule(names[0], "diagonal", UNKNOWN, 4.6)
    open_end[6] = float("inf")
    page = values(
        accepted(*names),
        [
            [*open_end, UNKNOWN],
            [*healthy(names[1], "diagonal", 0.012), UNKNOWN],
            [*silent(names[2], "diagonal"), "no wave on sensor 2"],
        ],
        columns=[*DETECTED, "no_verdict"],
    )
    assert page["counts"].startswith("Of 3 unlabelled recordings, diagonal finds a nodule in 1")
    assert dict(page["sentences"]) == {
        "a": (
            "a nodule of about 4.6 mm (1.8 to 5 mm or more), 6 mm along the way; its score, 12.4, "
            "exceeds the threshold of 8.10."
        ),
        "b": (
            "no nodule found; its score, 3.10, does not exceed the threshold of 8.10; probability "
            "of a nodule 1.2 %."
        ),
        "c": "no verdict: no wave on sensor 2.",
    }


def test_nodules_come_first_and_the_likelier_ones_before_the_others():
    names = [f"unlabelled/{name}" for name in "abcde"]
    page = values(
        accepted(*names),
        [
            healthy(names[0], "diagonal", 0.01),
            nodule(names[1], "diagonal", 0.6),
            silent(names[2], "diagonal"),
            nodule(names[3], "diagonal", 0.9),
            healthy(names[4], "diagonal", 0.02),
        ],
    )
    assert [row["patient"] for row in page["rows"]] == list("dbcea")
    assert page["counts"].endswith(" On 1 it gives no verdict.")
    assert page["rows"][2]["probability"] == "not given"
    assert page["rows"][4]["size"] == "n/a"


BECAUSE = "the time from wave to wave is 6.40 s, but 3.20 to 3.30 s in the recordings that teach"


def test_a_strange_patient_is_told_before_the_verdict_and_has_no_probability():
    names = [f"unlabelled/{name}" for name in "abc"]
    kinds = [["no", BECAUSE], ["no", BECAUSE], ["yes", UNKNOWN]]
    verdicts = [
        nodule(names[0], "diagonal", 0.999),
        healthy(names[1], "diagonal", 0.01),
        nodule(names[2], "diagonal", 0.5),
    ]
    page = values(
        accepted(*names),
        [[*verdict, *kind] for verdict, kind in zip(verdicts, kinds, strict=True)],
        columns=[*DETECTED, "familiar", "unfamiliar_because"],
    )
    rows = {row["patient"]: row for row in page["rows"]}
    said = f"unlike the recordings that teach: {BECAUSE}"
    for name in "ab":
        assert rows[name]["unlike"] == BECAUSE
        assert rows[name]["quality"] == f"{BECAUSE}; no gap, no loose sensor"
        assert rows[name]["probability"] == "not given"
        assert dict(page["sentences"])[name].startswith(f"{said}. If it is judged all the same: ")
        assert "probability" not in dict(page["sentences"])[name]
    assert (rows["a"]["kind"], rows["b"]["kind"]) == ("nodule", "no nodule")
    assert (rows["c"]["unlike"], rows["c"]["probability"]) == ("", "50 %")
    assert page["counts"].endswith(" Unlike the recordings that teach: 2 of 3.")
    assert page["unknown_kind"] == ""


def test_the_page_says_why_nobody_can_tell_who_is_strange():
    reason = "only 20 places teach what is familiar; 49 are needed"
    page = values(
        accepted("unlabelled/a"),
        [[*nodule("unlabelled/a", "diagonal", 0.9), UNKNOWN, reason]],
        columns=[*DETECTED, "familiar", "unfamiliar_because"],
    )
    assert page["unknown_kind"] == reason
    assert page["rows"][0]["probability"] == "90 %"


def test_a_strange_pass_makes_a_place_strange():
    site = ["s", UNKNOWN, 2, "diagonal", "True", 2.7, 6.1, 1.8, 3.6, 2, 12.0, 8.0]
    page = values(
        accepted("unlabelled/a", "unlabelled/b", site="s"),
        [nodule(f"unlabelled/{name}", "diagonal", 0.9) for name in "ab"],
        [[*site, "no", f"unlabelled/b: {BECAUSE}"]],
        site_columns=[*SITE, "familiar", "unfamiliar_because"],
    )
    (row,) = page["rows"]
    assert row["unlike"] == f"unlabelled/b: {BECAUSE}"


def test_no_verdict_stands_with_its_reason_where_the_table_has_one():
    reason = [*silent("unlabelled/a", "diagonal"), "no wave on sensor 2"]
    other = [*nodule("unlabelled/a", "template", UNKNOWN), UNKNOWN]
    page = values(accepted("unlabelled/a"), [reason, other], columns=[*DETECTED, "no_verdict"])
    (row,) = page["rows"]
    assert (row["kind"], row["verdict"]) == ("no verdict", "no verdict: no wave on sensor 2")
    assert row["others"] == "template: nodule"


def test_a_rejected_recording_of_a_patient_is_not_forgotten():
    index = [["unlabelled/a", UNKNOWN, "rejected", "the file is empty", UNKNOWN]]
    index += [["3mm/r01", 3.0, "rejected", "the file is empty", UNKNOWN]]
    index += [["notes", UNKNOWN, "rejected", "no recording", UNKNOWN]]
    (row,) = values(index, [])["rows"]
    assert (row["verdict"], row["quality"]) == ("no verdict", "rejected: the file is empty")
    assert (row["patient"], row["recordings"]) == ("a", [])


def test_several_passes_over_a_site_are_one_patient():
    passes = ["unlabelled/b1", "unlabelled/b2-gap"]
    index = [*accepted("unlabelled/a"), *accepted(*passes, site="p")]
    index += [["0mm/r01", 0.0, "accepted", UNKNOWN, "p"]]
    detections = [healthy(name, "diagonal", 0.1) for name in ("unlabelled/a", *passes)]
    sites = [
        ["p", UNKNOWN, 2, "diagonal", True, 3.0, 5.04, 2.0, 4.0, 2, 9.0, 8.1],
        ["p", UNKNOWN, 2, "template", False, *[UNKNOWN] * 4, 2, *[UNKNOWN] * 2],
        ["p", 0.0, 2, "diagonal", True, 1.0, 5.0, 1.0, 2.0, 2, 9.0, 8.1],
    ]
    page = values(index, detections, sites)
    assert page["counts"].startswith("Of 2 unlabelled recordings and sites, diagonal finds")
    site, single = page["rows"]
    assert (site["patient"], [each["name"] for each in site["recordings"]]) == ("p", passes)
    assert (site["size"], site["place"]) == ("3.0 mm (2.0 to 4.0)", "5.0 mm")
    assert (site["probability"], site["others"]) == (
        "not given",
        "0 of 1 agree; template: no nodule",
    )
    assert site["quality"] == (
        "b1: no gap, no loose sensor; b2-gap: gaps: 5 % of the samples, the longest 0.5 s"
    )
    assert (single["patient"], single["passes"], site["passes"]) == ("a", 1, 2)
    assert site["sentence"] == (
        "a nodule of about 3.0 mm (2.0 to 4.0), 5 mm along the way; the mean score of 2 passes, "
        "9.00, exceeds the threshold of 8.10."
    )


def test_a_size_without_an_interval_is_called_so():
    row = [*nodule("unlabelled/a", "diagonal", UNKNOWN)]
    row[5:7] = [UNKNOWN, UNKNOWN]
    assert values(accepted("unlabelled/a"), [row])["rows"][0]["size"] == "2.7 mm, no interval"
    row[4] = UNKNOWN
    assert values(accepted("unlabelled/a"), [row])["rows"][0]["size"] == "not given"


def test_of_hundreds_of_patients_twenty_stand_open():
    names = [f"unlabelled/{number:03d}" for number in range(300)]
    rows = [(nodule if name.endswith("7") else healthy)(name, "diagonal", 0.5) for name in names]
    page = values(accepted(*names), rows)
    assert (len(page["rows"]), len(page["folded"])) == (20, 280)
    assert {row["kind"] for row in page["rows"]} == {"nodule"}
    assert page["sentences"] == []


def test_without_an_unlabelled_recording_there_is_no_row():
    index = [["0mm/r01", 0.0, "accepted", UNKNOWN, UNKNOWN]]
    page = values(index, [])
    assert (page["rows"], page["folded"], page["sentences"]) == ([], [], [])
    assert page["counts"] == page["unknown_kind"] == ""
