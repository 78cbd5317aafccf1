"""The head of a report that is signed, what marks a result that is not reliable, and its PDF."""

import shutil

import pytest
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.page import pdf
from flexband.report.text.numbers import with_minus
from flexband.study.presentation.title_block import title_block

STUDY = """
import numpy as np
import flexband as fb

study = fb.Study(
    lambda a: np.exp({rate} * a), {{"a": fb.Interval(-1.0, 1.0)}}, fb.PCCI(0, {order}),
    title_block={{"author": "A. <Weber>", "part": 4711}},
    requirements=fb.Requirement("response", below=2.0),
)
"""


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "study.py").write_text(STUDY.format(rate=0.1, order=3), encoding="utf-8")
    (tmp_path / "study.toml").write_text('title = "Wiper"\ndate = 2026-11-26\n', encoding="utf-8")
    result = run("run", tmp_path / "study.py", "-o", tmp_path / "out")
    assert result.exit_code in (0, 3), result.output
    return tmp_path / "out"


def test_a_page_has_the_title_block_of_the_study_and_of_the_file_beside_it(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "<h1>Wiper</h1>" in page
    for field, text in (("author", "A. &lt;Weber&gt;"), ("part number", "4711"),
                        ("date", "2026-11-26"), ("signature", "")):  # fmt: skip
        assert f"<dt>{field}</dt><dd>{text}</dd>" in page
    assert 'class="unreliable"' not in page
    (folder.parent / "study.toml").write_text('revision = "C"\n', encoding="utf-8")
    second = run("run", folder.parent / "study.py", "-o", folder)
    assert "no run was made" in second.output
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "<dt>revision</dt><dd>C</dd>" in page  # though the result is the same


def test_numbers_of_a_result_that_is_not_reliable_are_marked(tmp_path):
    (tmp_path / "study.py").write_text(STUDY.format(rate=3.0, order=0), encoding="utf-8")
    assert run("run", tmp_path / "study.py", "-o", tmp_path / "out").exit_code in (3, 5)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert '<main class="unreliable">' in page
    assert "marked ? are not reliable: the method does not trust its result" in page


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ({"autor": "A"}, "title_block must have title, author, part.* alone; got 'autor'"),
        ({"author": ["A"]}, r"title_block\['author'\] must be a text; got"),
        ("A", "title_block must be names with texts"),
    ],
)
def test_what_is_no_title_block_is_refused(block, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Study(lambda a: a, {"a": fb.Interval(0, 1)}, fb.PCCI(), title_block=block)


@pytest.mark.parametrize(
    ("text", "message"),
    [("author = ", "study.toml must be TOML"), ("autor = 1", "study.toml must have .*got 'autor'")],
)
def test_a_file_that_is_no_title_block_is_refused(tmp_path, text, message):
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(fb.errors.InputError, match=message):
        title_block({}, tmp_path / "study.py")


@pytest.mark.skipif(not any(map(shutil.which, pdf.BROWSERS)), reason="no browser")
def test_a_report_is_printed(folder):
    result = run("report", folder, "--pdf")
    assert result.exit_code == 0, result.output
    content = (folder / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF")
    assert b"/Type /Page\n" in content or content.count(b"/Type /Page") > 1


def test_without_a_browser_a_sentence_says_what_to_do(folder, monkeypatch):
    monkeypatch.setenv("PATH", "")
    result = run("report", folder, "--pdf")
    assert result.exit_code == 1
    assert "needs Chromium, Chrome or Edge on the PATH; none is there" in " ".join(
        result.output.split()
    )


def test_negative_numbers_have_a_minus_sign():
    texts = {"-1.2 … -3": "−1.2 … −3", "7e-5": "7e−5", "± -2 N": "± −2 N", "a-1": "a-1",
             "-1.3e-05 %": "−1.3e−5 %", "2e+09": "2e9", "case-1e-5": "case-1e-5",
             "v1e-5": "v1e-5"}  # fmt: skip
    assert {text: with_minus(text) for text in texts} == texts
