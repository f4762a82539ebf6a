# SPDX-License-Identifier: GPL-3.0-or-later
"""How the client behaves when services fail, with a coordinator made for it: versions, retries, deadlines."""
import unittest
from concurrent.futures import ThreadPoolExecutor

import grpc

import ndmap
from ndmap.errors import from_rpc
from ndmap.v1 import common_pb2, coordinator_pb2, coordinator_pb2_grpc


class FakeCoordinator(coordinator_pb2_grpc.CoordinatorServicer):
    """Fails as often as it is told to, and counts calls."""

    def __init__(self):
        self.protocol = common_pb2.PROTOCOL_CURRENT
        self.calls = []
        self.failures = {}
        self.caller = None

    def _enter(self, name, context):
        self.calls.append(name)
        codes = self.failures.get(name, [])
        if codes:
            context.abort(codes.pop(0), f"{name} fails")

    def GetVersion(self, request, context):
        self._enter("GetVersion", context)
        self.caller = request.caller
        return common_pb2.GetVersionResponse(version=common_pb2.Version(protocol=self.protocol, release="9.9"))

    def ListMaps(self, request, context):
        self._enter("ListMaps", context)
        return coordinator_pb2.ListMapsResponse()

    def GetMap(self, request, context):
        self._enter("GetMap", context)
        return coordinator_pb2.GetMapResponse(map=coordinator_pb2.Map(map=request.map, block_count=1))

    def DeleteMap(self, request, context):
        self._enter("DeleteMap", context)
        return coordinator_pb2.DeleteMapResponse()

    def StartJob(self, request, context):
        self._enter("StartJob", context)
        return coordinator_pb2.StartJobResponse(job=coordinator_pb2.Job(job=1))

    def GetJob(self, request, context):
        self._enter("GetJob", context)
        return coordinator_pb2.GetJobResponse(job=coordinator_pb2.Job(job=1, kind="trim", state="JOB_STATE_DONE"))

    def WatchJob(self, request, context):
        yield self._progress("JOB_STATE_RUNNING")
        self._enter("WatchJob", context)
        yield self._progress("JOB_STATE_DONE")

    @staticmethod
    def _progress(state):
        return coordinator_pb2.WatchJobResponse(progress=coordinator_pb2.JobProgress(job=1, state=state))


class ClientTest(unittest.TestCase):
    def setUp(self):
        self.coordinator = FakeCoordinator()
        # Freed last: the server's own threads must have ended.
        threads = ThreadPoolExecutor(4)
        self.addCleanup(threads.shutdown)
        server = grpc.server(threads)
        coordinator_pb2_grpc.add_CoordinatorServicer_to_server(self.coordinator, server)
        self.target = f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}"
        server.start()
        self.addCleanup(lambda: server.stop(0).wait())

    def connect(self):
        client = ndmap.connect(self.target, ndmap.ClientOptions(first_pause=0.001))
        self.addCleanup(client.close)
        return client

    def count(self, name):
        return self.coordinator.calls.count(name)

    def test_versions_are_exchanged(self):
        self.assertEqual(self.connect().release, "9.9")
        self.assertEqual(self.coordinator.caller.protocol, common_pb2.PROTOCOL_CURRENT)
        self.assertEqual(self.coordinator.caller.release, ndmap.__version__)
        self.coordinator.protocol = 99
        with self.assertRaisesRegex(ndmap.FailedPreconditionError, "speaks protocol 99, this client 1"):
            self.connect()

    def test_what_changes_nothing_is_tried_three_times(self):
        client = self.connect()
        self.coordinator.failures["ListMaps"] = [grpc.StatusCode.UNAVAILABLE] * 2
        self.assertEqual(client.maps(), [])
        self.assertEqual(self.count("ListMaps"), 3)
        self.coordinator.failures["GetMap"] = [grpc.StatusCode.UNAVAILABLE] * 3
        with self.assertRaisesRegex(ndmap.UnavailableError, f"the coordinator at {self.target}: GetMap fails"):
            client.open_map("m")
        self.assertEqual(self.count("GetMap"), 3)

    def test_other_errors_are_not_tried_again(self):
        client = self.connect()
        for code, kind in (
            (grpc.StatusCode.INVALID_ARGUMENT, ndmap.InvalidArgumentError),
            (grpc.StatusCode.NOT_FOUND, ndmap.NotFoundError),
            (grpc.StatusCode.ALREADY_EXISTS, ndmap.AlreadyExistsError),
            (grpc.StatusCode.FAILED_PRECONDITION, ndmap.FailedPreconditionError),
            (grpc.StatusCode.RESOURCE_EXHAUSTED, ndmap.ResourceExhaustedError),
            (grpc.StatusCode.DEADLINE_EXCEEDED, ndmap.DeadlineExceededError),
            (grpc.StatusCode.CANCELLED, ndmap.CancelledError),
            (grpc.StatusCode.ABORTED, ndmap.AbortedError),
            (grpc.StatusCode.UNIMPLEMENTED, ndmap.UnimplementedError),
            (grpc.StatusCode.INTERNAL, ndmap.InternalError),
            (grpc.StatusCode.DATA_LOSS, ndmap.DataLossError),
            (grpc.StatusCode.PERMISSION_DENIED, ndmap.NdmapError),
        ):
            with self.subTest(code=code):
                self.coordinator.calls.clear()
                self.coordinator.failures["ListMaps"] = [code]
                with self.assertRaises(ndmap.NdmapError) as caught:
                    client.maps()
                self.assertIs(type(caught.exception), kind)
                self.assertIs(caught.exception.code, code)
                self.assertEqual(self.count("ListMaps"), 1)

    def test_what_would_be_done_twice_is_tried_once(self):
        client = self.connect()
        for name, call in (("StartJob", client.open_map("m").trim), ("DeleteMap", lambda: client.delete_map("m"))):
            self.coordinator.failures[name] = [grpc.StatusCode.UNAVAILABLE]
            with self.assertRaises(ndmap.UnavailableError):
                call()
            self.assertEqual(self.count(name), 1)

    def test_a_watch_that_breaks_goes_on(self):
        self.coordinator.failures["WatchJob"] = [grpc.StatusCode.UNAVAILABLE] * 5
        heard = []
        job = self.connect().job(1, heard.append)
        # Each watch had said something before it broke, so that five are not too many.
        self.assertEqual(job.result(60).state, "done")
        self.assertEqual([one.state for one in heard], ["running"] * 6 + ["done"])

    def test_a_job_that_cannot_be_watched_is_asked_for(self):
        self.coordinator.failures["WatchJob"] = [grpc.StatusCode.RESOURCE_EXHAUSTED] * 100
        job = self.connect().job(1)
        self.assertEqual(job.result(60).state, "done")
        self.assertEqual(job.progress.state, "done")
        self.assertEqual(self.count("WatchJob"), 1)
        self.assertGreaterEqual(self.count("GetJob"), 1)

    def test_who_is_asked_does_not_stand_for_whom_it_could_not_reach(self):
        class Failed(grpc.RpcError):
            def __init__(self, code, details):
                self.code, self.details = lambda: code, lambda: details

        late, unavailable = grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.UNAVAILABLE
        other = "the block server at B:2 does not answer: failed to connect to all addresses; last error: x: refused"
        for code, details, message in (
            (unavailable, "failed to connect to all addresses; last error: x: refused", "A cannot be reached: refused"),
            (unavailable, other, f"A: {other}"),
            (late, "Deadline Exceeded", "A did not answer in time"),
            (late, "the block server at B:2 does not answer: Deadline Exceeded",
             "A: the block server at B:2 does not answer: Deadline Exceeded"),
        ):
            self.assertEqual(str(from_rpc(Failed(code, details), "A")), message)

    def test_a_watch_that_is_refused_ends(self):
        self.coordinator.failures["WatchJob"] = [grpc.StatusCode.NOT_FOUND]
        with self.assertRaisesRegex(ndmap.NotFoundError, "WatchJob fails"):
            self.connect().job(1).result(60)


if __name__ == "__main__":
    unittest.main()
