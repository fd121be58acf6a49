"""Union-find."""

from __future__ import annotations


class DisjointSets:
    """0 ... count - 1, at first each in a set of its own; a set is named by its least element."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))

    def find(self, i: int) -> int:
        parent = self._parent
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    def join(self, i: int, j: int) -> bool:
        """Makes the sets of i and j one; whether they were two."""
        i, j = self.find(i), self.find(j)
        self._parent[max(i, j)] = min(i, j)
        return i != j
