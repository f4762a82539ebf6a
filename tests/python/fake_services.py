# SPDX-License-Identifier: GPL-3.0-or-later
"""A coordinator and a block server in this process that say what a test tells them to, and keep what they are asked."""
from concurrent import futures

import grpc

from ndmap.v1 import attributes_pb2 as pb
from ndmap.v1 import block_service_pb2_grpc, common_pb2, coordinator_pb2, coordinator_pb2_grpc

VERSION = common_pb2.GetVersionResponse(version=common_pb2.Version(protocol=common_pb2.PROTOCOL_CURRENT))


class FakeServices:
    """One map, "m", whose only block is here. `answers` are given in turn: a message, a list of messages for a stream,
    or a (code, sentence) to refuse with."""

    def __init__(self, attributes=()):
        self.attributes = attributes
        self.answers = []
        # (call, request), of a stream all of its messages.
        self.asked = []
        self._server = grpc.server(futures.ThreadPoolExecutor(4), options=[("grpc.so_reuseport", 0)])
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"
        coordinator_pb2_grpc.add_CoordinatorServicer_to_server(_Coordinator(self), self._server)
        block_service_pb2_grpc.add_BlockServiceServicer_to_server(_BlockService(self), self._server)
        self._server.start()

    def stop(self):
        self._server.stop(None).wait()

    def requests(self, call):
        """What was asked so."""
        return [request for name, request in self.asked if name == call]

    def answer(self, call, request, context):
        self.asked.append((call, request))
        answer = self.answers.pop(0)
        if isinstance(answer, tuple):
            context.abort(*answer)
        return answer


class _Coordinator(coordinator_pb2_grpc.CoordinatorServicer):
    def __init__(self, services):
        self._services = services

    def GetVersion(self, request, context):
        return VERSION

    def GetMap(self, request, context):
        found = coordinator_pb2.Map(map="m", block_count=1, attributes=self._services.attributes)
        found.blocks.add(block=0, address=self._services.address)
        return coordinator_pb2.GetMapResponse(map=found)

    def DefineAttribute(self, request, context):
        return self._services.answer("DefineAttribute", request, context)

    def DropAttribute(self, request, context):
        return self._services.answer("DropAttribute", request, context)


class _BlockService(block_service_pb2_grpc.BlockServiceServicer):
    def __init__(self, services):
        self._services = services

    def GetVersion(self, request, context):
        return VERSION

    def ReadAttributes(self, request, context):
        yield from self._services.answer("ReadAttributes", request, context)

    def WriteAttribute(self, request_iterator, context):
        return self._services.answer("WriteAttribute", list(request_iterator), context)

    def Aggregate(self, request, context):
        return self._services.answer("Aggregate", request, context)


def attribute(name, dimension=0, kind=pb.VALUE_TYPE_DOUBLE, **fields):
    """A definition."""
    return pb.Attribute(name=name, dimension=dimension, type=kind, **fields)
