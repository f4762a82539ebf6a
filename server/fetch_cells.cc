// SPDX-License-Identifier: GPL-3.0-or-later
// Whole hexahedra for clients that walk in their own memory.
#include <algorithm>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "server/block_version.h"
#include "server/column.h"
#include "server/explorer.h"

namespace ndmap::server {
namespace {

// Darts in a part of a chunk, which is 2 to 6 MiB then.
constexpr uint64_t kPartDarts = 100000;
// Hexahedra in a chunk.
constexpr uint32_t kChunk = 2048;
// A step takes about a millisecond.
constexpr size_t kFetchedDartsAStep = 5000;

// Reads a chunk part by part. A part may end within a hexahedron: one beside much finer ones has any number
// of darts.
class ChunkReader {
 public:
  using Lcc = Block3::Lcc;
  using Dart = Block3::Dart;

  // The labels of critical darts, by the block that has their partners (none: all others are asked).
  struct Open {
    std::vector<Label> labels;
    // In part.critical.
    std::vector<size_t> places;
  };

  ChunkReader(const v1::DartRef& dart, uint64_t part_darts) : dart_(dart), part_darts_(part_darts) {}

  void BeginPart() {
    part_.Clear();
    open_.clear();
    in_part_ = 0;
    cell_told_ = false;
  }
  // True when the part is full or the chunk is over.
  absl::StatusOr<bool> Step(Block3& block) {
    absl::Status status = version_ == 0 ? Begin(block) : CheckUnchanged(block, version_);
    if (!status.ok()) return status;
    for (size_t k = 0; k < kFetchedDartsAStep && in_part_ < part_darts_; ++k) {
      const Dart d = Next(block.map());
      over_ = d == Lcc::null_handle;
      if (over_) return true;
      Tell(block, d);
    }
    return in_part_ == part_darts_;
  }

  bool over() const { return over_; }
  v1::FetchCellsResponse& part() { return part_; }
  const absl::btree_map<BlockId, Open>& open() const { return open_; }

 private:
  absl::Status Begin(Block3& block) {
    auto& map = block.map();
    if (absl::Status s = CheckVersion(block, dart_.version()); !s.ok()) return s;
    const Dart d = DartAt(map, DartIndex{dart_.dart()});
    if (d == Lcc::null_handle || map.attribute<3>(d) == Lcc::null_handle) {
      return absl::NotFoundError(absl::StrCat("block ", block.id().value, " has no dart ", dart_.dart()));
    }
    next_ = static_cast<uint32_t>(map.attributes<3>().index(map.attribute<3>(d))) / kChunk * kChunk;
    end_ = next_ + kChunk;
    version_ = block.version();
    return absl::OkStatus();
  }

  // The next dart of the chunk, hexahedron after hexahedron; the null handle at its end.
  Dart Next(Lcc& map) {
    while (true) {
      while (!stack_.empty()) {
        const Dart d = stack_.back();
        stack_.pop_back();
        if (seen_.insert(IndexOf(map, d)).second) return d;
      }
      auto& cells = map.attributes<3>();
      while (next_ < end_ && !cells.is_used(next_)) ++next_;
      if (next_ == end_) return Lcc::null_handle;
      cell_ = Block3::Types::Cell(typename Lcc::Attribute_handle<3>::type(next_++));
      cell_told_ = cell_begun_ = false;
      seen_.clear();
      stack_.push_back(map.info_of_attribute<3>(cell_).reference);
    }
  }

  void Tell(Block3& block, Dart d) {
    auto& map = block.map();
    if (!cell_told_) TellCell(map);
    const Dart d1 = map.beta<1>(d), d2 = map.beta<2>(d);
    Append(*part_.mutable_darts(), IndexOf(map, d).value);
    Append(*part_.mutable_beta1(), IndexOf(map, d1).value);
    Append(*part_.mutable_beta2(), IndexOf(map, d2).value);
    AddBeta3(block, d);
    AddVertex(map, d);
    const int row = part_.cell_darts_size() - 1;
    part_.set_cell_darts(row, part_.cell_darts(row) + 1);
    ++in_part_;
    stack_.push_back(d1);
    stack_.push_back(d2);
  }

  void TellCell(Lcc& map) {
    if (in_part_ == 0) {
      part_.set_block(dart_.block());
      part_.set_version(version_);
      part_.set_continued(cell_begun_);
    }
    const auto& info = map.info_of_attribute<3>(cell_);
    part_.add_cell_darts(0);
    part_.add_cell_hi(info.id.hi());
    part_.add_cell_lo(info.id.lo());
    part_.add_cell_states(
        static_cast<uint32_t>(info.state == CellState::kClear ? CellState::kUnknown : info.state));
    cell_told_ = cell_begun_ = true;
  }

  void AddBeta3(Block3& block, Dart d) {
    auto& map = block.map();
    if (!block.IsCritical(d)) {
      Append(*part_.mutable_beta3(),
             map.is_free<3>(d) ? DartIndex::kNone : IndexOf(map, map.beta<3>(d)).value);
      return;
    }
    const Critical& c = block.critical(d);
    open_[c.peer].labels.push_back(c.label);
    open_[c.peer].places.push_back(static_cast<size_t>(part_.critical_size()));
    part_.add_critical(static_cast<uint32_t>(in_part_));
    part_.add_partner_blocks(c.peer.value);
    Append(*part_.mutable_beta3(), DartIndex::kNone);
  }

  void AddVertex(Lcc& map, Dart d) {
    const auto index = static_cast<uint32_t>(map.attributes<0>().index(map.attribute<0>(d)));
    Append(*part_.mutable_vertices(), index);
    if (!vertices_.insert(index).second) return;
    const Point3 p = Frame<Block3>::StartPoint(map, d);
    Append(*part_.mutable_points_of(), index);
    part_.mutable_points()->Add(p.begin(), p.end());
  }

  const v1::DartRef& dart_;
  const uint64_t part_darts_;
  // 0: not begun.
  uint64_t version_ = 0;
  // The next hexahedron, and the one that is being read: begun in the chunk, told in the part.
  uint32_t next_ = 0;
  uint32_t end_ = 0;
  Block3::Types::Cell cell_;
  bool cell_begun_ = false;
  bool cell_told_ = false;
  bool over_ = false;
  absl::flat_hash_set<DartIndex> seen_;
  absl::flat_hash_set<uint32_t> vertices_;
  std::vector<Dart> stack_;
  v1::FetchCellsResponse part_;
  uint64_t in_part_ = 0;
  absl::btree_map<BlockId, Open> open_;
};

void SetBeta3(v1::FetchCellsResponse& response, size_t critical, uint32_t block, uint32_t dart) {
  response.set_partner_blocks(static_cast<int>(critical), block);
  Set(*response.mutable_beta3(), response.critical(static_cast<int>(critical)), dart);
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
                                  const std::function<bool(const v1::FetchCellsResponse&)>& write) {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  RemoteBlocks blocks(request.map(), *std::move(info), host_->address(), &answers_, peers_, gone, max_darts_);
  // The partners of a part's darts are one question.
  ChunkReader reader(request.dart(), std::min(kPartDarts, max_darts_));
  auto step = [&](Block3& block) { return reader.Step(block); };
  while (true) {
    reader.BeginPart();
    absl::Status status = host_->QuerySliced(request.map(), request.dart().block(), step, gone);
    if (!status.ok()) return status;
    if (reader.over() && reader.part().darts().empty()) return absl::OkStatus();
    if (status = ResolvePartners(blocks, reader.open(), reader.part()); !status.ok()) return status;
    if (!write(reader.part())) return absl::CancelledError("the caller has gone");
    if (reader.over()) return absl::OkStatus();
  }
}

}  // namespace ndmap::server
