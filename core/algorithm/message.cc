// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/message.h"

#include <xxhash.h>

#include <bit>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are written little-endian");

constexpr size_t kHeader = 8;
constexpr size_t kChecksum = 8;
constexpr uint32_t kHasPayloads = 1;

template <class T>
void AppendColumn(std::string& out, const T* data, size_t count) {
  out.append(reinterpret_cast<const char*>(data), count * sizeof(T));
}

absl::Status Bad(absl::string_view what, size_t bytes) {
  return absl::InvalidArgumentError(absl::StrCat("message batch of ", bytes, " bytes: ", what));
}

}  // namespace

void MessageBatch::Add(const Message& message) {
  if (!message.payload.empty() && payload_ends_.empty()) payload_ends_.assign(kinds_.size(), 0);
  kinds_.push_back(message.kind);
  labels_.push_back(message.label);
  if (!payload_ends_.empty() || !message.payload.empty()) {
    payload_.append(message.payload.data(), message.payload.size());
    payload_ends_.push_back(static_cast<uint32_t>(payload_.size()));
  }
}

void MessageBatch::Clear() {
  kinds_.clear();
  labels_.clear();
  payload_ends_.clear();
  payload_.clear();
}

size_t MessageBatch::encoded_bytes() const {
  return kHeader + kChecksum + kinds_.size() * (1 + sizeof(Label)) + payload_ends_.size() * sizeof(uint32_t) +
         payload_.size();
}

Message MessageBatch::operator[](size_t i) const {
  Message message{kinds_[i], labels_[i], {}};
  if (!payload_ends_.empty()) {
    const uint32_t begin = i == 0 ? 0 : payload_ends_[i - 1];
    message.payload = absl::string_view(payload_).substr(begin, payload_ends_[i] - begin);
  }
  return message;
}

std::string MessageBatch::Encode() const {
  std::string out;
  out.reserve(encoded_bytes());
  const uint32_t header[2] = {static_cast<uint32_t>(kinds_.size()), payload_ends_.empty() ? 0 : kHasPayloads};
  AppendColumn(out, header, 2);
  AppendColumn(out, kinds_.data(), kinds_.size());
  AppendColumn(out, labels_.data(), labels_.size());
  AppendColumn(out, payload_ends_.data(), payload_ends_.size());
  out += payload_;
  const uint64_t checksum = XXH3_64bits(out.data(), out.size());
  AppendColumn(out, &checksum, 1);
  return out;
}

absl::StatusOr<MessageBatch> MessageBatch::Decode(absl::string_view bytes) {
  if (bytes.size() < kHeader + kChecksum) return Bad("shorter than its header", bytes.size());
  const size_t body = bytes.size() - kChecksum;
  uint64_t checksum;
  std::memcpy(&checksum, bytes.data() + body, sizeof(checksum));
  if (checksum != XXH3_64bits(bytes.data(), body)) return Bad("checksum differs", bytes.size());
  uint32_t header[2];
  std::memcpy(header, bytes.data(), sizeof(header));
  const size_t count = header[0];
  const bool payloads = (header[1] & kHasPayloads) != 0;
  const size_t columns = kHeader + count * (1 + sizeof(Label) + (payloads ? sizeof(uint32_t) : 0));
  if (columns > body || (!payloads && columns != body)) {
    return Bad(absl::StrCat("a count of ", count, " does not fit"), bytes.size());
  }
  MessageBatch batch;
  const char* at = bytes.data() + kHeader;
  auto read = [&at](auto& column, size_t n) {
    column.resize(n);
    if (n == 0) return;
    std::memcpy(static_cast<void*>(column.data()), at, n * sizeof(column[0]));
    at += n * sizeof(column[0]);
  };
  read(batch.kinds_, count);
  read(batch.labels_, count);
  if (payloads) {
    read(batch.payload_ends_, count);
    batch.payload_.assign(at, body - columns);
    uint32_t before = 0;
    for (uint32_t end : batch.payload_ends_) {
      if (end < before || end > batch.payload_.size()) return Bad("payload ends out of order", bytes.size());
      before = end;
    }
  }
  return batch;
}

}  // namespace ndmap
