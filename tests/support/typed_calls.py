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
        n_axes: As many as an array must have.
        fixed: Axes of so many entries.
        named: Axes that are as long as others of the same name.
        dtypes: Those that jaxtyping passed, and those that it did not.
    """

    def __init__(self, hint: Any) -> None:
        """Read off what jaxtyping found in the text."""
        self.n_axes, self.dtypes = len(hint.dims), dict[np.dtype[Any], bool]()
        axes = list(enumerate(hint.dims))
        self.fixed = [(axis, dim.size) for axis, dim in axes if isinstance(dim, hints._FixedDim)]
        self.named = [(axis, dim.name) for axis, dim in axes if isinstance(dim, hints._NamedDim)]
        self.probe = [dict(self.fixed).get(axis, 1) for axis, _ in axes]
        self.hint = hint

    def takes(self, dtype: np.dtype[Any]) -> bool:
        """What jaxtyping says of an array of this dtype with nothing remembered."""
        if dtype not in self.dtypes:
            push_shape_memo({})
            self.dtypes[dtype] = slowly(self.hint, np.empty(self.probe, dtype))
            pop_shape_memo()
        return self.dtypes[dtype]

    def fits(self, array: np.ndarray) -> bool:
        """Whether an array is of this kind; if so, lengths of named axes are remembered for the call."""
        shape = array.shape
        if len(shape) != self.n_axes or not self.takes(array.dtype):
            return False
        for axis, size in self.fixed:
            if shape[axis] != size:
                return False
        lengths: dict[str, int] = get_shape_memo()[0]  # type: ignore[no-untyped-call]
        news = []
        for axis, name in self.named:
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
    """The hint as a plain one, or None: a length that is worked out, broadcast, or of any number of axes."""
    if hint.array_type is not np.ndarray or hint._skip_instancecheck or hint.index_variadic is not None:
        return None
    simple = (
        dim is hints._anonymous_dim
        or (isinstance(dim, hints._FixedDim) and not dim.broadcastable)
        or (isinstance(dim, hints._NamedDim) and not dim.broadcastable and not dim.treepath)
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
