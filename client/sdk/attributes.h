// SPDX-License-Identifier: Apache-2.0
// Attributes of cells (docs/attributes.md): what is defined, which cells are meant, and columns of values.
//
//   map.DefineAttribute(ndmap::NewAttribute("temperature").OnVertices().OfDoubles().Mean().Fill(20.0));
//   ndmap::AttributeReader reader = map.ReadAttributes(0, {"temperature"}, ndmap::AllCells());
//   for (absl::StatusOr<ndmap::CellValues>& part : reader) {
//     if (!part.ok()) return part.status();
//     for (double t : part->columns[0].doubles) ...
//   }
//
// Values (NewAttribute, CellIds, AttributeColumn, CellValues) are plain: one thread at a time changes them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "ndmap/v1/attributes.pb.h"

namespace ndmap {

// An attribute to be defined: doubles on hexahedra, copied when cells are split and 0 at first, unless told
// otherwise. Nothing is checked here: the coordinator refuses what does not fit together, with a sentence.
class NewAttribute {
 public:
  explicit NewAttribute(absl::string_view name) {
    attribute_.set_name(std::string(name));
    attribute_.set_dimension(3);
    attribute_.set_type(v1::VALUE_TYPE_DOUBLE);
    attribute_.set_split(v1::SPLIT_RULE_COPY);
  }

  // The cells that have it.
  NewAttribute& OnCells(uint32_t dimension) {
    attribute_.set_dimension(dimension);
    return *this;
  }
  NewAttribute& OnVertices() { return OnCells(0); }
  NewAttribute& OnEdges() { return OnCells(1); }
  NewAttribute& OnFaces() { return OnCells(2); }
  NewAttribute& OnHexahedra() { return OnCells(3); }

  NewAttribute& OfType(v1::ValueType type) {
    attribute_.set_type(type);
    return *this;
  }
  NewAttribute& OfDoubles() { return OfType(v1::VALUE_TYPE_DOUBLE); }
  NewAttribute& OfIntegers() { return OfType(v1::VALUE_TYPE_INT64); }
  NewAttribute& OfVectors() { return OfType(v1::VALUE_TYPE_VEC3); }
  NewAttribute& OfCategories() { return OfType(v1::VALUE_TYPE_CATEGORY); }

  // What new cells get.
  NewAttribute& Split(v1::SplitRule rule) {
    attribute_.set_split(rule);
    return *this;
  }
  NewAttribute& Copy() { return Split(v1::SPLIT_RULE_COPY); }
  NewAttribute& Mean() { return Split(v1::SPLIT_RULE_MEAN); }
  NewAttribute& Midpoint() { return Split(v1::SPLIT_RULE_MIDPOINT); }
  NewAttribute& Zero() { return Split(v1::SPLIT_RULE_ZERO); }
  NewAttribute& Divide() { return Split(v1::SPLIT_RULE_DIVIDE); }

  // What every cell has until something is written: of doubles, integers, vectors, categories.
  NewAttribute& Fill(double value) {
    FillValues().add_doubles(value);
    return *this;
  }
  NewAttribute& Fill(int64_t value) {
    FillValues().add_integers(value);
    return *this;
  }
  NewAttribute& Fill(int value) { return Fill(int64_t{value}); }
  NewAttribute& Fill(const std::array<double, 3>& value) {
    v1::Values& fill = FillValues();
    for (double x : value) fill.add_doubles(x);
    return *this;
  }
  NewAttribute& Fill(absl::string_view text) {
    v1::Values& fill = FillValues();
    fill.add_codes(0);
    fill.add_categories(std::string(text));
    return *this;
  }
  NewAttribute& Fill(const char* text) { return Fill(absl::string_view(text)); }

  const v1::Attribute& attribute() const { return attribute_; }

 private:
  v1::Values& FillValues() {
    attribute_.clear_fill();
    return *attribute_.mutable_fill();
  }
  v1::Attribute attribute_;
};

// Ids of cells as two columns (navigate.proto, CellId), equally long.
struct CellIds {
  std::vector<uint64_t> hi, lo;

  size_t size() const { return hi.size(); }
  void Add(uint64_t upper, uint64_t lower) {
    hi.push_back(upper);
    lo.push_back(lower);
  }
};

// Which cells. Of ids any number: calls are made of 65536 each.
v1::CellSelection TheseCells(const CellIds& ids);
v1::CellSelection AllCells();
// Every cell of these levels, both included.
v1::CellSelection CellsOfLevels(uint32_t lowest, uint32_t highest);
// The cells that a question of explore.h gives.
v1::CellSelection CellsOf(const v1::ExploreRequest& question);

// Values of one attribute, one a cell: of the four vectors the one that the type says is filled.
struct AttributeColumn {
  std::string name;
  // Unspecified as long as there is no value.
  v1::ValueType type = v1::VALUE_TYPE_UNSPECIFIED;
  // Of DOUBLE one a cell, of VEC3 three.
  std::vector<double> doubles;
  std::vector<int64_t> integers;
  // Of CATEGORY: places in `categories`.
  std::vector<uint32_t> codes;
  std::vector<std::string> categories;

  static AttributeColumn Doubles(std::vector<double> values);
  static AttributeColumn Integers(std::vector<int64_t> values);
  static AttributeColumn Vectors(absl::Span<const std::array<double, 3>> values);
  static AttributeColumn Texts(absl::Span<const std::string> values);

  // Cells.
  size_t size() const;
  // The values. FAILED_PRECONDITION naming both types when the column has values of another one.
  absl::StatusOr<absl::Span<const double>> AsDoubles() const;
  absl::StatusOr<absl::Span<const int64_t>> AsIntegers() const;
  absl::StatusOr<std::vector<std::array<double, 3>>> AsVectors() const;
  // Views of `categories`.
  absl::StatusOr<std::vector<absl::string_view>> AsTexts() const;
};

// Cells and their values. Columns are in the order in which they were asked for.
struct CellValues {
  CellIds cells;
  std::vector<AttributeColumn> columns;
  // Of ids that were asked for: places in `cells` of those that the map has not; their values mean nothing.
  std::vector<size_t> missing;
};

namespace internal {
class AttributeParts;
class Connection;
// Of a message that `who` sent. DATA_LOSS when columns are not as long as there are cells.
absl::StatusOr<CellValues> ToCellValues(const v1::ReadAttributesResponse& part,
                                        const std::vector<std::string>& names, absl::string_view who);
// Cells [begin, end) of a column. Categories are numbered anew: only those in use.
v1::Values ToValues(const AttributeColumn& column, size_t begin, size_t end);
}  // namespace internal

// The parts of an answer as a range, to be gone through once, by one thread at a time; the next part is
// waited for when the iterator goes on. An error is the last element. Parts are of at most 65536 cells.
// Leaving the loop early cancels the call.
class AttributeReader {
 public:
  class iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = absl::StatusOr<CellValues>;
    using difference_type = std::ptrdiff_t;
    using pointer = value_type*;
    using reference = value_type&;

    reference operator*() const { return reader_->part_; }
    pointer operator->() const { return &reader_->part_; }
    iterator& operator++() {
      if (!reader_->Next()) reader_ = nullptr;
      return *this;
    }
    void operator++(int) { ++*this; }
    friend bool operator==(const iterator&, const iterator&) = default;

   private:
    friend class AttributeReader;
    explicit iterator(AttributeReader* reader) : reader_(reader) {}
    AttributeReader* reader_;
  };

  explicit AttributeReader(std::unique_ptr<internal::AttributeParts> parts);
  AttributeReader(AttributeReader&&) noexcept;
  AttributeReader& operator=(AttributeReader&&) noexcept;
  ~AttributeReader();

  // Waits for the first part. Once.
  iterator begin() { return iterator(Next() ? this : nullptr); }
  iterator end() { return iterator(nullptr); }

 private:
  // False when there are no more parts.
  bool Next();

  std::unique_ptr<internal::AttributeParts> parts_;
  bool failed_ = false;
  absl::StatusOr<CellValues> part_ = CellValues();
};

}  // namespace ndmap
