// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/exchange.h"

#include <spdlog/spdlog.h>

#include <string>
#include <utility>
#include <vector>

#include "server/wire.h"
#include "service/status.h"

namespace ndmap::server {

// One stream. Acknowledgements are gathered while a write is in flight and go out together with the next.
// `taken` of a batch may come after the stream has ended, so this object outlives the reactor that gRPC
// knows.
class ExchangeStreams::Incoming : public std::enable_shared_from_this<Incoming> {
 public:
  explicit Incoming(ExchangeStreams* streams) : streams_(streams), reactor_(new Reactor(this)) {}

  void Begin() {
    self_ = shared_from_this();
    reactor_->StartRead(&request_);
  }
  // Ends the stream once.
  void End(const absl::Status& status) {
    absl::MutexLock lock(&mutex_);
    if (std::exchange(ended_, true)) return;
    reactor_->Finish(service::ToGrpc(status));
  }
  ExchangeReactor* reactor() { return reactor_; }

 private:
  class Reactor : public ExchangeReactor {
   public:
    explicit Reactor(Incoming* incoming) : incoming_(incoming) {}
    void OnReadDone(bool ok) override { incoming_->OnRead(ok); }
    void OnWriteDone(bool ok) override { incoming_->OnWritten(ok); }
    void OnCancel() override { incoming_->End(absl::CancelledError("the sender has gone")); }
    void OnDone() override {
      incoming_->OnDone();
      delete this;
    }

   private:
    Incoming* const incoming_;
  };

  void OnRead(bool ok) {
    if (!ok) {
      End(absl::OkStatus());
      return;
    }
    absl::StatusOr<Envelope> envelope = FromWire(request_.batch());
    if (!envelope.ok()) {
      // The sender opens a new stream and sends it again.
      spdlog::warn("a batch of map \"{}\" is refused: {}", request_.batch().key().map(),
                   std::string(envelope.status().message()));
      End(envelope.status());
      return;
    }
    streams_->host_->Deliver(*std::move(envelope), [weak = weak_from_this(), number = request_.number()] {
      if (std::shared_ptr<Incoming> incoming = weak.lock()) incoming->Acknowledge(number);
    });
    absl::MutexLock lock(&mutex_);
    if (!ended_) reactor_->StartRead(&request_);
  }

  void Acknowledge(uint64_t number) {
    absl::MutexLock lock(&mutex_);
    if (ended_) return;
    acknowledged_.push_back(number);
    WriteAcknowledged();
  }

  void OnWritten(bool ok) {
    absl::MutexLock lock(&mutex_);
    writing_ = false;
    if (ok && !ended_) WriteAcknowledged();
  }

  void WriteAcknowledged() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (writing_ || acknowledged_.empty()) return;
    writing_ = true;
    response_.Clear();
    response_.mutable_numbers()->Assign(acknowledged_.begin(), acknowledged_.end());
    acknowledged_.clear();
    reactor_->StartWrite(&response_);
  }

  void OnDone() {
    std::shared_ptr<Incoming> self;
    {
      absl::MutexLock lock(&mutex_);
      ended_ = true;
      self = std::move(self_);
    }
    absl::MutexLock lock(&streams_->mutex_);
    streams_->open_.erase(self);
  }

  ExchangeStreams* const streams_;
  Reactor* const reactor_;
  v1::ExchangeRequest request_;
  absl::Mutex mutex_;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<uint64_t> acknowledged_ ABSL_GUARDED_BY(mutex_);
  v1::ExchangeResponse response_;
  // Until OnDone.
  std::shared_ptr<Incoming> self_;
};

ExchangeReactor* ExchangeStreams::Open() {
  auto incoming = std::make_shared<Incoming>(this);
  ExchangeReactor* const reactor = incoming->reactor();
  bool finished;
  {
    absl::MutexLock lock(&mutex_);
    finished = finished_;
    if (!finished) open_.insert(incoming);
  }
  incoming->Begin();
  if (finished) incoming->End(absl::UnavailableError("the server is stopping"));
  return reactor;
}

void ExchangeStreams::Finish() {
  std::vector<std::shared_ptr<Incoming>> open;
  {
    absl::MutexLock lock(&mutex_);
    finished_ = true;
    open.assign(open_.begin(), open_.end());
  }
  for (auto& incoming : open) incoming->End(absl::UnavailableError("the server is stopping"));
}

}  // namespace ndmap::server
