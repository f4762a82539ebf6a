// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/definition.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

AttributeDefinition Valid() {
  return {"temperature", 0, ValueType::kDouble, SplitRule::kMean, {1, 2, 3}, "", 5};
}

TEST(AttributeDefinition, TextAndBack) {
  AttributeDefinition label{"label",          3,         ValueType::kCategory, SplitRule::kCopy, {},
                            "a\nb c\xc3\xa9", 1ull << 63};
  const std::vector<AttributeDefinition> all = {Valid(), label};
  auto decoded = DecodeDefinitions(EncodeDefinitions(all));
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, all);
  EXPECT_TRUE(DecodeDefinitions("")->empty());
}

TEST(AttributeDefinition, RefusesTextThatIsNone) {
  const std::string good = EncodeDefinitions({Valid()});
  for (const std::string& bad : {std::string("x"), good + good, good + "\nx 0 1 1 1 0 0 0 q",
                                 std::string("x 0 9 1 1 0 0 0 "), std::string("x 0 1 9 1 0 0 0 "),
                                 std::string(".x 0 1 1 1 0 0 0 "), std::string("x -1 1 1 1 0 0 0 ")}) {
    EXPECT_EQ(DecodeDefinitions(bad).status().code(), absl::StatusCode::kInvalidArgument) << bad;
  }
  std::string many;
  for (uint64_t i = 0; i <= AttributeDefinition::kMaxAttributes; ++i) {
    AttributeDefinition d = Valid();
    d.name = absl::StrCat("a", i);
    absl::StrAppend(&many, EncodeDefinitions({d}));
  }
  EXPECT_EQ(DecodeDefinitions(many).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(AttributeDefinition, RulesFitTypeAndDimension) {
  AttributeDefinition d = Valid();
  EXPECT_TRUE(Validate(d).ok());
  d.dimension = 1;
  EXPECT_FALSE(Validate(d).ok());
  d.split = SplitRule::kDivide;
  EXPECT_TRUE(Validate(d).ok());
  d.type = ValueType::kInt64;
  EXPECT_FALSE(Validate(d).ok());
  d = Valid();
  d.type = ValueType::kCategory;
  EXPECT_FALSE(Validate(d).ok());
  d = Valid();
  d.dimension = 4;
  EXPECT_FALSE(Validate(d).ok());
  d = Valid();
  d.name = "a b";
  EXPECT_FALSE(Validate(d).ok());
}

}  // namespace
}  // namespace ndmap
