import pytest

from capsule.configuration_files import read_config_file
from capsule.errors import CapsuleError


@pytest.mark.parametrize("text", ["a: {b: 1}\n", '{"a": {"b": 1}}', "\ufeffa:\r\n  b: 1\r\n"])
def test_yaml_and_json_are_read(tmp_path, text):
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    assert read_config_file(tmp_path / "c.yaml") == {"a": {"b": 1}}


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"", ": this file is empty"),
        (b"# nothing\n", ": this file is empty"),
        (b"- 1\n- 2\n", ": this file holds a list instead of keys"),
        (b"fit", ": this file holds a str instead of keys"),
        (b"fit: [1, 2\n", ", line 2: "),
        (b"fit:\n\tseed: 1\n", ", line 2: found character"),
        (b"fit: {}\nreport: {}\nfit: {}\n", ", line 3: the key 'fit' appears twice"),
        (b"fit:\n  seed: 1\n  seed: 2\n", ", line 3: the key 'seed' appears twice"),
        (b"fit: \xff\n", ": this is not UTF-8 text"),
        (b"fit: \x00\n", ": this is not valid YAML"),
        (b"a: *b\n", ", line 1: the alias *b is not allowed; write its value out"),
        (
            b"a: &a [1]\nb: &b [*a, *a]\n",
            ", line 2: the alias *a is not allowed; write its value out",
        ),
        (b"fit:\n  seed: " + b"1" * 5000, ": a value cannot be read: "),
        (b"? [1]\n: 2\n", ", line 1: found unhashable key"),
        (b"[" * 20_000, ": the keys are nested too deeply"),
    ],
)
def test_what_is_no_configuration_is_told_with_the_file_and_the_line(tmp_path, content, fault):
    path = tmp_path / "c.yaml"
    path.write_bytes(content)
    with pytest.raises(CapsuleError) as caught:
        read_config_file(path)
    assert str(caught.value).startswith(f"{path}{fault}")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(CapsuleError, match="No such file or directory"):
        read_config_file(tmp_path / "none.yaml")
