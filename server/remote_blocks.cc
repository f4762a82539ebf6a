// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/remote_blocks.h"

#include <grpcpp/completion_queue.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/peer_calls.h"
#include "server/wire.h"
#include "service/status.h"

namespace ndmap::server {
namespace {

struct Call {
  grpc::ClientContext context;
  std::shared_ptr<v1::BlockService::Stub> stub;
  std::unique_ptr<grpc::ClientAsyncResponseReader<v1::AskBlockResponse>> reader;
  grpc::Status status;
};

// Calls under way. The thread that waits for them watches their sockets itself: gRPC's threads for callbacks
// may be asleep (service/poller.h).
class Calls {
 public:
  ~Calls() {
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }
  void Start(const v1::AskBlockRequest& request, v1::AskBlockResponse* answer, Call& call) {
    call.reader = call.stub->AsyncAskBlock(&call.context, request, &queue_);
    call.reader->Finish(answer, &call.status, &call);
    ++left_;
  }
  // Until all have ended.
  void Wait() {
    void* tag = nullptr;
    bool ok = false;
    while (left_ > 0 && queue_.Next(&tag, &ok)) --left_;
  }

 private:
  grpc::CompletionQueue queue_;
  int left_ = 0;
};

}  // namespace

absl::StatusOr<std::vector<v1::AskBlockResponse>> RemoteBlocks::Ask(
    std::vector<v1::AskBlockRequest> requests) {
  std::vector<v1::AskBlockResponse> answers(requests.size());
  std::vector<std::unique_ptr<Call>> calls(requests.size());
  for (size_t k = 0; k < requests.size(); ++k) {
    requests[k].set_map(map_);
    if (requests[k].block() >= info_.block_count) {
      return absl::NotFoundError(absl::StrCat("block ", requests[k].block(), " of map \"", map_,
                                              "\", which has ", info_.block_count));
    }
  }
  Calls under_way;
  for (size_t k = 0; k < requests.size(); ++k) {
    if (IsHere(requests[k].block())) continue;
    calls[k] = std::make_unique<Call>();
    Call& call = *calls[k];
    call.context.set_deadline(std::chrono::system_clock::now() + PeerStubs::kDeadline);
    call.stub = peers_->To(info_.addresses[requests[k].block()]);
    under_way.Start(requests[k], &answers[k], call);
  }
  absl::Status result;
  for (size_t k = 0; k < requests.size(); ++k) {
    if (result.ok() && calls[k] == nullptr) result.Update(answers_->Answer(requests[k], gone_, answers[k]));
  }
  // Nobody waits for the others when one part has failed.
  for (auto& call : calls) {
    if (!result.ok() && call != nullptr) call->context.TryCancel();
  }
  under_way.Wait();
  for (size_t k = 0; k < requests.size() && result.ok(); ++k) {
    if (calls[k] == nullptr || calls[k]->status.ok()) continue;
    const uint32_t block = requests[k].block();
    result = FromServer(calls[k]->status,
                        absl::StrCat("block ", block, " on the block server at ", info_.addresses[block]));
  }
  if (!result.ok()) return result;
  return answers;
}

absl::StatusOr<std::vector<OrbitPiece>> RemoteBlocks::Expand(absl::Span<const Question> questions) {
  std::vector<v1::AskBlockRequest> requests;
  for (const Question& question : questions) {
    v1::AskBlockRequest& request = requests.emplace_back();
    request.set_block(question.block.value);
    request.set_version(question.version);
    v1::ExpandQuestion& expand = *request.mutable_expand();
    expand.set_dimension(question.dimension);
    expand.set_max_darts(max_darts_);
    const bool only_darts =
        std::all_of(question.seeds.begin(), question.seeds.end(),
                    [](const OrbitSeed& seed) { return seed.kind == OrbitSeed::Kind::kDart; });
    for (const OrbitSeed& seed : question.seeds) {
      if (only_darts) {
        expand.add_darts(seed.dart.value);
        continue;
      }
      v1::OrbitSeed& wire = *expand.add_seeds();
      if (seed.kind == OrbitSeed::Kind::kDart) {
        wire.set_dart(seed.dart.value);
      } else {
        ToWire(seed.label,
               seed.kind == OrbitSeed::Kind::kLabel ? *wire.mutable_label() : *wire.mutable_after_label());
      }
    }
  }
  absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = Ask(std::move(requests));
  if (!answers.ok()) return answers.status();
  std::vector<OrbitPiece> pieces;
  for (const v1::AskBlockResponse& answer : *answers) {
    OrbitPiece& piece = pieces.emplace_back();
    piece.version = answer.version();
    for (uint32_t d : answer.expand().darts()) piece.darts.push_back(DartIndex{d});
    for (const v1::OrbitCrossing& crossing : answer.expand().crossings()) {
      piece.crossings.push_back({FromWire(crossing.label()),
                                 crossing.after() ? OrbitSeed::Kind::kAfterLabel : OrbitSeed::Kind::kLabel,
                                 crossing.has_peer() ? BlockId{crossing.peer()} : BlockId()});
    }
    piece.not_here.assign(answer.expand().not_here().begin(), answer.expand().not_here().end());
  }
  return pieces;
}

}  // namespace ndmap::server
