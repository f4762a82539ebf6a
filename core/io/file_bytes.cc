// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/file_bytes.h"

#include <lzma.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace ndmap::internal {
namespace {

absl::Status TooLarge(uint64_t max_bytes) {
  return absl::ResourceExhaustedError(absl::StrCat("has more than the ", max_bytes, " bytes that are read"));
}

absl::StatusOr<std::string> ReadPlain(const std::string& path, uint64_t max_bytes) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) return absl::NotFoundError("no such file");
  if (error) return absl::PermissionDeniedError(error.message());
  if (std::filesystem::is_directory(status)) return absl::InvalidArgumentError("is a directory");
  if (!std::filesystem::is_regular_file(status)) return absl::InvalidArgumentError("is not a regular file");
  const uint64_t size = std::filesystem::file_size(path, error);
  if (error) return absl::UnavailableError(error.message());
  if (size > max_bytes) return TooLarge(max_bytes);
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) return absl::PermissionDeniedError(absl::StrCat("cannot be opened: ", std::strerror(errno)));
  std::string bytes(size, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(size));
  if (in.bad()) return absl::UnavailableError("cannot be read to its end");
  bytes.resize(static_cast<size_t>(in.gcount()));
  return bytes;
}

}  // namespace

absl::StatusOr<std::string> DecompressXz(absl::string_view bytes, uint64_t max_bytes) {
  constexpr uint64_t kDecoderMemory = uint64_t{256} << 20;
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, kDecoderMemory, LZMA_CONCATENATED) != LZMA_OK) {
    return absl::ResourceExhaustedError("no memory to decompress");
  }
  stream.next_in = reinterpret_cast<const uint8_t*>(bytes.data());
  stream.avail_in = bytes.size();
  std::string out;
  lzma_ret result = LZMA_OK;
  while (result == LZMA_OK && out.size() <= max_bytes) {
    const size_t done = out.size();
    out.resize(std::min<uint64_t>(std::max<uint64_t>(2 * done, 1 << 16), max_bytes + 1));
    stream.next_out = reinterpret_cast<uint8_t*>(out.data() + done);
    stream.avail_out = out.size() - done;
    result = lzma_code(&stream, LZMA_FINISH);
    out.resize(out.size() - stream.avail_out);
  }
  lzma_end(&stream);
  if (out.size() > max_bytes) return TooLarge(max_bytes);
  switch (result) {
    case LZMA_STREAM_END:
      return out;
    case LZMA_FORMAT_ERROR:
      return absl::InvalidArgumentError("is not compressed with xz");
    case LZMA_BUF_ERROR:
      return absl::InvalidArgumentError("truncated: its xz compression has no end");
    case LZMA_MEMLIMIT_ERROR:
      return absl::ResourceExhaustedError("takes more than 256 MiB to decompress");
    case LZMA_MEM_ERROR:
      return absl::ResourceExhaustedError("no memory to decompress");
    default:
      return absl::InvalidArgumentError("its xz compression is damaged");
  }
}

absl::StatusOr<std::string> ReadFileBytes(const std::string& path, uint64_t max_bytes) {
  absl::StatusOr<std::string> bytes;
  try {
    bytes = ReadPlain(path, max_bytes);
    if (bytes.ok() && absl::EndsWith(absl::AsciiStrToLower(path), ".xz")) {
      bytes = bytes->empty() ? absl::InvalidArgumentError("is empty") : DecompressXz(*bytes, max_bytes);
    }
  } catch (const std::bad_alloc&) {
    bytes = absl::ResourceExhaustedError("too large for this machine's memory");
  }
  if (bytes.ok()) return bytes;
  return absl::Status(bytes.status().code(), absl::StrCat(path, ": ", bytes.status().message()));
}

absl::Status WriteFileBytes(const std::string& path, absl::string_view bytes) {
  errno = 0;
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  if (!out) return absl::UnavailableError(absl::StrCat(path, ": cannot be written: ", std::strerror(errno)));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (out) return absl::OkStatus();
  const std::string why = std::strerror(errno);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
  return absl::UnavailableError(absl::StrCat(path, ": cannot be written: ", why));
}

}  // namespace ndmap::internal
