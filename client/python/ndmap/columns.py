# SPDX-License-Identifier: Apache-2.0
"""Many walks at once, in numpy columns."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from ndmap.connection import Connection, server_name
from ndmap.darts import Darts, DartsLike, Walks, Word, check_map, parse_word, references
from ndmap.errors import AbortedError, FailedPreconditionError, InternalError, InvalidArgumentError, StaleDartError
from ndmap.info import MapInfo
from ndmap.v1 import navigate_pb2

# What one call may carry: starts (below what servers take unless told otherwise), and starts times letters.
STARTS_A_CALL = 1 << 17
BETAS_A_CALL = 1 << 24
MAX_LETTERS = 65536
_ATTEMPTS = 4


def _column(values: Any, kind: type[np.unsignedinteger[Any]], name: str) -> np.ndarray:
    given = np.asarray(values)
    if given.ndim != 1 or (len(given) and given.dtype.kind not in "iu"):
        raise InvalidArgumentError(f"{name}: a column of whole numbers expected, not {given.dtype} of shape {given.shape}")
    if len(given) and (int(given.min()) < 0 or int(given.max()) > np.iinfo(kind).max):
        raise InvalidArgumentError(f"{name}: whole numbers of 0 ... {np.iinfo(kind).max} expected")
    return given.astype(kind)


@dataclass(frozen=True, eq=False)
class DartColumns:
    """Many darts of one map by block and index, one row a dart; with a version other than 0 a dart is refused once its
    block has changed. Made of arrays or lists of whole numbers."""

    map: str
    block: np.ndarray  # uint32
    index: np.ndarray  # uint32
    version: np.ndarray = None  # type: ignore[assignment]  # uint64; 0 for all unless given

    def __post_init__(self) -> None:
        object.__setattr__(self, "block", _column(self.block, np.uint32, "block"))
        object.__setattr__(self, "index", _column(self.index, np.uint32, "index"))
        version = np.zeros(len(self.index), np.uint64) if self.version is None else self.version
        object.__setattr__(self, "version", _column(version, np.uint64, "version"))
        if not len(self.block) == len(self.index) == len(self.version):
            raise InvalidArgumentError(
                f"{len(self.block)} blocks, {len(self.index)} indices and {len(self.version)} versions, expected as many"
            )

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, eq=False)
class WalkedColumns:
    """Where walks ended, one row a walk."""

    # The last darts that the word reached, with the versions of their blocks.
    darts: DartColumns
    # Letters that were applied: all of them unless `free`.
    used: np.ndarray  # uint32
    # The dart is free for the next letter: the boundary of the map.
    free: np.ndarray  # bool

    def __len__(self) -> int:
        return len(self.darts)


ManyDarts = Union[DartColumns, WalkedColumns, DartsLike]


def columns_of(map_name: str, darts: ManyDarts) -> DartColumns:
    """Darts in whatever form they were given. InvalidArgumentError for darts of another map."""
    if isinstance(darts, (WalkedColumns, Walks)):
        darts = darts.darts
    if isinstance(darts, (DartColumns, Darts)):
        check_map(map_name, darts.map)
        return DartColumns(map_name, darts.block, darts.index, darts.version)
    rows = references(map_name, darts)
    return DartColumns(
        map_name,
        np.array([row.block for row in rows], np.uint32),
        np.array([row.dart for row in rows], np.uint32),
        np.array([row.version for row in rows], np.uint64),
    )


class _Walk:
    """One attempt at all walks of a question."""

    def __init__(self, connection: Connection, info: MapInfo, starts: DartColumns, word: bytes) -> None:
        self._connection = connection
        self._info = info
        self._starts = starts
        self._word = word
        self.block, self.index, self.used = (np.empty(len(starts), np.uint32) for _ in range(3))
        # By block; 0: neither named nor met.
        self.version = np.zeros(info.block_count, np.uint64)
        named = starts.version != 0
        blocks, versions = starts.block[named], starts.version[named]
        self.version[blocks] = versions
        if (self.version[blocks] != versions).any():
            row = int(np.flatnonzero(self.version[blocks] != versions)[0])
            raise StaleDartError(
                f"darts of block {blocks[row]} were named at versions {versions[row]} and {self.version[blocks[row]]}:"
                " ask for them again"
            )

    def run(self) -> None:
        addresses = [self._info.address_of(block) for block in range(self._info.block_count)]
        a_call = min(STARTS_A_CALL, BETAS_A_CALL // max(1, len(self._word)))
        for address in sorted(set(addresses)):
            here = np.array([there == address for there in addresses])
            rows = np.flatnonzero(here[self._starts.block])
            for first in range(0, len(rows), a_call):
                self._ask(address, rows[first : first + a_call])

    def _ask(self, address: str, rows: np.ndarray) -> None:
        known = np.flatnonzero(self.version)
        request = navigate_pb2.WalkRequest(
            map=self._info.name,
            blocks=self._starts.block[rows].astype("<u4").tobytes(),
            darts=self._starts.index[rows].astype("<u4").tobytes(),
            version_blocks=known.tolist(),
            versions=self.version[known].tolist(),
            word=self._word,
        )
        stub = self._connection.block_server(address)
        try:
            answer = self._connection.idempotent(stub.Walk, request, server_name(address))
        except FailedPreconditionError as error:
            # The only state that matters to a walk is the block's version.
            raise StaleDartError(str(error)) from None
        for column, given in ((self.block, answer.blocks), (self.index, answer.darts), (self.used, answer.used)):
            if len(given) != 4 * len(rows):
                raise InternalError(f"{server_name(address)} gave {len(given) // 4} results for {len(rows)} darts")
            column[rows] = np.frombuffer(given, "<u4")
        self.version[list(answer.version_blocks)] = list(answer.versions)


def walk(connection: Connection, info: MapInfo, darts: ManyDarts, word: Word) -> WalkedColumns:
    """Map.walk. One call for as many darts of one server as it takes."""
    letters = parse_word(word)
    if len(letters) > MAX_LETTERS:
        raise InvalidArgumentError(f"a word of {len(letters)} letters, at most {MAX_LETTERS} are allowed")
    starts = columns_of(info.name, darts)
    if len(starts):
        info.address_of(int(starts.block.max()))
    for attempt in range(_ATTEMPTS):
        walks = _Walk(connection, info, starts, letters)
        try:
            walks.run()
            break
        except StaleDartError as error:
            # A version that the caller did not name is one that an earlier call of this attempt met.
            if starts.version.any():
                raise
            if attempt + 1 == _ATTEMPTS:
                raise AbortedError(str(error)) from None
    ends = DartColumns(info.name, walks.block, walks.index, walks.version[walks.block])
    return WalkedColumns(darts=ends, used=walks.used, free=walks.used < len(letters))
