# SPDX-License-Identifier: Apache-2.0
"""Maps from mesh files. What reads, checks, glues and cuts a mesh is the program `ndmap`; this package has no second one."""
from __future__ import annotations

import os
import subprocess

from ndmap.errors import InvalidArgumentError, MissingPackageError, NdmapError


def create_from_file(
    program: str, target: str, name: str, mesh: str | os.PathLike[str], options: list[str], timeout: float
) -> None:
    """Lets `ndmap create NAME --mesh FILE` make the map, and waits. Its own sentence when it does not."""
    # A name that looks like an option is none.
    command = [program, "create", f"--mesh={os.fspath(mesh)}", *options, f"--coordinator={target}", "--json", "--", name]
    try:
        run = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace", timeout=timeout, check=False,
        )
    except FileNotFoundError:
        raise MissingPackageError(
            f"create_map_from_mesh() needs the program '{program}', which reads and cuts mesh files: install it, or say "
            "where it is (program=)"
        ) from None
    except OSError as error:
        raise MissingPackageError(f"the program '{program}' cannot be run: {error.strerror}") from None
    except subprocess.TimeoutExpired:
        raise NdmapError(f"'{program} create' took more than {timeout:g} s (ClientOptions.transfer_timeout)") from None
    if run.returncode == 0:
        return
    said = [line for line in run.stderr.splitlines() if line.strip()] or [f"exit code {run.returncode}"]
    raise InvalidArgumentError(said[-1].removeprefix("ndmap create: "))
