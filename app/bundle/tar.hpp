/// Archives in the ustar format (POSIX.1-1988), compressed by gzip; they appear whole or not at all.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "platform/core/result.hpp"

namespace firstlook {

/// The longest name that a file in the archive may have.
inline constexpr std::size_t kTarNameMax = 100;

class TarGzWriter {
 public:
  /// Error: kDiskWrite.
  [[nodiscard]] static Result<TarGzWriter> create(const std::string& path);
  TarGzWriter(TarGzWriter&&) noexcept;
  ~TarGzWriter();

  /// Begins a regular file of exactly `size` bytes, which follow by write(). Errors: kDiskWrite; kUsage for a name that
  /// is too long.
  [[nodiscard]] Status begin(std::string_view name, std::uint64_t size, std::int64_t modified_s);
  [[nodiscard]] Status write(std::span<const std::byte> bytes);
  /// A whole file.
  [[nodiscard]] Status add(std::string_view name, std::string_view text, std::int64_t modified_s);
  /// Ends the archive and gives it its name. Error: kDiskWrite.
  [[nodiscard]] Status commit();

 private:
  struct Stream;
  explicit TarGzWriter(std::unique_ptr<Stream> stream);
  [[nodiscard]] Status compress(std::span<const std::byte> bytes, bool last);
  [[nodiscard]] Status pad();

  std::unique_ptr<Stream> stream_;
};

}  // namespace firstlook
