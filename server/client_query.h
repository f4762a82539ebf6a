// SPDX-License-Identifier: GPL-3.0-or-later
// What questions of clients may cost a block server: how many at one time, how long each, how large an
// answer. Calls of the coordinator and of other block servers are no such questions and are never refused for
// their sake, so that clients cannot stop a job, nor two servers each other.
#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/sync_stream.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/synchronization/notification.h"
#include "absl/time/time.h"
#include "google/protobuf/message.h"

namespace ndmap::server {

// Each with the flag of ndmap-server that sets it.
struct QueryLimits {
  uint32_t max_queries = 256;                         // --max-queries
  uint64_t max_response_bytes = 64 << 20;             // --max-response-bytes; of an answer, exports excepted
  absl::Duration max_query_time = absl::Seconds(60);  // --max-query-seconds
  absl::Duration max_export_time = absl::Seconds(3600);  // --max-export-seconds
};

// Counts the questions that are being answered. Thread-safe.
class QueryGate {
 public:
  explicit QueryGate(const QueryLimits& limits) : limits_(limits) {}

 private:
  friend class ClientQuery;

  const QueryLimits limits_;
  std::atomic<uint32_t> running_{0};
};

// One question on the thread that answers it, from its arrival to its end.
class ClientQuery {
 public:
  // kValues: all values of a map, or a stream of values to be written; as an export, it takes its time.
  enum class Kind { kQuestion, kExport, kValues };

  ClientQuery(QueryGate& gate, grpc::ServerContext* context, Kind kind = Kind::kQuestion);
  ~ClientQuery();
  ClientQuery(const ClientQuery&) = delete;
  ClientQuery& operator=(const ClientQuery&) = delete;

  using Gone = std::function<bool()>;
  // What `answer` returns; RESOURCE_EXHAUSTED naming the flag when there are too many questions (then it is
  // not called), when time was up before it was done, or when what it wrote was too much. `answer` is to end
  // soon after `gone` says true: the caller has gone, or time is up.
  grpc::Status Run(absl::FunctionRef<absl::Status(const Gone& gone)> answer);
  // The same for an answer of one message, which is cleared when it is too large.
  grpc::Status Run(google::protobuf::Message& response,
                   absl::FunctionRef<absl::Status(const Gone& gone)> answer);

  // When time is up.
  absl::Time end() const { return end_; }

  // Reads parts of the question; one that does not come is given up one second after time is up.
  template <class Part>
  std::function<bool(Part&)> From(grpc::ServerReader<Part>* reader) {
    SetAlarm();
    return [reader](Part& part) { return reader->Read(&part); };
  }
  // Writes parts of the answer; false when nobody wants more. A caller that does not read is given up one
  // second after time is up.
  template <class Part>
  std::function<bool(const Part&)> Into(grpc::ServerWriter<Part>* writer) {
    SetAlarm();
    return [this, writer](const Part& part) { return Fits(part.ByteSizeLong()) && writer->Write(part); };
  }

 private:
  bool Fits(uint64_t bytes);
  void SetAlarm();
  // `status`, or the limit that was the reason for it.
  absl::Status Explain(const absl::Status& status) const;

  QueryGate& gate_;
  grpc::ServerContext* const context_;
  const Kind kind_;
  const absl::Time end_;
  const bool admitted_;
  bool late_ = false;
  bool large_ = false;
  uint64_t bytes_ = 0;
  absl::Notification alarm_over_;
  std::unique_ptr<grpc::Alarm> alarm_;
};

}  // namespace ndmap::server
