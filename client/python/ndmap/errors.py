# SPDX-License-Identifier: Apache-2.0
"""What goes wrong, by the codes of gRPC. The text of an error is one sentence."""
from __future__ import annotations

import grpc


class NdmapError(Exception):
    """The root of all errors of this package. `code` is gRPC's, also when no service was asked."""

    code: grpc.StatusCode = grpc.StatusCode.UNKNOWN


class InvalidArgumentError(NdmapError, ValueError):
    """What was given is wrong whatever the state of the cluster."""

    code = grpc.StatusCode.INVALID_ARGUMENT


class NotFoundError(NdmapError, LookupError):
    """No such map, job, surface, block, dart or cell."""

    code = grpc.StatusCode.NOT_FOUND


class AlreadyExistsError(NdmapError):
    """There is a map of that name."""

    code = grpc.StatusCode.ALREADY_EXISTS


class FailedPreconditionError(NdmapError):
    """Not in this state: another job works on the map, or the versions of two programs differ."""

    code = grpc.StatusCode.FAILED_PRECONDITION


class StaleDartError(FailedPreconditionError):
    """The block has changed since the dart was got: its index may stand for another dart now."""


class ResourceExhaustedError(NdmapError):
    """A configured limit, which the sentence names."""

    code = grpc.StatusCode.RESOURCE_EXHAUSTED


class UnavailableError(NdmapError, ConnectionError):
    """A server cannot be reached; may be tried again."""

    code = grpc.StatusCode.UNAVAILABLE


class DeadlineExceededError(NdmapError, TimeoutError):
    """A server did not answer in the time that ClientOptions allow, or a job did not end in the time given."""

    code = grpc.StatusCode.DEADLINE_EXCEEDED


class CancelledError(NdmapError):
    """A call was cancelled, for example because the client was closed meanwhile."""

    code = grpc.StatusCode.CANCELLED


class JobCancelledError(CancelledError):
    """The job was cancelled; its map is valid, unless the job was to make it."""


class AbortedError(NdmapError):
    """The work was given up; a question, because the map kept changing while it was asked."""

    code = grpc.StatusCode.ABORTED


class JobFailedError(AbortedError):
    """The job failed; the sentence says why."""


class UnimplementedError(NdmapError):
    """The service does not know this call: it is of another version."""

    code = grpc.StatusCode.UNIMPLEMENTED


class InternalError(NdmapError):
    """A fault of ndmap."""

    code = grpc.StatusCode.INTERNAL


class DataLossError(NdmapError):
    """What came over the wire is not what was sent."""

    code = grpc.StatusCode.DATA_LOSS


class OutputError(NdmapError, OSError):
    """A file cannot be written."""

    code = grpc.StatusCode.UNAVAILABLE


class MissingPackageError(NdmapError, ImportError):
    """An optional package is not installed; the sentence names the one to install."""

    code = grpc.StatusCode.FAILED_PRECONDITION


_BY_CODE: dict[grpc.StatusCode, type[NdmapError]] = {
    kind.code: kind
    for kind in (
        InvalidArgumentError,
        NotFoundError,
        AlreadyExistsError,
        FailedPreconditionError,
        ResourceExhaustedError,
        UnavailableError,
        DeadlineExceededError,
        CancelledError,
        AbortedError,
        UnimplementedError,
        InternalError,
        DataLossError,
    )
}


def _unreachable(message: str, who: str) -> str:
    # gRPC's sentence about a failed connection is long; its end is what matters: "...: Connection refused". What the
    # one who was asked says of another, whom it could not reach, begins otherwise and stays.
    if not message.lower().startswith(("failed to connect", "dns resolution")):
        return f"{who}: {message}"
    return f"{who} cannot be reached: {message.rsplit(': ', 1)[-1]}"


def from_rpc(error: grpc.RpcError, who: str) -> NdmapError:
    """The error of a call. `who` ("the coordinator at 127.0.0.1:7000") begins the sentences that gRPC itself makes."""
    code: grpc.StatusCode = error.code()
    message: str = error.details() or ""
    if code == grpc.StatusCode.UNAVAILABLE:
        message = _unreachable(message, who)
    elif code == grpc.StatusCode.DEADLINE_EXCEEDED:
        # gRPC's own words; others are of somebody whom the one who was asked waited for.
        own = message in ("", "Deadline Exceeded")
        message = f"{who} did not answer in time" if own else f"{who}: {message}"
    elif code == grpc.StatusCode.UNIMPLEMENTED:
        message = f"{who}: {message or 'it does not know this call'}"
    result = _BY_CODE.get(code, NdmapError)(message)
    result.code = code
    return result
