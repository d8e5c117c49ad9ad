"""Bearings from real CSI recordings, on the command line and as a function.

::

    wifipgo recordings PATH [--out DIR]

Reads links (`wifipgo.radio.recordings.wsr_dataset`), computes each profile
(`wifipgo.radio.aoa.moving_aperture`) and takes its peaks with the code of the simulator
(`wifipgo.radio.aoa.find_peaks`).
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import tyro

from wifipgo.command.command_line import exit_code, say
from wifipgo.command.docstrings import documented
from wifipgo.command.terminal import Terminal
from wifipgo.data import CSI, example_or_path
from wifipgo.radio.aoa.moving_aperture import Bearing
from wifipgo.radio.recordings.bearing_files import write_bearings
from wifipgo.radio.recordings.intel5300 import read_csi_log
from wifipgo.radio.recordings.lone_log import is_log, packet_rows, packet_table, write_packets
from wifipgo.radio.recordings.recorded_link import Link, bearing
from wifipgo.radio.recordings.report import print_report
from wifipgo.radio.recordings.wsr_dataset import read_links


def report(
    path: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="PATH")],
    out: Path = Path("results/recordings"),
    channel: int | None = None,
) -> None:
    """Find transmitters in real Wi-Fi recordings and compare with motion capture.

    Prints one line a link: the bearing (top peak of the profile), the peak closest to
    the truth (an oracle's choice, not an answer), the truth (bearing from the mean
    position of the receiver's path), the error of the top peak, the share of the
    signal's power that it explains, the confidence (1: certain, 0: a guess; "out" marks
    the least confident 10 % of the links), where there are some, the packets left out as antenna A
    did not hear them at both ends, and, where the recording carries them, the
    answer and error of the WSR toolbox. Then medians and means per set, with and without
    the links marked "out", the bearings as CSV and JSON, and a picture with one polar profile a link.
    Without a survey of the transmitters there are no truth and no errors.

    Example: wifipgo recordings example

    Example: wifipgo recordings data/wsr/raw_LOS_A_L1 --out results/los

    A pack, ``data/wsr/wsr_slim_dev.npz``, and a folder of packs or runs, ``data/wsr``, are read too.
    Of a log alone, csi.dat, of either layout, it prints what it holds, and writes a line a packet as CSV: a
    bearing needs the motion, too. Exit code 2 and one line on stderr if a recording cannot be
    read.

    Args:
        path: A raw run (folder with csi_rx_*.dat), a packed .npz, a log .dat, or a folder of packs or runs;
            "example" for simulated links that ship with the package.
        out: Folder for the results, made if it is not there.
        channel: Wi-Fi channel at 5 GHz of a run that has no survey.
    """
    path = example_or_path(path, CSI)
    if is_log(path):
        _report_log(path, out)
        return
    links = read_links(path, channel=channel)
    out.mkdir(parents=True, exist_ok=True)
    bearings = [bearing(link) for link in links]
    print_report(links, bearings, title=path.resolve().name)
    for file in write_bearings(links, bearings, out / path.resolve().stem):
        say(f"bearings: {file}")
    _draw(links, bearings, out / f"{path.resolve().stem}.png", title=path.resolve().stem)


def _report_log(path: Path, out: Path) -> None:
    """Print what a log holds, and write its packets."""
    log = read_csi_log(path)
    rows = packet_rows(log)
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"{path.stem}.csv"
    write_packets(rows, file)
    Terminal().print(packet_table(log, rows, title=path.name))
    say(f"packets: {file}")


def _draw(links: list[Link], bearings: list[Bearing], picture: Path, *, title: str) -> None:
    """Draw what was printed already: a picture that fails is a warning."""
    from wifipgo.command.figures import drawing  # noqa: PLC0415 (loads matplotlib, slowly)

    with drawing(picture):
        from wifipgo.radio.recordings.picture import save_picture  # noqa: PLC0415

        save_picture(links, bearings, picture, title=title)
        say(f"picture: {picture}")


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    return exit_code(lambda: tyro.cli(documented(report), prog="wifipgo recordings", args=args))


if __name__ == "__main__":
    sys.exit(main())
