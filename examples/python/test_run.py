"""The graph of a run as a test: `pytest examples/python`, with the wheel installed.

A run is a recording: here `courier.mcap`, in your project the one that the previous job has just recorded.
"""

from pathlib import Path

import pytest

import bagreel

EXAMPLES = Path(__file__).resolve().parents[1]
RUN = EXAMPLES / "courier.mcap"


@pytest.fixture(scope="module")
def mission():
    return bagreel.read(RUN)


def test_the_graph_is_as_expected():
    assert bagreel.check(RUN, EXAMPLES / "ci/minimal.yaml").ok


def test_a_run_keeps_its_own_baseline(tmp_path):
    bagreel.baseline(RUN, tmp_path / "graph.yaml")
    assert bagreel.check(RUN, tmp_path / "graph.yaml").ok


def test_a_missing_node_is_named(tmp_path):
    expect = tmp_path / "graph.yaml"
    expect.write_text("schema: bagreel.expect/1\nnodes:\n  /lidar_rear: {}\n")
    outcome = bagreel.check(RUN, expect)
    assert not outcome.ok and outcome.errors == 1
    assert outcome.findings[0]["id"] == "node-missing" and "/lidar_rear" in str(outcome)


def test_the_robot_is_localized_before_it_drives(mission):
    started = [event["name"] for event in mission.events if event["kind"] == "started"]
    assert started.index("/amcl") < started.index("/nav/planner")


def test_the_planner_slows_down_once(mission):
    rates = [event for event in mission.events if event["kind"] == "rate" and event["name"] == "/plan"]
    assert len(rates) == 1


def test_the_same_mission_recorded_otherwise_differs_in_nothing_else():
    differences = bagreel.diff(RUN, EXAMPLES / "courier")
    assert {difference["kind"] for difference in differences} <= {"qos"}, differences
