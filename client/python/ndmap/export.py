# SPDX-License-Identifier: Apache-2.0
"""A map as files for ParaView: a VTU piece a block, written by the block's own server, and the PVTU index of them."""
from __future__ import annotations

import os
import threading
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Callable, Iterator
from xml.sax.saxutils import escape

import grpc
import xxhash

from ndmap.connection import Connection, server_name
from ndmap.errors import DataLossError, InvalidArgumentError, from_rpc
from ndmap.info import MapInfo
from ndmap.output import OutputFiles
from ndmap.v1 import block_service_pb2 as pb

_AT_ONCE = 4
_QUOTES = {'"': "&quot;"}
CELLS = ("hexahedron", "polyhedron")
# Told how many pieces of how many are there, and the bytes so far.
ExportProgress = Callable[[int, int, int], None]


@dataclass(frozen=True)
class Exported:
    """What was written."""

    # The file to open.
    index: str
    pieces: tuple[str, ...]
    # Of the pieces.
    bytes: int
    cells: int


def check_cells(cells: str) -> None:
    """InvalidArgumentError unless pieces can be written so."""
    if cells not in CELLS:
        raise InvalidArgumentError(f"cells '{cells}' is none of {', '.join(CELLS)}")


def stream_piece(
    connection: Connection, info: MapInfo, block: int, options: dict[str, str]
) -> Iterator[bytes | pb.ExportSummary]:
    """The bytes of one block's piece, then its summary. Not tried again: half of it may have gone its way."""
    address = info.address_of(block)
    stub = connection.block_server(address)
    request = pb.ExportPieceRequest(map=info.name, block=block, options=options)
    digest = xxhash.xxh3_64()
    count = 0
    summary: pb.ExportSummary | None = None
    call: Any = connection.guarded(lambda: stub.ExportPiece(request, timeout=connection.options.transfer_timeout))
    try:
        for answer in call:
            if answer.HasField("summary"):
                summary = answer.summary
            else:
                digest.update(answer.data)
                count += len(answer.data)
                yield answer.data
    except grpc.RpcError as error:
        raise from_rpc(error, server_name(address)) from None
    finally:
        call.cancel()
    if summary is None or summary.bytes != count or summary.checksum != digest.intdigest():
        raise DataLossError(
            f"block {block}: the piece that came from {server_name(address)} ({count} bytes) "
            "is not the one that was sent"
        )
    yield summary


def index_text(first_piece: str, names: list[str]) -> str:
    """The text of the .pvtu file for these pieces, which all have the arrays of the one that is given."""
    head = b""
    with open(first_piece, "rb") as file:
        for line in file:
            if line.startswith(b"<AppendedData"):
                break
            head += line
    root = ElementTree.fromstring(head + b"</VTKFile>")
    lines = ['<?xml version="1.0"?>', _tag("VTKFile", {**root.attrib, "type": "PUnstructuredGrid"})]
    lines.append('<PUnstructuredGrid GhostLevel="0">')
    for section in ("PointData", "CellData", "Points"):
        element = root.find(f"UnstructuredGrid/Piece/{section}")
        assert element is not None
        lines.append(_tag(f"P{section}", element.attrib))
        for array in element:
            declared = {name: value for name, value in array.attrib.items() if name not in ("format", "offset")}
            lines.append(_tag(f"P{array.tag}", declared, "/"))
        lines.append(f"</P{section}>")
    lines += [_tag("Piece", {"Source": name}, "/") for name in names]
    return "\n".join(lines + ["</PUnstructuredGrid>", "</VTKFile>", ""])


def _tag(name: str, attributes: dict[str, str], end: str = "") -> str:
    quoted = [f' {key}="{escape(text, _QUOTES)}"' for key, text in attributes.items()]
    return f"<{name}{''.join(quoted)}{end}>"


class _Export:
    """One export under way."""

    def __init__(self, connection: Connection, info: MapInfo, options: dict[str, str], made: OutputFiles) -> None:
        self._connection, self._info, self._options, self._made = connection, info, options, made
        self._lock = threading.Lock()
        self._failed = False
        self.ready = self.bytes = self.cells = 0
        # Where the first piece is until it is put in place.
        self.first = ""

    def fetch(self, block: int, path: str, progress: ExportProgress | None) -> None:
        """One piece into its file; nothing once another has failed."""
        if self._failed:
            return
        summary = pb.ExportSummary()

        def parts() -> Iterator[bytes]:
            for part in stream_piece(self._connection, self._info, block, self._options):
                if isinstance(part, bytes):
                    yield part
                else:
                    summary.CopyFrom(part)

        try:
            beside = self._made.write(path, parts())
            with self._lock:
                if block == 0:
                    self.first = beside
                self.ready += 1
                self.bytes += summary.bytes
                self.cells += summary.counts.get("cells", 0)
                if progress:
                    progress(self.ready, self._info.block_count, self.bytes)
        except BaseException:
            self._failed = True
            raise


def export(
    connection: Connection,
    info: MapInfo,
    folder: str | os.PathLike[str],
    cells: str,
    progress: ExportProgress | None,
    attributes: bool = True,
) -> Exported:
    """Map.export; with the attributes of vertices and hexahedra, or without."""
    check_cells(cells)
    into = os.fspath(folder)
    made = OutputFiles(into)
    names = [f"block_{block:04d}.vtu" for block in range(info.block_count)]
    paths = [os.path.join(into, name) for name in names]
    index = os.path.join(into, "mesh.pvtu")
    options = {"cells": cells} if attributes else {"cells": cells, "attributes": "none"}
    work = _Export(connection, info, options, made)
    try:
        with ThreadPoolExecutor(min(_AT_ONCE, info.block_count)) as pool:
            for future in [pool.submit(work.fetch, block, path, progress) for block, path in enumerate(paths)]:
                future.result()
        # The index last: until then the one that was there leads to the pieces that were.
        made.write(index, iter([index_text(work.first, names).encode()]))
        made.put_in_place()
    except BaseException:
        made.take_back()
        raise
    made.keep()
    return Exported(index=index, pieces=tuple(paths), bytes=work.bytes, cells=work.cells)
