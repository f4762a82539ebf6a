// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers in the arrays of a .vtu file: as text, in base64 or raw, compressed or not.
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"
#include "core/io/vtu_document.h"
#include "core/io/word_scanner.h"

namespace ndmap::internal {
namespace {

static_assert(std::endian::native == std::endian::little, "other orders of bytes are turned into this one");

class ArrayReader {
 public:
  // `any`: whatever its type, whatever its numbers.
  ArrayReader(const VtuDocument& document, const VtuArray& array, uint64_t max_bytes, bool any)
      : document_(document), array_(array), max_bytes_(max_bytes), any_(any) {}

  absl::Status Wrong(absl::string_view what) const {
    return absl::InvalidArgumentError(
        absl::StrCat("array '", array_.name, "' of line ", array_.line, ": ", what));
  }

  template <class T>
  absl::StatusOr<std::vector<T>> Numbers() const {
    if (array_.format == "ascii") return FromText<T>();
    const auto bytes = Bytes();
    if (!bytes.ok()) return bytes.status();
    return FromBytes<T>(*bytes);
  }

 private:
  template <class T>
  absl::StatusOr<std::vector<T>> FromText() const {
    std::vector<T> numbers;
    WordScanner in(array_.text, '\0');
    absl::string_view word;
    while (in.Word(&word)) {
      T number{};
      bool ok = false;
      if constexpr (std::is_same_v<T, double>) {
        ok = absl::SimpleAtod(word, &number) && (any_ || std::isfinite(number));
      } else {
        ok = absl::SimpleAtoi(word, &number);
      }
      if (!ok) {
        return Wrong(absl::StrCat("entry ", numbers.size(), ", counted from 0, is ", Shown(word),
                                  !std::is_same_v<T, double> ? ", no integer"
                                  : any_                     ? ", no number"
                                                             : ", no finite number"));
      }
      numbers.push_back(number);
    }
    return numbers;
  }

  template <class T>
  absl::StatusOr<std::vector<T>> FromBytes(absl::string_view bytes) const {
    const std::string& type = array_.type;
    if constexpr (std::is_same_v<T, double>) {
      if (type == "Float64") return Convert<T, double>(bytes);
      if (type == "Float32") return Convert<T, float>(bytes);
    } else if (any_ && type == "String") {
      return Convert<T, int8_t>(bytes);
    }
    if (any_ || !std::is_same_v<T, double>) {
      if (type == "Int64") return Convert<T, int64_t>(bytes);
      if (type == "UInt64") return Convert<T, uint64_t>(bytes);
      if (type == "Int32") return Convert<T, int32_t>(bytes);
      if (type == "UInt32") return Convert<T, uint32_t>(bytes);
      if (type == "Int16") return Convert<T, int16_t>(bytes);
      if (type == "UInt16") return Convert<T, uint16_t>(bytes);
      if (type == "Int8") return Convert<T, int8_t>(bytes);
      if (type == "UInt8") return Convert<T, uint8_t>(bytes);
    }
    return Wrong(
        absl::StrCat("is of type ", Shown(type),
                     std::is_same_v<T, double> ? "; Float32 or Float64 expected" : "; integers expected"));
  }

  template <class T, class Stored>
  absl::StatusOr<std::vector<T>> Convert(absl::string_view bytes) const {
    if (bytes.size() % sizeof(Stored) != 0) {
      return Wrong(absl::StrCat("has ", bytes.size(), " bytes, no whole number of ", array_.type));
    }
    std::vector<T> numbers(bytes.size() / sizeof(Stored));
    for (size_t i = 0; i < numbers.size(); ++i) {
      char raw[sizeof(Stored)];
      std::memcpy(raw, bytes.data() + i * sizeof(Stored), sizeof(Stored));
      if (document_.big_endian) std::reverse(raw, raw + sizeof(Stored));
      Stored stored;
      std::memcpy(&stored, raw, sizeof(Stored));
      numbers[i] = static_cast<T>(stored);
    }
    return numbers;
  }

  absl::StatusOr<std::string> Bytes() const {
    if (array_.format == "binary") {
      const auto decoded = Decode(array_.text);
      if (!decoded.ok()) return decoded.status();
      return Unpack(*decoded);
    }
    if (array_.format != "appended") {
      return Wrong(absl::StrCat("has format ", Shown(array_.format), "; ascii, binary or appended expected"));
    }
    if (array_.offset > document_.appended.size()) {
      return Wrong(absl::StrCat("truncated: begins at ", array_.offset, " of ", document_.appended.size(),
                                " bytes of appended data"));
    }
    absl::string_view data = document_.appended.substr(array_.offset);
    if (!document_.appended_base64) return Unpack(data);
    const auto& offsets = document_.all_offsets;
    const auto next = std::upper_bound(offsets.begin(), offsets.end(), array_.offset);
    if (next != offsets.end()) data = data.substr(0, *next - array_.offset);
    const auto decoded = Decode(data.substr(0, data.find('<')));
    if (!decoded.ok()) return decoded.status();
    return Unpack(*decoded);
  }

  // Several stretches of base64, each padded for itself, may follow one another: the header is one of its own
  // in many files.
  absl::StatusOr<std::string> Decode(absl::string_view text) const {
    std::string all, part;
    while (!text.empty()) {
      size_t end = text.find('=');
      while (end < text.size() && text[end] == '=') ++end;
      const absl::string_view stretch = text.substr(0, end);
      if (!absl::Base64Unescape(stretch, &part)) return Wrong("is not base64, or was cut off");
      all += part;
      text.remove_prefix(stretch.size());
    }
    return all;
  }

  bool TakeHeader(absl::string_view* data, uint64_t* value) const {
    const size_t size = document_.wide_header ? 8 : 4;
    if (data->size() < size) return false;
    char raw[8] = {};
    std::memcpy(raw, data->data(), size);
    if (document_.big_endian) std::reverse(raw, raw + size);
    std::memcpy(value, raw, sizeof(*value));
    data->remove_prefix(size);
    return true;
  }

  absl::StatusOr<std::string> Unpack(absl::string_view data) const {
    uint64_t first = 0;
    if (!TakeHeader(&data, &first)) return Wrong("truncated: not even its header is there");
    if (document_.compressor != VtuCompressor::kNone) return Decompress(data, first);
    if (first > data.size()) {
      return Wrong(absl::StrCat("truncated: ", first, " bytes are promised, ", data.size(), " are there"));
    }
    return std::string(data.substr(0, first));
  }

  // The header has the number of blocks, the size of a block and of the last (0: as the others), and the
  // compressed size of each.
  absl::StatusOr<std::string> Decompress(absl::string_view data, uint64_t blocks) const {
    uint64_t block_size = 0, last_size = 0;
    if (blocks == 0) return std::string();
    if (!TakeHeader(&data, &block_size) || !TakeHeader(&data, &last_size)) {
      return Wrong("truncated: the header of its compression is not whole");
    }
    const size_t entry = document_.wide_header ? 8 : 4;
    if (blocks > data.size() / entry) {
      return Wrong(absl::StrCat("truncated: ", blocks, " compressed blocks are promised, the sizes of ",
                                data.size() / entry, " are there at most"));
    }
    absl::string_view sizes = data.substr(0, blocks * entry);
    data.remove_prefix(sizes.size());
    std::string all;
    for (uint64_t b = 0; b < blocks; ++b) {
      uint64_t compressed = 0;
      TakeHeader(&sizes, &compressed);
      if (compressed > data.size())
        return Wrong(absl::StrCat("truncated: compressed block ", b, " is not whole"));
      const uint64_t size = b + 1 == blocks && last_size != 0 ? last_size : block_size;
      if (absl::Status s = Block(data.substr(0, compressed), b, size, &all); !s.ok()) return s;
      data.remove_prefix(compressed);
    }
    return all;
  }

  absl::Status Block(absl::string_view compressed, uint64_t number, uint64_t size, std::string* all) const {
    if (size > max_bytes_ || all->size() + size > max_bytes_) {
      return absl::ResourceExhaustedError(
          absl::StrCat("array '", array_.name, "' has more than the ", max_bytes_, " bytes that are read"));
    }
    absl::Status damaged = Wrong(absl::StrCat("compressed block ", number, " is damaged"));
    if (document_.compressor == VtuCompressor::kLzma) {
      auto block = DecompressXz(compressed, size);
      if (!block.ok() || block->size() != size) return damaged;
      all->append(*block);
      return absl::OkStatus();
    }
    // Zlib makes at most 1032 bytes of one: a promise beyond that is no reason to take memory.
    if (size > 1032 * static_cast<uint64_t>(compressed.size()) + 64) return damaged;
    const size_t before = all->size();
    all->resize(before + size);
    uLongf written = size;
    const int result = uncompress(reinterpret_cast<Bytef*>(all->data() + before), &written,
                                  reinterpret_cast<const Bytef*>(compressed.data()), compressed.size());
    return result == Z_OK && written == size ? absl::OkStatus() : damaged;
  }

  const VtuDocument& document_;
  const VtuArray& array_;
  uint64_t max_bytes_;
  bool any_;
};

template <class T>
absl::StatusOr<std::vector<T>> Read(const VtuDocument& document, const VtuArray& array,
                                    std::optional<uint64_t> count, uint64_t max_bytes, bool any = false) {
  const ArrayReader reader(document, array, max_bytes, any);
  auto numbers = reader.Numbers<T>();
  if (numbers.ok() && count && numbers->size() != *count) {
    return reader.Wrong(absl::StrCat("has ", numbers->size(), " entries; ", *count, " expected"));
  }
  return numbers;
}

}  // namespace

absl::StatusOr<std::vector<double>> VtuReals(const VtuDocument& document, const VtuArray& array,
                                             uint64_t count, uint64_t max_bytes) {
  return Read<double>(document, array, count, max_bytes);
}

absl::StatusOr<std::vector<int64_t>> VtuIntegers(const VtuDocument& document, const VtuArray& array,
                                                 std::optional<uint64_t> count, uint64_t max_bytes) {
  return Read<int64_t>(document, array, count, max_bytes);
}

absl::StatusOr<std::vector<double>> VtuAnyNumbers(const VtuDocument& document, const VtuArray& array,
                                                  uint64_t count, uint64_t max_bytes) {
  return Read<double>(document, array, count, max_bytes, true);
}

absl::StatusOr<std::vector<std::string>> VtuTexts(const VtuDocument& document, const VtuArray& array,
                                                  uint64_t max_bytes) {
  const auto bytes = Read<int64_t>(document, array, std::nullopt, max_bytes, true);
  if (!bytes.ok()) return bytes.status();
  // A 0 ends each text; VTK's own writer tells bytes above 127 as negative numbers.
  std::vector<std::string> texts;
  std::string text;
  for (int64_t byte : *bytes) {
    if (byte != 0) {
      text.push_back(static_cast<char>(byte));
      continue;
    }
    texts.push_back(std::move(text));
    text.clear();
  }
  return texts;
}

}  // namespace ndmap::internal
