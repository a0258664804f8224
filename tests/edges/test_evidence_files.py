"""Evidence for the report is read as it was written."""

from capsule.page.plot_data import StoredEvidence, read_evidence, write_evidence


def test_evidence_comes_back_as_it_was_and_only_the_wanted_one(tmp_path):
    written = {
        f"{size}mm/r{run}": StoredEvidence("no gap", "ab+/=") for size in (0, 3) for run in (1, 2)
    }
    written["3mm/r2"] = StoredEvidence("gaps: 5 %", "cd")
    paths = [tmp_path / "0mm.json", tmp_path / "3mm.json"]
    for path in paths:
        some = {name: each for name, each in written.items() if name.startswith(path.stem)}
        write_evidence(path, some)
    read = read_evidence(paths, ["0mm/r1", "3mm/r2", "5mm/r1"])
    assert read == {name: written[name] for name in ("0mm/r1", "3mm/r2")}


def test_a_folder_without_a_usable_recording_has_no_evidence(tmp_path):
    write_evidence(tmp_path / "0mm.json", {})
    assert read_evidence([tmp_path / "0mm.json"], ["0mm/r1"]) == {}
