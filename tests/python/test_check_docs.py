"""The check of the pages finds what it is for: a small house with one mistake at a time."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

import check_docs  # noqa: E402

PAGES = {
    "README.md": "# Top\n[words](docs/glossary.md) [house](docs/architecture.md#the-rooms)\n",
    "docs/glossary.md": "# Words\n[back](../README.md)\n",
    "docs/architecture.md": "# House\n[words](glossary.md)\n## The rooms\n| `mesh/` | arrays | `cut.h` |\n",
    "native/flipfree/mesh/cut.h": "// Cuts.\n",
}


@pytest.fixture
def house(tmp_path: Path) -> Path:
    for name, text in PAGES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def append(house: Path, text: str) -> None:
    page = house / "docs/architecture.md"
    page.write_text(page.read_text() + text + "\n")


def test_a_house_in_order_has_no_complaints(house: Path) -> None:
    assert check_docs.complaints(house) == []


@pytest.mark.parametrize(
    ("mistake", "complaint"),
    [
        ("[gone](gone.md)", "gone.md does not exist"),
        ("![gone](images/gone.png)", "images/gone.png does not exist"),
        ("[below](../README.md#nothing)", "has no such heading"),
        ("Since 4f1d0c9 it is so.", "4f1d0c9 looks like a commit"),
        ("See `fill.h`.", "there is no fill.h"),
        ("| `attic/` | | |", "there is no room attic"),
    ],
)
def test_a_mistake_on_a_page_is_named(house: Path, mistake: str, complaint: str) -> None:
    append(house, mistake)
    found = check_docs.complaints(house)
    assert len(found) == 1 and complaint in found[0]


def test_numbers_words_and_code_are_no_commits_and_no_links(house: Path) -> None:
    append(house, "1002528 unknowns, 8.1e-13, 1146164_cut, deadbeat\n```\n[x](y) f(a[0])(b)\n```")
    assert check_docs.complaints(house) == []


def test_a_page_that_nobody_links_to_is_named(house: Path) -> None:
    (house / "docs/lost.md").write_text("[words](glossary.md)\n")
    assert check_docs.complaints(house) == ["docs/lost.md: no page links to it"]


def test_a_page_without_the_glossary_is_named(house: Path) -> None:
    append(house, "[new](new.md)")
    (house / "docs/new.md").write_text("# New\n")
    assert check_docs.complaints(house) == ["docs/new.md: no link to docs/glossary.md"]


def test_a_room_without_a_row_is_named(house: Path) -> None:
    room = house / "native/flipfree/certify"
    room.mkdir()
    (room / "certify.h").write_text("// Certifies.\n")
    assert check_docs.complaints(house) == ["docs/architecture.md: no row begins with `certify/`"]
