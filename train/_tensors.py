"""Arrays of many worlds as tensors."""

from typing import Any

import numpy as np
import torch


def tensor_of(x: np.ndarray, device: Any = "cpu") -> torch.Tensor:
    """A tensor with what is in an array, in its memory where that can be; in single precision."""
    return torch.from_numpy(np.ascontiguousarray(x, np.float32 if x.dtype == np.float64 else None)).to(device)
