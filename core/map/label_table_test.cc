// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/map/label_table.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "core/map/flat_handle.h"

namespace ndmap {
namespace {

TEST(LabelTable, FindsWhatAPlainMapFindsWhateverIsInsertedRelabelledAndErased) {
  std::mt19937 random(7);
  LabelTable<FlatDart> table;
  std::map<FlatDart, Critical> by_dart;
  std::map<Label, FlatDart> by_label;
  uint64_t next_root = 0;
  for (int step = 0; step < 20000; ++step) {
    const FlatDart dart{static_cast<uint32_t>(1 + random() % 500)};
    const auto it = by_dart.find(dart);
    if (it == by_dart.end()) {
      const Critical c{{++next_root, 1 + random() % 1000},
                       random() % 4 == 0 ? BlockId() : BlockId{static_cast<uint32_t>(random() % 64)},
                       random() % 2 == 0};
      table.Insert(dart, c);
      by_dart.emplace(dart, c);
      by_label.emplace(c.label, dart);
      continue;
    }
    ASSERT_EQ(table.Of(dart).critical(), it->second);
    ASSERT_EQ(table.Of(dart).dart, dart);
    by_label.erase(it->second.label);
    if (random() % 2 == 0) {
      const Label label{++next_root, it->second.label.path};
      table.Relabel(dart, label);
      it->second.label = label;
      by_label.emplace(label, dart);
    } else {
      EXPECT_EQ(table.Find(it->second.label)->dart, dart);
      table.Erase(dart);
      EXPECT_EQ(table.Find(it->second.label), nullptr);
      by_dart.erase(it);
    }
  }
  ASSERT_GT(by_dart.size(), 100u);
  EXPECT_EQ(table.rows().size(), by_dart.size());
  for (const auto& [label, dart] : by_label) {
    ASSERT_NE(table.Find(label), nullptr);
    EXPECT_EQ(table.Find(label)->dart, dart);
  }
  size_t walked = 0;
  for (const auto& row : table.rows()) {
    EXPECT_EQ(by_label.at(row.label), row.dart);
    ++walked;
  }
  EXPECT_EQ(walked, by_dart.size());
  table.Clear();
  EXPECT_TRUE(table.rows().empty());
  EXPECT_EQ(table.Find(by_label.begin()->first), nullptr);
}

TEST(LabelTable, ACriticalDartTakesAboutFortyBytes) {
  LabelTable<FlatDart> table;
  constexpr uint32_t kDarts = 100000;
  for (uint32_t i = 1; i <= kDarts; ++i) table.Insert(FlatDart(i), {{i, 1}, BlockId{1}, true});
  EXPECT_GE(table.allocated_bytes(), kDarts * sizeof(LabelTable<FlatDart>::Row));
  EXPECT_LE(table.allocated_bytes(), kDarts * 50);
}

}  // namespace
}  // namespace ndmap
