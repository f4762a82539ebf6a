// SPDX-License-Identifier: GPL-3.0-or-later
// A stream of parts of an answer from another server.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/found_cells.h"
#include "server/peer_calls.h"

namespace ndmap::server {

template <class Part>
class PartStream {
 public:
  template <class Start>
  PartStream(PeerStubs& peers, const std::string& address, const Caller& caller, Start start)
      : address_(address),
        stub_(peers.To(address)),
        context_(caller.Onward()),
        reader_(start(*stub_, context_.get())) {}
  ~PartStream() {
    if (reader_ == nullptr) return;
    context_->TryCancel();
    reader_->Finish();
  }
  PartStream(const PartStream&) = delete;
  PartStream& operator=(const PartStream&) = delete;

  // The next part; false when there are no more.
  absl::StatusOr<bool> Next(Part& part) {
    part.Clear();
    if (reader_ == nullptr) return false;
    if (reader_->Read(&part)) return true;
    if (absl::Status s = FromPeer(std::exchange(reader_, nullptr)->Finish(), address_); !s.ok()) return s;
    return false;
  }

 private:
  const std::string address_;
  const std::shared_ptr<v1::BlockService::Stub> stub_;
  const std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<Part>> reader_;
};

// The cells that another server found, from the part that begins them to the end of its answer. `check` looks
// at each part.
template <class Part>
class FoundThere final : public FoundSource {
 public:
  using Check = std::function<absl::Status(const Part&)>;
  FoundThere(PartStream<Part>* stream, Part first, bool points, Check check)
      : stream_(stream), part_(std::move(first)), points_(points), check_(std::move(check)) {}

  absl::StatusOr<std::vector<FoundCell>> Next() override {
    while (part_.found().cell_hi_size() == 0) {
      absl::StatusOr<bool> more = stream_->Next(part_);
      if (!more.ok()) return more.status();
      if (!*more) return std::vector<FoundCell>();
      if (absl::Status s = check_(part_); !s.ok()) return s;
    }
    absl::StatusOr<std::vector<FoundCell>> cells = FromWire(part_.found(), points_, last_);
    if (cells.ok()) last_ = cells->back().id;
    part_.Clear();
    return cells;
  }

 private:
  PartStream<Part>* const stream_;
  Part part_;
  const bool points_;
  const Check check_;
  CellId last_;
};

}  // namespace ndmap::server
