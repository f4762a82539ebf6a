# SPDX-License-Identifier: Apache-2.0
"""Long work on a map: watched, waited for, cancelled."""
from __future__ import annotations

import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Callable

from ndmap.connection import Connection
from ndmap.errors import (
    DeadlineExceededError,
    JobCancelledError,
    JobFailedError,
    ResourceExhaustedError,
    UnavailableError,
)
from ndmap.info import state_name
from ndmap.v1 import common_pb2, coordinator_pb2

# A watch is begun anew after this time, so that no call is without a deadline.
_WATCH_SECONDS = 300.0
# Between questions about a job that cannot be watched.
_ASK_AGAIN_SECONDS = 0.5
ENDED = ("done", "cancelled", "failed")


def phase(algorithm: str, **parameters: object) -> coordinator_pb2.Phase:
    """A phase of a job."""
    texts = {name: str(value) for name, value in parameters.items()}
    return coordinator_pb2.Phase(algorithm=algorithm, parameters=texts)


@dataclass(frozen=True)
class JobProgress:
    """How far a job is."""

    job: int
    # "running", "cancelling", "done", "cancelled" or "failed"; then `error` says why.
    state: str
    error: str
    # 0-based; equal to phase_count when all have ended.
    phase_index: int
    phase_count: int
    # The running phase's.
    algorithm: str
    # Since the job began.
    seconds: float
    # The running phase's counts so far, of all blocks ("refined", "cells_tested").
    counts: dict[str, int]
    # Between blocks, in the running phase.
    messages: int
    # How many blocks still work.
    blocks_busy: int
    # All that the coordinator said, by block.
    message: coordinator_pb2.JobProgress = field(repr=False, compare=False)

    @classmethod
    def from_proto(cls, progress: coordinator_pb2.JobProgress) -> JobProgress:
        """What the message says."""
        counts: Counter[str] = Counter()
        for block in progress.blocks:
            counts.update(block.counts)
        return cls(
            job=progress.job,
            state=state_name(coordinator_pb2.JobState.Name(progress.state)),
            error=progress.error,
            phase_index=progress.phase_index,
            phase_count=progress.phase_count,
            algorithm=progress.algorithm,
            seconds=progress.seconds,
            counts=dict(counts),
            messages=sum(block.messages_sent for block in progress.blocks),
            blocks_busy=sum(not block.idle for block in progress.blocks),
            message=progress,
        )


@dataclass(frozen=True)
class PhaseResult:
    """What one phase did."""

    algorithm: str
    parameters: dict[str, str]
    # What the algorithm counted, summed over blocks ("refined", "removed", "hexahedra").
    counts: dict[str, int]
    # 32 hexadecimal digits; zeros unless the algorithm makes one.
    digest: str
    # Sentences about faults found, at most 20; counts["findings"] is their true number.
    findings: tuple[str, ...]
    seconds: float
    cpu_seconds: float
    messages: int
    message_bytes: int
    # Cancelled while it ran: the counts cover what was done until then.
    cancelled: bool

    @classmethod
    def from_proto(cls, result: coordinator_pb2.PhaseResult) -> PhaseResult:
        """What the message says."""
        report: common_pb2.Report = result.report
        return cls(
            algorithm=result.phase.algorithm,
            parameters=dict(result.phase.parameters),
            counts=dict(sorted(report.counts.items())),
            digest=f"{report.digest_hi:016x}{report.digest_lo:016x}",
            findings=tuple(report.findings),
            seconds=result.wall_seconds,
            cpu_seconds=result.user_seconds + result.system_seconds,
            messages=result.messages,
            message_bytes=result.message_bytes,
            cancelled=result.cancelled,
        )


@dataclass(frozen=True)
class JobResult:
    """A job as it was when the coordinator was asked."""

    job: int
    map: str
    kind: str
    state: str
    error: str
    # Of the phases that have ended. Empty in lists of jobs.
    phases: tuple[PhaseResult, ...]
    seconds: float

    @classmethod
    def from_proto(cls, job: coordinator_pb2.Job) -> JobResult:
        """What the message says."""
        return cls(
            job=job.job,
            map=job.map,
            kind=job.kind,
            state=state_name(coordinator_pb2.JobState.Name(job.state)),
            error=job.error,
            phases=tuple(PhaseResult.from_proto(result) for result in job.results),
            seconds=(job.ended or time.time()) - job.started,
        )

    def raise_for_state(self) -> JobResult:
        """Itself if the job is done; JobCancelledError or JobFailedError if it ended otherwise."""
        if self.state == "cancelled":
            left = "the map was not made: delete it" if self.kind == "create" else "the map is valid"
            raise JobCancelledError(f"job {self.job} ({self.kind}) was cancelled; {left}")
        if self.state == "failed":
            raise JobFailedError(f"job {self.job} ({self.kind}) failed: {self.error}")
        return self


ProgressCallback = Callable[[JobProgress], None]


class Job:
    """A job of a cluster as a future: result(), done(), cancel(), progress.

    A thread of this client watches the job from the moment somebody wants to know. It is the thread that calls
    `progress`, at once and then at most ten times a second; what `progress` raises ends the calls, not the job, and
    is raised by result().
    """

    def __init__(self, connection: Connection, job: int, progress: ProgressCallback | None = None) -> None:
        self._connection = connection
        self._job = job
        self._callback = progress
        self._changed = threading.Condition()
        self._watcher: threading.Thread | None = None
        self._last: JobProgress | None = None
        self._result: JobResult | None = None
        self._error: BaseException | None = None
        self._callback_error: BaseException | None = None
        if progress:
            self._watch()

    def __repr__(self) -> str:
        return f"Job({self._job})"

    @property
    def id(self) -> int:
        """The job's number."""
        return self._job

    def get(self) -> JobResult:
        """The job as it is now, however it stands."""
        request = coordinator_pb2.GetJobRequest(job=self._job)
        return JobResult.from_proto(self._connection.idempotent(self._connection.coordinator.GetJob, request).job)

    @property
    def progress(self) -> JobProgress:
        """How far the job is."""
        self._watch()
        with self._changed:
            self._changed.wait_for(lambda: self._last or self._error)
            if self._last is None:
                assert self._error is not None
                raise self._error
            return self._last

    def done(self) -> bool:
        """Whether the job has ended, however it ended."""
        return self.progress.state in ENDED

    def result(self, timeout: float | None = None) -> JobResult:
        """Waits until the job has ended. DeadlineExceededError if that takes longer than `timeout` seconds;
        JobCancelledError, JobFailedError if it is not done; UnavailableError if the coordinator is gone."""
        self._watch()
        with self._changed:
            if not self._changed.wait_for(lambda: self._result or self._error, timeout):
                raise DeadlineExceededError(f"job {self._job} has not ended after {timeout} s")
            if self._result is None:
                assert self._error is not None
                raise self._error
        if self._callback_error is not None:
            raise self._callback_error
        return self._result.raise_for_state()

    def cancel(self) -> None:
        """Asks the job to stop at the next safe place; the map stays valid. Does not wait: result() raises
        JobCancelledError then."""
        request = coordinator_pb2.CancelJobRequest(job=self._job)
        self._connection.idempotent(self._connection.coordinator.CancelJob, request)

    def _watch(self) -> None:
        with self._changed:
            if self._watcher is None:
                self._watcher = threading.Thread(target=self._run, name=f"ndmap-job-{self._job}", daemon=True)
                self._watcher.start()

    def _run(self) -> None:
        result: JobResult | None = None
        error: BaseException | None = None
        try:
            self._follow()
            result = self.get()
        except BaseException as raised:  # Whatever it is, somebody waits for it.
            error = raised
        with self._changed:
            self._result, self._error = result, error
            self._changed.notify_all()

    def _follow(self) -> None:
        """Returns when the job has ended. The watch goes on when the connection was lost for a moment."""
        options = self._connection.options
        pause, failures = options.first_pause, 0
        while True:
            before = self._last
            try:
                self._connection.guarded(self._stream)
                if self._last is not None and self._last.state in ENDED:
                    return
                raise UnavailableError("the watch ended before the job")
            except ResourceExhaustedError:
                # Too many are watching. The job goes on all the same, and is asked for now and then.
                self._ask()
                if self._last is not None and self._last.state in ENDED:
                    return
                time.sleep(_ASK_AGAIN_SECONDS)
                continue
            except (UnavailableError, DeadlineExceededError):
                if self._last is not before:
                    pause, failures = options.first_pause, 0
                failures += 1
                if failures >= options.attempts:
                    raise
            time.sleep(pause)
            pause *= 2

    def _stream(self) -> None:
        request = coordinator_pb2.WatchJobRequest(job=self._job, interval_milliseconds=100)
        for answer in self._connection.coordinator.WatchJob(request, timeout=_WATCH_SECONDS):
            self._tell(JobProgress.from_proto(answer.progress))

    def _ask(self) -> None:
        request = coordinator_pb2.GetJobRequest(job=self._job)
        job = self._connection.idempotent(self._connection.coordinator.GetJob, request).job
        progress = coordinator_pb2.JobProgress(
            job=job.job, state=job.state, error=job.error, phase_index=len(job.results), phase_count=len(job.phases)
        )
        self._tell(JobProgress.from_proto(progress))

    def _tell(self, progress: JobProgress) -> None:
        with self._changed:
            self._last = progress
            self._changed.notify_all()
        if self._callback and self._callback_error is None:
            try:
                self._callback(progress)
            except BaseException as error:
                self._callback_error = error
