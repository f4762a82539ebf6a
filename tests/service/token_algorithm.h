// SPDX-License-Identifier: GPL-3.0-or-later
// A distributed algorithm for tests of actors and services that needs no map: every block throws tokens, each
// goes from block to block a number of times. The total of hops is known beforehand, so a message that is
// lost, applied twice or counted wrongly shows. Parameters: tokens, hops (per token), endless (work never
// ends until cancelled), fail_block (Receive fails there), endless_start (Start never ends until cancelled),
// no_memory (where block 0 throws std::bad_alloc: start, receive, work, finish or report), read_only.
#pragma once

#include <cstring>
#include <memory>
#include <new>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"

namespace ndmap {

class TokenAlgorithm : public BlockAlgorithm {
 public:
  TokenAlgorithm(const Environment& environment, const Parameters& parameters)
      : self_(environment.self.value), blocks_(environment.block_count) {
    tokens_ = parameters.IntegerOr("tokens", 0, 0, int64_t{1} << 40).value();
    hops_ = parameters.IntegerOr("hops", 1, 1, 1 << 30).value();
    endless_ = parameters.IntegerOr("endless", 0, 0, 1).value() != 0;
    fail_block_ = parameters.IntegerOr("fail_block", -1, -1, 1 << 30).value();
    throw_block_ = parameters.IntegerOr("throw_block", -1, -1, 1 << 30).value();
    endless_start_ = parameters.Has("endless_start");
    no_memory_ = parameters.TextOr("no_memory", "");
    read_only_ = parameters.Has("read_only");
    lost_block_ = parameters.IntegerOr("kept_block", -1, -1, 1 << 30).value();
  }
  bool changes_map() const override { return !read_only_; }
  absl::StatusOr<bool> Start(size_t) override {
    Allocate("start");
    return cancelled_ || !endless_start_;
  }
  absl::Status Receive(BlockId from, const Message& message, Outbox& out) override {
    if (fail_block_ == int64_t{self_}) return absl::InternalError("label 12:1 is not known");
    if (throw_block_ == int64_t{self_}) throw std::runtime_error("precondition violated");
    Allocate("receive");
    ++received_;
    sum_ += message.label.root;
    if (message.label.path > 1) Throw({message.label.root, message.label.path - 1}, out);
    return absl::OkStatus();
  }
  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    Allocate("work");
    size_t done = 0;
    for (; done < budget && HasWork(); ++done) {
      ++worked_;
      if (thrown_ == tokens_) continue;
      ++thrown_;
      Throw({uint64_t{self_} * 1000003 + static_cast<uint64_t>(thrown_), static_cast<uint64_t>(hops_)}, out);
    }
    return done;
  }
  bool HasWork() const override { return !cancelled_ && (thrown_ < tokens_ || endless_); }
  void Cancel() override { cancelled_ = true; }
  absl::StatusOr<bool> Finish(size_t) override {
    Allocate("finish");
    if (lost_block_ == int64_t{self_}) return absl::InternalError("still kept: label 7:1");
    return true;
  }
  Report report() const override {
    Allocate("report");
    Report report;
    report.counts["received"] = received_;
    report.counts["thrown"] = thrown_;
    report.counts["worked"] = worked_;
    report.digest.lo = sum_;
    return report;
  }

 private:
  void Allocate(absl::string_view where) const {
    if (self_ == 0 && no_memory_ == where) throw std::bad_alloc();
  }
  void Throw(const Label& label, Outbox& out) {
    if (blocks_ == 1) return;
    // Any fixed rule that spreads tokens.
    uint32_t to = static_cast<uint32_t>((label.root * 31 + label.path * 17) % blocks_);
    if (to == self_) to = (to + 1) % blocks_;
    out.Send(BlockId{to},
             {1, label, label.path % 5 == 0 ? absl::string_view("payload") : absl::string_view()});
  }

  const uint32_t self_;
  const uint32_t blocks_;
  int64_t tokens_ = 0;
  int64_t hops_ = 0;
  bool endless_ = false;
  int64_t fail_block_ = -1;
  int64_t throw_block_ = -1;
  int64_t lost_block_ = -1;
  bool endless_start_ = false;
  std::string no_memory_;
  bool read_only_ = false;
  bool cancelled_ = false;
  int64_t thrown_ = 0;
  int64_t received_ = 0;
  int64_t worked_ = 0;
  uint64_t sum_ = 0;
};

}  // namespace ndmap
