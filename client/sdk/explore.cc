// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/explore.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/sdk/connection.h"
#include "client/sdk/map.h"

namespace ndmap {
namespace {

void Set(const std::array<double, 3>& from, v1::Point& to) {
  to.set_x(from[0]);
  to.set_y(from[1]);
  to.set_z(from[2]);
}

// The block whose server knows most about where a question begins; false if any will do.
bool FirstBlock(const v1::ExploreRequest& request, uint32_t* block) {
  for (const v1::Anchor& anchor : request.anchors()) {
    if (!anchor.has_dart() && anchor.at_case() != v1::Anchor::kBlock) continue;
    *block = anchor.has_dart() ? anchor.dart().block() : anchor.block();
    return true;
  }
  return false;
}

}  // namespace

v1::Anchor CellAnchor(absl::string_view id) {
  v1::Anchor anchor;
  anchor.set_text(std::string(id));
  return anchor;
}

v1::Anchor CellAnchor(const v1::CellId& id) {
  v1::Anchor anchor;
  *anchor.mutable_cell() = id;
  return anchor;
}

v1::Anchor DartAnchor(uint32_t block, uint32_t dart, uint64_t version) {
  v1::DartRef ref;
  ref.set_block(block);
  ref.set_dart(dart);
  ref.set_version(version);
  return DartAnchor(ref);
}

v1::Anchor DartAnchor(const v1::DartRef& dart) {
  v1::Anchor anchor;
  *anchor.mutable_dart() = dart;
  return anchor;
}

v1::Anchor PointAnchor(const std::array<double, 3>& point) {
  v1::Anchor anchor;
  Set(point, *anchor.mutable_point());
  return anchor;
}

v1::Anchor BoxAnchor(const std::array<double, 3>& lo, const std::array<double, 3>& hi) {
  v1::Anchor anchor;
  Set(lo, *anchor.mutable_box()->mutable_lo());
  Set(hi, *anchor.mutable_box()->mutable_hi());
  return anchor;
}

v1::Anchor NearestVertexAnchor(const std::array<double, 3>& point) {
  v1::Anchor anchor;
  Set(point, *anchor.mutable_nearest_vertex());
  return anchor;
}

v1::Anchor BlockAnchor(uint32_t block) {
  v1::Anchor anchor;
  anchor.set_block(block);
  return anchor;
}

v1::ExploreRequest CellsAt(const v1::Anchor& anchor, uint32_t dimension) {
  v1::ExploreRequest request;
  *request.add_anchors() = anchor;
  request.set_give(v1::GIVE_CELLS);
  request.set_dimension(dimension);
  return request;
}

v1::ExploreRequest Orbit(const v1::Anchor& anchor, uint32_t i) {
  v1::ExploreRequest request;
  *request.add_anchors() = anchor;
  request.add_close(i);
  request.set_give(v1::GIVE_DARTS);
  return request;
}

v1::ExploreRequest IncidentCells(const v1::Anchor& anchor, uint32_t own_dimension, uint32_t dimension) {
  v1::ExploreRequest request = CellsAt(anchor, dimension);
  request.add_close(own_dimension);
  return request;
}

v1::ExploreRequest AdjacentCells(const v1::Anchor& anchor, uint32_t dimension, uint32_t through) {
  return Ring(anchor, dimension, 1, through);
}

v1::ExploreRequest Ring(const v1::Anchor& anchor, uint32_t dimension, uint32_t k, uint32_t through) {
  v1::ExploreRequest request = CellsAt(anchor, dimension);
  // One step too many is enough to be refused, and is no reason to make a request of gigabytes.
  for (uint32_t step = 0; step < k && step <= kMaxRing; ++step) {
    request.add_close(dimension);
    request.add_close(through);
  }
  request.set_without_anchors(true);
  return request;
}

absl::Status MapHandle::ExploreOnce(const v1::ExploreRequest& request, PartSink take) const {
  uint32_t block = 0;
  if (!FirstBlock(request, &block)) {
    block = connection_->NextNumber() % std::max<uint32_t>(1, info_->block_count());
  }
  absl::StatusOr<std::string> address = AddressOf(block);
  if (!address.ok()) return address.status();
  auto server = connection_->BlockServer(*address);
  if (!server.ok()) return server.status();
  grpc::ClientContext context;
  internal::SetDeadline(context, connection_->options().transfer_timeout);
  auto stream = (*server)->Explore(&context, request);
  absl::Status wrong;
  v1::ExploreResponse part;
  while (wrong.ok() && stream->Read(&part)) wrong = take(part);
  if (!wrong.ok()) context.TryCancel();
  absl::Status status = internal::FromGrpc(stream->Finish(), internal::ServerName(*address));
  return wrong.ok() ? status : wrong;
}

absl::Status MapHandle::Explore(const v1::ExploreRequest& request, PartSink take) const {
  v1::ExploreRequest mine = request;
  mine.set_map(name());
  bool handed = false;
  absl::Status last;
  absl::Status status = internal::Retry(connection_->options(), [&] {
    last = ExploreOnce(mine, [&](const v1::ExploreResponse& part) {
      handed = true;
      return take(part);
    });
    // What the caller has seen cannot be taken back: no other try then, whatever the error.
    return handed ? absl::OkStatus() : last;
  });
  return handed ? last : status;
}

absl::StatusOr<v1::ExploreResponse> MapHandle::Explore(const v1::ExploreRequest& request) const {
  v1::ExploreRequest mine = request;
  mine.set_map(name());
  v1::ExploreResponse all;
  absl::Status status = internal::Retry(connection_->options(), [&] {
    all.Clear();
    return ExploreOnce(mine, [&](const v1::ExploreResponse& part) {
      all.MergeFrom(part);
      return absl::OkStatus();
    });
  });
  if (!status.ok()) return status;
  return all;
}

}  // namespace ndmap
