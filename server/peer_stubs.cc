// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/peer_stubs.h"

#include "service/channel.h"

namespace ndmap::server {

std::shared_ptr<v1::BlockService::Stub> PeerStubs::To(const std::string& address) {
  absl::MutexLock lock(&mutex_);
  std::shared_ptr<v1::BlockService::Stub>& there = stubs_[address];
  if (there == nullptr) there = v1::BlockService::NewStub(service::MakeChannel(address));
  return there;
}

}  // namespace ndmap::server
