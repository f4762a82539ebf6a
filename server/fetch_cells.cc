// SPDX-License-Identifier: GPL-3.0-or-later
// Whole hexahedra for clients that walk in their own memory.
#include <cstring>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "server/explorer.h"
#include "server/wire.h"

namespace ndmap::server {
namespace {

// Hexahedra in a chunk. With hanging faces a hexahedron has some hundred darts of 20 bytes at most on average
// over a chunk, which keeps the answer far below a message's 16 MiB.
constexpr uint32_t kChunk = 2048;
constexpr size_t kHexahedraAStep = 256;
constexpr size_t kMostBytes = 12 << 20;

// Little-endian 32-bit numbers, one after the other.
void Append(std::string& column, uint32_t value) {
  char bytes[4];
  std::memcpy(bytes, &value, sizeof(bytes));
  column.append(bytes, sizeof(bytes));
}

class ChunkReader {
 public:
  using Lcc = Block3::Lcc;
  using Dart = Block3::Dart;

  ChunkReader(const v1::DartRef& dart, v1::FetchCellsResponse& response) : dart_(dart), response_(response) {}

  absl::StatusOr<bool> Step(Block3& block) {
    auto& map = block.map();
    if (response_.version() == 0) {
      if (absl::Status s = Begin(block); !s.ok()) return s;
    }
    if (response_.version() != block.version()) {
      return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed during the query"));
    }
    auto& cells = map.attributes<3>();
    for (size_t k = 0; k < kHexahedraAStep && next_ < end_; ++k, ++next_) {
      if (cells.is_used(next_)) Read(block, typename Lcc::Attribute_handle<3>::type(next_));
    }
    if (response_.darts().size() * 5 > kMostBytes) {
      return absl::ResourceExhaustedError(
          absl::StrCat("hexahedra of block ", block.id().value, " have too many darts for one message"));
    }
    return next_ >= end_;
  }

  // The labels of critical darts, by the block that has their partners (none: all others are asked).
  struct Open {
    std::vector<Label> labels;
    // In response.critical.
    std::vector<size_t> places;
  };
  const absl::btree_map<BlockId, Open>& open() const { return open_; }

 private:
  absl::Status Begin(Block3& block) {
    auto& map = block.map();
    if (dart_.version() != 0 && dart_.version() != block.version()) {
      return absl::FailedPreconditionError(
          absl::StrCat("block ", block.id().value, " has changed since version ", dart_.version(),
                       " (it is at ", block.version(), " now): ask for its darts again"));
    }
    const Dart d = DartAt(map, DartIndex{dart_.dart()});
    if (d == Lcc::null_handle || map.attribute<3>(d) == Lcc::null_handle) {
      return absl::NotFoundError(absl::StrCat("block ", block.id().value, " has no dart ", dart_.dart()));
    }
    const auto index = static_cast<uint32_t>(map.attributes<3>().index(map.attribute<3>(d)));
    next_ = index / kChunk * kChunk;
    end_ = next_ + kChunk;
    response_.set_block(block.id().value);
    response_.set_version(block.version());
    return absl::OkStatus();
  }

  void Read(Block3& block, Block3::Types::Cell cell) {
    auto& map = block.map();
    const auto& info = map.info_of_attribute<3>(cell);
    const size_t before = response_.darts().size();
    seen_.clear();
    stack_.push_back(info.reference);
    while (!stack_.empty()) {
      const Dart d = stack_.back();
      stack_.pop_back();
      if (!seen_.insert(IndexOf(map, d)).second) continue;
      const Dart d1 = map.beta<1>(d), d2 = map.beta<2>(d);
      Append(*response_.mutable_darts(), IndexOf(map, d).value);
      Append(*response_.mutable_beta1(), IndexOf(map, d1).value);
      Append(*response_.mutable_beta2(), IndexOf(map, d2).value);
      AddBeta3(block, d);
      AddVertex(map, d);
      stack_.push_back(d1);
      stack_.push_back(d2);
    }
    response_.add_cell_darts(static_cast<uint32_t>((response_.darts().size() - before) / 4));
    response_.add_cell_hi(info.id.hi());
    response_.add_cell_lo(info.id.lo());
    response_.add_cell_states(
        static_cast<uint32_t>(info.state == CellState::kClear ? CellState::kUnknown : info.state));
  }

  void AddBeta3(Block3& block, Dart d) {
    auto& map = block.map();
    if (!block.IsCritical(d)) {
      Append(*response_.mutable_beta3(),
             map.is_free<3>(d) ? DartIndex::kNone : IndexOf(map, map.beta<3>(d)).value);
      return;
    }
    const Critical& c = block.critical(d);
    open_[c.peer].labels.push_back(c.label);
    open_[c.peer].places.push_back(static_cast<size_t>(response_.critical_size()));
    response_.add_critical(static_cast<uint32_t>(response_.beta3().size() / 4));
    response_.add_partner_blocks(c.peer.value);
    Append(*response_.mutable_beta3(), DartIndex::kNone);
  }

  void AddVertex(Lcc& map, Dart d) {
    const auto vertex = map.attribute<0>(d);
    const auto index = static_cast<uint32_t>(map.attributes<0>().index(vertex));
    Append(*response_.mutable_vertices(), index);
    if (!vertices_.insert(index).second) return;
    const Point3 p = Frame<Block3>::StartPoint(map, d);
    Append(*response_.mutable_points_of(), index);
    response_.mutable_points()->Add(p.begin(), p.end());
  }

  const v1::DartRef& dart_;
  v1::FetchCellsResponse& response_;
  uint32_t next_ = 0;
  uint32_t end_ = 0;
  absl::btree_map<BlockId, Open> open_;
  absl::flat_hash_set<DartIndex> seen_;
  absl::flat_hash_set<uint32_t> vertices_;
  std::vector<Dart> stack_;
};

void SetBeta3(v1::FetchCellsResponse& response, size_t critical, uint32_t block, uint32_t dart) {
  response.set_partner_blocks(static_cast<int>(critical), block);
  std::memcpy(response.mutable_beta3()->data() + 4 * response.critical(static_cast<int>(critical)), &dart, 4);
}

// Asks the blocks that have them, or all others, for the partners' darts.
absl::Status ResolvePartners(RemoteBlocks& blocks, const absl::btree_map<BlockId, ChunkReader::Open>& open,
                             v1::FetchCellsResponse& response) {
  std::vector<v1::AskBlockRequest> requests;
  std::vector<const ChunkReader::Open*> asked;
  for (const auto& [peer, part] : open) {
    for (uint32_t b = 0; b < blocks.block_count(); ++b) {
      if (peer.valid() ? b != peer.value : b == response.block()) continue;
      v1::AskBlockRequest& request = requests.emplace_back();
      request.set_block(b);
      for (const Label& label : part.labels) {
        request.mutable_resolve()->add_roots(label.root);
        request.mutable_resolve()->add_paths(label.path);
      }
      asked.push_back(&part);
    }
  }
  const std::vector<v1::AskBlockRequest> questions = requests;
  absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = blocks.Ask(std::move(requests));
  if (!answers.ok()) return answers.status();
  size_t found = 0;
  for (size_t k = 0; k < asked.size(); ++k) {
    response.add_blocks(questions[k].block());
    response.add_versions((*answers)[k].version());
    const v1::ResolveAnswer& answer = (*answers)[k].resolve();
    if (static_cast<size_t>(answer.darts_size()) != asked[k]->labels.size()) {
      return absl::InternalError(absl::StrCat("block ", questions[k].block(), " resolved other labels"));
    }
    for (int i = 0; i < answer.darts_size(); ++i) {
      if (answer.darts(i) == DartIndex::kNone) continue;
      ++found;
      SetBeta3(response, asked[k]->places[static_cast<size_t>(i)], questions[k].block(), answer.darts(i));
    }
  }
  if (found == static_cast<size_t>(response.critical_size())) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(found, " of ", response.critical_size(), " labels of block ",
                                             response.block(),
                                             " have a partner at the moment: the map is being changed"));
}

}  // namespace

absl::Status Explorer::FetchCells(const v1::FetchCellsRequest& request, const std::function<bool()>& gone,
                                  v1::FetchCellsResponse& response) {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  ChunkReader reader(request.dart(), response);
  auto step = [&](Block3& block) { return reader.Step(block); };
  absl::Status status = host_->QuerySliced(request.map(), request.dart().block(), step, gone);
  if (!status.ok()) return status;
  RemoteBlocks blocks(request.map(), *std::move(info), host_->address(), &answers_, peers_, gone, max_darts_);
  return ResolvePartners(blocks, reader.open(), response);
}

}  // namespace ndmap::server
