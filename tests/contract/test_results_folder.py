"""What a folder of results keeps and gives up: manifests, locks, digests."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from wifipgo.errors import BadInputError
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import read_sealed, write_sealed
from wifipgo.files.folder_lock import held

KIND = "evaluate"


def written(folder: Path) -> Path:
    """A folder with results of a run."""
    results_folder.begin(folder, KIND)
    results_folder.note(folder, ["a.json", "in/b.npz", "mine/"])
    for name in ("a.json", "in/b.npz", "mine/x", "in/b.npz.tmp"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("x")
    return folder


def test_only_what_a_run_wrote_is_removed(tmp_path: Path) -> None:
    out = written(tmp_path / "out")
    (out / "in/thesis.tex").write_text("40 pages")
    with pytest.raises(BadInputError, match=r"also holds 'in/thesis\.tex'"):
        results_folder.remove(out, KIND)
    assert (out / "a.json").exists()
    (out / "in/thesis.tex").unlink()
    with pytest.raises(BadInputError, match="nothing but results of train"):
        results_folder.remove(out, "train")
    results_folder.remove(out, KIND)
    assert not out.exists()


def test_links_are_not_followed(tmp_path: Path) -> None:
    written(tmp_path / "data")
    out = written(tmp_path / "out")
    results_folder.note(out, ["link/a.json", "../data/a.json"])
    (out / "link").symlink_to(tmp_path / "data")
    with pytest.raises(BadInputError, match="also holds 'link'"):
        results_folder.remove(out, KIND)
    assert (tmp_path / "data/a.json").exists()


@pytest.mark.parametrize("n_removed", range(6))
def test_a_removal_that_is_killed_can_be_done_again(
    n_removed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, unlink, left = written(tmp_path / "out"), Path.unlink, iter(range(n_removed))

    def dying(path: Path, missing_ok: bool = False) -> None:
        next(left)
        unlink(path, missing_ok=missing_ok)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", dying)
        try:
            results_folder.remove(out, KIND)
        except StopIteration:
            assert out.exists()
    results_folder.remove(out, KIND)
    assert not out.exists()


def test_a_manifest_cut_short_loses_no_later_name(tmp_path: Path) -> None:
    out = written(tmp_path / "out")
    with (out / results_folder.MANIFEST).open("a") as file:
        file.write('\n"c.js')
    results_folder.note(out, ["d.json"])
    (out / "d.json").write_text("x")
    assert results_folder.foreign(out, KIND) == []


def test_results_take_a_name_and_leave_nothing_of_the_old(tmp_path: Path) -> None:
    out, staging = written(tmp_path / "out"), tmp_path / "staging"
    written(results_folder.replaced_of(out))  # of a run that was killed
    staging.mkdir()
    (staging / "new.json").write_text("x")
    results_folder.publish(staging, out, KIND, later=["picture.png"])
    (out / "picture.png").write_text("x")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"]
    assert results_folder.foreign(out, KIND) == []
    replaced = results_folder.replaced_of(out)
    replaced.mkdir()
    (replaced / "mine").write_text("x")
    with pytest.raises(BadInputError, match=r"out\.replaced also holds 'mine'"):
        results_folder.check_replaceable(out, KIND)


def test_a_lock_is_held_by_one_and_by_no_dead_process(tmp_path: Path) -> None:
    lock = tmp_path / "out.lock"
    lock.write_text("process 1 on another-host\n")  # what a dead process left
    with held(tmp_path / "out"):
        with pytest.raises(BadInputError, match=f"process {os.getpid()} on "), held(tmp_path / "out"):
            pass
        with held(tmp_path / "other"):
            pass
    assert not lock.exists()
    head = "import os, sys; from pathlib import Path; from wifipgo.files.folder_lock import held; "
    dying = f"{head} lock = held(Path(sys.argv[1])); lock.__enter__(); os._exit(9)"
    subprocess.run([sys.executable, "-c", dying, str(tmp_path / "out")], check=False, cwd=Path.cwd())
    assert lock.exists()
    with held(tmp_path / "out"):
        pass


def test_every_flipped_byte_is_known(tmp_path: Path) -> None:
    path, content = tmp_path / "a.npz", bytes(range(256))
    write_sealed(path, content)
    assert read_sealed(path) == content
    whole = path.read_bytes()
    for k in range(0, len(whole), 7):
        path.write_bytes(whole[:k] + bytes([whole[k] ^ 1]) + whole[k + 1 :])
        with pytest.raises(BadInputError, match=r"a\.npz: damaged"):
            read_sealed(path)
    for cut in (0, 10, 200, len(whole) - 1):
        path.write_bytes(whole[:cut])
        with pytest.raises(BadInputError, match="damaged"):
            read_sealed(path)
