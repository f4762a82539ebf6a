# SPDX-License-Identifier: Apache-2.0
"""The files of an export: they take their places together when all are complete, or those that were there stay."""
from __future__ import annotations

import os
import re
import tempfile
from typing import Iterator

try:
    import fcntl
except ImportError:  # Another system: nobody is kept from writing into the same folder.
    fcntl = None  # type: ignore[assignment]

from ndmap.errors import OutputError

_BESIDE = ".new"
_BEFORE = ".old"
# The same as the command line's.
_LOCK_FILE = ".ndmap-lock"
_PIECE = re.compile(r"block_\d{4,}\.vtu(\.new|\.new\.part|\.old)?")


class OutputFiles:
    """Files for one folder, which is made if it is missing, and locked until keep() or take_back()."""

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self._folders: list[str] = []
        # Places of files that wait beside them, and of files that were moved: with whether they replaced one.
        self._beside: list[str] = []
        self._placed: list[tuple[str, bool]] = []
        self._lock = -1
        try:
            missing = os.path.abspath(folder)
            while not os.path.exists(missing):
                self._folders.append(missing)
                missing = os.path.dirname(missing)
            os.makedirs(folder, exist_ok=True)
            # Refused before anything is asked for, not at the first piece.
            with tempfile.NamedTemporaryFile(dir=folder, prefix=".ndmap-"):
                pass
            self._take_lock()
        except OSError as error:
            if isinstance(error, OutputError):
                raise
            raise OutputError(f"cannot write into '{folder}': {error.strerror}") from None

    def write(self, path: str, parts: Iterator[bytes]) -> str:
        """Writes the file beside its place, and says where."""
        beside = path + _BESIDE
        self._beside.append(path)
        try:
            with open(beside + ".part", "wb") as file:
                for part in parts:
                    file.write(part)
            os.replace(beside + ".part", beside)
        except OSError as error:
            if hasattr(error, "code"):
                raise
            raise OutputError(f"cannot write '{path}': {error.strerror}") from None
        return beside

    def put_in_place(self) -> None:
        """In the order of `write`. What is replaced waits for keep() or take_back()."""
        for path in self._beside:
            try:
                replaces = os.path.exists(path)
                if replaces:
                    os.replace(path, path + _BEFORE)
                # From here on it comes back.
                self._placed.append((path, replaces))
                os.replace(path + _BESIDE, path)
            except OSError as error:
                raise OutputError(f"cannot write '{path}': {error.strerror}") from None

    def keep(self) -> None:
        """All is well: what was replaced goes, and so do pieces of an earlier export that are not among the new."""
        named = {os.path.basename(path) for path, _ in self._placed}
        for name in os.listdir(self._folder):
            if name not in named and _PIECE.fullmatch(name):
                _remove(os.path.join(self._folder, name))
        for path, replaces in self._placed:
            if replaces:
                _remove(path + _BEFORE)
        self._release()

    def take_back(self) -> None:
        """As if nothing had been written."""
        for path, replaces in reversed(self._placed):
            if replaces:
                os.replace(path + _BEFORE, path)
            else:
                _remove(path)
        for path in self._beside:
            _remove(path + _BESIDE)
            _remove(path + _BESIDE + ".part")
        self._release()
        for folder in self._folders:
            if os.path.isdir(folder) and not os.listdir(folder):
                os.rmdir(folder)

    def _take_lock(self) -> None:
        if fcntl is None:
            return
        path = os.path.join(self._folder, _LOCK_FILE)
        while True:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # Who had it before may have removed it while this one was opening it.
                if os.path.exists(path) and os.path.samestat(os.fstat(descriptor), os.stat(path)):
                    self._lock = descriptor
                    return
            except BlockingIOError:
                raise OutputError(
                    f"cannot write into '{self._folder}': another export is writing there: wait for it to end, or take "
                    "another folder"
                ) from None
            finally:
                if self._lock != descriptor:
                    os.close(descriptor)

    def _release(self) -> None:
        if self._lock < 0:
            return
        # While it is locked: a file that others may have locked since is not removed.
        _remove(os.path.join(self._folder, _LOCK_FILE))
        os.close(self._lock)
        self._lock = -1


def _remove(path: str) -> None:
    try:
        os.unlink(path)
    except OSError:
        pass
