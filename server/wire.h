// SPDX-License-Identifier: GPL-3.0-or-later
// From messages of the wire to types of the house and back.
#pragma once

#include "absl/status/statusor.h"
#include "ndmap/v1/block_service.pb.h"
#include "server/actor.h"
#include "server/transport.h"

namespace ndmap::server {

PhaseId FromWire(const v1::PhaseKey& key);
void ToWire(const Envelope& envelope, v1::Batch& batch);
// DATA_LOSS when the messages do not have their checksum.
absl::StatusOr<Envelope> FromWire(const v1::Batch& batch);
void ToWire(BlockId block, const BlockSnapshot& snapshot, v1::BlockProgress& progress);
void ToWire(const Report& report, v1::Report& wire);
inline Label FromWire(const v1::Label& label) { return {label.root(), label.path()}; }
void ToWire(const Label& label, v1::Label& wire);

}  // namespace ndmap::server
