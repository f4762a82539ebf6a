// SPDX-License-Identifier: GPL-3.0-or-later
// What blocks say to each other: small messages that name a critical dart by its label, gathered in batches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/map/ids.h"

namespace ndmap {

// One message. `kind` belongs to the algorithm that is running; `payload` is empty in most messages and lives
// as long as the batch it came from.
struct Message {
  uint8_t kind = 0;
  Label label;
  absl::string_view payload;
};

// Messages from one block to another in packed columns, which is also the form on the wire: no object a
// message.
class MessageBatch {
 public:
  void Add(const Message& message);
  // Removes all messages, keeps the memory.
  void Clear();

  size_t size() const { return kinds_.size(); }
  bool empty() const { return kinds_.empty(); }
  // The size of Encode()'s result. O(1).
  size_t encoded_bytes() const;
  // Message i, 0 <= i < size().
  Message operator[](size_t i) const;

  // Columns, little-endian: count (u32), flags (u32; bit 0: payloads follow), kinds, roots, paths,
  // payload ends and payload bytes, and an XXH3-64 of all that before it.
  std::string Encode() const;
  // INVALID_ARGUMENT if the bytes are not what Encode() makes; never trusts a size in them. O(bytes).
  static absl::StatusOr<MessageBatch> Decode(absl::string_view bytes);

 private:
  std::vector<uint8_t> kinds_;
  std::vector<Label> labels_;
  // End of each payload in payload_; stays empty while no message has one.
  std::vector<uint32_t> payload_ends_;
  std::string payload_;
};

// Where an algorithm puts what it says. What is put here is counted as sent at once.
class Outbox {
 public:
  virtual ~Outbox() = default;
  // To one block.
  virtual void Send(BlockId to, const Message& message) = 0;
  // To every other block of the map: what a map with broadcast routing does, which knows no peers.
  virtual void Broadcast(const Message& message) = 0;
};

}  // namespace ndmap
