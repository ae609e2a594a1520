"""What the documents say works: their Python, their commands, their links, their references."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import check_documents
import check_references
import make_gallery
import pytest
from source_text import tracked_files

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
COMMAND_LINE = "import sys; sys.argv[0] = 'linkwise'; from linkwise.cli import main; main()"
PAGES = ("results", "input")
LONGEST = 600  # seconds: a fuse; an example alone takes less than 10


def blocks(document, language):
    """The code blocks of a document in one language."""
    pattern = rf"^```{language}\n(.*?)^```"
    return re.findall(pattern, document.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def name(path):
    return path.relative_to(ROOT).as_posix()


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A folder with the examples, as in the repository, that may be written to."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("document", [d for d in DOCUMENTS if blocks(d, "python")], ids=name)
def test_python_of_a_document_runs(document, workplace):
    names = {"__name__": "document"}
    for block in blocks(document, "python"):
        exec(compile(block, name(document), "exec"), names)


def commands(document):
    lines = "\n".join(blocks(document, "bash")).splitlines()
    return [line for line in lines if line.startswith("linkwise ")]


@pytest.mark.parametrize("document", [d for d in DOCUMENTS if commands(d)], ids=name)
def test_commands_of_a_document_run(document, workplace):
    for command in commands(document):
        arguments = shlex.split(command)[1:]
        done = subprocess.run(
            [sys.executable, "-c", COMMAND_LINE, *arguments],
            cwd=workplace,
            capture_output=True,
            text=True,
            timeout=LONGEST,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stderr}"
        assert done.stdout


@pytest.mark.parametrize("example", EXAMPLES, ids=name)
def test_example_prints_what_it_must(example, workplace):
    picture = ["picture.svg"] if "[PICTURE.svg" in example.read_text(encoding="utf-8") else []
    done = subprocess.run(
        [sys.executable, f"examples/{example.name}", *picture],
        cwd=workplace,
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert ": ok" in done.stdout
    assert "WRONG" not in done.stdout
    for path in picture:
        assert "<svg" in (workplace / path).read_text()


def test_a_wrong_number_ends_an_example(workplace):
    (workplace / "examples" / "wrong.py").write_text(
        "from checked import check\n\ncheck('x', 1.0, 2.0, 0.5)\n"
    )
    done = subprocess.run(
        [sys.executable, "examples/wrong.py"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stdout.rstrip().endswith("WRONG")


def test_the_gallery_says_what_the_examples_say():
    gallery = (ROOT / "docs" / "gallery.md").read_text()
    for example in make_gallery.SHOWN:
        assert make_gallery.page(ROOT, example) in gallery, example
        assert (ROOT / "docs" / make_gallery.picture(example)).is_file(), example


@pytest.mark.parametrize("checker", [check_documents, check_references], ids=lambda c: c.__name__)
def test_links_and_references_of_the_repository(checker):
    if not (ROOT / ".git").exists():
        pytest.skip("not a clone: the tools ask git for the files")
    assert checker.check(ROOT, tracked_files(ROOT)) == []


def test_documents_name_what_the_tables_of_the_core_hold():
    import linkwise as lw

    texts = {name: " ".join((ROOT / f"docs/{name}.md").read_text().split()) for name in PAGES}
    groups = " ".join(dict.fromkeys(row["group"] for row in lw.quantities()))
    assert f"`{groups}`" in texts["results"]
    assert f"`{groups}`" in texts["input"]
    for row in lw.quantities():
        assert f"`{row['name']}`" in texts["results"], row["name"]
    for row in lw.numerics():
        assert f"`{row['name']}`" in texts["input"].replace("[simulate] ", ""), row["name"]
