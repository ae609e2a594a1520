import json

import pytest

from linkwise.paper import write_report


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """(folder, results) of a quick run: a few seconds."""
    folder = tmp_path_factory.mktemp("paper") / "report"
    return folder, write_report(folder, quick=True)


@pytest.fixture(scope="session")
def results(report):
    folder, _ = report

    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    return json.loads((folder / "results.json").read_text(), parse_constant=refuse)


@pytest.fixture(scope="session")
def table2(results):
    """(method, maneuver, protocol) -> row."""
    return {(r["method"], r["maneuver"], r["protocol"]): r for r in results["table2"]}
