# SPDX-License-Identifier: Apache-2.0
"""What all objects of one client share: the coordinator's stub, and one channel for each block server met so far."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable, TypeVar

import grpc

from ndmap._version import __version__
from ndmap.errors import (
    AbortedError,
    CancelledError,
    FailedPreconditionError,
    InvalidArgumentError,
    UnavailableError,
    from_rpc,
)
from ndmap.options import ClientOptions
from ndmap.v1 import block_service_pb2_grpc, common_pb2, coordinator_pb2_grpc

# A message of the protocol is at most this long.
MAX_MESSAGE_BYTES = 16 << 20

_CHANNEL_OPTIONS = [
    ("grpc.max_receive_message_length", MAX_MESSAGE_BYTES),
    ("grpc.max_send_message_length", MAX_MESSAGE_BYTES),
    ("grpc.enable_http_proxy", 0),
    # Equal to the services': a peer that is cut off is noticed while a long stream is silent.
    ("grpc.keepalive_time_ms", 10000),
    ("grpc.keepalive_timeout_ms", 5000),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 2000),
]

Method = Callable[..., Any]
Result = TypeVar("Result")


def check_target(target: str) -> None:
    """InvalidArgumentError unless it is HOST:PORT with a port of 1 ... 65535 ("[::1]:7000" for IPv6 numbers)."""
    host, colon, port = target.rpartition(":")
    bracketed = "[" in host and host.endswith("]")
    is_port = port.isascii() and port.isdigit() and 1 <= int(port) <= 65535
    if not colon or not host or (":" in host and not bracketed) or not is_port:
        raise InvalidArgumentError(f"'{target}' is not HOST:PORT, for example 127.0.0.1:7000")


def _own_version() -> common_pb2.Version:
    return common_pb2.Version(protocol=common_pb2.PROTOCOL_CURRENT, release=__version__, program="python")


def server_name(address: str) -> str:
    """For errors."""
    return f"the block server at {address}"


class Connection:
    """Makes all calls. Connects when it is first used."""

    def __init__(self, target: str, options: ClientOptions) -> None:
        check_target(target)
        self.target = target
        self.options = options
        self.coordinator_name = f"the coordinator at {target}"
        self._lock = threading.Lock()
        self._channels: list[grpc.Channel] = []
        self._closed = False
        self._servers: dict[str, block_service_pb2_grpc.BlockServiceStub] = {}
        self.coordinator = coordinator_pb2_grpc.CoordinatorStub(self._channel(target))

    def _channel(self, target: str) -> grpc.Channel:
        channel = grpc.insecure_channel(target, options=_CHANNEL_OPTIONS)
        self._channels.append(channel)
        return channel

    def close(self) -> None:
        """Ends all calls that are under way."""
        with self._lock:
            self._closed = True
            for channel in self._channels:
                channel.close()

    def retry(self, call: Callable[[], Result]) -> Result:
        """Calls until it does not raise UnavailableError, options.attempts times at most."""
        pause = self.options.first_pause
        for _ in range(self.options.attempts - 1):
            try:
                return call()
            except UnavailableError:
                time.sleep(pause)
                pause *= 2
        return call()

    def patient(self, call: Callable[[], Result]) -> Result:
        """The same, and for call_timeout while it raises AbortedError: a job is bringing the map up to date."""
        end = time.monotonic() + self.options.call_timeout
        pause = self.options.first_pause
        while True:
            try:
                return self.retry(call)
            except AbortedError:
                if time.monotonic() + pause > end:
                    raise
            time.sleep(pause)
            pause = min(2 * pause, 1.0)

    def once(self, method: Method, request: Any, who: str = "", timeout: float | None = None) -> Any:
        """A call with a deadline (call_timeout unless given); `who` is the coordinator unless given."""
        return self.guarded(lambda: method(request, timeout=timeout or self.options.call_timeout), who)

    def idempotent(self, method: Method, request: Any, who: str = "") -> Any:
        """The same, tried again when the server does not answer."""
        return self.retry(lambda: self.once(method, request, who))

    def guarded(self, call: Callable[[], Result], who: str = "") -> Result:
        """Does what calls gRPC; its errors become ours."""
        if self._closed:
            raise FailedPreconditionError(f"the client of {self.coordinator_name} is closed")
        try:
            return call()
        except grpc.RpcError as error:
            raise from_rpc(error, who or self.coordinator_name) from None
        except ValueError as error:
            # What a channel says that was closed meanwhile.
            if not self._closed:
                raise
            raise CancelledError(f"the client of {self.coordinator_name} was closed: {error}") from None

    def exchange_versions(self, stub: Any, who: str) -> common_pb2.Version:
        """The peer's version. FailedPreconditionError that names both protocols if they differ."""
        request = common_pb2.GetVersionRequest(caller=_own_version())
        answer = self.once(stub.GetVersion, request, who, self.options.connect_timeout)
        if answer.version.protocol != common_pb2.PROTOCOL_CURRENT:
            raise FailedPreconditionError(
                f"{who} speaks protocol {answer.version.protocol}, this client {common_pb2.PROTOCOL_CURRENT}"
            )
        return answer.version

    def block_server(self, address: str) -> block_service_pb2_grpc.BlockServiceStub:
        """The stub for a block server; versions are exchanged when it is first used."""
        with self._lock:
            known = self._servers.get(address)
            if known is not None:
                return known
            if self._closed:
                raise FailedPreconditionError(f"the client of {self.coordinator_name} is closed")
            channel = self._channel(address)
        stub = block_service_pb2_grpc.BlockServiceStub(channel)
        try:
            self.retry(lambda: self.exchange_versions(stub, server_name(address)))
        except Exception:
            with self._lock:
                self._channels.remove(channel)
            channel.close()
            raise
        with self._lock:
            return self._servers.setdefault(address, stub)
