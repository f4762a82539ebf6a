// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/walks.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/strings/str_cat.h"
#include "core/map/ids.h"
#include "server/column.h"
#include "server/walk_answer.h"

namespace ndmap::server {
namespace {

constexpr int kWalkAttempts = 4;
// Starts times letters: about a second of work.
constexpr size_t kMaxBetas = 1 << 24;

absl::Status Check(const v1::WalkRequest& request, uint64_t max_darts) {
  const Column starts(request.darts());
  if (!starts.IsWhole() || request.blocks().size() != request.darts().size()) {
    return absl::InvalidArgumentError(absl::StrCat("columns of ", request.blocks().size(),
                                                   " bytes of blocks and ", request.darts().size(),
                                                   " bytes of darts, expected as many, 4 for each start"));
  }
  if (request.version_blocks_size() != request.versions_size()) {
    return absl::InvalidArgumentError(absl::StrCat(request.version_blocks_size(), " blocks with ",
                                                   request.versions_size(), " versions, expected as many"));
  }
  if (starts.size() > std::min<uint64_t>(max_darts, kMaxWalks)) {
    return absl::ResourceExhaustedError(
        absl::StrCat(starts.size(), " starts, at most ", std::min<uint64_t>(max_darts, kMaxWalks),
                     " are allowed in one request (", kMaxWalks, ", or the server's --max-query-darts)"));
  }
  const std::string& word = request.word();
  if (word.size() > kMaxWord || starts.size() * word.size() > kMaxBetas) {
    return absl::InvalidArgumentError(
        absl::StrCat(starts.size(), " starts with a word of ", word.size(), " letters; at most ", kMaxWord,
                     " letters are allowed, and ", kMaxBetas, " for all starts together"));
  }
  for (char c : word) {
    const auto letter = static_cast<unsigned char>(c);
    if (letter > 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("beta ", letter, ": a map of dimension 3 has beta 0 ... 3"));
    }
  }
  return absl::OkStatus();
}

// One attempt.
class Rounds {
 public:
  Rounds(const v1::WalkRequest& request, RemoteBlocks& blocks, v1::WalkResponse& response)
      : request_(request), blocks_(blocks), response_(response) {}

  absl::Status Run() {
    for (int i = 0; i < request_.versions_size(); ++i) {
      if (request_.versions(i) != 0) versions_[request_.version_blocks(i)] = request_.versions(i);
    }
    const Column blocks(request_.blocks());
    *response_.mutable_blocks() = request_.blocks();
    *response_.mutable_darts() = request_.darts();
    response_.mutable_used()->resize(request_.darts().size());
    for (size_t row = 0; row < blocks.size(); ++row) {
      if (blocks[row] >= blocks_.block_count()) {
        return absl::NotFoundError(absl::StrCat("block ", blocks[row], " of map \"", blocks_.map(),
                                                "\", which has ", blocks_.block_count()));
      }
      round_[blocks[row]].rows.push_back(static_cast<uint32_t>(row));
    }
    for (bool first = true; !round_.empty(); first = false) {
      if (absl::Status s = Round(first); !s.ok()) return s;
    }
    for (const auto& [block, version] : met_) {
      response_.add_version_blocks(block);
      response_.add_versions(version);
    }
    return absl::OkStatus();
  }

 private:
  // Walks that are in a block at the beginning of a round, in the order of the question.
  struct Group {
    std::vector<uint32_t> rows;
    // By row; in the first round, where all stand at darts, there are none.
    std::vector<Label> labels;
  };

  absl::Status Round(bool first) {
    std::vector<v1::AskBlockRequest> questions;
    for (const auto& [block, group] : round_) {
      v1::AskBlockRequest& question = questions.emplace_back();
      question.set_block(block);
      if (auto known = versions_.find(block); known != versions_.end()) question.set_version(known->second);
      Put(group, first, *question.mutable_walk());
    }
    absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = blocks_.Ask(std::move(questions));
    if (!answers.ok()) return answers.status();
    arrived_.assign(Column(request_.darts()).size(), false);
    const absl::btree_map<uint32_t, Group> asked = std::exchange(round_, {});
    size_t k = 0;
    for (const auto& [block, group] : asked) {
      if (absl::Status s = Take(block, group, (*answers)[k++]); !s.ok()) return s;
    }
    for (const auto& [block, group] : asked) {
      for (uint32_t row : group.rows) {
        if (!arrived_[row]) return NoPartner(row);
      }
    }
    return absl::OkStatus();
  }

  void Put(const Group& group, bool first, v1::WalkQuestion& question) const {
    question.set_word(request_.word());
    const Column darts(response_.darts()), used(response_.used());
    for (size_t i = 0; i < group.rows.size(); ++i) {
      const uint32_t row = group.rows[i];
      if (first) {
        Append(*question.mutable_darts(), darts[row]);
        continue;
      }
      question.add_roots(group.labels[i].root);
      question.add_paths(group.labels[i].path);
      // The crossing's own letter is not counted yet.
      Append(*question.mutable_used(), used[row] + 1);
    }
  }

  absl::Status Take(uint32_t block, const Group& group, const v1::AskBlockResponse& response) {
    const v1::WalkAnswer& answer = response.walk();
    const Column darts(answer.darts()), used(answer.used()), crossings(answer.crossings()),
        peers(answer.peers());
    const size_t n = group.rows.size();
    if (answer.darts().size() != sizeof(uint32_t) * n || answer.used().size() != answer.darts().size() ||
        answer.peers().size() != answer.crossings().size() ||
        static_cast<size_t>(answer.roots_size()) != crossings.size() ||
        answer.paths_size() != answer.roots_size()) {
      return absl::InternalError(absl::StrCat("block ", block, " answered about other walks"));
    }
    versions_[block] = met_[block] = response.version();
    for (size_t i = 0; i < n; ++i) {
      if (darts[i] == DartIndex::kNone) continue;
      const uint32_t row = group.rows[i];
      if (arrived_[row]) return NoPartner(row);
      arrived_[row] = true;
      Set(*response_.mutable_blocks(), row, block);
      Set(*response_.mutable_darts(), row, darts[i]);
      Set(*response_.mutable_used(), row, used[i]);
    }
    for (size_t k = 0; k < crossings.size(); ++k) {
      const uint32_t i = crossings[k], peer = peers[k];
      if (i >= n || used[i] >= request_.word().size() ||
          (peer != DartIndex::kNone && peer >= blocks_.block_count())) {
        return absl::InternalError(absl::StrCat("block ", block, " answered with a crossing to nowhere"));
      }
      const Label label{answer.roots(static_cast<int>(k)), answer.paths(static_cast<int>(k))};
      for (uint32_t b = peer == DartIndex::kNone ? 0 : peer; b < blocks_.block_count(); ++b) {
        if (peer != DartIndex::kNone ? b != peer : b == block) continue;
        round_[b].rows.push_back(group.rows[i]);
        round_[b].labels.push_back(label);
      }
    }
    return absl::OkStatus();
  }

  absl::Status NoPartner(uint32_t row) const {
    return absl::UnavailableError(
        absl::StrCat("dart ", Column(response_.darts())[row], " of block ", Column(response_.blocks())[row],
                     " has no one partner at the moment: the map is being changed"));
  }

  const v1::WalkRequest& request_;
  RemoteBlocks& blocks_;
  v1::WalkResponse& response_;
  // Named or met, and met.
  absl::btree_map<uint32_t, uint64_t> versions_, met_;
  absl::btree_map<uint32_t, Group> round_;
  // By row: some block has taken it in this round.
  std::vector<bool> arrived_;
};

}  // namespace

absl::Status Walks::Walk(const v1::WalkRequest& request, const std::function<bool()>& gone,
                         v1::WalkResponse& response) {
  if (absl::Status s = Check(request, max_darts_); !s.ok()) return s;
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  RemoteBlocks blocks(request.map(), *std::move(info), host_->address(), answers_, peers_, gone, max_darts_);
  absl::Status status;
  for (int k = 0; k < kWalkAttempts; ++k) {
    response.Clear();
    status = Rounds(request, blocks, response).Run();
    // A version that the client did not name is one that this attempt met itself.
    const bool changed =
        absl::IsAborted(status) || (absl::IsFailedPrecondition(status) && request.versions_size() == 0);
    if (!changed) return status;
  }
  return absl::AbortedError(status.message());
}

}  // namespace ndmap::server
