// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sim/simulator.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap {

class Simulator::BlockOutbox final : public Outbox {
 public:
  BlockOutbox(Simulator& simulator, BlockId self) : simulator_(simulator), self_(self) {}
  void Send(BlockId to, const Message& message) override { simulator_.Put(self_, to, message); }
  void Broadcast(const Message& message) override {
    for (uint32_t b = 0; b < simulator_.block_count_; ++b) {
      if (BlockId{b} != self_) simulator_.Put(self_, BlockId{b}, message);
    }
  }

 private:
  Simulator& simulator_;
  const BlockId self_;
};

void Simulator::Put(BlockId from, BlockId to, const Message& message) {
  in_flight_.push_back({from, to, message.kind, message.label, std::string(message.payload), false});
  ++statistics_.messages;
  statistics_.most_in_flight = std::max(statistics_.most_in_flight, in_flight_.size());
}

Simulator::InFlight Simulator::TakeMessage() {
  size_t i = Random(in_flight_.size());
  if (options_.ordered_channels) {
    // The oldest of the same channel; a duplicate is a retransmission and may come later than its successors.
    for (size_t j = 0; j < i; ++j) {
      if (in_flight_[j].from == in_flight_[i].from && in_flight_[j].to == in_flight_[i].to) {
        i = j;
        break;
      }
    }
  }
  InFlight message = in_flight_[i];
  if (static_cast<int>(Random(1000)) < options_.duplicates_per_mille && !options_.ordered_channels) {
    in_flight_[i].duplicate = true;
    ++statistics_.duplicates;
    return message;
  }
  if (options_.ordered_channels) {
    in_flight_.erase(in_flight_.begin() + static_cast<std::ptrdiff_t>(i));
  } else {
    in_flight_[i] = std::move(in_flight_.back());
    in_flight_.pop_back();
  }
  return message;
}

absl::StatusOr<Report> Simulator::RunPhase(const std::vector<std::unique_ptr<BlockAlgorithm>>& algorithms) {
  auto failed = [this](size_t block, const absl::Status& status) {
    return absl::Status(status.code(),
                        absl::StrCat("seed ", options_.seed, ", block ", block, ": ", status.message()));
  };
  statistics_ = {};
  in_flight_.clear();
  block_count_ = static_cast<uint32_t>(algorithms.size());
  // In parts, one block's between another's.
  std::vector<size_t> starting(algorithms.size());
  std::iota(starting.begin(), starting.end(), 0);
  while (!starting.empty()) {
    size_t& chosen = starting[Random(starting.size())];
    const absl::StatusOr<bool> started = algorithms[chosen]->Start(RandomSlice());
    if (!started.ok()) return failed(chosen, started.status());
    if (!*started) continue;
    chosen = starting.back();
    starting.pop_back();
  }
  std::vector<size_t> working(algorithms.size());
  for (uint64_t event = 0;; ++event) {
    if (event == options_.most_events) {
      return absl::DeadlineExceededError(
          absl::StrCat("seed ", options_.seed, ": not quiet after ", event, " events"));
    }
    working.clear();
    for (size_t b = 0; b < algorithms.size(); ++b) {
      if (algorithms[b]->HasWork()) working.push_back(b);
    }
    if (working.empty() && in_flight_.empty()) break;
    const bool deliver = working.empty() || (!in_flight_.empty() && Random(4) != 0);
    if (deliver) {
      const InFlight m = TakeMessage();
      BlockOutbox out(*this, m.to);
      const absl::Status s = algorithms[m.to.value]->Receive(m.from, {m.kind, m.label, m.payload}, out);
      if (!s.ok()) return failed(m.to.value, s);
    } else {
      const size_t b = working[Random(working.size())];
      BlockOutbox out(*this, BlockId{static_cast<uint32_t>(b)});
      const auto done = algorithms[b]->Work(RandomSlice(), out);
      if (!done.ok()) return failed(b, done.status());
    }
  }
  Report report;
  for (size_t b = 0; b < algorithms.size(); ++b) {
    absl::StatusOr<bool> finished = false;
    while (finished.ok() && !*finished) finished = algorithms[b]->Finish(RandomSlice());
    if (!finished.ok()) return failed(b, finished.status());
    report.Merge(algorithms[b]->report());
  }
  return report;
}

}  // namespace ndmap
