# SPDX-License-Identifier: Apache-2.0
"""How a client behaves: how long it waits and how often it tries again."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ClientOptions:
    """Times are in seconds."""

    # For the first answer of a coordinator or a block server.
    connect_timeout: float = 4.0
    # For one short call: a question, a job's start.
    call_timeout: float = 30.0
    # For one long stream: a surface up, a piece down.
    transfer_timeout: float = 1800.0
    # Calls that change nothing, or that are harmless when done twice, are tried that often in all when a server does
    # not answer, with this pause after the first try, twice as long after each further one.
    attempts: int = 3
    first_pause: float = 0.05
