"""Ray: a cluster of the user's, or one of our own that nobody but this computer reaches."""

import importlib
import os
import socket
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ipaddress import ip_address
from typing import Any

from wifipgo.command.extras import load_extra
from wifipgo.command.processes import THREADS
from wifipgo.errors import BadInputError

_PATIENCE_S = 10.0
_SETTINGS = {"log_to_driver": False, "logging_level": "error"}
_TOKEN = "if it asks for a token, set RAY_AUTH_MODE=token and RAY_AUTH_TOKEN or RAY_AUTH_TOKEN_PATH here too"


def load_ray(
    address: str, *, what: str = "--executor ray", extra: str = "ray", modules: Sequence[str] = ()
) -> Any:
    """The Ray library, loaded only when it is asked for, and what its own cluster listens on decided before.

    Raises:
        MissingExtraError: It is not installed.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is sent anywhere
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    if not address:  # no other computer is to join, so it takes the loopback on every system
        os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
    load_extra(what, extra, "ray", *modules)
    return importlib.import_module("ray")


@contextmanager
def joined(ray: Any, address: str, *, n_cpus: int) -> Iterator[None]:
    """Join the cluster at an address; without one start our own, whatever runs here and RAY_ADDRESS says.

    Args:
        ray: The library.
        address: Of a cluster; empty: our own.
        n_cpus: Work at once on our own.

    Raises:
        ValueError: Nothing answers there, or it does not let us in.
    """
    _see_if_open(address)
    where = {"address": address} if address else {"address": "local", "num_cpus": n_cpus}
    dashboard = {} if address else {"include_dashboard": False}
    threads = {"env_vars": dict.fromkeys(THREADS, "1")}
    try:
        ray.init(**where, **dashboard, **_SETTINGS, runtime_env=threads)
    except (ConnectionError, RuntimeError, ValueError, ray.exceptions.RayError) as problem:
        reason = f"ray-address {address}: {first_line(problem)}" if address else first_line(problem)
        raise BadInputError(f"{reason}; {_TOKEN}") from problem
    try:
        if not address:
            _warn_if_reachable(ray)
        yield
    finally:
        ray.shutdown()


def _see_if_open(address: str) -> None:
    """Refuse an address at which nothing listens; Ray itself tries for minutes.

    Raises:
        ValueError: Nothing does.
    """
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdecimal():
        return  # "auto" and the like
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE_S).close()
    except (OSError, OverflowError) as problem:
        raise BadInputError(f"ray-address {address}: nothing answers there ({problem})") from problem


def _warn_if_reachable(ray: Any) -> None:
    """Say so if others could reach our own cluster: an older Ray, or one that was imported before us."""
    host = str(ray.get_runtime_context().gcs_address).rpartition(":")[0].strip("[]")
    if not ip_address(host).is_loopback and os.environ.get("RAY_AUTH_MODE", "").lower() != "token":
        danger = "whoever reaches its ports can run code here"
        remedy = "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER=0 keeps it here, RAY_AUTH_MODE=token asks for a token"
        warnings.warn(f"Ray listens on {host}: {danger}; {remedy}", RuntimeWarning, stacklevel=3)


def far_errand() -> Callable[[bytes], bytes]:
    """`baselines.evaluation.errands.carried_out` for a computer of a cluster, which may have no such package.

    Ray sends the inner function as it is, not by its name, so it runs there and can say what is missing.
    """

    def carry_out(errand: bytes) -> bytes:
        import pickle  # noqa: PLC0415
        import socket  # noqa: PLC0415 (nothing of this module is there)

        try:
            from baselines.evaluation.errands import carried_out  # noqa: PLC0415
        except ImportError as problem:
            missing = f"{socket.gethostname()} of the cluster cannot import wifipgo ({problem})"
            hint = "install the same version there, extras included"
            return pickle.dumps((False, RuntimeError(f"{missing}: {hint}"), ""))
        return carried_out(errand)

    return carry_out


def first_line(problem: BaseException) -> str:
    """What Ray says about a failure, without its pages of advice."""
    lines = [line.strip() for line in str(problem).splitlines() if line.strip()]
    detail = [line for line in lines if "exit detail" in line.lower()]
    return f"{type(problem).__name__}: {' '.join([*lines[:1], *detail])}".rstrip(": ")
