"""Types and shapes of every call in a test run, at less than half the price.

``--jaxtyping-packages`` writes ``@jaxtyping.jaxtyped(typechecker=...)`` before each function of the project.
That decorator binds the arguments, checks them, calls, and checks arguments and answer again; and it compiles
three functions for each one that is imported. The one below checks arguments and answer once, with the same
memory of shapes, and compiles what is called. What `isinstance` says of a numpy array, millions of times in a
test run, is found without copies of that memory: dtypes that jaxtyping passed once, then axis by axis.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import jaxtyping
import numpy as np
from beartype import BeartypeConf, beartype
from jaxtyping import _array_types as hints
from jaxtyping._storage import get_shape_memo, pop_shape_memo, push_shape_memo

KIND = type(jaxtyping.Float[np.ndarray, ""])  # of all shapes
slowly: Callable[[Any, object], bool] = vars(KIND)["__instancecheck__"]
CHECKED = beartype(conf=BeartypeConf(violation_type=TypeError))


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which raises `TypeError` for arguments or an answer that are not as it says."""
    typed: Callable[..., Any] | None = None

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        nonlocal typed
        __tracebackhide__ = True
        if typed is None:
            typed = CHECKED(function)
        push_shape_memo({})
        try:
            return typed(*args, **kwargs)
        finally:
            pop_shape_memo()

    return call


def checked_class(cls: type) -> type:
    """The class; a dataclass is made of checked fields. Methods have been seen to one by one."""
    if dataclasses.is_dataclass(cls) and "__init__" in vars(cls):
        cls.__init__ = checked(cls.__init__)  # type: ignore[method-assign]
    return cls


def checked_thing(thing: Any) -> Any:
    """What the import hook may decorate: a function or a class."""
    return checked_class(thing) if isinstance(thing, type) else checked(thing)


def jaxtyped(*, typechecker: object) -> Callable[[Any], Any]:
    """Stands in for `jaxtyping.jaxtyped`, as the import hook calls it."""
    return checked_thing


class PlainHint:
    """A shape of which each axis is a number or a name or anything, for numpy arrays.

    Attributes:
        at: Where any number of axes may be, or None.
        name: Theirs together, or None.
        n_axes: How many others there are, which are numbered without those.
        fixed: Axes of so many entries.
        named: Axes that are as long as others of the same name.
        dtypes: Whether jaxtyping passed them.
    """

    def __init__(self, hint: Any) -> None:
        """Read off what jaxtyping found in the text."""
        self.hint, self.dtypes = hint, dict[np.dtype[Any], bool]()
        dims, self.at = list(hint.dims), hint.index_variadic
        self.name = None if self.at is None else getattr(dims.pop(self.at), "name", None)
        self.n_axes = len(dims)
        self.fixed = [(axis, dim.size) for axis, dim in enumerate(dims) if isinstance(dim, hints._FixedDim)]
        self.named = [(axis, dim.name) for axis, dim in enumerate(dims) if isinstance(dim, hints._NamedDim)]

    def takes(self, dtype: np.dtype[Any]) -> bool:
        """What jaxtyping says of an array of this dtype with nothing remembered."""
        if dtype not in self.dtypes:
            sizes = dict(self.fixed)
            push_shape_memo({})
            probe = np.empty([sizes.get(axis, 1) for axis in range(self.n_axes)], dtype)
            self.dtypes[dtype] = slowly(self.hint, probe)
            pop_shape_memo()
        return self.dtypes[dtype]

    def fits(self, array: np.ndarray) -> bool:
        """Whether an array is of this kind; if so, lengths of named axes are remembered for the call."""
        shape, rest = array.shape, (False, ())
        if self.at is not None and len(shape) >= self.n_axes:
            end = self.at + len(shape) - self.n_axes
            shape, rest = shape[: self.at] + shape[end:], (False, shape[self.at : end])
        if len(shape) != self.n_axes or not self.takes(array.dtype):
            return False
        lengths, rests, *_ = get_shape_memo()  # type: ignore[no-untyped-call]
        if self.name is not None and rests.get(self.name, rest) != rest:
            return slowly(self.hint, array)  # it may broadcast
        agree = agrees(shape, self.fixed, self.named, lengths)
        if agree and self.name is not None:
            rests[self.name] = rest
        return agree


def agrees(
    shape: tuple[int, ...],
    fixed: list[tuple[int, int]],
    named: list[tuple[int, str]],
    lengths: dict[str, int],
) -> bool:
    """Whether axes are as long as their numbers and others of their names, which are remembered if so."""
    for axis, size in fixed:
        if shape[axis] != size:
            return False
    news = []
    for axis, name in named:
        known = lengths.get(name)
        if known is None:
            lengths[name] = shape[axis]
            news.append(name)
        elif known != shape[axis]:
            for new in news:
                del lengths[new]
            return False
    return True


@functools.cache
def plain(hint: Any) -> PlainHint | None:
    """The hint as a plain one, or None: a length that is worked out, or axes that broadcast."""
    if hint.array_type is not np.ndarray or hint._skip_instancecheck:
        return None
    simple = (
        dim in (hints._anonymous_dim, hints._anonymous_variadic_dim)
        or (isinstance(dim, hints._FixedDim) and not dim.broadcastable)
        or (
            isinstance(dim, hints._NamedDim | hints._NamedVariadicDim)
            and not dim.broadcastable
            and not dim.treepath
        )
        for dim in hint.dims
    )
    return PlainHint(hint) if all(simple) else None


def is_of(hint: Any, thing: object) -> bool:
    """Whether `thing` is what a hint with a shape says: in place of jaxtyping's own `isinstance`."""
    if type(thing) is np.ndarray and (shape := plain(hint)) is not None:
        return shape.fits(thing)
    return slowly(hint, thing)


def install() -> None:
    """From here on the import hook decorates, and shapes are looked at, so."""
    jaxtyping.jaxtyped = jaxtyped  # type: ignore[assignment]
    KIND.__instancecheck__ = is_of  # type: ignore[method-assign, assignment]
