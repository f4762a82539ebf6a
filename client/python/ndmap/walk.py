# SPDX-License-Identifier: Apache-2.0
"""Proposition 1 from outside: walks that go on in the block, and on the server, that a crossing leads to."""
from __future__ import annotations

from typing import Iterable, Sequence

import numpy as np

from ndmap.connection import Connection, server_name
from ndmap.darts import DartInfo, Darts, DartsLike, Walks, Word, parse_word, references
from ndmap.errors import FailedPreconditionError, InternalError, InvalidArgumentError, StaleDartError
from ndmap.info import MapInfo
from ndmap.v1 import block_service_pb2 as pb
from ndmap.v1 import common_pb2, navigate_pb2

# What one call may carry.
MAX_STARTS = 65536
MAX_LETTERS = 65536


class _Walker:
    """One walk under way: where it goes on, and with which letter."""

    __slots__ = ("block", "start", "next_letter", "done", "free", "at", "block_crossings", "server_crossings")

    def __init__(self, dart: navigate_pb2.DartRef) -> None:
        self.block: int = dart.block
        self.start = pb.BetaStart(dart=dart)
        self.next_letter = 0
        self.done = self.free = False
        self.at = pb.DartInfo()
        self.block_crossings = self.server_crossings = 0


def _ask(
    connection: Connection, info: MapInfo, block: int, starts: Iterable[pb.BetaStart], word: bytes
) -> Sequence[pb.BetaResult]:
    """One call: walks in one block, as far as that block can follow them. A result for each start."""
    address = info.address_of(block)
    request = pb.BetaRequest(map=info.name, block=block, starts=starts, word=word, stay=True)
    stub = connection.block_server(address)
    try:
        results = connection.idempotent(stub.Beta, request, server_name(address)).results
    except FailedPreconditionError as error:
        # The only state that matters to a walk is the block's version.
        raise StaleDartError(str(error)) from None
    if len(results) != len(request.starts):
        raise InternalError(f"{server_name(address)} gave {len(results)} results for {len(request.starts)} darts")
    return results


def any_dart(connection: Connection, info: MapInfo, block: int) -> DartInfo:
    """Some dart of a block."""
    if not isinstance(block, (int, np.integer)) or not 0 <= block < 1 << 32:
        raise InvalidArgumentError(f"block {block!r}: a number of 0 ... {info.block_count - 1} expected")
    results = _ask(connection, info, int(block), [pb.BetaStart(any_dart=True)], b"")
    return Darts.from_protos(info.name, [results[0].at])[0]


class _Walk:
    """All walks of one question."""

    def __init__(self, connection: Connection, info: MapInfo, word: bytes) -> None:
        self._connection = connection
        self._info = info
        self._word = word

    def go(self, walkers: list[_Walker]) -> None:
        """Lets walkers in one block, at one letter, go as far as they can there, and over to the next block."""
        block, letter = walkers[0].block, walkers[0].next_letter
        rest = self._word[letter : letter + MAX_LETTERS]
        results = _ask(self._connection, self._info, block, [walker.start for walker in walkers], rest)
        lost: list[tuple[_Walker, common_pb2.Label]] = []
        for walker, result in zip(walkers, results):
            walker.next_letter += result.used
            walker.at = result.at
            if result.end == pb.WALK_END_ARRIVED:
                walker.done = walker.next_letter == len(self._word)
                walker.start = pb.BetaStart(dart=result.at.dart)
            elif result.end == pb.WALK_END_FREE:
                walker.free = walker.done = True
            elif result.end != pb.WALK_END_CROSSING:
                raise InternalError(
                    f"map '{self._info.name}': block {block} does not have the label that leads to it"
                )
            elif result.has_peer:
                self._cross(walker, result.peer, result.label)
            else:
                lost.append((walker, result.label))
        if lost:
            self._search(block, lost)

    def _cross(self, walker: _Walker, peer: int, label: common_pb2.Label) -> None:
        there = self._info.address_of(peer)
        walker.block_crossings += 1
        walker.server_crossings += there != self._info.address_of(walker.block)
        walker.block = peer
        walker.start = pb.BetaStart(label=label)
        # The crossing is the letter.
        walker.next_letter += 1

    def _search(self, block: int, lost: list[tuple[_Walker, common_pb2.Label]]) -> None:
        """Broadcast routing: no dart knows where its partner is, so every other block is asked."""
        for peer in range(self._info.block_count):
            if peer == block or not lost:
                continue
            found = _ask(self._connection, self._info, peer, [pb.BetaStart(label=label) for _, label in lost], b"")
            for (walker, label), result in zip(lost, found):
                if result.end == pb.WALK_END_ARRIVED:
                    self._cross(walker, peer, label)
            lost = [item for item, result in zip(lost, found) if result.end != pb.WALK_END_ARRIVED]
        if lost:
            label = lost[0][1]
            raise InternalError(
                f"map '{self._info.name}': no block but {block} has label {label.root:x}:{label.path:x}"
            )


def beta(connection: Connection, info: MapInfo, darts: DartsLike, word: Word) -> Walks:
    """Map.beta. A call for each group of walks that are in the same block at the same letter."""
    letters = parse_word(word)
    walkers = [_Walker(dart) for dart in references(info.name, darts)]
    walk = _Walk(connection, info, letters)
    under_way = walkers
    while under_way:
        groups: dict[tuple[int, int], list[_Walker]] = {}
        for walker in under_way:
            groups.setdefault((walker.block, walker.next_letter), []).append(walker)
        for _, group in sorted(groups.items(), key=lambda item: item[0]):
            for first in range(0, len(group), MAX_STARTS):
                walk.go(group[first : first + MAX_STARTS])
        under_way = [walker for walker in under_way if not walker.done]
    return Walks(
        darts=Darts.from_protos(info.name, [walker.at for walker in walkers]),
        used=np.array([walker.next_letter for walker in walkers], np.int64),
        free=np.array([walker.free for walker in walkers], np.bool_),
        block_crossings=np.array([walker.block_crossings for walker in walkers], np.int64),
        server_crossings=np.array([walker.server_crossings for walker in walkers], np.int64),
    )
