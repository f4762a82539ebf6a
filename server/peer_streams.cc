// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/peer_streams.h"

#include <grpcpp/alarm.h>
#include <grpcpp/client_context.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "server/wire.h"
#include "service/channel.h"

namespace ndmap::server {

// The stream to one process. Callbacks of gRPC only move batches between containers and start the next
// operation.
class PeerStream : public std::enable_shared_from_this<PeerStream> {
 public:
  explicit PeerStream(const std::string& address)
      : address_(address), stub_(v1::BlockService::NewStub(service::MakeChannel(address))) {}

  void Send(const Envelope& envelope, Taken taken) {
    // Encoded outside the lock.
    auto item = std::make_shared<Item>();
    ToWire(envelope, *item->request.mutable_batch());
    item->taken = std::move(taken);
    absl::MutexLock lock(&mutex_);
    if (stopped_) return;
    item->request.set_number(++last_number_);
    unacknowledged_.emplace(last_number_, std::move(item));
    Pump();
  }

  void Discard(absl::string_view map) {
    absl::MutexLock lock(&mutex_);
    for (auto it = unacknowledged_.begin(); it != unacknowledged_.end();) {
      auto next = std::next(it);
      if (it->second->request.batch().key().map() == map) unacknowledged_.erase(it);
      it = next;
    }
  }

  std::string Broken() const {
    absl::MutexLock lock(&mutex_);
    return call_ == nullptr && !unacknowledged_.empty() ? error_ : "";
  }

  void Break() {
    absl::MutexLock lock(&mutex_);
    if (call_ != nullptr) CancelCall();
  }

  void Stop() {
    absl::MutexLock lock(&mutex_);
    stopped_ = true;
    if (call_ != nullptr) CancelCall();
    alarm_.Cancel();
    auto over = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return call_ == nullptr && !alarm_set_; };
    mutex_.Await(absl::Condition(&over));
    unacknowledged_.clear();
  }

 private:
  struct Item {
    v1::ExchangeRequest request;
    Taken taken;
  };

  // One gRPC call; lives until its OnDone.
  class Call : public grpc::ClientBidiReactor<v1::ExchangeRequest, v1::ExchangeResponse> {
   public:
    explicit Call(std::shared_ptr<PeerStream> stream) : stream_(std::move(stream)) {}
    void Begin() {
      stream_->stub_->async()->Exchange(&context_, this);
      // Writes are started from outside of reactions: the hold keeps the call until reading has ended.
      AddHold();
      StartRead(&response_);
      StartCall();
    }
    void OnReadDone(bool ok) override {
      if (!ok) {
        {
          absl::MutexLock lock(&stream_->mutex_);
          open_ = false;
        }
        RemoveHold();
        return;
      }
      stream_->OnAcknowledged(response_);
      StartRead(&response_);
    }
    void OnWriteDone(bool ok) override { stream_->OnWritten(this, ok); }
    void OnDone(const grpc::Status& status) override {
      std::shared_ptr<PeerStream> stream = std::move(stream_);
      stream->OnDone(status);
      delete this;
    }

    grpc::ClientContext context_;
    // Under the stream's mutex: writes may be started.
    bool open_ = true;
    // The item that is being written; kept alive although it may be acknowledged or discarded meanwhile.
    std::shared_ptr<Item> writing_;
    uint64_t written_ = 0;

   private:
    std::shared_ptr<PeerStream> stream_;
    v1::ExchangeResponse response_;
  };

  // Starts the next thing that can be started.
  void Pump() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (stopped_ || alarm_set_) return;
    if (call_ == nullptr) {
      if (unacknowledged_.empty()) return;
      call_ = new Call(shared_from_this());
      call_->Begin();
    }
    if (!call_->open_ || call_->writing_ != nullptr) return;
    auto next = unacknowledged_.upper_bound(call_->written_);
    if (next == unacknowledged_.end()) return;
    call_->writing_ = next->second;
    call_->written_ = next->first;
    call_->StartWrite(&call_->writing_->request);
  }

  void OnWritten(Call* call, bool ok) {
    absl::MutexLock lock(&mutex_);
    call->writing_.reset();
    if (ok) Pump();
  }

  void OnAcknowledged(const v1::ExchangeResponse& response) {
    std::vector<std::shared_ptr<Item>> taken;
    {
      absl::MutexLock lock(&mutex_);
      backoff_ = kFirstBackoff;
      for (uint64_t number : response.numbers()) {
        auto it = unacknowledged_.find(number);
        if (it == unacknowledged_.end()) continue;
        taken.push_back(std::move(it->second));
        unacknowledged_.erase(it);
      }
    }
    for (auto& item : taken) item->taken();
  }

  void OnDone(const grpc::Status& status) {
    absl::MutexLock lock(&mutex_);
    call_ = nullptr;
    error_ = absl::StrCat("to ", address_, ": ", status.error_message());
    if (stopped_ || unacknowledged_.empty()) return;
    alarm_set_ = true;
    // Weakly: an alarm keeps what it called until it is set again, so the stream would keep itself.
    alarm_.Set(std::chrono::system_clock::now() + backoff_, [weak = weak_from_this()](bool) {
      const std::shared_ptr<PeerStream> self = weak.lock();
      if (self == nullptr) return;
      absl::MutexLock lock(&self->mutex_);
      self->alarm_set_ = false;
      self->Pump();
    });
    backoff_ = std::min(backoff_ * 2, kLastBackoff);
  }

  void CancelCall() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { call_->context_.TryCancel(); }

  static constexpr std::chrono::milliseconds kFirstBackoff{20};
  static constexpr std::chrono::milliseconds kLastBackoff{1000};

  const std::string address_;
  const std::unique_ptr<v1::BlockService::Stub> stub_;
  mutable absl::Mutex mutex_;
  std::map<uint64_t, std::shared_ptr<Item>> unacknowledged_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_number_ ABSL_GUARDED_BY(mutex_) = 0;
  Call* call_ ABSL_GUARDED_BY(mutex_) = nullptr;
  std::string error_ ABSL_GUARDED_BY(mutex_);
  std::chrono::milliseconds backoff_ ABSL_GUARDED_BY(mutex_) = kFirstBackoff;
  grpc::Alarm alarm_;
  bool alarm_set_ ABSL_GUARDED_BY(mutex_) = false;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
};

PeerStreams::PeerStreams() = default;
PeerStreams::~PeerStreams() { Stop(); }

void PeerStreams::Send(const std::string& address, const Envelope& envelope, Taken taken) {
  std::shared_ptr<PeerStream> stream;
  {
    absl::MutexLock lock(&mutex_);
    if (stopped_) return;
    std::shared_ptr<PeerStream>& there = streams_[address];
    if (there == nullptr) there = std::make_shared<PeerStream>(address);
    stream = there;
  }
  stream->Send(envelope, std::move(taken));
}

void PeerStreams::Discard(absl::string_view map) {
  absl::MutexLock lock(&mutex_);
  for (auto& [address, stream] : streams_) stream->Discard(map);
}

std::vector<std::string> PeerStreams::Broken() const {
  std::vector<std::string> result;
  absl::MutexLock lock(&mutex_);
  for (auto& [address, stream] : streams_) {
    if (std::string why = stream->Broken(); !why.empty()) result.push_back(std::move(why));
  }
  return result;
}

void PeerStreams::BreakAll() {
  absl::MutexLock lock(&mutex_);
  for (auto& [address, stream] : streams_) stream->Break();
}

void PeerStreams::Stop() {
  absl::flat_hash_map<std::string, std::shared_ptr<PeerStream>> streams;
  {
    absl::MutexLock lock(&mutex_);
    stopped_ = true;
    streams.swap(streams_);
  }
  for (auto& [address, stream] : streams) stream->Stop();
}

}  // namespace ndmap::server
