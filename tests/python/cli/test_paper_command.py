"""`linkwise paper`."""

import json


def test_the_command_writes_the_report(linkwise, tmp_path):
    result = linkwise("paper", "--output", "there/report", "--quick", "--json")
    assert result.code == 0
    assert result.err == ""
    written = json.loads((tmp_path / "there/report/results.json").read_text())
    assert result.json == written
    assert result.json["quick"] is True


def test_a_folder_that_cannot_be_made_is_refused(linkwise, tmp_path):
    (tmp_path / "file").write_text("")
    result = linkwise("paper", "-o", "file", "--quick")
    assert result.code == 2
    assert "file" in result.complaint
    assert "name another" in result.complaint
