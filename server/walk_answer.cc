// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/walk_answer.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/map/walk.h"
#include "server/block_version.h"
#include "server/column.h"

namespace ndmap::server {
namespace {

// A step takes about a millisecond.
constexpr size_t kLettersAStep = 20000;

class BlockWalks {
 public:
  BlockWalks(const v1::AskBlockRequest& request, v1::AskBlockResponse& response)
      : request_(request),
        question_(request.walk()),
        word_(reinterpret_cast<const uint8_t*>(question_.word().data()), question_.word().size()),
        darts_(question_.darts()),
        used_(question_.used()),
        walks_(darts_.size() + static_cast<size_t>(question_.roots_size())),
        response_(response),
        answer_(*response.mutable_walk()) {}

  absl::Status Check() const {
    if (question_.roots_size() != question_.paths_size() || !darts_.IsWhole() ||
        (!question_.used().empty() && question_.used().size() != sizeof(uint32_t) * walks_)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "columns of ", question_.darts().size(), " bytes of darts, ", question_.roots_size(), " roots, ",
          question_.paths_size(), " paths and ", question_.used().size(),
          " bytes of letters used, expected 4 bytes a dart, as many roots as paths, and 4 bytes of "
          "letters used for each of them or none"));
    }
    if (walks_ > kMaxWalks || word_.size() > kMaxWord) {
      return absl::InvalidArgumentError(absl::StrCat(walks_, " walks and a word of ", word_.size(),
                                                     " letters; at most ", kMaxWalks, " and ", kMaxWord,
                                                     " are allowed"));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Step(Block3& block) {
    if (absl::Status s = response_.version() == 0 ? Begin(block) : CheckUnchanged(block, response_.version());
        !s.ok()) {
      return s;
    }
    for (size_t letters = 0; next_ < walks_ && letters < kLettersAStep; ++next_) {
      const size_t used = question_.used().empty() ? 0 : used_[next_];
      if (used > word_.size()) {
        return absl::InvalidArgumentError(
            absl::StrCat(used, " letters used of a word of ", word_.size(), " letters"));
      }
      letters += 1 + word_.size() - used;
      if (absl::Status s = One(block, used); !s.ok()) return s;
    }
    return next_ == walks_;
  }

 private:
  absl::Status Begin(const Block3& block) {
    if (absl::Status s = CheckVersion(block, request_.version()); !s.ok()) return s;
    response_.set_version(block.version());
    answer_.mutable_darts()->resize(sizeof(uint32_t) * walks_);
    answer_.mutable_used()->resize(sizeof(uint32_t) * walks_);
    return absl::OkStatus();
  }

  absl::Status One(Block3& block, size_t used) {
    DartIndex from;
    if (next_ < darts_.size()) {
      from.value = darts_[next_];
    } else {
      const auto i = static_cast<int>(next_ - darts_.size());
      const auto d = block.Find({question_.roots(i), question_.paths(i)});
      if (d == Block3::Lcc::null_handle) {
        Set(*answer_.mutable_darts(), next_, DartIndex::kNone);
        Set(*answer_.mutable_used(), next_, static_cast<uint32_t>(used));
        return absl::OkStatus();
      }
      from = IndexOf(block.map(), d);
    }
    const absl::StatusOr<WalkResult> walk = Walk(block, from, word_.subspan(used));
    if (!walk.ok()) return walk.status();
    Set(*answer_.mutable_darts(), next_, walk->dart.value);
    Set(*answer_.mutable_used(), next_, static_cast<uint32_t>(used + walk->used));
    if (walk->end == WalkResult::End::kCrossing) {
      Append(*answer_.mutable_crossings(), static_cast<uint32_t>(next_));
      answer_.add_roots(walk->label.root);
      answer_.add_paths(walk->label.path);
      Append(*answer_.mutable_peers(), walk->peer.value);
    }
    return absl::OkStatus();
  }

  const v1::AskBlockRequest& request_;
  const v1::WalkQuestion& question_;
  const absl::Span<const uint8_t> word_;
  const Column darts_;
  const Column used_;
  const size_t walks_;
  v1::AskBlockResponse& response_;
  v1::WalkAnswer& answer_;
  size_t next_ = 0;
};

}  // namespace

absl::Status AnswerWalk(BlockHost& host, const v1::AskBlockRequest& request,
                        const std::function<bool()>& gone, v1::AskBlockResponse& response) {
  BlockWalks walks(request, response);
  if (absl::Status s = walks.Check(); !s.ok()) return s;
  auto step = [&](Block3& block) { return walks.Step(block); };
  return host.QuerySliced(request.map(), request.block(), step, gone);
}

}  // namespace ndmap::server
