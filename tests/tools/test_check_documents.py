"""The checks of links and references find what they are for, and nothing else."""

import check_documents as documents
import check_references as references
import pytest

PAGE = """# A page

## Two words, `code` & more

text
"""


@pytest.fixture
def site(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "page.md").write_text(PAGE)
    return tmp_path


def found(site, text):
    (site / "docs" / "a.md").write_text(text)
    return documents.check(site, ["docs/a.md"])


@pytest.mark.parametrize(
    ("link", "problem"),
    [
        ("[a](missing.md)", "docs/a.md:2: missing.md: does not exist"),
        ("![a](missing.svg)", "does not exist"),
        ('<img src="missing.png">', "does not exist"),
        ("[a](page.md#nowhere)", "has no heading #nowhere"),
        ("[a](#nowhere)", "has no heading #nowhere"),
        ("[a](../../outside.md)", "leaves the repository"),
        ("[a](/docs/page.md)", "is absolute"),
    ],
)
def test_a_broken_link_is_found(site, link, problem):
    (violation,) = found(site, f"# A\n{link}\n")
    assert problem in violation


@pytest.mark.parametrize(
    "text",
    [
        "[a](page.md), [b](page.md#two-words-code--more), [c](../docs/page.md), [d](#a)",
        "[a](https://example.org/x.md) and [b](mailto:a@example.org)",
        "`[a](missing.md)` and <!-- [b](missing.md) -->",
        "```text\n[a](missing.md)\n```",
        "[folder](../docs)",
    ],
)
def test_a_good_page_passes(site, text):
    assert found(site, f"# A\n{text}\n") == []


def test_repeated_headings_are_numbered():
    assert documents.anchors("# A b\n## A b\n## A b\n") == {"a-b", "a-b-1", "a-b-2"}


BIBLIOGRAPHY = "@book{kane1985,\n  year = {1985},\n}\n"


def cited(root, path, text, bibliography=BIBLIOGRAPHY):
    (root / "references.bib").write_text(bibliography)
    file = root / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return references.check(root, [path])


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("a.md", "See [kane1985].\n"),
        ("src/a.cpp", "// as in [kane1985, eq. (3)]\nint x[2];\n"),
        ("src/a.cpp", '{"method", "text", "kane1985"},\n'),
        ("src/a.hpp", "/// [kane1985,\n/// chapter 2]\n"),
        ("a.py", '"""From [kane1985; kane1985]."""\nx[0] = y["key"]\n'),
    ],
)
def test_known_citations_pass(tmp_path, path, text):
    assert cited(tmp_path, path, text) == []


@pytest.mark.parametrize(
    "text",
    [
        "[kane1986]",
        "[Kane1985]",
        "[kane-1985]",
        "[kane1985; levinson1985]",
        '"levinson1985"',
        "[kane1985;\n// levinson1985]",
    ],
)
def test_unknown_citations_are_found(tmp_path, text):
    (violation,) = cited(tmp_path, "a.cpp", f"// [kane1985]\n// {text}\n")
    assert "is not in references.bib" in violation


def test_a_reference_that_nobody_cites_is_found(tmp_path):
    assert cited(tmp_path, "a.md", "nothing") == ["references.bib: kane1985 is cited nowhere"]


def test_a_link_is_no_citation(tmp_path):
    (violation,) = cited(tmp_path, "a.md", "[kane1985](page.md)")
    assert "cited nowhere" in violation


def test_badly_spelt_and_double_keys_are_found(tmp_path):
    bibliography = BIBLIOGRAPHY + BIBLIOGRAPHY + "@book{Kane-1985,\n}\n"
    violations = cited(tmp_path, "a.md", "[kane1985] [Kane-1985]", bibliography)
    assert any("Kane-1985 is not author and year" in v for v in violations)
    assert any("kane1985 is there twice" in v for v in violations)
