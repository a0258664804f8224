"""The files beside the page hold all recordings once, however many processes write them."""

import re

from capsule.forks import Forks
from capsule.page.archive_evidence import Evidence
from capsule.page.data_files import DataFiles
from capsule.page.packing import deflated
from support.stored import StoredResults

ROWS = [(place, {"recording": f"3mm/r{place}"}) for place in range(70)]


def evidence_of(rows):
    for place, row in rows:
        yield Evidence(row["recording"], deflated("{}"), f'{{"row":{place}}}')


def test_every_recording_stands_in_one_file_and_the_files_are_listed_in_order(tmp_path):
    told = DataFiles(tmp_path / "report").write(ROWS, evidence_of, StoredResults())
    assert (told.folder, told.each, len(told.files)) == ("report", 32, 3)
    texts = [(tmp_path / "report" / f"{name}.js").read_text() for name in told.files]
    assert [len(re.findall(r"\[\"", text)) for text in texts] == [32, 32, 6]
    expected = [deflated(f'{{"row":{place}}}') for place in range(70)]
    assert re.findall(r'","([^"]+)"', "".join(texts)) == expected


def test_two_processes_write_the_same_files(tmp_path):
    alone = DataFiles(tmp_path / "one" / "report").write(ROWS, evidence_of, StoredResults())
    both = DataFiles(tmp_path / "two" / "report", Forks(2))
    assert both.write(ROWS, evidence_of, StoredResults()) == alone
    for path in (tmp_path / "one" / "report").iterdir():
        assert (tmp_path / "two" / "report" / path.name).read_bytes() == path.read_bytes()


def test_without_a_recording_there_is_no_file(tmp_path):
    assert DataFiles(tmp_path / "report").write([], evidence_of, StoredResults()).files == []


def test_the_page_is_told_the_quality_of_each_recording(tmp_path):
    told = DataFiles(tmp_path / "report").write(ROWS, evidence_of, StoredResults())
    assert told.quality("3mm/r69") == "3mm/r69: no gap, no loose sensor"
