"""A dataset of a run file, read as it is indexed."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

CLOSED = "the run file is closed; ibfil.open opens it again"


class Column:
    """A dataset (T, ...) of which the first ``rows`` count; indexing reads, ``np.asarray`` reads it all."""

    def __init__(self, dataset: h5py.Dataset, rows: int) -> None:
        self._dataset = dataset
        self.shape: tuple[int, ...] = (rows, *dataset.shape[1:])
        self.dtype = dataset.dtype

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        return f"<Column {self.shape} {self.dtype}; [...] reads>"

    def __getitem__(self, key: Any) -> np.ndarray:
        first, *rest = key if isinstance(key, tuple) else (key,)
        if isinstance(first, slice):
            start, stop, step = first.indices(len(self))
            if step < 0:  # which h5py does not do
                return self[(slice(None), *rest)][first]
            first = slice(start, max(start, stop), step)
        elif first is not Ellipsis:
            number = int(first)
            if not -len(self) <= number < len(self):
                raise IndexError(f"output {number} of {len(self)}")
            first = number % len(self)
        else:
            return np.asarray(self)[key]
        return self._open[(first, *rest)]

    @property
    def _open(self) -> h5py.Dataset:
        """The dataset. Raises ValueError where its file has been closed."""
        if not self._dataset:
            raise ValueError(CLOSED)
        return self._dataset

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        values = self._open[: len(self)]
        return values if dtype is None else values.astype(dtype)
