// SPDX-License-Identifier: GPL-3.0-or-later
// Where the bytes of a block are.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/map/block.h"
#include "core/map/dart_index.h"

namespace ndmap {

// Elements of one kind. Erased ones leave rows behind, which the next ones are put in the place of.
struct MemoryPart {
  uint64_t used = 0;
  // That are used or were.
  uint64_t rows = 0;
  // Of all rows, and what finds them.
  uint64_t bytes = 0;

  // Of rows that are free now.
  uint64_t free_bytes() const { return rows == 0 ? 0 : bytes / rows * (rows - used); }
};

// The parts add up to AccountedBytes() of a block without slots, whatever its storage.
struct BlockMemory {
  // Their links, marks, and the numbers of their attributes.
  MemoryPart darts;
  // Points, levels.
  MemoryPart vertices;
  // n-cells: ids, states.
  MemoryPart cells;
  // Critical darts: labels, peers, signs, and both tables that find them.
  MemoryPart labels;
};

namespace internal {
template <class Container>
MemoryPart PartOf(const Container& container) {
  return {container.size(), RowsOf(container), ContainerBytes(container)};
}

template <class Container>
size_t BytesToGrow(const Container& container, size_t elements) {
  const MemoryPart part = PartOf(container);
  const size_t spare = part.rows - part.used;
  return elements <= spare ? 0 : (elements - spare) * ElementBytes(container);
}
}  // namespace internal

// O(1).
template <class Types>
BlockMemory MemoryOf(const Block<Types>& block) {
  const auto& map = block.map();
  BlockMemory memory;
  memory.darts = internal::PartOf(map.darts());
  memory.vertices = internal::PartOf(map.template attributes<0>());
  memory.cells = internal::PartOf(map.template attributes<Types::n>());
  const auto& labels = block.label_table();
  memory.labels = {labels.rows().size(), labels.rows().rows(), labels.allocated_bytes()};
  return memory;
}

// By how much AccountedBytes() grows when so many more are made, free rows used first. O(1).
template <class Types>
size_t BytesToGrow(const Block<Types>& block, size_t darts, size_t vertices, size_t cells) {
  const auto& map = block.map();
  return internal::BytesToGrow(map.darts(), darts) +
         internal::BytesToGrow(map.template attributes<0>(), vertices) +
         internal::BytesToGrow(map.template attributes<Types::n>(), cells);
}

}  // namespace ndmap
