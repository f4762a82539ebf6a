// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/message.h"

#include <random>
#include <string>

#include "gtest/gtest.h"

namespace ndmap {
namespace {

MessageBatch Sample(bool payloads) {
  MessageBatch batch;
  batch.Add({1, {0, 1}, {}});
  batch.Add({2, {77, 0x1234}, payloads ? "abc" : ""});
  batch.Add({3, {~uint64_t{0}, 5}, {}});
  batch.Add({1, {9, 6}, payloads ? "defgh" : ""});
  return batch;
}

TEST(MessageBatchTest, EncodedBatchReadsBack) {
  for (bool payloads : {false, true}) {
    const MessageBatch batch = Sample(payloads);
    const std::string bytes = batch.Encode();
    EXPECT_EQ(bytes.size(), batch.encoded_bytes());
    auto decoded = MessageBatch::Decode(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    ASSERT_EQ(decoded->size(), batch.size());
    for (size_t i = 0; i < batch.size(); ++i) {
      EXPECT_EQ((*decoded)[i].kind, batch[i].kind);
      EXPECT_EQ((*decoded)[i].label, batch[i].label);
      EXPECT_EQ((*decoded)[i].payload, batch[i].payload);
    }
  }
}

TEST(MessageBatchTest, DamagedBytesAreRefused) {
  const std::string bytes = Sample(true).Encode();
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(MessageBatch::Decode(absl::string_view(bytes).substr(0, length)).ok()) << length;
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x41);
    EXPECT_FALSE(MessageBatch::Decode(damaged).ok()) << "byte " << i;
  }
}

}  // namespace
}  // namespace ndmap
