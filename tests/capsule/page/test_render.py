"""Nothing on the page can run but its own script."""

import pytest

from capsule.page.render import PAGE, render_page


def filled(template, style="", script=""):
    return "".join(render_page({PAGE: template}, style, script, {}))


def test_the_policy_allows_this_script_and_no_other():
    template = '<meta content="{{ policy }}"><script>{{ script }}</script>'
    page = filled(template, "p {}", "a < b && c")
    assert "<script>a < b && c</script>" in page
    assert "default-src 'none'" in page and "unsafe" not in page
    assert page.count("'sha256-") == 2


def test_an_end_tag_in_the_script_is_refused():
    with pytest.raises(ValueError, match="end tag"):
        filled("", script="x = '</script>'")
