// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/mesh_reader.h"

#include <exception>
#include <new>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_formats.h"
#include "core/mesh/cell_geometry.h"
#include "core/mesh/mesh_check.h"

namespace ndmap {
namespace {

absl::Status Invalid(absl::string_view what) { return absl::InvalidArgumentError(what); }

// Numbers that count up by one need no array.
void ShortenNumbers(std::vector<uint64_t>* numbers, uint64_t* first) {
  for (size_t i = 1; i < numbers->size(); ++i) {
    if ((*numbers)[i] != (*numbers)[0] + i) return;
  }
  if (!numbers->empty()) *first = (*numbers)[0];
  std::vector<uint64_t>().swap(*numbers);
}

// VTK's documented wedge has its triangles the other way round than Gmsh's prism, but many programs write the
// one under the other's name.
void MendPrisms(MeshFile* file) {
  VolumeMesh& mesh = file->mesh;
  uint64_t prisms = 0;
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    if (mesh.kinds[c] != CellKind::kPrism) continue;
    if (Soundness(CellKind::kPrism, CellCorners(mesh, c)) != CellSoundness::kInverted) return;
    ++prisms;
  }
  if (prisms == 0) return;
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    if (mesh.kinds[c] != CellKind::kPrism) continue;
    uint32_t* corners = &mesh.corners[mesh.begins[c]];
    std::swap(corners[1], corners[2]);
    std::swap(corners[4], corners[5]);
  }
  file->notes.push_back(
      absl::StrCat(prisms == 1 ? "turned the one prism" : absl::StrCat("turned all ", prisms, " prisms"),
                   ": their triangles are listed the other way round than ", file->format, " says"));
}

absl::StatusOr<MeshFile> ReadAny(absl::string_view bytes, uint64_t max_bytes) {
  if (bytes.size() > max_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("has ", bytes.size(), " bytes; at most ", max_bytes, " are read"));
  }
  const absl::string_view text = absl::StripLeadingAsciiWhitespace(bytes);
  if (text.empty()) return Invalid("is empty");
  if (absl::StartsWith(text, "$")) return internal::ReadGmsh(bytes);
  if (absl::StartsWith(text, "<")) return internal::ReadVtu(text, max_bytes);
  if (absl::StartsWith(text, "MFEM")) return internal::ReadMfem(bytes);
  if (bytes.size() >= 4 && (absl::StartsWith(bytes, absl::string_view("\1\0\0\0", 4)) ||
                            absl::StartsWith(bytes, absl::string_view("\0\0\0\1", 4)))) {
    return internal::ReadMeditBinary(bytes);
  }
  if (absl::StartsWith(text, "# vtk")) return Invalid("is a legacy VTK file; save it as VTU");
  if (absl::StartsWith(text, "MeshVersion") || absl::StartsWith(text, "#")) return internal::ReadMedit(bytes);
  if (absl::StartsWith(text, "(")) return Invalid("looks like a Fluent mesh; save it as Gmsh 4.1 or VTU");
  return Invalid("is no volume mesh that is known: VTU, Gmsh, Medit or MFEM");
}

absl::StatusOr<MeshFile> ReadAndFinish(absl::string_view bytes, uint64_t max_bytes) {
  auto file = ReadAny(bytes, max_bytes);
  if (!file.ok()) return file;
  MeshSource& source = file->mesh.source;
  ShortenNumbers(&source.cells, &source.first_cell);
  ShortenNumbers(&source.points, &source.first_point);
  if (absl::Status s = internal::CheckArrays(file->mesh); !s.ok()) return s;
  MendPrisms(&*file);
  return file;
}

}  // namespace

namespace internal {

void LeftOut::NoteTo(MeshFile* file) const {
  if (counts_.empty()) return;
  std::string what;
  for (const auto& [name, count] : counts_)
    absl::StrAppend(&what, what.empty() ? "" : ", ", count, " ", name);
  file->notes.push_back(absl::StrCat("left out what has fewer than three dimensions: ", what));
}

bool PointNumbers::Add(uint64_t number) {
  const uint32_t index = static_cast<uint32_t>(numbers_.size());
  if (consecutive_ && index > 0 && number != numbers_[0] + index) {
    consecutive_ = false;
    for (uint32_t i = 0; i < index; ++i) indices_.emplace(numbers_[i], i);
  }
  numbers_.push_back(number);
  return consecutive_ || indices_.emplace(number, index).second;
}

std::optional<uint32_t> PointNumbers::Find(uint64_t number) const {
  if (consecutive_) {
    if (numbers_.empty() || number < numbers_[0] || number - numbers_[0] >= numbers_.size()) return {};
    return static_cast<uint32_t>(number - numbers_[0]);
  }
  const auto it = indices_.find(number);
  if (it == indices_.end()) return {};
  return it->second;
}

}  // namespace internal

absl::StatusOr<MeshFile> ReadVolumeMeshFromBytes(absl::string_view bytes, uint64_t max_bytes) {
  try {
    return ReadAndFinish(bytes, max_bytes);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("too large for this machine's memory: ", bytes.size(), " bytes"));
  } catch (const std::exception& e) {
    return Invalid(absl::StrCat("cannot be read: ", e.what()));
  }
}

absl::StatusOr<MeshFile> ReadVolumeMesh(const std::string& path, uint64_t max_bytes) {
  const auto bytes = internal::ReadFileBytes(path, max_bytes);
  if (!bytes.ok()) return bytes.status();
  auto file = ReadVolumeMeshFromBytes(*bytes, max_bytes);
  if (!file.ok())
    return absl::Status(file.status().code(), absl::StrCat(path, ": ", file.status().message()));
  file->mesh.source.file = path;
  return file;
}

absl::StatusOr<GluedMesh> ReadGluedMesh(const std::string& path, const GlueOptions& options,
                                        uint64_t max_bytes) {
  auto file = ReadVolumeMesh(path, max_bytes);
  if (!file.ok()) return file.status();
  auto glued = Glue(std::move(file->mesh), options);
  if (!glued.ok()) return glued;
  glued->notes.insert(glued->notes.begin(), file->notes.begin(), file->notes.end());
  return glued;
}

}  // namespace ndmap
