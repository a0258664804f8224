"""Files beside the page: letters and digits alone, whatever a recording says, and all of it."""

import copy
import json
import re

from capsule.configuration import read_config_file
from capsule.forks import Forks
from capsule.page import beside
from capsule.page.packing import deflated
from support.project import ROOT

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")


def test_the_evidence_of_a_usual_archive_stands_inside_the_page_of_a_large_one_beside_it():
    assert not beside.stands_beside(120, SETTINGS)
    assert not beside.stands_beside(1200, SETTINGS)
    assert beside.stands_beside(12000, SETTINGS)
    longer = copy.deepcopy(SETTINGS)
    longer["preprocessing"]["length"] *= 10
    assert beside.stands_beside(1200, longer)
    smaller = copy.deepcopy(SETTINGS)
    smaller["report"]["max_megabytes"] = 0
    assert beside.stands_beside(1, smaller)


def texts_of(name, among_others="{}"):
    return deflated(json.dumps({"recording": name})), deflated(among_others)


def test_a_file_holds_its_recordings_in_their_order_and_nothing_that_could_run():
    evil = '");alert(1);//</script>\u2028'
    made = [texts_of(f"3mm/r{i}", json.dumps({"# a": evil})) for i in range(30)]
    name, script = beside.data_file(2, iter(made))
    assert re.fullmatch(r"00002-[0-9a-f]{16}", name)
    form = rf'EvidenceStore\.receive\("{name}",(\[[A-Za-z0-9+/=",\[\]]+\])\);\n'
    assert [*map(tuple, json.loads(re.fullmatch(form, script)[1]))] == made
    assert evil not in script


def test_a_file_is_named_by_its_content_so_that_no_page_reads_another_ones():
    (one, _), (other, _) = (
        beside.data_file(0, [texts_of("3mm/r01", content)]) for content in ("{}", '{"a":1}')
    )
    assert one != other


ROWS = [(place, {"recording": f"3mm/r{place}"}) for place in range(70)]


def evidence_of(rows):
    for place, _ in rows:
        yield deflated("{}"), deflated(f'{{"row":{place}}}')


def test_every_recording_stands_in_one_file_and_the_files_are_listed_in_order(tmp_path):
    told = beside.write_beside(tmp_path / "report", ROWS, evidence_of)
    assert (told["folder"], told["each"], len(told["files"])) == ("report", 32, 3)
    texts = [(tmp_path / "report" / f"{name}.js").read_text() for name in told["files"]]
    assert [len(re.findall(r"\[\"", text)) for text in texts] == [32, 32, 6]
    expected = [deflated(f'{{"row":{place}}}') for place in range(70)]
    assert re.findall(r'","([^"]+)"', "".join(texts)) == expected


def test_two_processes_write_the_same_files(tmp_path):
    alone = beside.write_beside(tmp_path / "one" / "report", ROWS, evidence_of)
    both = beside.write_beside(tmp_path / "two" / "report", ROWS, evidence_of, Forks(2))
    assert both == alone
    for path in (tmp_path / "one" / "report").iterdir():
        assert (tmp_path / "two" / "report" / path.name).read_bytes() == path.read_bytes()


def test_without_a_recording_there_is_no_file(tmp_path):
    assert beside.write_beside(tmp_path / "report", [], evidence_of)["files"] == []
