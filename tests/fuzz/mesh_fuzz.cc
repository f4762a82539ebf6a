// SPDX-License-Identifier: GPL-3.0-or-later
// Feeds the mesh readers whatever libFuzzer thinks of. What is read must be glued or refused; what is glued
// must be what its links say. Run without a corpus it writes a file of every format to the folder that
// NDMAP_FUZZ_SEEDS names.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "absl/strings/string_view.h"
#include "core/io/mesh_reader.h"
#include "core/io/mesh_reader_testing.h"
#include "core/io/vtu_testing.h"
#include "core/mesh/mesh_facts.h"
#include "core/mesh/mesh_testing.h"

namespace {

using ndmap::VtuStyle;

void Require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

void RequireSentence(const absl::Status& status) {
  Require(!status.message().empty(), "an error says what it is");
  Require(status.message().find('\n') == absl::string_view::npos, "an error is one line");
}

void RequireLinks(const ndmap::GluedMesh& glued) {
  const ndmap::VolumeMesh& mesh = glued.mesh;
  for (uint32_t c = 0; c < mesh.cells(); ++c) {
    const ndmap::CellShape& shape = ndmap::ShapeOf(mesh.kinds[c]);
    for (uint8_t f = 0; f < shape.faces; ++f) {
      const ndmap::FaceLink& link = glued.Link(c, f);
      if (link.boundary()) continue;
      Require(link.cell != c && link.cell < mesh.cells(), "a link leads to another cell");
      Require(glued.Link(link.cell, link.face) == (ndmap::FaceLink{c, f, link.turn}), "a link leads back");
      const int k = shape.face_corners[f];
      for (int i = 0; i < k; ++i) {
        Require(mesh.FacePoint(c, f, i) == mesh.FacePoint(link.cell, link.face, (link.turn + k - i) % k),
                "a link joins the same points");
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* folder = std::getenv("NDMAP_FUZZ_SEEDS");
  if (folder == nullptr) return 0;
  const ndmap::VolumeMesh mesh = ndmap::OneOfEach();
  int count = 0;
  const auto seed = [&](const std::string& bytes) {
    std::ofstream(std::string(folder) + "/seed" + std::to_string(count++), std::ios::binary) << bytes;
  };
  for (bool binary : {false, true}) {
    seed(ndmap::Gmsh2(mesh, binary));
    seed(ndmap::Gmsh4(mesh, binary));
  }
  seed(ndmap::Medit(mesh));
  seed(ndmap::Mfem(mesh));
  for (int version = 1; version <= 4; ++version) seed(ndmap::MeditBinary(mesh, version, version == 2));
  for (auto format :
       {VtuStyle::kAscii, VtuStyle::kBinary, VtuStyle::kAppendedRaw, VtuStyle::kAppendedBase64}) {
    for (auto compressor : {VtuStyle::kNone, VtuStyle::kZlib, VtuStyle::kLzma})
      seed(Vtu(mesh, {format, compressor}));
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr uint64_t kMostBytes = 1 << 24;
  const absl::string_view bytes(reinterpret_cast<const char*>(data), size);
  auto file = ndmap::ReadVolumeMeshFromBytes(bytes, kMostBytes);
  if (!file.ok()) {
    RequireSentence(file.status());
    return 0;
  }
  for (bool lenient : {false, true}) {
    const auto glued = ndmap::Glue(file->mesh, {.allow_concave = lenient, .merge_equal_points = lenient});
    if (!glued.ok()) {
      RequireSentence(glued.status());
      continue;
    }
    RequireLinks(*glued);
    const ndmap::MeshFacts facts = ndmap::Describe(*glued);
    Require(facts.boundary_faces == glued->boundary_faces, "the boundary is counted alike");
    Require(facts.components <= glued->mesh.cells(), "no more components than cells");
  }
  return 0;
}
