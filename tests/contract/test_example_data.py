"""The data that ship: the same when written again, small, in the package, and good to start from."""

from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from support.packaged_files import packaged_files
from support.project_files import ROOT

import wifipgo
from benchmarks.example_data import SIGMA, STAMP, Team, team_graph, write_all
from wifipgo.data import CSI, GRAPH, PACK, RUN, example_data, example_or_path
from wifipgo.graph.files.g2o import read_g2o
from wifipgo.graph.optimise import main as optimise
from wifipgo.graph.optimise import optimise as optimised
from wifipgo.graph.solvers.spatial import FULL_WEIGHT
from wifipgo.radio.recordings.__main__ import main as recordings
from wifipgo.radio.recordings.recorded_link import bearing
from wifipgo.radio.recordings.wsr_dataset import read_links
from wifipgo.se2 import wrap_angle


def contents(folder: Path) -> dict[str, bytes]:
    """Bytes of every file, by its path."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def unpacked(folder: Path) -> dict[str, bytes]:
    """The same with archives taken apart, whose headers depend on the version of Python that wrote them."""
    found = contents(folder)
    for name in [name for name in found if name.endswith(".npz")]:
        del found[name]
        with ZipFile(folder / name) as archive:
            found |= {f"{name}/{member}": archive.read(member) for member in archive.namelist()}
    return found


@pytest.fixture(scope="module")
def team() -> Team:
    return team_graph()


def test_written_again_they_are_the_same(tmp_path: Path) -> None:
    """To the byte, but for numbers of graphs that processors round in other ways."""
    write_all(tmp_path)
    shipped, again = unpacked(wifipgo.example_data()), unpacked(tmp_path)
    assert again.keys() == shipped.keys()
    graphs = {name for name in shipped if name.endswith(".g2o")}
    assert [name for name in shipped if name not in graphs and shipped[name] != again[name]] == []
    for name in sorted(graphs):
        (words, there), (same, here) = taken_apart(shipped[name]), taken_apart(again[name])
        assert words == same
        np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-6, err_msg=name)


def taken_apart(graph: bytes) -> tuple[list[str], list[float]]:
    """Words and whole numbers of a graph file, and its other numbers."""
    tokens = graph.decode().split()
    numbers = [token for token in tokens if "." in token or "e-" in token]
    return [token for token in tokens if token not in set(numbers)], [float(token) for token in numbers]


def test_they_are_small_and_in_the_package() -> None:
    sizes = {name: len(content) for name, content in contents(example_data()).items()}
    assert sum(size for name, size in sizes.items() if name.startswith(CSI)) <= 300_000
    assert sum(size for name, size in sizes.items() if name.startswith(GRAPH)) <= 200_000
    inside = example_data().relative_to(ROOT).as_posix()
    assert {f"{inside}/{name}" for name in sizes} <= packaged_files()


def test_bearings_of_the_pack_and_of_the_run() -> None:
    """Truth is the survey; some links are wrong, as of real recordings."""
    for path, n_links in ((example_data() / CSI / PACK, 6), (example_data() / CSI / RUN, 3)):
        links = read_links(path)
        errors_rad = wrap_angle(np.array([bearing(link).azimuth_rad - link.truth_rad for link in links]))
        assert len(links) == n_links
        assert {link.stamp for link in links} == {STAMP}
        assert np.median(np.rad2deg(np.abs(errors_rad))) < 3.0
        assert all(len(link.forward) > 100 and link.n_left_out == 0 for link in links)


def test_the_graph_is_that_of_the_team(team: Team) -> None:
    graph = read_g2o(example_data() / GRAPH).graph
    assert len(graph.robots) == 4
    np.testing.assert_allclose(graph.poses, team.graph.poses, atol=1e-6)
    np.testing.assert_allclose(graph.z, team.graph.z, atol=1e-6)
    np.testing.assert_allclose(graph.information[0], np.diag(SIGMA**-2), rtol=1e-6)


def test_a_robust_loss_finds_the_wrong_measurements_and_the_truth(team: Team) -> None:
    """What the example teaches: plain squares end decimetres off, GNC drops what is wrong."""
    graph = team.graph
    off_m = {}
    for robust in ("none", "gnc"):
        found = optimised(graph, robust=robust)
        off_m[robust] = np.sqrt(np.mean(np.sum((found.poses - team.truth)[:, :2] ** 2, axis=1)))
    dropped = np.flatnonzero(found.weight < FULL_WEIGHT)
    ends = {(int(graph.tail[k]), int(graph.head[k])) for k in dropped}
    assert len(team.wrong - ends) <= 1
    assert len(ends - team.wrong) <= 6
    assert off_m["gnc"] < 0.1 < off_m["none"]


def test_the_word_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both commands know it anywhere; a file or folder of that name goes first."""
    monkeypatch.chdir(tmp_path)
    assert recordings(["example", "--out", "bearings"]) == 0
    assert optimise(["example", "--robust", "gnc", "--out", "optimum"]) == 0
    assert Path("bearings/csi.png").is_file()
    assert Path("optimum/report.json").is_file()
    Path("example").mkdir()
    assert example_or_path(Path("example"), CSI) == Path("example")
    assert recordings(["example"]) == 2
    assert example_or_path(Path("elsewhere"), CSI) == Path("elsewhere")
